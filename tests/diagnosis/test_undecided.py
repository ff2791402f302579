"""What keeps a component from being cleared, of those of which nothing else is said."""

from dataclasses import replace

import pytest

from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.undecided import left_open
from fdi.telemetry import Flight

from .build import alarms_of, bank_of, model, named, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
SKY = row(BANK, "SUN.y", "STAR.y")
BARO, RADAR = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")
FLOWN = (Flight(0, 100, takeoff=20.0, landing=90.0),)


def why(name, raised, *, bank=BANK, **more):
    """What keeps one component from being cleared."""
    (found,) = left_open(alarms_of(bank, raised, **more), set(bank.system.components) - {name})
    assert found.component == name
    return found.text


def words(name, place):
    return alarm_words(name, BANK.generators[place], BANK.system)


def briefly(alarms, place, start, end):
    """A test beyond its threshold without an alarm."""
    state, t = alarms.state.copy(), alarms.residuals.t
    state[place, (t >= start) & (t < end)] = 1
    return replace(alarms, state=state)


def test_of_whom_something_is_said_nothing_is_left_open():
    alarms = alarms_of(BANK, {})
    assert named(left_open(alarms, set())) == list(SHOWN)
    assert named(left_open(alarms, {"gps", "sun"})) == ["baro", "radar", "star"]
    assert left_open(alarms, set(SHOWN)) == ()


def test_what_lies_outside_the_model_is_not_left_open():
    text = model(SHOWN).replace("    component: sun\n", "")
    bank = bank_of(text)
    assert "outside_model" in bank.system.components
    assert "outside_model" not in named(left_open(alarms_of(bank, {}), set()))


def test_an_alarm_is_told_with_its_beginning():
    said = why("sun", {SKY: [(40, 60), (70, 80)]})
    assert said == f"an alarm concerns it: {words('sun', SKY)}, from 40.0 s"


def test_of_several_tests_the_first_is_told_and_the_others_are_counted():
    said = why("gps", {BARO: [(50, 60)], RADAR: [(40, 60)]})
    assert said == f"an alarm concerns it: {words('gps', RADAR)}, from 40.0 s, and 1 more"


@pytest.mark.parametrize(("start", "flights", "is_told"), [(60, FLOWN, True), (5, FLOWN, False)])
def test_a_test_that_left_health_in_flight_without_an_alarm_is_told(start, flights, is_told):
    alarms = briefly(alarms_of(BANK, {}, flights=flights), SKY, start, start + 0.5)
    (found,) = left_open(alarms, set(SHOWN) - {"sun"})
    brief = f"a test left health briefly: {words('sun', SKY)}, from {start:.1f} s"
    assert (found.text == brief) == is_told


def test_an_alarm_is_told_before_what_left_health_earlier():
    alarms = briefly(alarms_of(BANK, {BARO: [(50, 60)]}), RADAR, 30, 30.5)
    (found,) = left_open(alarms, set(SHOWN) - {"gps"})
    assert found.text == f"an alarm concerns it: {words('gps', BARO)}, from 50.0 s, and 1 more"


def test_an_alarm_on_the_ground_is_told_as_that():
    said = why("gps", {BARO: [(5, 15)]}, flights=FLOWN)
    assert said == "1 of its 2 tests scatters more than at first, or raised an alarm on the ground"


def test_who_has_no_test_that_ran_is_told_so():
    assert why("sun", {}, unknown={SKY: [(0, 100)]}) == "no test of it ran"


def test_tests_that_ended_early_are_counted():
    said = why("gps", {}, unknown={BARO: [(70, 100)]})
    assert said == "1 of its 2 tests did not run all the way to the end"


def test_whose_tests_ran_and_were_quiet_has_none_that_says_how_small_a_fault_it_shows():
    said = why("sun", {}, unknown={SKY: [(0, 0.25)]})
    assert said == "its tests do not say how small a fault of it they would show"
