"""What keeps a component from being cleared, of those of which nothing else is said."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis.isolability import implementable_isolability
from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.undecided import FOLLOWED, NO_SIZE, ONLY_ACCUSE, left_open, not_testable
from fdi.diagnosis.verdict import count_tests
from fdi.telemetry import Flight
from fdi.telemetry.ends import FlightEnd

from .build import RATE, alarms_of, bank_of, model, named, row

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
    alarms = briefly(alarms_of(BANK, {}, flights=flights), SKY, start, start + 1)
    (found,) = left_open(alarms, set(SHOWN) - {"sun"})
    brief = f"a test left health briefly: {words('sun', SKY)}, from {start:.1f} s"
    assert (found.text == brief) == is_told


def test_a_moment_beyond_a_threshold_is_told_only_where_it_speaks_against_a_part():
    """It does in the last seconds; elsewhere it keeps nobody from being cleared."""
    for start, is_told in ((40, False), (88, True)):
        alarms = briefly(alarms_of(BANK, {}, flights=FLOWN), SKY, start, start + 0.5)
        (found,) = left_open(alarms, set(SHOWN) - {"sun"})
        moment = f"a test left health for a moment: {words('sun', SKY)}, from {start:.1f} s"
        assert (found.text == moment) == is_told


def test_the_verdict_counts_each_test_of_which_an_open_part_is_told_that_it_left_health():
    alarms = briefly(briefly(alarms_of(BANK, {}), SKY, 40, 41), BARO, 60, 60.5)
    told = [one.component for one in left_open(alarms, set()) if "left health" in one.text]
    assert told == ["sun", "star"]
    found = count_tests(alarms)
    assert (found.raised, found.strayed, found.touched) == (0, 1, 1)


def test_an_alarm_is_told_before_what_left_health_earlier():
    alarms = briefly(alarms_of(BANK, {BARO: [(50, 60)]}), RADAR, 30, 31)
    (found,) = left_open(alarms, set(SHOWN) - {"gps"})
    assert found.text == f"an alarm concerns it: {words('gps', BARO)}, from 50.0 s, and 1 more"


def test_an_alarm_on_the_ground_is_told_as_that():
    said = why("gps", {BARO: [(5, 15)]}, flights=FLOWN)
    assert said == "1 of its 2 tests raised an alarm on the ground"


def test_a_test_that_scatters_more_is_told_as_that():
    alarms = alarms_of(BANK, {}, flights=FLOWN)
    t = alarms.residuals.t
    values = np.zeros(alarms.state.shape)
    values[BARO] = np.where(np.arange(len(t)) % 2, 0.1, -0.1) * np.where(t > 50, 3.0, 1.0)
    rough = replace(alarms, residuals=replace(alarms.residuals, values=values))
    (found,) = left_open(rough, set(SHOWN) - {"gps"})
    assert found.text == "1 of its 2 tests scatters more than at first"


def test_who_has_no_test_that_ran_is_told_so():
    assert why("sun", {}, unknown={SKY: [(0, 100)]}) == "no test of it ran"


@pytest.mark.parametrize(
    ("gap", "said"),
    [
        ((30, 60), "1 of its 2 tests ran for less than 80% of the time in the air"),
        ((85, 90), "1 of its 2 tests did not run in the last 5 s in the air"),
    ],
)
def test_whether_a_test_ran_too_little_or_not_to_the_end_is_told(gap, said):
    assert why("gps", {}, unknown={BARO: [gap]}, flights=FLOWN) == said


@pytest.mark.parametrize(
    ("how", "at", "said"),
    [
        ("in_air", 100.0, "it may have ended a log that ends without a landing"),
        ("impact", 99.0, "it may have ended a log that ends without a landing"),
        (
            "impact",
            80.0,
            "a moment's failure of it may have ended a flight that ends without a landing",
        ),
    ],
)
def test_who_may_have_ended_a_flight_did_not_end_a_log_that_goes_on(how, at, said):
    bank = bank_of(model(SHOWN).replace("sun: {", "sun: {ends_log: true, "))
    ends = (FlightEnd(0, how, at),)
    assert why("sun", {}, bank=bank, ends=ends) == said


def test_of_whom_no_size_can_be_stated_is_told_so():
    wide = np.full((len(BANK.generators), round(100 * RATE)), 1e3)
    (found,) = left_open(alarms_of(BANK, {}, threshold=wide), set(SHOWN) - {"sun"})
    assert found.text == NO_SIZE


def test_parts_whose_tests_can_only_accuse_have_the_same_reason():
    """One line for all of them, whatever else is so of their tests."""
    more = "equations:\n  a: {text: x = y, fault: wing.lift, component: wing}\n"
    bank = bank_of(model(SHOWN, {"wing": []}, more))
    held = [i for i, one in enumerate(bank.generators) if "wing.lift" in one.faults]
    for unknown in ({}, {place: [(70, 100)] for place in held}):
        assert why("wing", {}, bank=bank, unknown=unknown) == ONLY_ACCUSE


def test_a_sensor_that_is_compared_with_what_uses_it_is_told_as_that():
    bank = bank_of(model({"gps": ["x"], "filter": ["x"]}, {"gps": ["filter"]}))
    assert why("gps", {}, bank=bank) == FOLLOWED


LOW = "limits:\n  low: {variable: x, min: 12, component: gps, says: shows less than 12 m}\n"


def standing(bank):
    """Alarms of a bank whose tests are all violated from the flight's beginning on."""
    every = np.ones(len(bank.generators), bool)
    values = np.full((len(every), round(100 * RATE)), 9.0)
    unknown = {row: [(0, 100)] for row in range(len(every))}
    alarms = alarms_of(bank, {}, unfit=every, unknown=unknown, flights=FLOWN)
    return replace(alarms, residuals=replace(alarms.residuals, values=values))


def test_a_limit_that_is_violated_from_the_beginning_on_is_named_where_nothing_else_was_tested():
    bank = bank_of(model({"gps": ["x"]}, more=LOW), "mtes")
    alarms = standing(bank)
    (found,) = not_testable(alarms, bank, implementable_isolability(bank), flew=True)
    assert found.text == "Gps shows less than 12 m: so from the beginning of the flight on"


def test_a_limit_that_is_violated_from_the_beginning_on_is_named_where_other_tests_ran():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=LOW))
    low = [i for i, g in enumerate(bank.generators) if "low" in bank.describe(g)]
    alarms = standing(bank)
    fit = ~np.isin(np.arange(len(bank.generators)), low)
    alarms = replace(
        alarms, unfit=~fit, state=np.where(fit[:, None], 0, alarms.state).astype(np.int8)
    )
    (found,) = left_open(alarms, {"baro"})
    assert "shows less than 12 m: so from the beginning of the flight on" in found.text


@pytest.mark.parametrize("aloft", [(), ((30.0, 80.0),)])
def test_of_a_hop_below_the_fields_of_the_ground_it_is_told_that_compasses_were_not_tested(aloft):
    """Where the vehicle was high enough, something else kept the tests from running."""
    high = "limits:\n  low: {variable: x, min: 12, component: gps, when: aloft, says: is low}\n"
    bank = bank_of(model({"gps": ["x"]}, more=high), "mtes")
    unknown = {row: [(0, 100)] for row in range(len(bank.generators))}
    flown = (replace(FLOWN[0], aloft=aloft),)
    alarms = alarms_of(bank, {}, unknown=unknown, flights=flown)
    (found,) = not_testable(alarms, bank, implementable_isolability(bank), flew=True)
    hop = "its tests hold clear of the magnetic fields of the ground only, 2.5 m above it"
    assert (found.text == hop) == (aloft == ())
