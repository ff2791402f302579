"""How large is a report's page, what does it cost, and how smoothly does it pan?

    .venv/bin/python benchmarks/page.py [LOG ... | LABELS.json ...]

CPU seconds of the analysis and of the page, the page's bytes, and frames a second while all plots
in view pan together in a headless Chromium (playwright drives the installed one; without either
this part is skipped), and the CPU of the page's thread for a frame, which a busy machine does not
lengthen. Without an argument: the flight of the publication, 62 minutes, in ../shared beside the
repository. Of a file of labels every flight is measured, without panning, and the worst are told:
the page and the whole folder of a report, in bytes and in CPU against that of the analysis.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from fdi import analyze
from fdi.errors import FdiError
from fdi.report.files import FORMATS, contents
from fdi.report.html import html_report

ROOT = Path(__file__).resolve().parents[1]
LOG = ROOT.parent / "shared" / "flights" / "paper" / "afrika.tlog"
MOST_BYTES, LEAST_RATE = 6e6, 30.0
FRAMES = 150
PAN = """(frames) => new Promise((done) => {
  flightClock.show(data.span[0], data.span[0] + 0.5 * (data.span[1] - data.span[0]));
  const times = [];
  const step = (now) => {
    times.push(now);
    if (times.length > frames) { done(times); return; }
    flightClock.move(times.length < frames / 2 ? 0.01 : -0.01);
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
})"""


def panned(path: Path) -> tuple[list[float], float] | None:
    """Return the lengths of the frames while a page pans and the CPU of one, s; or None."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    if not chromium:
        return None
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page: Any = browser.new_page(viewport={"width": 1400, "height": 1000})
        page.goto(path.as_uri())
        page.evaluate("document.getElementById('overview').scrollIntoView()")
        page.wait_for_timeout(1000)
        tools = page.context.new_cdp_session(page)
        tools.send("Performance.enable", {"timeDomain": "threadTicks"})
        before = _busy(tools)
        times = page.evaluate(PAN, FRAMES)
        cpu = (_busy(tools) - before) / FRAMES
        browser.close()
    return [(later - one) / 1e3 for one, later in pairwise(times)], cpu


def _busy(tools: Any) -> float:
    metrics = tools.send("Performance.getMetrics")["metrics"]
    return float(next(one["value"] for one in metrics if one["name"] == "TaskDuration"))


def measured(log: Path) -> bool:
    """Print the figures of a log's page; return whether its bounds hold."""
    start = time.process_time()
    analysis = analyze(log)
    middle = time.process_time()
    page = html_report(analysis)
    end = time.process_time()
    size = len(page.encode())
    print(
        f"{log.name}: {analysis.log.duration / 60:.0f} min, analysis {middle - start:.2f} s CPU, "
        f"page {end - middle:.2f} s CPU, {size / 1e6:.2f} MB (bound {MOST_BYTES / 1e6:g} MB)"
    )
    is_good = size <= MOST_BYTES and end - middle <= middle - start
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "report.html"
        path.write_text(page, "utf-8")
        found = panned(path)
    if found is None:
        print("  panning: skipped, there is no chromium or no playwright")
        return is_good
    frames, cpu = found
    rate = len(frames) / sum(frames)
    slow = sorted(frames)[int(0.95 * len(frames))]
    print(
        f"  panning: {rate:.0f} frames a second (bound {LEAST_RATE:g}), 95 % within "
        f"{1e3 * slow:.0f} ms; {1e3 * cpu:.1f} ms CPU of the page's thread for a frame"
    )
    return is_good and cpu <= 1.0 / LEAST_RATE


@dataclass(frozen=True, slots=True)
class Cost:
    """What a flight's report costs: CPU of the analysis, the page, all files, s; bytes of it."""

    name: str
    analysis: float
    page: float
    files: float
    size: int


def cost(log: Path) -> Cost | None:
    """Return what a flight's report costs, None where it cannot be analysed."""
    start = time.process_time()
    try:
        analysis = analyze(log)
    except FdiError as error:
        print(f"  {log.name}: {error}")
        return None
    middle = time.process_time()
    size = len(html_report(analysis).encode())
    page = time.process_time()
    for _ in contents(analysis, FORMATS):  # with the page once more
        pass
    end = time.process_time()
    return Cost(log.name, middle - start, page - middle, end - page, size)


def surveyed(labels: Path) -> bool:
    """Print the worst of all flights of a file of labels; return whether the bounds hold."""
    names = sorted(json.loads(labels.read_text("utf-8"))["flights"])
    logs = [labels.parent / name for name in names]
    cost(logs[0])  # imports and templates are paid once
    costs = [one for one in map(cost, logs) if one is not None]
    print(f"{labels}: {len(costs)} of {len(logs)} flights")
    largest = max(costs, key=lambda one: one.size)
    print(f"  largest page {largest.size / 1e6:.2f} MB ({largest.name})")
    for told, of in (("page", lambda o: o.page), ("all files", lambda o: o.files)):
        shares = sorted(((of(one) / one.analysis, one.name) for one in costs), reverse=True)
        total = sum(map(of, costs)) / sum(one.analysis for one in costs)
        over = sum(share > 1.0 for share, _ in shares)
        print(
            f"  CPU of {told} over that of the analysis: {total:.2f} in all, "
            f"{shares[len(shares) // 2][0]:.2f} median, {over} above 1; worst "
            + ", ".join(f"{share:.2f} ({name})" for share, name in shares[:5])
        )
    return all(one.size <= MOST_BYTES and one.page <= one.analysis for one in costs)


def main() -> int:
    """Print the figures; return 1 where a bound is missed."""
    logs = [Path(name) for name in sys.argv[1:]] or [LOG]
    here = [log for log in logs if log.is_file()]
    for log in logs:
        if log not in here:
            print(f"skipped: {log} is not here")
    passed = [surveyed(log) if log.suffix == ".json" else measured(log) for log in here]
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
