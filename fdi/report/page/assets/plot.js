// A panel as a plot to zoom, by uPlot.

const AXIS = 60;
// Room for the second half of the last tick's label.
const RIGHT = 20;
// One pixel: a browser strokes wider lines many times slower, and a pan draws thousands of pieces.
const LINE = 1;
const plots = [];

/** Return curves as one table of uPlot's: common times, and a column for each curve. */
function tableOf(panel) {
  const times = panel.t?.map((packed) => column(packed, packed.n)) ?? [];
  const tables = panel.curves.map((curve) => {
    const found = curve.channel ? channel(curve.channel) : { t: times[curve.t], v: column(curve.v, times[curve.t].length) };
    return broken(found.t, found.v);
  });
  return uPlot.join(tables.map(([t, v]) => [t, v]), tables.map(() => [1, 2])); // unknown on both sides of a gap
}

/** Return the range of what is shown, a little wider: all of the curves, and of a bound where it
 *  mostly is, since one that soars in a manoeuvre would dwarf the rest. */
function rangeOf(plot, [from, to], panel) {
  if (panel.picture) return [0, panel.picture.top];
  let low = Infinity, high = -Infinity;
  const t = plot.data[0];
  const first = Math.max(before(t, from), 0);
  for (let k = 1; k < plot.data.length; k++) {
    if (!plot.series[k].show) continue;
    const v = plot.data[k];
    const bounds = panel.curves[k - 1].look === "bound" ? [] : null;
    for (let i = first; i < t.length && (t[i] <= to || t[i - 1] <= to); i++) {
      if (v[i] === null || v[i] === undefined) continue;
      if (bounds) { bounds.push(v[i]); continue; }
      if (v[i] < low) low = v[i];
      if (v[i] > high) high = v[i];
    }
    if (bounds?.length) {
      const middle = bounds.sort((a, b) => a - b)[bounds.length >> 1];
      low = Math.min(low, middle);
      high = Math.max(high, middle);
    }
  }
  if (low > high) return [0, 1];
  const margin = 0.05 * (high - low) || 0.05 * Math.abs(high) || 0.5;
  return [low - margin, high + margin];
}

function bandsOf(plot, panel) {
  const { ctx, bbox } = plot;
  const x = (t) => plot.valToPos(t, "x", true);
  const fill = (from, to, ink) => {
    const a = Math.max(x(from), bbox.left), b = Math.min(x(to), bbox.left + bbox.width);
    if (b > a) { ctx.fillStyle = ink; ctx.fillRect(a, bbox.top, Math.max(b - a, 1), bbox.height); }
  };
  ctx.save();
  for (const [from, to, name] of data.modes) fill(from, to, colour(`m${modeNames.indexOf(name) % 6}`));
  for (const [from, to] of panel.hot ?? []) fill(from, to, colour("hot"));
  ctx.restore();
}

/** Return the picture behind a panel's curves, which stands in its drawing; null where there is none. */
function pictureOf(inside, panel, onLoad) {
  const still = panel.picture ? inside.querySelector(".still image") : null;
  if (!still) return null;
  const found = new Image();
  found.addEventListener("load", onLoad);
  found.src = still.href.baseVal;
  return found;
}

