// One time axis: what is shown, and the moment under the pointer, for all plots that share it.

const LEAST_S = 0.05;

class Clock {
  constructor(low, high, home) {
    this.whole = [low, high];
    this.home = home ?? [low, high];
    this.shown = [...this.home];
    this.listeners = [];
  }

  onChange(listener) { this.listeners.push(listener); }

  show(low, high) {
    let length = Math.min(Math.max(high - low, LEAST_S), this.whole[1] - this.whole[0]);
    let from = Math.max(this.whole[0], Math.min(low, this.whole[1] - length));
    this.shown = [from, from + length];
    for (const listener of this.listeners) listener();
  }

  /** Zoom by a factor (below 1: in) about a moment. */
  zoom(factor, about) {
    const [low, high] = this.shown;
    const at = about ?? (pointer.t !== null && pointer.t > low && pointer.t < high ? pointer.t : (low + high) / 2);
    this.show(at - (at - low) * factor, at + (high - at) * factor);
  }

  move(share) {
    const [low, high] = this.shown;
    this.show(low + share * (high - low), high + share * (high - low));
  }

  around(t, before = 15, after = 5) { this.show(t - before, t + after); }

  all() { this.show(...this.whole); }

  do(what) {
    const flight = data.marks.filter((mark) => ["takeoff", "landing", "impact"].includes(mark.kind));
    const onset = data.marks.find((mark) => mark.rank === 1) ?? data.marks.findLast((mark) => mark.grave);
    if (what === "in") this.zoom(0.5);
    if (what === "out") this.zoom(2);
    if (what === "left") this.move(-0.3);
    if (what === "right") this.move(0.3);
    if (what === "all") this.all();
    if (what === "flight" && flight.length > 1) this.show(flight[0].at - 2, flight.at(-1).at + 2);
    else if (what === "flight") this.all();
    if (what === "onset") this.around(onset?.at ?? this.whole[1] - 5);
  }
}

/** The moment under the pointer, the same for every plot, whatever its clock. */
const pointer = {
  t: null,
  listeners: [],
  onChange(listener) { this.listeners.push(listener); },
  set(t, from) {
    if (t === this.t) return;
    this.t = t;
    for (const listener of this.listeners) listener(t, from);
  },
};

const flightClock = new Clock(data.span[0], data.span[1]);
let clockInUse = flightClock;

const KEYS = { ArrowLeft: "left", ArrowRight: "right", "+": "in", "=": "in", "-": "out", _: "out", 0: "all" };

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.target.closest("input, select, textarea, .turned")) return;
  const what = KEYS[event.key];
  if (!what) return;
  event.preventDefault();
  clockInUse.do(what);
});

/** Let drag, Shift and drag, wheel and double click on an element move a clock. */
function steer(target, clock, timeAt) {
  let from = null;
  target.addEventListener("pointerenter", () => { clockInUse = clock; });
  target.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    clock.zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(event));
  }, { passive: false });
  target.addEventListener("pointerdown", (event) => {
    if (!event.shiftKey) return;
    from = [event.clientX, ...clock.shown];
    event.preventDefault();
    event.stopPropagation();
    target.setPointerCapture(event.pointerId);
  }, true);
  // uPlot begins its selection on mousedown, which follows
  target.addEventListener("mousedown", (event) => { if (event.shiftKey) event.stopPropagation(); }, true);
  target.addEventListener("pointermove", (event) => {
    if (!from) return;
    const seconds = ((from[0] - event.clientX) / target.clientWidth) * (from[2] - from[1]);
    clock.show(from[1] + seconds, from[2] + seconds);
  });
  target.addEventListener("pointerup", () => { from = null; });
}
