// The way over ground, and in space; the moment under the pointer stands on it.

const way = data.track && {
  t: column(data.track.t, data.track.n), e: column(data.track.e, data.track.n),
  m: column(data.track.m, data.track.n), h: column(data.track.h, data.track.n).map((h) => h ?? 0),
};

const wayStep = way && longestStep(way.t);

/** Return the smallest and the largest of an array, which may be long. */
function ends(values) {
  return values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
}

function inkAt(i) {
  if (document.getElementById("inked").value === "height") {
    const [low, high] = way.height ??= ends(way.h);
    const share = high > low ? (way.h[i] - low) / (high - low) : 0;
    return `hsl(${240 - 220 * share} 75% 52%)`;
  }
  const name = modeAt(way.t[i]);
  return name ? colour(`c${modeNames.indexOf(name) % 6}`) : colour("soft");
}

function drawWay(ctx, place) {
  const [from, to] = flightClock.shown;
  ctx.lineWidth = 1.8;
  let ink = null;
  const inks = new Map();
  const cached = (i) => {
    const key = document.getElementById("inked").value === "height" ? Math.round(way.h[i]) : modeAt(way.t[i]);
    if (!inks.has(key)) inks.set(key, inkAt(i));
    return inks.get(key);
  };
  for (const isShown of [false, true]) {
    ctx.globalAlpha = isShown ? 1 : 0.25;
    ink = null;
    for (let i = 1; i < way.t.length; i++) {
      const isGap = way.t[i] - way.t[i - 1] > wayStep;
      if (isGap || (way.t[i] >= from && way.t[i - 1] <= to) !== isShown) { if (ink !== null) ctx.stroke(); ink = null; continue; }
      const own = cached(i);
      if (own !== ink) {
        if (ink !== null) ctx.stroke();
        ctx.beginPath(); ctx.moveTo(...place(i - 1)); ctx.strokeStyle = ink = own;
      }
      ctx.lineTo(...place(i));
    }
    if (ink !== null) ctx.stroke();
  }
  ctx.globalAlpha = 1;
  const dot = (i, fill, size = 4) => { ctx.fillStyle = fill; ctx.beginPath(); ctx.arc(...place(i), size, 0, 7); ctx.fill(); };
  dot(0, colour("green"));
  dot(way.t.length - 1, colour("red"));
  for (const mark of data.marks) if (mark.kind === "onset") { const [x, y] = place(before(way.t, mark.at)); ctx.fillStyle = colour("red"); ctx.fillText("▼", x - 5, y - 4); }
  if (pointer.t !== null) dot(before(way.t, pointer.t), colour("ink"), 5);
}

function says(i) {
  return `${way.t[i].toFixed(1)} s, ${way.h[i].toFixed(0)} m high, ${Math.hypot(way.e[i] - way.e[0], way.m[i] - way.m[0]).toFixed(0)} m away ${modeAt(way.t[i])}`;
}

function hovering(surface, places) {
  const tip = tipIn(surface.live);
  surface.live.addEventListener("pointermove", (event) => {
    if (event.buttons && surface.live.classList.contains("turned")) return;
    const box = surface.live.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    let best = -1, least = 400;
    for (let i = 0; i < way.t.length; i++) {
      const [a, b] = places(i);
      const far = (a - x) ** 2 + (b - y) ** 2;
      if (far < least) { least = far; best = i; }
    }
    pointer.set(best < 0 ? null : way.t[best], surface);
    tip(best < 0 ? "" : says(best), x, y);
  });
  surface.live.addEventListener("pointerleave", () => { pointer.set(null, surface); tip(""); });
}

