"""The few lines of advice that come first, and advice as a document holds it."""

from dataclasses import replace

from fdi.diagnosis import Advice, Ending
from fdi.methods.setup import Check, Setting
from fdi.report.advice_text import advice_line, advice_rows, first_steps
from fdi.result import Analysis
from fdi.telemetry.ends import FlightEnd

LOOK = Advice("Look at it", "Broken is seen", None, "a page", "https://example.org/a")
RECORD = Advice(
    "Record it",
    "It shows",
    Setting("LOG_BITMASK", 1.0, 3.0),
    "b",
    "https://example.org/b",
    "next flight",
)


def with_advice(analysis: Analysis, *advice: Advice) -> Analysis:
    """Return an analysis whose findings bring this advice and whose ends bring none."""
    told = analysis.diagnosis
    findings = tuple(replace(one, advice=advice) for one in told.findings)
    endings = tuple(replace(one, advice=()) for one in told.endings)
    return replace(analysis, diagnosis=replace(told, findings=findings, endings=endings))


def test_the_last_line_is_what_to_record(analysis: Analysis) -> None:
    found = first_steps(with_advice(analysis, LOOK, RECORD))
    assert found == (
        "Look at it. Broken is seen.",
        "Next time: record it; set LOG_BITMASK from 1 to 3.",
    )


def test_no_more_lines_than_asked_for(analysis: Analysis) -> None:
    many = [replace(LOOK, do=f"Look {n}") for n in range(5)]
    found = first_steps(with_advice(analysis, *many, RECORD), most=3)
    assert [line.split(".")[0].split(":")[0] for line in found] == ["Look 0", "Look 1", "Next time"]


def test_a_wrong_set_up_goes_before_the_finding(analysis: Analysis) -> None:
    """A set-up stays wrong until somebody mends it."""
    setting = Setting("COMPASS_ORIENT", 0.0, 8.0, "It fits then")
    check = Check("compass 1", "wrong", "it is turned", settings=(setting,))
    found = first_steps(with_advice(analysis, LOOK), [check])
    assert "set COMPASS_ORIENT from 0 to 8. It fits then." in found[0]
    assert found[-1].startswith("Look at it")


def test_what_carries_a_vehicle_that_crashed_is_told_before_how_and_that_before_the_rest(
    analysis: Analysis,
) -> None:
    """Of a crash that nobody is accused of: too little thrust, then the blow, then a compass."""
    told = analysis.diagnosis
    crash = Ending(FlightEnd(0, "impact", 80.0, 9.0), advice=(LOOK,))
    made = replace(analysis, diagnosis=replace(told, findings=(), endings=(crash,)))
    checks = [Check("compass 1", "wrong", ""), Check("thrust to weight", "wrong", "")]
    lines = first_steps(made, checks, most=20)
    places = [
        next(i for i, line in enumerate(lines) if word in line)
        for word in ("Make the vehicle lighter", "Look at it", "Compare the compass' arrow")
    ]
    assert places == sorted(places)


def test_what_did_not_decide_is_not_told_first(analysis: Analysis) -> None:
    found = first_steps(with_advice(analysis, LOOK), [Check("compass 1", "not known", "")])
    assert found == ("Look at it. Broken is seen.",)


def test_a_question_has_no_full_stop() -> None:
    assert advice_line(replace(LOOK, do="Is it whole?")) == "Is it whole? Broken is seen."


def test_a_parameter_that_is_only_read_is_shown_as_it_is() -> None:
    read = replace(LOOK, parameter=Setting("FRAME_TYPE", 1.0))
    assert advice_line(read) == "Look at it (FRAME_TYPE, now 1). Broken is seen."


def test_a_document_holds_parameter_and_page() -> None:
    (row,) = advice_rows([RECORD])
    assert row["parameter"] == {"name": "LOG_BITMASK", "now": 1.0, "suggested": 3.0}
    assert row["source"] == "b, https://example.org/b"
    assert row["when"] == "next flight"
