// Puts plots where drawings stand, and listens.

const redraws = [];

/** Make what comes into view, and not before: a page may hold a hundred plots. */
const waiting = new Map();
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting || !waiting.has(entry.target)) continue;
    const make = waiting.get(entry.target);
    waiting.delete(entry.target);
    watcher.unobserve(entry.target);
    entry.target.classList.add("on");
    make(entry.target);
  }
}, { rootMargin: "400px" });

function later(figure, make) {
  waiting.set(figure, make);
  watcher.observe(figure);
}

function drawn(make) {
  return (figure) => {
    const redraw = make(figure);
    redraws.push(redraw);
    redraw();
  };
}

function start() {
  document.documentElement.classList.add("scripted");
  const clocks = new Map();
  for (const box of document.querySelectorAll("[data-case]")) {
    const held = data.cases[box.dataset.case];
    const clock = new Clock(data.span[0], data.span[1], held.window);
    clocks.set(box, clock);
    box.addEventListener("click", (event) => {
      const what = event.target.dataset?.do;
      if (what === "onset") clock.show(...held.window);
      if (what === "all") clock.all();
      if (what === "overview") { flightClock.show(...held.window); document.getElementById("overview").scrollIntoView(); }
    });
  }
  for (const figure of document.querySelectorAll("figure[data-plot]")) {
    const place = figure.dataset.plot;
    if (place === "grid") later(figure, drawn(makeGrid));
    else if (place === "track") later(figure, drawn(makeTrack));
    else if (place === "track3d") later(figure, drawn(makeSpace));
    else later(figure, () => addTools(figure, makePlot(figure, panelAt(place), clocks.get(figure.closest("[data-case]")) ?? flightClock)));
  }
  const marks = makeMarks(document.getElementById("marks"));
  redraws.push(marks);
  marks();
  document.getElementById("bar").addEventListener("click", (event) => {
    const what = event.target.dataset?.do;
    if (what === "link") copyLink(event.target);
    else if (what) flightClock.do(what);
  });
  document.getElementById("level").addEventListener("change", refresh);
  document.getElementById("told")?.addEventListener("change", filterTable);
  document.getElementById("inked")?.addEventListener("change", refresh);
  document.addEventListener("click", (event) => {
    const at = event.target.dataset?.at;
    if (at !== undefined) flightClock.around(+at, 10, 10);
  });
  pointer.onChange((t) => {
    const near = t === null ? null : shownMarks().find((mark) => Math.abs(mark.at - t) < 0.004 * (flightClock.shown[1] - flightClock.shown[0]));
    document.getElementById("now").textContent = t === null ? "" : `${t.toFixed(2)} s ${modeAt(t)}${near ? `; ${near.kind}: ${near.text}` : ""}`;
  });
  makePicker();
  let wide = innerWidth;
  addEventListener("resize", () => {
    if (innerWidth === wide) return;
    wide = innerWidth;
    for (const one of plots) one.resize();
    for (const redraw of redraws) redraw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { inks.clear(); for (const one of plots) one.rebuild(); refresh(); });
  followAddress();
}

function refresh() {
  for (const one of plots) one.redraw();
  for (const redraw of redraws) redraw();
}

start();
