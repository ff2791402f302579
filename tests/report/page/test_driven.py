"""The reports of all examples, driven as a person does: no error, no request, nothing barred.

Each is opened from disk with the network cut. axe-core looks for what keeps people out who use a
keyboard or a screen reader.
"""

from collections.abc import Iterator
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from fdi import analyze
from fdi.report.html import html_report

from ..browsing import until

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
ALWAYS = ("copter_motor_failure_crash", "rover")
LOGS = [
    pytest.param(log, id=log.stem, marks=() if log.stem in ALWAYS else pytest.mark.soak)
    for log in sorted(EXAMPLES.rglob("*.tlog"))
]
"""``make page`` drives all of them."""
SHOWN = "flightClock.shown"
OVERVIEW = "plots.filter((one) => one.live.closest('figure[data-plot^=overview]'))"
MOST_BYTES = 6_000_000


@pytest.fixture(scope="module", params=LOGS)
def report(
    browser: Any, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    own = request.param.with_suffix(".yaml")
    model = own if own.is_file() else "auto"
    path = tmp_path_factory.mktemp("driven") / "report.html"
    path.write_text(html_report(analyze(request.param, model=model)), "utf-8")
    return path


@pytest.fixture
def page(browser: Any, report: Path) -> Iterator[Any]:
    context = browser.new_context(viewport={"width": 1400, "height": 900}, offline=True)
    opened = context.new_page()
    told: list[str] = []
    asked: list[str] = []
    opened.on("pageerror", lambda error: told.append(str(error)))
    opened.on("console", lambda line: told.append(line.text) if line.type == "error" else None)
    opened.on("request", lambda request: asked.append(request.url))
    opened.goto(report.as_uri())
    yield opened
    context.close()
    assert not told
    assert asked == [report.as_uri()]


def seen(page: Any) -> list[float]:
    found: list[float] = page.evaluate(SHOWN)
    return found


def drag(page: Any, over: Any, start: float, end: float) -> None:
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    page.mouse.move(box["x"] + start * box["width"], box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + end * box["width"], box["y"] + 40, steps=3)
    page.mouse.up()


def test_a_report_can_be_explored(page: Any, report: Path) -> None:
    assert report.stat().st_size <= MOST_BYTES
    whole = seen(page)
    first = page.locator('figure[data-plot="overview.0"] .u-over')
    page.locator('figure[data-plot="overview.0"]').scroll_into_view_if_needed()
    drag(page, first, 0.3, 0.5)
    zoomed = seen(page)
    assert zoomed[1] - zoomed[0] == pytest.approx(0.2 * (whole[1] - whole[0]), rel=0.1)
    # one time axis; what is out of sight follows
    until(page, f"{OVERVIEW}.every((one) => one.plot.scales.x.min === {zoomed[0]!r})")
    shown = page.evaluate(f"{OVERVIEW}.map((one) => one.plot.scales.x.max)")
    assert len(shown) > 1
    assert set(shown) == {zoomed[1]}
    first.hover()
    moment = page.evaluate("pointer.t")
    assert zoomed[0] < moment < zoomed[1]
    assert f"{moment:.2f} s" in page.locator("#now").text_content()
    page.locator("#bar button").first.focus()
    widths = [zoomed[1] - zoomed[0]]
    for key in ("+", "-", "-"):
        page.keyboard.press(key)
        widths.append(seen(page)[1] - seen(page)[0])
    before = seen(page)
    page.keyboard.press("ArrowRight")
    assert seen(page) != before
    page.keyboard.press("0")
    assert seen(page) == whole
    halves = [later / earlier for earlier, later in pairwise(widths)]
    assert halves == pytest.approx([0.5, 2.0, 2.0], rel=0.01)


def test_any_channel_and_every_plot_is_drawn(page: Any) -> None:
    page.locator("#search").fill("attitude roll")
    page.locator("#add").click()
    page.locator("#search").fill("attitude pitch")
    page.locator("#add").click()
    assert page.locator("#picked .uplot").count() == 1
    for figure in page.locator("figure[data-plot]").all():
        figure.scroll_into_view_if_needed()
        figure.locator(".live canvas").first.wait_for()
    ink = page.evaluate(
        "[...document.querySelectorAll('figure[data-plot] canvas')].map((one) => new Set(new "
        "Uint32Array(one.getContext('2d').getImageData(0, 0, one.width, one.height).data.buffer)"
        ").size)"
    )
    assert min(ink) > 1  # none is empty


COUNTED = """() => new Promise((done) => {
  const overview = plots.filter((one) => one.live.closest('figure[data-plot^=overview]'));
  const drawn = overview.map(() => 0);
  overview.forEach((one, place) => one.plot.hooks.draw.push(() => { drawn[place] += 1; }));
  const seen = overview.map((one) => inSight.has(one.live));
  for (let i = 0; i < 20; i++) flightClock.move(0.002);
  requestAnimationFrame(() => requestAnimationFrame(() => {
    const soon = [...drawn];
    const end = performance.now() + 20000;
    const rest = () => {
      if (drawn.includes(0) && performance.now() < end) setTimeout(rest, 50);
      else setTimeout(() => done({ seen, soon, last: [...drawn] }), 300);
    };
    rest();
  }));
})"""


def test_a_pan_draws_what_is_in_sight_once_a_frame_and_the_rest_when_it_rests(page: Any) -> None:
    page.evaluate("document.getElementById('overview').scrollIntoView()")
    until(page, f"new Set({OVERVIEW}.map((one) => inSight.has(one.live))).size === 2")
    page.evaluate("flightClock.zoom(0.5)")
    until(page, f"{OVERVIEW}.every((one) => one.plot.scales.x.min === flightClock.shown[0])")
    found = page.evaluate(COUNTED)
    assert set(found["seen"]) == {True, False}
    assert found["soon"] == [int(in_sight) for in_sight in found["seen"]]
    assert set(found["last"]) == {1}


def test_the_pointer_leaves_no_trail_on_the_way(page: Any) -> None:
    if not page.evaluate("!!way"):
        pytest.skip("no position in this log")
    page.locator('figure[data-plot="track"]').scroll_into_view_if_needed()
    page.locator('figure[data-plot="track"] canvas').wait_for()
    page.wait_for_timeout(300)
    pictures = []
    for share in (0.2, 0.8, 0.2):
        page.evaluate(
            "(share) => pointer.set(way.t[Math.floor(share * way.t.length)], null)", share
        )
        page.wait_for_timeout(200)
        pictures.append(
            page.evaluate("document.querySelector('figure[data-plot=track] canvas').toDataURL()")
        )
    assert pictures[0] == pictures[2] != pictures[1]


@pytest.mark.parametrize(("width", "scheme"), [(400, "dark"), (1400, "light")])
def test_nothing_serious_keeps_anybody_out(page: Any, width: int, scheme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python")
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    page.evaluate(files(axe.__name__).joinpath("axe.min.js").read_text("utf-8"))
    found = page.evaluate("axe.run()")
    told = [
        (one["impact"], one["id"], one["nodes"][0]["html"][:200]) for one in found["violations"]
    ]
    assert len(found["passes"]) > 10
    assert told == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
