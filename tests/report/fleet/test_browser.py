"""What a browser makes of the page of many logs; skipped where chromium or playwright lack."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fdi.fleet import Job, failed
from fdi.report.fleet.document import fleet_page

from ..browsing import opened
from ..test_text import HOSTILE
from .build import accused, finding, row
from .test_page import HARM

NAMES = "[...document.querySelectorAll('tbody tr:not([hidden]) summary')].map((s) => s.textContent)"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rows = [
        row("b.tlog", airborne_s=300.0),
        accused("c.tlog", report="t.reports/c-1.fdi"),
        row("a.bin", vehicle="plane", airborne_s=70.0),
        accused("d.tlog", "gps", findings=[finding("gps", confidence=0.99)], ended="landed"),
        failed(Job("e.tlog"), OSError("gone")),
        row(f"{HARM}{HOSTILE}".replace("/", ""), warnings=[HARM]),
    ]
    path = tmp_path_factory.mktemp("fleet") / "t.html"
    path.write_text(fleet_page(rows, "t.parquet"), "utf-8")
    return path


@pytest.fixture
def page(browser: Any, written: Path) -> Iterator[Any]:
    with opened(browser, written, 1400) as shown:
        yield shown


def test_a_column_is_sorted_both_ways_with_what_is_unknown_last(page: Any) -> None:
    head = page.get_by_role("button", name="in the air")
    head.click()
    assert page.evaluate(NAMES)[0] == "b.tlog"
    assert page.evaluate(NAMES)[-1] == "e.tlog"
    head.click()
    assert page.evaluate(NAMES)[0] == "a.bin"
    assert page.evaluate(NAMES)[-1] == "e.tlog"
    assert page.locator('th[aria-sort="ascending"]').count() == 1


def test_the_surest_accusation_and_the_worst_end_come_first(page: Any) -> None:
    page.get_by_role("button", name="accused").click()
    assert page.evaluate(NAMES)[:2] == ["d.tlog", "c.tlog"]
    page.get_by_role("button", name="how it ended").click()
    assert page.evaluate(NAMES)[0] == "c.tlog"


def test_keys_alone_sort(page: Any) -> None:
    page.get_by_role("button", name="log", exact=True).focus()
    page.keyboard.press("Enter")
    assert page.evaluate(NAMES)[1:4] == ["a.bin", "b.tlog", "c.tlog"]


def test_filters_go_together_and_say_how_many_are_left(page: Any) -> None:
    page.locator("#state").select_option("flagged")
    assert sorted(page.evaluate(NAMES)) == ["c.tlog", "d.tlog"]
    page.locator("#words").fill("GPS 99")
    assert page.evaluate(NAMES) == ["d.tlog"]
    assert page.locator("#shown").text_content() == "1 of 6"
    page.locator("#words").fill("")
    page.locator("#state").select_option("")
    page.locator("#kind").select_option("plane")
    assert page.evaluate(NAMES) == ["a.bin"]


def test_a_point_of_a_trend_leads_to_its_log_also_where_that_is_filtered_out(page: Any) -> None:
    page.locator("#state").select_option("failed")
    page.locator('.trends a[href="#log-2"]').first.click()
    page.locator("#log-2 details[open]").wait_for()
    assert page.locator("#log-2").is_visible()


def test_foreign_text_is_inert(page: Any) -> None:
    assert page.title() == "t.parquet: 6 logs"
    assert page.locator("img").count() == 0
    assert page.evaluate("document.scripts.length") == 1
    assert any("onerror" in name for name in page.evaluate(NAMES))


@pytest.mark.parametrize("width", [360, 400, 821, 1400])
def test_no_page_is_wider_than_its_window(page: Any, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_without_scripts_the_table_holds_the_same(browser: Any, written: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    opened = context.new_page()
    opened.goto(written.as_uri())
    assert opened.locator("tbody tr:visible").count() == 6
    assert not opened.locator("#words").is_visible()
    context.close()