/** Draw as much of a picture as lies within the shown time. */
function drawPicture(plot, picture, { t: [from, to], top }) {
  if (!picture?.naturalWidth) return;
  const { ctx, bbox } = plot;
  const x = (t) => plot.valToPos(t, "x", true), y = (v) => plot.valToPos(v, "y", true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.drawImage(picture, x(from), y(top), x(to) - x(from), y(0) - y(top));
  ctx.restore();
}

function linesOf(plot) {
  const { ctx, bbox } = plot;
  strokeMarks(ctx, (t) => plot.valToPos(t, "x", true), [bbox.left, bbox.left + bbox.width], [bbox.top, bbox.top + bbox.height], devicePixelRatio);
}

const shorter = (value) => (value === null || value === undefined ? "–" : Math.abs(value) >= 1e5 || (value && Math.abs(value) < 1e-3) ? value.toExponential(2) : String(+value.toPrecision(5)));

/** Return a tick with the digits that tell it from the next. */
function ticked(tick, step) {
  if (Math.abs(tick) >= 1e6 || (step && step < 1e-6)) return tick.toExponential(2);
  let digits = 0;
  while (digits < 9 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits++;
  return tick.toFixed(digits);
}

/** Make a panel a plot inside an element, on a clock; returns it. */
function makePlot(inside, panel, clock, height = 170) {
  const live = element("div", undefined, "live");
  live.tabIndex = 0;
  live.setAttribute("role", "img");
  live.setAttribute("aria-label", `${panel.title}${panel.unit ? `, ${panel.unit}` : ""}; curves: ${panel.curves.map((c) => c.label).join(", ")}. Arrow keys move, plus and minus zoom, 0 shows all.`);
  live.addEventListener("focus", () => { clockInUse = clock; });
  inside.append(live);
  const table = tableOf(panel);
  const picture = pictureOf(inside, panel, () => made.redraw());
  const wide = () => Math.max(live.clientWidth, 200);
  const axis = () => ({ stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line") }, font: "11px system-ui, sans-serif" });
  const options = () => ({
    width: wide(), height: made.height, padding: [8, RIGHT, 0, 0],
    scales: { x: { time: false, range: () => clock.shown }, y: { range: (plot) => rangeOf(plot, clock.shown, panel) } },
    axes: [{ ...axis(), size: 26, values: (_, ticks) => ticks.map((tick) => `${+tick.toFixed(3)} s`) }, { ...axis(), size: AXIS, space: 24, values: (plot, ticks, place, space, step) => ticks.map((tick) => ticked(tick, step)) }],
    cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 5 }, focus: { prox: -1 }, bind: { dblclick: () => () => { clock.all(); return null; } } },
    legend: { live: true },
    series: [
      { label: "s", value: (_, t) => (t === null || t === undefined ? "–" : t.toFixed(2)) },
      ...panel.curves.map((curve) => ({
        label: curve.label,
        stroke: colour(`c${curve.ink % 8}`),
        width: LINE,
        dash: curve.look === "dash" ? [7, 4] : curve.look === "bound" ? [2, 3] : undefined,
        points: { show: curve.look === "line" ? undefined : false, size: 4 },
        paths: curve.stepped ? uPlot.paths.stepped({ align: 1 }) : undefined,
        value: (_, v) => shorter(v),
      })),
    ],
    hooks: {
      drawClear: [(plot) => { bandsOf(plot, panel); if (picture) drawPicture(plot, picture, panel.picture); }],
      draw: [linesOf],
      setSelect: [(plot) => {
        if (plot.select.width < 4) return;
        clock.show(plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x"));
        plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
      setCursor: [(plot) => {
        live.classList.toggle("at", plot.cursor.left >= 0);
        if (!plot.told) pointer.set(plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : null, made);
      }],
    },
  });
  const made = { plot: null, live, panel, table, clock, height };
  const build = () => {
    made.plot?.destroy();
    made.plot = new uPlot(options(), table, live);
    steer(made.plot.over, clock, (event) => made.plot.posToVal(event.clientX - made.plot.over.getBoundingClientRect().left, "x"));
  };
  build();
  made.redraw = () => made.plot.redraw(false);
  made.rebuild = build;
  made.resize = () => made.plot.setSize({ width: wide(), height: made.height });
  clock.onChange(whenSeen(live, () => made.plot?.setScale("x", { min: clock.shown[0], max: clock.shown[1] })));
  pointer.onChange((t, from) => {
    if (from === made || !made.plot || !inSight.has(live)) return;
    const left = t === null ? -10 : made.plot.valToPos(t, "x");
    made.plot.told = true;
    made.plot.setCursor({ left: left >= 0 && left <= made.plot.over.clientWidth ? left : -10, top: -10 }, true);
    made.plot.told = false;
  });
  plots.push(made);
  return made;
}

/** Return what a plot shows now as CSV: s of the log's clock, and a column for each curve. */
function shownAsCsv(made) {
  const quoted = (text) => `"${text.replaceAll('"', '""')}"`;
  const [from, to] = made.clock.shown;
  const unit = made.panel.unit ? `, ${made.panel.unit}` : "";
  const lines = [["s", ...made.panel.curves.map((curve) => curve.label + unit)].map(quoted).join(",")];
  made.table[0].forEach((t, row) => {
    const values = made.table.slice(1).map((one) => one[row] ?? "");
    if (t >= from && t <= to && values.some((one) => one !== "")) lines.push([+t.toFixed(6), ...values].join(","));
  });
  return `${lines.join("\n")}\n`;
}

function save(text, name) {
  const link = element("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Put beside a plot's title what can be done with it: fold it, make it taller, save what it shows. */
function addTools(figure, made) {
  const tools = element("span", undefined, "tools");
  const add = (text, title, act) => {
    const button = element("button", text);
    button.type = "button";
    button.setAttribute("aria-label", `${title}: ${made.panel.title}`);
    button.title = title;
    button.addEventListener("click", () => act(button));
    tools.append(button);
    return button;
  };
  add("fold", "fold or unfold", (button) => {
    const isFolded = figure.classList.toggle("folded");
    button.setAttribute("aria-expanded", String(!isFolded));
    button.textContent = isFolded ? "unfold" : "fold";
    if (!isFolded) made.resize();
  }).setAttribute("aria-expanded", "true");
  add("taller", "twice as high, or as before", (button) => {
    const isTall = button.textContent === "taller";
    made.height *= isTall ? 2 : 0.5;
    button.textContent = isTall ? "lower" : "taller";
    made.resize();
  });
  add("CSV", "save the shown stretch as CSV", () => save(shownAsCsv(made), `${made.panel.title.replace(/[^\w.-]+/g, "_").slice(0, 60)}.csv`));
  figure.querySelector("figcaption").prepend(tools);
}
