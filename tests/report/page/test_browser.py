"""What a browser makes of the page; skipped where no chromium is installed.

Steps of a person (zoom, keys, choices) need the package playwright as well, which drives the
installed chromium and downloads none.
"""

import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fdi.report.html import html_report

from ..browsing import opened, until
from ..build import message, small_analysis, small_log
from ..test_text import HOSTILE

HARM = "</script><img src=x onerror=document.title='harm'><script>document.title='harm'</script>"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browser")
    log = small_log(name=f"{HARM[:40]}.tlog".replace("/", ""), text=f"{HARM} {HOSTILE}")
    own = message(HARM, {f"a.{HARM}": log["VFR_HUD"].si("alt")}, log["VFR_HUD"].t)
    log = replace(log, messages={**log.messages, HARM: own}, parameters={HARM: 1.0})
    path = folder / "report.html"
    path.write_text(html_report(small_analysis(folder, log)), "utf-8")
    return path


def test_the_scripts_run_from_disk(chromium: str, written: Path, tmp_path: Path) -> None:
    command = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1200,6000"]
    command += [f"--user-data-dir={tmp_path}", "--virtual-time-budget=4000", "--dump-dom"]
    done = subprocess.run(
        [*command, written.as_uri()], capture_output=True, text=True, timeout=600, check=False
    )
    assert '<html lang="en" class="scripted">' in done.stdout
    assert '<option value="VFR_HUD.alt">' in done.stdout  # made by the last of them
    assert "<title>harm" not in done.stdout


@pytest.fixture
def page(browser: Any, written: Path) -> Iterator[Any]:
    with opened(browser, written, 1300) as shown:
        yield shown


def seen(page: Any) -> tuple[float, float]:
    low, high = page.evaluate("flightClock.shown")
    return low, high


def test_foreign_text_is_inert(page: Any) -> None:
    assert page.title() != "harm"
    assert page.locator("img").count() == 0
    assert page.evaluate("document.scripts.length") == 3
    assert page.get_by_text("onerror=document.title").count() > 0


def test_keys_zoom_move_and_show_all(page: Any) -> None:
    whole = seen(page)
    page.keyboard.press("+")
    zoomed = seen(page)
    assert zoomed[1] - zoomed[0] == pytest.approx((whole[1] - whole[0]) / 2)
    page.keyboard.press("ArrowRight")
    assert seen(page)[0] > zoomed[0]
    page.keyboard.press("0")
    assert seen(page) == whole


def test_dragging_over_a_plot_zooms_all_of_them(page: Any) -> None:
    figure = page.locator('figure[data-plot="overview.0"]')
    figure.scroll_into_view_if_needed()
    box = figure.locator(".u-over").bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 30)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 30, steps=5)
    page.mouse.up()
    low, high = seen(page)
    assert (low, high) == pytest.approx((0.4 * 89.75, 0.6 * 89.75), abs=0.5)
    until(page, f"plots.some((one) => one.plot.scales.x.min === {low!r})")
    shown = page.evaluate("plots.map((one) => [one.plot.scales.x.min, one.plot.scales.x.max])")
    assert [low, high] in shown


def test_the_pointer_stands_at_one_moment_in_every_plot(page: Any) -> None:
    page.locator(".case").scroll_into_view_if_needed()
    over = page.locator(".case .u-over").first
    over.scroll_into_view_if_needed()
    over.hover()
    moment = page.evaluate("pointer.t")
    assert moment == pytest.approx(35.0, abs=0.5)  # the middle of 25 to 45 s
    assert str(int(moment)) in page.locator("#now").text_content()
    lefts = page.evaluate(
        "plots.filter((one) => one.plot.cursor.left >= 0)"
        ".map((one) => one.plot.posToVal(one.plot.cursor.left, 'x'))"
    )
    assert len(lefts) > 1
    assert lefts == pytest.approx([moment] * len(lefts), abs=0.3)


