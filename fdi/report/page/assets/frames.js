// When is something drawn again? Once a frame at the most; what is out of sight when a pan rests.

const REST_MS = 120;
const asked = new Set(); // to be drawn in the next frame
const late = new Map(); // by element out of sight: what draws it
const inSight = new Set();
let resting = null;

const sight = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) { inSight.delete(target); continue; }
    inSight.add(target);
    if (late.has(target)) next(late.get(target));
    late.delete(target);
  }
}, { rootMargin: "100px" });

function next(redraw) {
  if (!asked.size) requestAnimationFrame(() => {
    const all = [...asked];
    asked.clear();
    for (const one of all) one();
  });
  asked.add(redraw);
}

function catchUp() {
  for (const redraw of late.values()) next(redraw);
  late.clear();
}

/** Return a function that has an element drawn again as soon as that is of use. */
function whenSeen(live, redraw) {
  sight.observe(live);
  return () => {
    if (inSight.has(live)) { next(redraw); return; }
    late.set(live, redraw);
    clearTimeout(resting);
    resting = setTimeout(catchUp, REST_MS);
  };
}

/** Have an element follow a clock and the pointer. */
function follows(live, clock, redraw) {
  const ask = whenSeen(live, redraw);
  clock.onChange(ask);
  pointer.onChange(ask);
}
