import base64
import hashlib
import json
import re
from collections import Counter
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import pytest

from fdi.methods.estimator.findings import Finding as EstimatorFinding
from fdi.report.html import html_report
from fdi.report.page.script import script, style
from fdi.result import Analysis

from .build import NOTHING, small_analysis, small_log
from .test_text import HOSTILE, noticed


class Tags(HTMLParser):
    """Collects tags and addresses, and checks that what opens is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: Counter[str] = Counter()
        self.addresses: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen[tag] += 1
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]
        assert not any(name.startswith("on") for name, _ in attrs)
        if tag not in ("meta", "img", "br", "link", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> str:
    log = small_log(name="<script>alert(1)<x>.tlog", text=HOSTILE)
    return html_report(
        small_analysis(tmp_path_factory.mktemp("hostile"), log, verdict="<img src=x>")
    )


def test_the_page_needs_nothing_from_elsewhere(hostile: str) -> None:
    tags = Tags()
    tags.feed(hostile)
    assert not tags.open
    assert not tags.seen.keys() & {"link", "iframe", "object", "base", "b", "img"}
    assert all(address.startswith("#") for address in tags.addresses)
    assert tags.seen["script"] == 3


def test_foreign_text_is_escaped_and_without_control_characters(hostile: str) -> None:
    assert "&lt;script&gt;alert(1)&lt;x&gt;.tlog" in hostile
    assert "&lt;img src=x&gt;" in hostile
    assert "&lt;b&gt;&amp;$x_1$" in hostile
    assert not any(letter in hostile for letter in "\x1b\x07\u202e")


def test_the_policy_allows_these_scripts_and_styles_and_nothing_else(hostile: str) -> None:
    """The hashes are of what stands between the tags: a browser computes the same."""
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', hostile)
    assert policy is not None
    allowed = {part.split()[0]: part.split()[1:] for part in unescape(policy[1]).split("; ")}
    scripts = re.findall(r"<script>(.*?)</script>", hostile, re.DOTALL)
    (style,) = re.findall(r"<style>(.*?)</style>", hostile, re.DOTALL)

    def named(text: str) -> str:
        digest = hashlib.sha256(text.encode()).digest()
        return f"'sha256-{base64.b64encode(digest).decode()}'"

    assert allowed == {
        "default-src": ["'none'"],
        "script-src": [named(text) for text in scripts],
        "style-src": [named(style)],
        "base-uri": ["'none'"],
        "form-action": ["'none'"],
        "img-src": ["data:"],
    }
    assert len(scripts) == 2


def test_no_style_stands_in_an_attribute_which_the_policy_would_refuse(hostile: str) -> None:
    markup = re.sub(r"<(script|style)\b.*?</\1>", "", hostile, flags=re.DOTALL)
    assert not re.search(r"<[^>]*\sstyle=", markup)


def test_our_scripts_and_styles_ask_for_nothing_and_set_foreign_text_as_text() -> None:
    ours = script() + style()
    asking = r"https?:|url\(|@import|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\(|\beval\("
    assert not re.search(asking, ours)
    assert not re.search(r"innerHTML|outerHTML|insertAdjacent|document\.write|setHTML", ours)


def test_foreign_text_in_the_data_cannot_end_their_element(hostile: str) -> None:
    found = re.search(r'<script type="application/json" id="page-data">(.*?)</script>', hostile)
    assert found is not None
    assert "<" not in found[1]
    data = json.loads(found[1])
    assert any("<b>&$x_1$" in mark["text"] for mark in data["marks"])


def test_the_page_tells_everything_the_analysis_knows(analysis: Analysis) -> None:
    told = html_report(analysis)
    for expected in (
        "gps failed first",
        "30.0 s into the flight",
        "estimator shows it",
        "a lasting change of 1 hPa would have shown",
        "its tests do not say how small a fault they would show",
        "GPS receiver shows another height",
        "no test of it reads a channel of this log",
        "17 bytes belong to no record",
        "this log has no field climb",
        "fdi analyze flight.tlog",
        analysis.log.sha256,
        analysis.airframe.sha256,
        analysis.policy.sha256,
        "lowest",
    ):
        assert expected in told, expected


def test_the_command_is_told_without_the_folders_of_whoever_ran_it(analysis: Analysis) -> None:
    command = ("fdi", "analyze", "/home/a/b.tlog", "--model=C:\\c\\d.yaml", "--window", "1:2.5")
    page = html_report(replace(analysis, command=command))
    assert "fdi analyze b.tlog --model=d.yaml --window 1:2.5</dd>" in page
    assert "/home/a" not in page


def test_confidence_is_told_with_what_it_rests_on(analysis: Analysis) -> None:
    told = html_report(analysis)
    assert "75 %; for it: a test that concerns nobody else (+2.5)" in told
    assert "<dt>who else</dt><dd>Barometer 4 %</dd>" in told


def test_a_quiet_page_has_no_findings(tmp_path: Path) -> None:
    told = html_report(small_analysis(tmp_path, **NOTHING))
    assert 'id="findings"' not in told
    assert "No component is accused." in told


def test_the_page_says_which_flight_the_estimators_findings_are_of(analysis: Analysis) -> None:
    told = html_report(noticed(analysis, flights=2))
    assert "own estimator noticed in flight 2 of 2, the only one looked at</h2>" in told
    assert 'href="#estimator"' in told
    assert 'id="estimator"' not in html_report(analysis)


def test_a_column_of_remarks_stands_there_only_with_a_remark(analysis: Analysis) -> None:
    early = EstimatorFinding("rejected", 50.0, 51.0, "velocity is rejected")
    assert "<th>remark</th>" not in html_report(noticed(analysis, early, flights=1))
    late = replace(early, is_late=True)
    told = html_report(noticed(analysis, early, late, flights=1))
    assert "<th>remark</th>" in told
    assert told.count("<td>after the upset: a consequence</td>") == 1


def test_the_page_names_a_frame_that_is_no_ordinary_one(analysis: Analysis) -> None:
    """ "other" says nothing to whoever flies a Y6."""
    log = replace(analysis.log, vehicle="other", frame="Y6", format="dataflash_text")
    assert "dataflash text, 12.3 kB; Y6, " in html_report(replace(analysis, log=log))
