import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from fdi.report.figures import fault_grid_figure, isolability_figure
from fdi.report.html import html_report
from fdi.report.style import Picture
from fdi.result import Analysis

from .build import NOTHING, small_analysis, small_log
from .test_text import HOSTILE, noticed


def page(analysis: Analysis) -> str:
    drawn = {
        "fault_grid": fault_grid_figure(analysis),
        "isolability": isolability_figure(analysis.diagnosis.implementable),
    }
    return html_report(analysis, {name: Picture(figure) for name, figure in drawn.items()})


class Tags(HTMLParser):
    """Collects tags and addresses, and checks that what opens is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: set[str] = set()
        self.addresses: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.add(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]
        assert not any(name.startswith("on") for name, _ in attrs)
        if tag not in ("meta", "img", "br", "link"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> str:
    log = small_log(name="<script>alert(1)<x>.tlog", text=HOSTILE)
    return page(small_analysis(tmp_path_factory.mktemp("hostile"), log, verdict="<img src=x>"))


def test_the_page_needs_nothing_from_elsewhere(hostile: str) -> None:
    tags = Tags()
    tags.feed(hostile)
    assert not tags.open
    assert not tags.seen & {"script", "link", "iframe", "object", "base", "b"}
    assert all(address.startswith(("data:image/", "#")) for address in tags.addresses)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', hostile)
    assert policy is not None
    assert policy[1].startswith("default-src 'none'")


def test_foreign_text_is_escaped_and_without_control_characters(hostile: str) -> None:
    assert "&lt;script&gt;alert(1)&lt;x&gt;.tlog" in hostile
    assert "&lt;img src=x&gt;" in hostile
    assert "&lt;b&gt;&amp;$x_1$" in hostile
    assert not any(letter in hostile for letter in "\x1b\x07\u202e")


def test_the_page_tells_everything_the_analysis_knows(analysis: Analysis) -> None:
    told = page(analysis)
    for expected in (
        "gps failed first",
        "30.0 s into the flight",
        "estimator shows it",
        "a lasting change of 1 hPa would have shown",
        "its tests do not say how small a fault they would show",
        "GPS receiver shows another height",
        "no channel in this log shows it",
        "17 bytes belong to no record",
        "this log has no field climb",
        "fdi analyze flight.tlog",
        analysis.log.sha256,
        analysis.airframe.sha256,
        analysis.policy.sha256,
        "lowest",
    ):
        assert expected in told, expected


def test_confidence_is_told_with_what_it_rests_on(analysis: Analysis) -> None:
    told = page(analysis)
    assert "75 %; for it: a test that concerns nobody else (+2.5)" in told
    assert "<dt>who else</dt><dd>barometer 4 %</dd>" in told


def test_a_quiet_page_has_no_findings(tmp_path: Path) -> None:
    told = page(small_analysis(tmp_path, **NOTHING))
    assert 'id="findings"' not in told
    assert "No component is accused." in told


def test_the_page_says_which_flight_the_estimators_findings_are_of(analysis: Analysis) -> None:
    told = page(noticed(analysis, flights=2))
    assert "own estimator noticed in flight 2 of 2, the only one looked at</h2>" in told
    assert 'href="#estimator"' in told
    assert 'id="estimator"' not in page(analysis)
