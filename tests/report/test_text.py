import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from fdi.diagnosis.values import Agreement
from fdi.methods.estimator import estimator_health
from fdi.methods.estimator.findings import Finding as EstimatorFinding
from fdi.report import log_summary, print_summary, summary
from fdi.report.timeline import told_events
from fdi.result import Analysis
from fdi.telemetry import Event, Log

from .build import NOTHING, message, small_analysis, small_log

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


def page(log: Log, width: int = 120) -> str:
    """Return what ``fdi info`` says of a log."""
    out = io.StringIO()
    console = Console(file=out, width=width, color_system=None)
    for part in log_summary(log):
        console.print(part)
    return out.getvalue()


def test_a_page_about_a_log_tells_flights_events_and_damage() -> None:
    told = page(small_log())
    for expected in ("85.0 (9.8 m/s)", "Crash: Disarming", "17 bytes", "VFR_HUD", "plane"):
        assert expected in told


@pytest.mark.parametrize("width", [60, 80, 120])
def test_a_page_about_a_log_keeps_the_width(width: int) -> None:
    log = small_log(text="a long text " * 20)
    assert max(len(line.rstrip()) for line in page(log, width).splitlines()) <= width


def test_instances_that_came_alike_share_a_row() -> None:
    t = np.arange(0, 60, 0.5)
    some = [
        replace(message("BARO", {"alt": t}, t), instance=instance) for instance in (None, 1, 2)
    ] + [replace(message("BARO", {"alt": t[:9]}, t[:9]), instance=4)]
    told = page(replace(small_log(), messages={m.key: m for m in some}))
    rows = [line.split()[:2] for line in told.splitlines() if line.startswith("BARO")]
    assert rows == [["BARO[0-2]", "120"], ["BARO[4]", "9"]]
    assert "4 messages" in told


def test_what_is_said_again_in_the_words_of_mavlink_stands_apart() -> None:
    log = small_log()
    again = replace(log["VFR_HUD"], name="ALTITUDE", made_from="VFR_HUD")
    told = page(replace(log, messages={**log.messages, "ALTITUDE": again}))
    assert "3 messages" in told
    assert "ALTITUDE (VFR_HUD)" in told
    assert not [line for line in told.splitlines() if line.startswith("ALTITUDE")]


def event(t: float, kind: Any, text: str = "") -> Event:
    return Event(t, kind, text)


def test_of_too_many_events_plain_texts_go_first() -> None:
    """What happened last, a crash, must not be cut off by chatter before it."""
    chatter = [event(float(i), "text", f"waypoint {i}") for i in range(100)]
    log = replace(
        small_log(),
        _cache={"flights": ()},
        reported=(event(0.0, "mode", "AUTO"), *chatter, event(101.0, "impact", "impact")),
    )
    told, more = told_events(log, 10)
    assert [one.event.kind for one in told] == ["mode", *["text"] * 8, "impact"]
    assert more == 92
    assert "impact" in page(log)


def test_modes_that_flicker_are_told_once_and_a_mode_that_comes_back_again() -> None:
    """A copter of 2014 goes on between two modes a hundred times as it crashes."""
    flicker = [event(60.0 + i / 1e6, "mode", ("RTL", "LAND")[i % 2]) for i in range(100)]
    flown = [event(t, "mode", mode) for t, mode in ((0.0, "RTL"), (2.0, "LAND"), (4.0, "RTL"))]
    log = replace(small_log(), _cache={}, reported=(*flown, *flicker))
    told = [
        (one.event.kind, one.event.text, one.times)
        for one in told_events(log, 20)[0]
        if one.event.kind == "mode"
    ]
    alone = [("mode", "RTL", 1), ("mode", "LAND", 1), ("mode", "RTL", 1)]
    assert told == [*alone, ("mode", "RTL", 50), ("mode", "LAND", 50)]
    assert "RTL (50 times, last at 60.0 s)" in page(log)


def test_two_equal_texts_ten_seconds_apart_are_two_and_one_on_two_links_is_one() -> None:
    said = [event(t, "text", "Low battery") for t in (40.0, 40.4, 50.0)]
    log = replace(small_log(), _cache={"flights": ()}, reported=tuple(said))
    told = [(one.event.t, one.times, one.last) for one in told_events(log, 10)[0]]
    assert told == [(40.0, 2, 40.4), (50.0, 1, 50.0)]
    assert "Low battery (2 times, last at 40.4 s)" in page(log)
    assert page(log).count("times, last at") == 1


def test_among_too_many_events_a_text_that_is_repeated_for_minutes_is_told_once() -> None:
    said = [event(30.0 * i, "text", text) for i in range(5) for text in ("PreArm: A", "PreArm: B")]
    later = event(900.0, "text", "PreArm: A")
    log = replace(small_log(), _cache={}, reported=(*said, event(200.0, "arm"), later))
    told, more = told_events(log, 4)
    assert more == 0
    assert [(one.event.text, one.times, one.last) for one in told] == [
        ("PreArm: A", 5, 120.0),
        ("PreArm: B", 5, 120.0),
        ("", 1, 200.0),
        ("PreArm: A", 1, 900.0),
    ]


def noticed(analysis: Analysis, *findings: EstimatorFinding, flights: int) -> Analysis:
    """Return an analysis whose estimator noticed something in the last flight."""
    t = np.arange(0.0, 90.0, 0.5)
    log = analysis.log.with_message(
        message("EKF_STATUS_REPORT", {"velocity_variance": 0.1 + 0.0 * t}, t)
    )
    log._cache["flights"] = analysis.log.flights * flights
    health = replace(estimator_health(log), findings=findings)
    return replace(analysis, log=log, estimator=health)


def test_what_a_method_says_of_two_findings_of_one_part_is_told_once(analysis: Analysis) -> None:
    said = "only the method heading shows that the compass failed: no test of the model does"
    twice = tuple(Agreement("heading", 0, rank, True, said) for rank in (1, 3))
    told = summary(replace(analysis, diagnosis=replace(analysis.diagnosis, methods=twice)))
    assert " ".join(told.split()).count(said) == 1


def test_it_is_told_which_flight_the_estimators_findings_are_of(analysis: Analysis) -> None:
    one = EstimatorFinding("rejected", 50.0, 51.0, "velocity is rejected")
    alone = " ".join(summary(noticed(analysis, one, flights=1)).split())
    assert "own estimator noticed (more: fdi estimator) 50.0 s velocity is rejected" in alone
    several = " ".join(summary(noticed(analysis, one, flights=2)).split())
    assert "estimator noticed in flight 2 of 2, the only one looked at (more: " in several
    nothing = " ".join(summary(noticed(analysis, flights=2)).split())
    assert "the only one looked at (more: fdi estimator) nothing" in nothing
    assert "own estimator noticed" not in summary(noticed(analysis, flights=1))


def test_when_it_showed_before_is_told(analysis: Analysis) -> None:
    told = analysis.diagnosis
    first = replace(told.findings[0], earlier=((12.0, 14.5), (20.0, 21.0)))
    made = replace(analysis, diagnosis=replace(told, findings=(first, *told.findings[1:])))
    said = " ".join(summary(made).split())
    assert "so it did before, from log 12.0 s to 14.5 s and 1 more time" in said
    assert "so it did before" not in summary(analysis)


def test_what_the_estimator_noticed_too_late_is_counted(analysis: Analysis) -> None:
    late = EstimatorFinding("rejected", 86.0, 87.0, "velocity is rejected", is_late=True)
    told = " ".join(summary(noticed(analysis, late, flights=1)).split())
    assert "nothing before the vehicle was upset and 1 consequence after the" in told
