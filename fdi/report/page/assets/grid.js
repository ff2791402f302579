// The fault grid on the flight's clock, and the line of events above it.

const ROW = 27;
const NAME = 17; // of a row: the name stands above its bars, so that these are on the plots' own axis

/** A canvas that keeps the width of its parent and the sharpness of the screen; asked for its size it
 *  is empty. */
function canvasIn(inside, height, label) {
  const live = element("div", undefined, "live");
  const made = element("canvas", undefined, "own");
  made.setAttribute("aria-hidden", "true"); // what is around it says what it is
  live.append(made);
  live.tabIndex = 0;
  live.setAttribute("role", "img");
  live.setAttribute("aria-label", label);
  inside.append(live);
  const size = () => {
    const ratio = devicePixelRatio || 1;
    const wide = Math.max(live.clientWidth, 100), tall = typeof height === "function" ? height(wide) : height;
    const ctx = made.getContext("2d");
    const [pixels, lines] = [Math.round(wide * ratio), Math.round(tall * ratio)];
    if (made.width !== pixels || made.height !== lines) {
      made.style.height = `${tall}px`;
      made.width = pixels;
      made.height = lines;
    }
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, wide, tall);
    ctx.font = "11px system-ui, sans-serif";
    return { ctx, wide, tall };
  };
  return { live, made, size };
}

function tipIn(live) {
  const tip = element("div", undefined, "tip");
  tip.hidden = true;
  live.append(tip);
  return (text, x, y) => {
    tip.hidden = !text;
    if (!text) return;
    tip.textContent = text;
    tip.style.left = `${Math.max(0, Math.min(x + 12, live.clientWidth - tip.offsetWidth))}px`;
    tip.style.top = `${y + 14}px`;
  };
}

/** Place a canvas on the flight's clock: as wide as the plots' own axes. */
function onClock(surface, clock, draw, told) {
  const tip = tipIn(surface.live);
  let wide = 0;
  const timeAt = (event) => {
    const box = surface.live.getBoundingClientRect();
    const share = (event.clientX - box.left - AXIS) / (wide - AXIS - RIGHT);
    return share < 0 || share > 1 ? null : clock.shown[0] + share * (clock.shown[1] - clock.shown[0]);
  };
  const redraw = () => {
    const { ctx, wide: w, tall } = surface.size();
    wide = w;
    const right = w - RIGHT;
    const x = (t) => AXIS + ((t - clock.shown[0]) / (clock.shown[1] - clock.shown[0])) * (right - AXIS);
    draw(ctx, x, right, tall);
    if (pointer.t !== null && pointer.t >= clock.shown[0] && pointer.t <= clock.shown[1]) {
      ctx.strokeStyle = colour("cursor");
      ctx.setLineDash([4, 3]);
      ctx.beginPath(); ctx.moveTo(x(pointer.t), 0); ctx.lineTo(x(pointer.t), tall); ctx.stroke();
      ctx.setLineDash([]);
    }
  };
  follows(surface.live, clock, redraw);
  surface.live.addEventListener("pointermove", (event) => {
    const t = timeAt(event);
    pointer.set(t, surface);
    const box = surface.live.getBoundingClientRect();
    tip(told(t, event.clientX - box.left, event.clientY - box.top), event.clientX - box.left, event.clientY - box.top);
  });
  surface.live.addEventListener("pointerleave", () => { pointer.set(null, surface); tip(""); });
  surface.live.addEventListener("dblclick", () => clock.all());
  surface.live.addEventListener("focus", () => { clockInUse = clock; });
  steer(surface.live, clock, timeAt);
  let from = null;
  surface.live.addEventListener("pointerdown", (event) => { if (!event.shiftKey) from = timeAt(event); });
  surface.live.addEventListener("pointerup", (event) => {
    const to = timeAt(event);
    if (from !== null && to !== null && Math.abs(to - from) > 0.01 * (clock.shown[1] - clock.shown[0])) clock.show(Math.min(from, to), Math.max(from, to));
    from = null;
  });
  return redraw;
}

function makeGrid(inside) {
  const surface = canvasIn(inside, data.grid.length * ROW + 4, `Fault grid of ${data.grid.length} faults; the tables below say the same`);
  const draw = (ctx, x, right, tall) => {
    ctx.textBaseline = "middle";
    ctx.save();
    ctx.beginPath(); ctx.rect(AXIS, 0, right - AXIS, tall); ctx.clip();
    data.grid.forEach((row, place) => {
      const top = place * ROW + 2;
      ctx.fillStyle = colour(row.accused ? "red" : "soft");
      ctx.fillText(row.accused ? `${row.name}, accused` : row.name, AXIS, top + NAME - 6);
      for (const [kind, ink] of [["off", "unknown"], ["on", row.accused ? "red" : `g-${row.group}`]]) {
        ctx.fillStyle = colour(ink);
        for (const [from, to] of row[kind]) ctx.fillRect(x(from), top + NAME, Math.max(x(to) - x(from), 1), ROW - NAME - 1);
      }
    });
    ctx.restore();
    // through the bars alone: a line through the names makes these hard to read
    for (const place of data.grid.keys()) strokeMarks(ctx, x, [AXIS, right], [place * ROW + 2 + NAME, (place + 1) * ROW + 1], 1);
  };
  return onClock(surface, flightClock, draw, (t, x, y) => {
    const row = data.grid[Math.floor((y - 2) / ROW)];
    if (!row) return "";
    const is = t === null ? "" : row.on.some(([a, b]) => a <= t && t < b) ? ": marked" : row.off.some(([a, b]) => a <= t && t < b) ? ": unknown" : ": quiet";
    return `${row.name}${is}`;
  });
}