def test_a_case_shows_the_whole_flight_by_one_click(page: Any) -> None:
    case = page.locator(".case").first
    case.scroll_into_view_if_needed()
    span = (
        "(() => { const one = plots.find((p) => p.live.closest('.case'));"
        " return one.plot.scales.x.max - one.plot.scales.x.min; })()"
    )
    case.locator(".u-over").first.wait_for()
    assert page.evaluate(span) == pytest.approx(20.0)
    case.get_by_role("button", name="whole flight").click()
    until(page, f"{span} > 80")
    assert page.evaluate(span) == pytest.approx(89.75)


def test_any_channel_can_be_picked_and_added(page: Any) -> None:
    page.locator("#search").fill("vfr alt")
    options = page.locator("#channel option").all_text_contents()
    assert options == ["VFR_HUD.alt"]
    page.locator("#add").click()
    page.locator("#search").fill("gps")
    page.locator("#add").click()
    assert page.locator("#picked .uplot").count() == 1
    assert "VFR_HUD.alt, GPS_RAW_INT.alt" in page.locator("#picked figcaption").text_content()


def test_a_channel_with_a_hostile_name_is_plotted_and_inert(page: Any) -> None:
    page.locator("#search").fill("harm")
    page.locator("#add").click()
    assert page.locator("#picked .uplot").count() == 1
    assert HARM in page.locator("#picked figcaption").text_content()
    assert page.locator("img").count() == 0
    assert page.title() != "harm"


def test_events_are_filtered_by_severity(page: Any) -> None:
    rows = page.locator("tr[data-level]:visible")
    every = rows.count()
    page.locator("#told").select_option("3")
    assert 0 < rows.count() < every


@pytest.mark.parametrize("width", [360, 1300])
def test_no_page_is_wider_than_its_window(page: Any, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_paper_shows_drawings_and_evidence_but_no_tables_of_parameters_and_tests(page: Any) -> None:
    page.locator(".case").first.scroll_into_view_if_needed()
    page.locator(".case .uplot").first.wait_for()
    page.emulate_media(media="print")
    assert page.locator(".case .still svg").first.is_visible()
    assert not page.locator(".case .uplot").first.is_visible()
    assert page.locator("#quiet").is_visible()
    assert page.locator(".paper").is_visible()  # says what is left out
    for left_out in ("#parameters", "#residuals", "#events", "#channels"):
        assert not page.locator(left_out).is_visible()


def test_without_scripts_drawings_and_tables_tell_it(browser: Any, written: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    opened = context.new_page()
    opened.goto(written.as_uri())
    assert opened.locator(".case .still svg").first.is_visible()
    assert opened.locator("svg.airframe").is_visible()
    assert not opened.locator("#bar").is_visible()
    assert opened.locator("noscript").count() == 1
    context.close()


def test_the_address_holds_what_is_shown_and_shows_what_it_holds(page: Any) -> None:
    page.evaluate("flightClock.show(20, 30)")
    until(page, "location.hash === '#t=20,30'")
    page.evaluate("location.hash = '#t=40,44.5'")
    until(page, "flightClock.shown[0] === 40")
    assert seen(page) == (40, 44.5)
    page.evaluate("location.hash = '#t=x,9'")
    page.evaluate("location.hash = '#findings'")
    assert seen(page) == (40, 44.5)


def test_what_a_plot_shows_is_saved_as_csv(page: Any) -> None:
    figure = page.locator('figure[data-plot="overview.0"]')
    figure.scroll_into_view_if_needed()
    page.evaluate("flightClock.show(20, 30)")
    with page.expect_download() as found:
        figure.get_by_role("button", name="save the shown stretch as CSV").click()
    head, *rows = Path(found.value.path()).read_text("utf-8").splitlines()
    assert head.startswith('"s",')
    times = [float(row.split(",")[0]) for row in rows]
    assert len(times) > 5
    assert 20 <= min(times) < max(times) <= 30


def test_a_plot_can_be_folded_and_made_taller(page: Any) -> None:
    figure = page.locator('figure[data-plot="overview.0"]')
    figure.scroll_into_view_if_needed()
    height = figure.locator(".u-wrap").bounding_box()["height"]
    figure.get_by_role("button", name="twice as high").click()
    assert figure.locator(".u-wrap").bounding_box()["height"] == 2 * height
    figure.get_by_role("button", name="fold or unfold").click()
    assert not figure.locator(".live").is_visible()
