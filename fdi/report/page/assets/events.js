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

/** Stroke lines at the marks that are shown, between two edges of each axis. */
function strokeMarks(ctx, x, [left, right], [top, bottom], width) {
  ctx.save();
  ctx.lineWidth = width;
  for (const mark of shownMarks()) {
    const at = x(mark.at);
    if (at < left || at > right) continue;
    ctx.strokeStyle = colour(mark.grave ? "red" : "soft");
    ctx.globalAlpha = mark.grave ? 0.8 : 0.35;
    ctx.setLineDash(mark.kind === "onset" ? [5, 4] : []);
    ctx.beginPath(); ctx.moveTo(at, top); ctx.lineTo(at, bottom); ctx.stroke();
  }
  ctx.restore();
}

const INKS = { onset: "red", impact: "red", failsafe: "red", arm: "green", disarm: "green", takeoff: "green", landing: "green", mode: "c3" };
const SIGNS = { onset: "▼", impact: "✕", takeoff: "▲", landing: "▽", arm: "●", disarm: "○", mode: "◆", failsafe: "!" };

function makeMarks(inside) {
  const surface = canvasIn(inside, 34, "Events along the time axis; the table below holds them all");
  const draw = (ctx, x, right) => {
    ctx.textBaseline = "middle";
    for (const [from, to, name] of data.modes) {
      const a = Math.max(x(from), AXIS), b = Math.min(x(to), right);
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
      if (at < AXIS || at > right) continue;
      ctx.fillStyle = colour(INKS[mark.kind] ?? (mark.grave ? "red" : "soft"));
      ctx.fillText(SIGNS[mark.kind] ?? "•", at, 9);
    }
  };
  return onClock(surface, flightClock, draw, (t) => {
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
