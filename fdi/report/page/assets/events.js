// Events along the time axis, filtered by how grave they are, here and in the table.

const level = () => +document.getElementById("level").value;

let marksAt = { level: null, found: [] };

function shownMarks() {
  const most = level();
  if (marksAt.level !== most) {
    const found = data.marks.filter((mark) => mark.level <= most || ["onset", "impact", "takeoff", "landing"].includes(mark.kind));
    marksAt = { level: most, found };
  }
  return marksAt.found;
}

const INKS = { onset: "red", impact: "red", failsafe: "red", arm: "green", disarm: "green", takeoff: "green", landing: "green", mode: "c3" };
const SIGNS = { onset: "▼", impact: "✕", takeoff: "▲", landing: "▽", arm: "●", disarm: "○", mode: "◆", failsafe: "!" };

function makeMarks(inside) {
  const surface = canvasIn(inside, 34, "Events along the time axis; the table below holds them all");
  const draw = (ctx, x, wide) => {
    ctx.textBaseline = "middle";
    for (const [from, to, name] of data.modes) {
      const a = Math.max(x(from), AXIS), b = Math.min(x(to), wide);
      if (b <= a) continue;
      ctx.fillStyle = colour(`m${modeNames.indexOf(name) % 6}`);
      ctx.fillRect(a, 18, b - a, 15);
      ctx.fillStyle = colour("soft");
      ctx.textAlign = "left";
      if (ctx.measureText(name).width < b - a - 5) ctx.fillText(name, a + 3, 26); // the pointer tells the rest
    }
    ctx.textAlign = "center";
    for (const mark of shownMarks()) {
      const at = x(mark.at);
      if (at < AXIS || at > wide) continue;
      ctx.fillStyle = colour(INKS[mark.kind] ?? (mark.grave ? "red" : "soft"));
      ctx.fillText(SIGNS[mark.kind] ?? "•", Math.min(at, wide - 5), 9);
    }
  };
  return onClock(surface, flightClock, () => AXIS, draw, (t) => {
    if (t === null) return "";
    const near = 0.008 * (flightClock.shown[1] - flightClock.shown[0]);
    const found = shownMarks().filter((mark) => Math.abs(mark.at - t) < near);
    return found.slice(0, 6).map((mark) => `${mark.at.toFixed(1)} s ${mark.kind}: ${mark.text}`).join("; ") || modeAt(t);
  });
}

/** Hide rows of the table of events that are less grave than what is asked for. */
function filterTable() {
  const most = +document.getElementById("told").value;
  for (const row of document.querySelectorAll("tr[data-level]")) row.hidden = +row.dataset.level > most;
}
