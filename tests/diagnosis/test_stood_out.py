"""Facts beside the answer: which are told, in which order, and what they do to a verdict."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import EXAMPLES, analysis_of
from methods.setup.sensors import Ride, write
from report.build import small_analysis

from fdi.analysis import analyze
from fdi.diagnosis import Ending, Fact, NotTestable, Open, stood_out, with_facts
from fdi.diagnosis.verdict import UNEXPLAINED
from fdi.methods.setup import Check, check_setup
from fdi.result import Analysis
from fdi.telemetry import read
from fdi.telemetry.ends import FlightEnd

WRONG = Check("heading", "wrong", "the heading is off", rests_on=("gps",))
LIMITS = Check("motor limits", "not known", "in 69 % of the time", strikes=True)
COMPASS = Check("compass 2", "not known", "readings are off", strikes=True)
FINE = Check("motors", "in order", "they turn it")
QUIET = "No component is accused: all 9 tests stayed within what health explains."


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """Return an analysis that accuses nobody."""
    folder = tmp_path_factory.mktemp("quiet")
    return small_analysis(folder, findings=(), verdict=QUIET, outlook="healthy", endings=())


def facts(analysis: Analysis, *checks: Check) -> tuple[Fact, ...]:
    return stood_out(checks, analysis.alarms, analysis.diagnosis)


def test_what_carries_the_vehicle_is_told_first_and_what_is_in_order_not_at_all(
    quiet: Analysis,
) -> None:
    told = facts(quiet, COMPASS, FINE, WRONG, LIMITS)
    assert [fact.about for fact in told] == ["motor limits", "heading", "compass 2"]
    assert next(fact.text for fact in told) == "motor limits: in 69 % of the time"


def test_a_flight_whose_set_up_is_wrong_is_not_healthy(quiet: Analysis) -> None:
    answer = with_facts(quiet.diagnosis, facts(quiet, WRONG))
    assert answer.outlook == "alarms"
    assert answer.verdict == f"{QUIET} Heading: the heading is off."


def test_motors_at_their_limit_stand_in_a_verdict_that_accuses_nobody(quiet: Analysis) -> None:
    answer = with_facts(quiet.diagnosis, facts(quiet, LIMITS))
    assert answer.verdict == f"{QUIET} Motor limits: in 69 % of the time."
    assert answer.outlook == "healthy"


def test_what_stood_out_itself_is_open_and_not_ruled_out(quiet: Analysis) -> None:
    given = quiet.diagnosis.ruled_out
    name = given[0].component
    shakes = Fact(name, f"{name}: 13 m/s2 all along")
    answer = with_facts(quiet.diagnosis, [shakes])
    assert answer.ruled_out == given[1:]
    assert answer.open[-1].component == name
    assert answer.open[-1].text == "no test saw it change, but 13 m/s2 all along"


def test_a_compass_that_strikes_is_a_fact_and_no_verdict(quiet: Analysis) -> None:
    assert with_facts(quiet.diagnosis, facts(quiet, COMPASS)).verdict == QUIET


def test_an_accusation_keeps_its_verdict(tmp_path: Path) -> None:
    accused = small_analysis(tmp_path)
    told = facts(accused, LIMITS)
    assert with_facts(accused.diagnosis, told).verdict == accused.verdict
    assert len(told) == 1


def test_a_check_that_rests_on_who_is_accused_is_doubted(tmp_path: Path) -> None:
    (told,) = facts(small_analysis(tmp_path), WRONG)
    assert not told.is_wrong
    assert not told.leads
    assert told.text.endswith("on which this rests, is accused itself")


def test_what_strikes_is_left_out_where_an_accused_part_explains_it(tmp_path: Path) -> None:
    accused = small_analysis(tmp_path)
    (name,) = {finding.component for finding in accused.findings}
    assert facts(accused, replace(LIMITS, strikes=True, rests_on=("motor_9",))) != ()
    assert facts(accused, replace(LIMITS, strikes=True, rests_on=(name,))) == ()


def test_the_fact_stands_behind_the_first_sentence_where_letters_are_few(quiet: Analysis) -> None:
    ended = "Hit the ground at 9.8 m/s (log 47.1 s); no component explains it."
    long = f"{ended} First to leave health: {'x' * 150}."
    answer = with_facts(replace(quiet.diagnosis, verdict=long), facts(quiet, LIMITS))
    assert answer.verdict == f"{ended} Motor limits: in 69 % of the time."


def test_a_fact_that_says_more_stands_in_the_place_of_what_it_says_again(quiet: Analysis) -> None:
    verdict = "The recording stops in flight at 9 m (log 54.4 s). No component is accused: all ran."
    fact = Fact("ending", "the recording stops in flight (log 54.4 s): power was going", True, True)
    answer = with_facts(replace(quiet.diagnosis, verdict=verdict), [fact])
    assert answer.verdict == (
        "The recording stops in flight (log 54.4 s): power was going. No component is accused: "
        "all ran."
    )


@pytest.mark.parametrize(("about", "unexplained"), [("motors", ""), ("motor limits", UNEXPLAINED)])
def test_only_motors_in_another_order_may_explain_an_end(
    quiet: Analysis, about: str, unexplained: str
) -> None:
    verdict = f"Tipped over on the ground (log 11.6 s){UNEXPLAINED}."
    fact = Fact(about, f"{about}: they do not turn it; what fits: {'x' * 200}", True, True)
    answer = with_facts(replace(quiet.diagnosis, verdict=verdict), [fact])
    told = f"{about[0].upper()}{about[1:]}: they do not turn it."
    assert answer.verdict == f"Tipped over on the ground (log 11.6 s){unexplained}. {told}"


def test_a_fact_too_long_to_stand_behind_an_acquittal_stands_before_it(quiet: Analysis) -> None:
    quiet_for_long = f"No component is accused: {'x' * 150}."
    fact = Fact("ending", f"the log begins {'y' * 100}", True, True)
    answer = with_facts(replace(quiet.diagnosis, verdict=quiet_for_long), [fact])
    assert answer.verdict == f"The log begins {'y' * 100}. No component is accused."


def test_a_part_of_which_a_fact_tells_is_not_merely_untestable(quiet: Analysis) -> None:
    untested = NotTestable("autopilot_computer", "no channel shows it")
    fact = Fact("autopilot_computer", "its program stopped", True, True)
    answer = with_facts(replace(quiet.diagnosis, not_testable=(untested,)), [fact])
    assert answer.not_testable == ()
    assert Open("autopilot_computer", "its program stopped") in answer.open


@pytest.mark.parametrize(("speed", "told"), [(5.0, True), (0.6, False), (None, False)])
def test_a_fall_is_no_landing(quiet: Analysis, speed: float | None, told: bool) -> None:
    end = Ending(FlightEnd(0, "landed", 60.0, speed), ())
    fell = replace(quiet.diagnosis, endings=(end,))
    found = stood_out((), quiet.alarms, fell)
    assert bool(found) == told
    assert not told or "5.0 m/s" in found[0].text


def test_analyze_holds_what_check_says_of_the_same_log() -> None:
    path = next(EXAMPLES.glob("*motor_failure*.tlog"))
    assert analysis_of(path).setup == check_setup(read(path))


def test_analyze_tells_a_heading_that_is_off(tmp_path: Path) -> None:
    found = analyze(write(tmp_path / "ride.tlog", Ride(heading_off=np.radians(90))))
    assert "heading" in [fact.about for fact in found.stood_out]
    assert found.diagnosis.outlook != "healthy"
    assert {"about", "text", "is_wrong"} == set(found.document()["stood_out"][0])
