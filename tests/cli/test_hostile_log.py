"""What a log says of itself is inert in every output: no markup, no escape, no turned text.

The log is a flight with texts, parameters and a file name that a stranger made up, generated with
pymavlink into a real recording.
"""

import csv
import json
import struct
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

import fdi
from fdi.report.files import FORMATS, names_of
from fdi.shown import Rows

from .conftest import LOG, Run

TEXTS = (
    "</script><script>document.title='harm'</script>",
    "<img src=x onerror=document.title='harm'>",
    "\"'><svg/onload=document.title='harm'>",
    "\x1b[31m\x1b]0;harm\x07 \x9b2J red",
    "\u202eturned \u2066round\u2069 \u200f",
    "=HYPERLINK(1) ${7*7} {{7*7}} [bold]x[/bold] <!--",
    "-->]]></style><style>*{display:none}",
)
NAMES = ("<b>P</b>", "'\"><i>", "=1+1", "\x1b[31mP")
FILE = "<img src=x onerror=alert(1)>'\"&\u202e\x1b[31m.tlog"
UNSEEN = [chr(n) for n in (*range(0x1F), *range(0x7F, 0xA0)) if n not in (9, 10)]
TURNING = [*map(chr, range(0x202A, 0x202F)), *map(chr, range(0x2066, 0x206A)), "\u200f"]


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A flight into which the autopilot says all of this 30 s before its end."""
    own = LOG.read_bytes()
    end = max(struct.unpack(">Q", own[at - 8 : at])[0] for at in _frames(own)[-50:])
    said = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    messages = [
        said.statustext_encode(severity, text.encode()[:50]) for severity, text in enumerate(TEXTS)
    ]
    messages += [
        said.param_value_encode(name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32, 9, 1)
        for name in NAMES
        for value in (1.0, 2.0)
    ]
    parts = [struct.pack(">Q", end + i) + m.pack(said) for i, m in enumerate(messages)]
    path = tmp_path / FILE.replace("/", "")
    path.write_bytes(own + b"".join(parts))
    return path


def _frames(data: bytes) -> list[int]:
    return [at for at in range(8, len(data)) if data[at] in (0xFD, 0xFE) and data[at - 8] == 0]


class Page(HTMLParser):
    """Collects what a browser would run or load."""

    def __init__(self) -> None:
        super().__init__()
        self.scripts = 0
        self.bad: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.scripts += tag == "script"
        if tag in ("img", "iframe", "object", "i", "b") or (tag == "svg" and not dict(attrs)):
            self.bad.append(tag)
        self.bad += [name for name, _ in attrs if name.startswith("on") or name == "style"]


def assert_plain(text: str) -> None:
    """Check that nothing in a text commands a terminal or turns what stands beside it."""
    found = [letter for letter in (*UNSEEN, *TURNING) if letter in text]
    assert not found, text[max(text.find(found[0]) - 60, 0) :][:120]


def assert_no_code(page: str, scripts: int) -> None:
    found = Page()
    found.feed(page)
    assert (found.scripts, found.bad) == (scripts, [])


def assert_only_drawn(svg: str) -> None:
    tags = {one.tag.rpartition("}")[2] for one in ElementTree.fromstring(svg).iter()}
    assert not tags & {"script", "img", "foreignObject"}


def test_no_output_runs_shows_or_turns_what_a_log_says(
    run: Run, hostile: Path, model: Path
) -> None:
    ended = run("analyze", hostile, "--model", model, "--out", "out")
    assert ended.code == 0
    info = run("info", hostile)
    assert "onerror=document.title" in info.out  # it is told, and inert
    told = [ended.out, ended.err, info.out, run("info", hostile, "--json").out]
    written = {name: Path("out", name) for name in names_of(FORMATS)}
    told += [
        written[name].read_text("utf-8")
        for name in ("report.html", "analysis.json", "summary.txt", "fault_grid.csv")
    ]
    for text in told:
        assert_plain(text)
    assert_no_code(written["report.html"].read_text("utf-8"), 3)
    names = json.loads(written["analysis.json"].read_text("utf-8"))["log"]["name"]
    assert "onerror" in names
    for name in ("fault_grid.svg", "isolability.svg"):
        assert_only_drawn(written[name].read_text("utf-8"))
    for name in ("fault_grid.csv", "isolability.csv"):
        rows = csv.reader(written[name].read_text("utf-8").splitlines())
        assert not [cell for row in rows for cell in row if cell[:1] in "=+@" and cell]


@pytest.mark.parametrize(
    "words",
    [
        ("check",),
        ("estimator",),
        ("heading",),
        ("analyze", "--explain", "all"),
        ("analyze", "--json"),
        ("convert", "--out", "tables"),
    ],
    ids=" ".join,
)
def test_no_other_command_shows_or_turns_what_a_log_says(
    run: Run, hostile: Path, words: tuple[str, ...]
) -> None:
    ended = run(words[0], hostile, *words[1:])
    assert ended.code in (0, 3)
    assert_plain(ended.out + ended.err)


def test_what_a_log_says_is_inert_in_a_comparison(run: Run, hostile: Path, model: Path) -> None:
    ended = run(
        "compare", LOG, hostile, "--healthy", LOG, "--model", model, "--figure", "differences.svg"
    )
    assert ended.code == 0
    assert "onerror" in ended.out
    told = run("compare", LOG, hostile, "--healthy", LOG, "--model", model, "--json")
    assert "onerror" in told.out
    assert_plain(ended.out + ended.err + told.out + told.err)
    if Path("differences.svg").exists():
        assert_only_drawn(Path("differences.svg").read_text("utf-8"))


@pytest.mark.parametrize("what", ["grid", "track", "channels", "evidence", "isolability"])
def test_what_a_log_says_is_inert_in_a_figure(
    run: Run, hostile: Path, model: Path, what: str
) -> None:
    ended = run("figure", hostile, "--model", model, "--what", what, "--out", "figure.svg")
    assert_plain(ended.out + ended.err)
    if ended.code == 0:
        drawn = Path("figure.svg").read_text("utf-8")
        assert_plain(drawn)
        assert_only_drawn(drawn)


def test_what_a_log_says_is_inert_in_a_fleet(run: Run, hostile: Path, model: Path) -> None:
    words = ("--model", model, "--out", "fleet.parquet", "--html", "--ndjson", "--reports", "all")
    ended = run("batch", hostile, *words)
    assert ended.code == 0
    page = Path("fleet.html").read_text("utf-8")
    assert "onerror" in page
    for text in (ended.out, ended.err, page, Path("fleet.ndjson").read_text("utf-8")):
        assert_plain(text)
    assert_no_code(page, 1)
    for report in Path("fleet.reports").rglob("report.html"):
        assert_plain(str(report))
        assert_no_code(report.read_text("utf-8"), 3)


def test_what_a_log_says_is_inert_in_a_notebook(hostile: Path, model: Path) -> None:
    """There a value is HTML, and in a console its `repr`."""
    analysis = fdi.analyze(hostile, model=model)
    log = analysis.log
    values = [analysis, log, analysis.signals, *log.events, Rows(log.events), log.clock]
    for value in values:
        assert_plain(repr(value))
        if hasattr(value, "_repr_html_"):
            assert_plain(value._repr_html_())
            assert_no_code(value._repr_html_(), 0)


def test_a_browser_runs_nothing_that_a_log_says(
    run: Run, hostile: Path, model: Path, browser: Any
) -> None:
    run("analyze", hostile, "--model", model, "--out", "out", "--format", "html")
    path = Path("out/report.html").resolve()
    told: list[str] = []
    asked: list[str] = []
    page = browser.new_page()
    page.on("console", lambda line: told.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("dialog", lambda dialog: told.append(dialog.message))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    page.locator("#level").select_option("7")
    page.locator("#marks canvas").hover()
    page.mouse.wheel(0, 4000)
    assert not page.title().startswith("harm")
    assert page.locator("img").count() == 0
    assert page.get_by_text("onerror=document.title").count() > 0
    page.close()
    assert told == []
    assert asked == [path.as_uri()]