function makeTrack(inside) {
  const surface = canvasIn(inside, (wide) => Math.min(wide, 460), "Way over ground, north up");
  const [e0, e1] = ends(way.e), [m0, m1] = ends(way.m);
  let size = { wide: 100, tall: 100 };
  const scale = () => Math.min((size.wide - 40) / Math.max(e1 - e0, 1), (size.tall - 40) / Math.max(m1 - m0, 1));
  const place = (i) => [size.wide / 2 + (way.e[i] - (e0 + e1) / 2) * scale(), size.tall / 2 - (way.m[i] - (m0 + m1) / 2) * scale()];
  hovering(surface, place);
  const redraw = () => {
    const { ctx, wide, tall } = surface.size();
    size = { wide, tall };
    const rough = 90 / scale(), power = 10 ** Math.floor(Math.log10(rough));
    const step = [5, 2, 1].map((k) => k * power).find((one) => one <= rough) ?? power;
    drawWay(ctx, place);
    ctx.fillStyle = colour("soft");
    ctx.fillRect(10, tall - 12, step * scale(), 2);
    ctx.fillText(`${step} m`, 10, tall - 18);
  };
  follows(surface.live, flightClock, redraw);
  return redraw;
}

function makeSpace(inside) {
  const surface = canvasIn(inside, (wide) => Math.min(wide, 460), "Way in space; arrow keys turn it");
  surface.live.classList.add("turned");
  const [e0, e1] = ends(way.e), [m0, m1] = ends(way.m), [h0, h1] = ends(way.h);
  let turn = 0.6, tilt = 0.5, size = { wide: 100, tall: 100 };
  const span = Math.max(Math.hypot(e1 - e0, m1 - m0), h1 - h0, 1);
  const project = (e, m, h) => {
    const a = e - (e0 + e1) / 2, b = m - (m0 + m1) / 2, c = h - (h0 + h1) / 2;
    const x = a * Math.cos(turn) + b * Math.sin(turn), y = -a * Math.sin(turn) + b * Math.cos(turn);
    const scale = (Math.min(size.wide, size.tall) - 40) / span;
    return [size.wide / 2 + x * scale, size.tall / 2 - (y * Math.sin(tilt) + c * Math.cos(tilt)) * scale];
  };
  const place = (i) => project(way.e[i], way.m[i], way.h[i]);
  const redraw = () => {
    const { ctx, wide, tall } = surface.size();
    size = { wide, tall };
    ctx.strokeStyle = colour("line");
    ctx.beginPath();
    for (const [e, m] of [[e0, m0], [e1, m0], [e1, m1], [e0, m1], [e0, m0]]) ctx.lineTo(...project(e, m, h0));
    ctx.stroke();
    ctx.globalAlpha = 0.25;
    ctx.strokeStyle = colour("soft");
    ctx.beginPath();
    const every = Math.max(1, Math.floor(way.t.length / 80));
    for (let i = 0; i < way.t.length; i += every) { ctx.moveTo(...project(way.e[i], way.m[i], h0)); ctx.lineTo(...place(i)); }
    ctx.stroke();
    ctx.globalAlpha = 1;
    drawWay(ctx, place);
    const [x, y] = project((e0 + e1) / 2, m1, h0);
    ctx.fillStyle = colour("soft");
    ctx.fillText("north", x - 14, y - 5);
    ctx.fillText(`${(h1 - h0).toFixed(0)} m high, ${(e1 - e0).toFixed(0)} m by ${(m1 - m0).toFixed(0)} m`, 10, tall - 8);
  };
  let from = null;
  surface.live.addEventListener("pointerdown", (event) => { from = [event.clientX, event.clientY, turn, tilt]; surface.live.setPointerCapture(event.pointerId); });
  surface.live.addEventListener("pointermove", (event) => {
    if (!from) return;
    turn = from[2] - (event.clientX - from[0]) / 120;
    tilt = Math.max(0, Math.min(Math.PI / 2, from[3] + (event.clientY - from[1]) / 150));
    redraw();
  });
  surface.live.addEventListener("pointerup", () => { from = null; });
  surface.live.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!by) return;
    event.preventDefault();
    turn += by[0];
    tilt = Math.max(0, Math.min(Math.PI / 2, tilt + by[1]));
    redraw();
  });
  hovering(surface, place);
  follows(surface.live, flightClock, redraw);
  return redraw;
}
