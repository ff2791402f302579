import io
from pathlib import Path

from rich.console import Console

from fdi.report import log_summary, print_summary, summary
from fdi.result import Analysis

from .build import NOTHING, small_analysis, small_log

HOSTILE = "boom \x1b[31m\x07[link=http://x]y[/link] \u202e<b>&$x_1$"


def test_the_verdict_stands_before_everything_that_supports_it(analysis: Analysis) -> None:
    told = summary(analysis, folder=Path("out"))
    places = [
        told.index(text)
        for text in (
            "gps failed first",
            "Accused",
            "75 %",
            "What follows",
            "Ruled out",
            "Not testable",
            "17 bytes",
            "Warnings",
            "out/",
        )
    ]
    assert places == sorted(places)


def test_an_onset_is_told_since_take_off_on_the_log_clock_and_in_utc(analysis: Analysis) -> None:
    assert "30.0 s into the flight (log 40.0 s, 2023-11-14 22:14:00.0 UTC)" in summary(analysis)


def test_a_quiet_analysis_accuses_nobody(tmp_path: Path) -> None:
    told = summary(small_analysis(tmp_path, **NOTHING))
    assert "No component is accused." in told
    assert "Accused" not in told


def test_lines_keep_the_width(analysis: Analysis) -> None:
    for width in (60, 100):
        assert max(map(len, summary(analysis, width=width).splitlines())) <= width


def test_foreign_text_reaches_no_terminal_as_markup_or_escape(tmp_path: Path) -> None:
    log = small_log(name="[bold]x[red].tlog", text=HOSTILE)
    out = io.StringIO()
    console = Console(file=out, width=200, color_system=None)
    for part in log_summary(log):
        console.print(part)
    print_summary(small_analysis(tmp_path, log, verdict=HOSTILE), console)
    told = out.getvalue()
    assert "[bold]x[red].tlog" in told
    assert "boom [31m[link=http://x]y[/link] <b>&$x_1$" in told
    assert not any(letter in told for letter in "\x1b\x07\u202e")


def test_a_page_about_a_log_tells_flights_events_and_damage() -> None:
    out = io.StringIO()
    console = Console(file=out, width=120, color_system=None)
    for part in log_summary(small_log()):
        console.print(part)
    told = out.getvalue()
    for expected in ("85.0 (9.8 m/s)", "Crash: Disarming", "17 bytes", "VFR_HUD", "1 change of"):
        assert expected in told
