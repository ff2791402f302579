// What is shown stands in the page's address, so that a colleague sees the same moment: #t=from,to.

const WAIT_MS = 300;

const fragmentOf = (clock) => `#t=${clock.shown.map((t) => +t.toFixed(3)).join(",")}`;

/** Return the stretch, or the seconds around one moment, that a fragment names; null if none. */
function stretchIn(fragment) {
  const found = /^#t=(-?[\d.]+)(?:,(-?[\d.]+))?$/.exec(fragment);
  const [from, to] = [Number(found?.[1]), Number(found?.[2] ?? NaN)];
  if (!found || !Number.isFinite(from)) return null;
  if (found[2] === undefined) return [from - 10, from + 10];
  return to > from ? [from, to] : null;
}

function followAddress() {
  let waiting = null, isRead = false;
  const read = () => {
    const named = stretchIn(location.hash);
    if (!named) return;
    isRead = true; // what the address says need not be written there
    flightClock.show(...named);
    isRead = false;
    document.getElementById("overview").scrollIntoView();
  };
  flightClock.onChange(() => {
    if (isRead) return;
    clearTimeout(waiting);
    waiting = setTimeout(() => history.replaceState(null, "", fragmentOf(flightClock)), WAIT_MS);
  });
  addEventListener("hashchange", read);
  read();
}

async function copyLink(button) {
  history.replaceState(null, "", fragmentOf(flightClock));
  const said = button.textContent;
  try {
    await navigator.clipboard.writeText(location.href);
    button.textContent = "copied";
  } catch { // a browser may forbid it; the address holds it all the same
    button.textContent = "see the address";
  }
  setTimeout(() => { button.textContent = said; }, 2000);
}
