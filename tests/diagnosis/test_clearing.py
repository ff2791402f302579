"""Whom the data speak for, and which fault they would have shown: each rule by a known answer."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis.clearing import (
    _rougher,
    _scatter,
    ended_well,
    faults_by_component,
    quiet_tests,
    ruled_out,
    size_words,
)
from fdi.diagnosis.values import WouldShow
from fdi.telemetry import Flight
from fdi.telemetry.ends import FlightEnd

from .build import POLICY, RATE, alarms_of, bank_of, model, named, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
SKY = row(BANK, "SUN.y", "STAR.y")
FLOWN = (Flight(0, 100, takeoff=0.0, landing=100.0),)
LANDED = (FlightEnd(0, "landed", 100.0),)


def cleared(alarms, named_already=()):
    return {one.component: one for one in ruled_out(alarms, alarms.residuals.bank, named_already)}


def test_who_is_named_already_is_not_cleared():
    assert set(cleared(alarms_of(BANK, {}), ("gps", "star"))) == {"baro", "radar", "sun"}


def test_the_faults_of_a_component_have_their_columns():
    bank = bank_of(model({"gps": ["x", "y"], "baro": ["x"], "sun": ["y"]}))
    found = faults_by_component(bank)
    assert {name: [c for c, _ in own] for name, own in found.items()} == {
        "gps": [0, 1],
        "baro": [2],
        "sun": [3],
    }
    assert [fault.name for _, fault in found["gps"]] == ["GPS.x", "GPS.y"]


# Which tests may speak.


@pytest.mark.parametrize(("known_s", "able"), [(79.0, False), (81.0, True)])
def test_four_fifths_of_the_time_in_the_air_must_be_known(known_s, able):
    alarms = alarms_of(BANK, {}, unknown={SKY: [(0, 100 - known_s)]}, flights=FLOWN)
    assert quiet_tests(alarms)[0][SKY] == able


@pytest.mark.parametrize(("gap_s", "able"), [(0.75, True), (1.25, False)])
def test_four_fifths_of_the_last_five_seconds_must_be_known(gap_s, able):
    alarms = alarms_of(BANK, {}, unknown={SKY: [(96, 96 + gap_s)]}, flights=FLOWN)
    assert quiet_tests(alarms)[0][SKY] == able
    # of the first flight as well as of the second
    two = (Flight(0, 50, takeoff=0.0, landing=40.0), Flight(50, 100, takeoff=50.0, landing=100.0))
    alarms = alarms_of(BANK, {}, unknown={SKY: [(36, 36 + gap_s)]}, flights=two)
    assert quiet_tests(alarms)[0][SKY] == able


@pytest.mark.parametrize(("start", "speaks"), [(94.5, False), (95.0, True), (99.75, True)])
def test_a_test_that_was_triggered_in_the_last_five_seconds_speaks_against(start, speaks):
    alarms = alarms_of(BANK, {}, flights=FLOWN)
    state = alarms.state.copy()
    state[SKY, round(start * RATE)] = 1
    assert quiet_tests(replace(alarms, state=state))[1][SKY] == speaks


def test_a_test_that_is_not_judged_does_not_speak():
    alarms = alarms_of(BANK, {}, flights=FLOWN)
    unfit = np.arange(len(alarms.state)) == SKY
    able, against, *_ = quiet_tests(replace(alarms, unfit=unfit))
    assert np.flatnonzero(~able).tolist() == [SKY]
    assert not against.any()


def test_where_nothing_flew_nothing_speaks_for_anybody():
    alarms = alarms_of(BANK, {SKY: [(20, 30)]}, flights=(Flight(0, 100, takeoff=200.0),))
    able, against, *_ = quiet_tests(alarms)
    assert not able.any()
    assert np.flatnonzero(against).tolist() == [SKY]


@pytest.mark.parametrize(("times", "speaks"), [(1.9, False), (2.1, True)])
def test_what_scatters_twice_as_much_as_in_the_beginning_speaks_against(times, speaks):
    """For a fifth of the flight; in a twentieth it is one manoeuvre of many."""
    alarms = alarms_of(BANK, {}, flights=FLOWN)
    t = alarms.residuals.t
    swing = np.where(np.arange(len(t)) % 2, 0.1, -0.1)
    for share, counts in ((0.2, speaks), (0.05, False)):
        values = alarms.residuals.values.copy()
        values[SKY] = swing * np.where(t > 100 * (1 - share), times, 1.0)
        given = replace(alarms, residuals=replace(alarms.residuals, values=values))
        assert _rougher(given, np.ones(len(t), bool))[SKY] == counts
        assert quiet_tests(given)[1][SKY] == counts


def test_scatter_is_that_of_whole_blocks_that_are_known():
    ratio = np.array([[1.0, -1.0, 3.0, -3.0, 5.0, -5.0, 7.0], [1.0, -1.0, np.nan, -3.0, 5, 5, 9]])
    found = _scatter(ratio, 2)
    assert found == pytest.approx([np.quantile([1, 3, 5], 0.9), 0.9])
    assert np.isnan(_scatter(np.full((1, 6), np.nan), 2)).all()
    assert np.isnan(_scatter(ratio, 8)).all()


# How small a fault it would have shown.


@pytest.mark.parametrize(("threshold", "is_cleared"), [(99.0, True), (101.0, False)])
def test_a_change_of_more_than_a_hundred_deviations_is_not_worth_telling(threshold, is_cleared):
    alarms = alarms_of(BANK, {})
    wide = replace(alarms, threshold=np.full(alarms.state.shape, threshold))
    assert bool(cleared(wide)) == is_cleared


def test_of_several_tests_the_one_that_shows_the_smallest_change_tells():
    alarms = alarms_of(BANK, {})
    threshold = alarms.threshold.copy()
    threshold[row(BANK, "GPS.x", "RADAR.x")] = 0.5
    found = cleared(replace(alarms, threshold=threshold))
    assert [one.size for one in found["gps"].would_show] == pytest.approx([0.5])
    assert [one.size for one in found["radar"].would_show] == pytest.approx([0.5])
    assert [one.size for one in found["baro"].would_show] == pytest.approx([2.0])
    assert found["gps"].residuals == (BANK.generators[row(BANK, "GPS.x", "RADAR.x")].id,)


def test_a_test_without_a_threshold_shows_nothing():
    alarms = alarms_of(BANK, {})
    threshold = alarms.threshold.copy()
    threshold[SKY] = np.nan
    assert set(cleared(replace(alarms, threshold=threshold))) == {"gps", "baro", "radar"}


def test_until_when_it_is_said_where_the_flight_did_not_end_well():
    shown = "a lasting change of more than 2 m in either direction would have shown"
    for ends, late in ((LANDED, ""), ((), " until 10 s before the end")):
        found = cleared(alarms_of(BANK, {}, ends=ends, flights=FLOWN))
        assert {one.text for one in found.values()} == {shown + late}
    quick = replace(POLICY.use, mean_s=0.0)
    assert cleared(alarms_of(BANK, {}, use=quick))["gps"].text.endswith("would have shown")


@pytest.mark.parametrize(
    ("how", "flight", "well"),
    [
        ("landed", Flight(0, 100, takeoff=5.0, landing=90.0), True),
        ("failsafe", Flight(0, 100, takeoff=5.0, landing=90.0), True),
        ("failsafe", Flight(0, 100, takeoff=5.0), False),
        ("on_ground", Flight(0, 100, flew=False), True),
        ("in_air", Flight(0, 100, takeoff=5.0), False),
        ("impact", Flight(0, 100, takeoff=5.0, landing=90.0), False),
    ],
)
def test_a_flight_ended_well_that_is_seen_to_land(how, flight, well):
    alarms = alarms_of(BANK, {}, flights=(flight,), ends=(FlightEnd(0, how, 95.0),))
    assert ended_well(alarms) == well


def test_who_may_end_the_log_is_cleared_by_a_landing_only():
    text = model(SHOWN).replace("gps: {", "gps: {ends_log: true, ")
    bank = bank_of(text)
    for ends, is_out in ((LANDED, True), ((), False), ((FlightEnd(0, "in_air", 100.0),), False)):
        assert ("gps" in cleared(alarms_of(bank, {}, flights=FLOWN, ends=ends))) == is_out


def test_who_shows_in_what_the_vehicle_does_only_is_not_cleared():
    """No channel of its own: the tests do not say how small a fault they would show."""
    more = "equations:\n  a: {text: z = x, solves: [z], fault: wing.lift, component: wing}\n"
    text = model({**SHOWN, "camera": ["z"]}, {"wing": []}, more)
    found = cleared(alarms_of(bank_of(text), {}))
    assert "camera" in found
    assert "wing" not in found


@pytest.mark.parametrize("level", [-40.0, 5.0])
def test_what_would_have_shown_does_not_depend_on_what_is_measured(level):
    alarms = alarms_of(BANK, {})
    signals = alarms.residuals.signals
    columns = {channel: column + level for channel, column in signals.columns.items()}
    moved = replace(alarms.residuals, signals=replace(signals, columns=columns))
    found = cleared(replace(alarms, residuals=moved))
    assert set(found) == set(SHOWN)
    assert [one.size for own in found.values() for one in own.would_show] == pytest.approx(
        [2.0] * 5
    )


def test_a_channel_that_reads_nothing_all_along_clears_nobody():
    alarms = alarms_of(BANK, {})
    columns = dict(alarms.residuals.signals.columns)
    dead = next(channel for channel in columns if channel.field == "x")
    columns[dead] = np.zeros_like(columns[dead])
    signals = replace(alarms.residuals.signals, columns=columns)
    found = cleared(replace(alarms, residuals=replace(alarms.residuals, signals=signals)))
    assert len(found) == len(SHOWN) - 1


def test_the_largest_of_each_unit_is_told_in_what_a_person_reads():
    sizes = [WouldShow("a", 2.0, "m"), WouldShow("b", 5.0, "m"), WouldShow("c", 120.0, "Pa")]
    both = "in either direction"
    assert size_words(sizes) == (
        f"a lasting change of more than 5 m {both} and "
        f"a lasting change of more than 1.2 hPa {both} would have shown"
    )
    assert size_words([WouldShow("a", 0.5, "1")]) == (
        f"a lasting change of more than 0.5 {both} would have shown"
    )


def test_how_long_a_reading_stands_still_or_is_silent_is_told_as_that():
    still, gone = WouldShow("d", 12.0, "s", "frozen"), WouldShow("e", 3.0, "s", "silent")
    assert (
        size_words([still, gone])
        == "a frozen reading for more than 12 s and silence for more than 3 s would have shown"
    )


def test_a_size_is_told_for_the_direction_in_which_it_holds():
    up, down = WouldShow("a", 0.5, "V", "rises"), WouldShow("a", 0.7, "V", "falls")
    assert size_words([up]) == "a lasting rise of more than 0.5 V would have shown"
    assert (
        size_words([up, down])
        == "a lasting rise of more than 0.5 V or fall of more than 0.7 V would have shown"
    )
    one_way = WouldShow("b", 9.0, "V", "falls")  # of another channel: its rise would not show
    assert size_words([up, down, one_way]) == (
        "a lasting rise of more than 0.5 V or fall of more than 0.7 V and "
        "a lasting fall of more than 9 V would have shown"
    )


def test_the_cleared_are_sorted():
    bank = bank_of(model(dict(sorted(SHOWN.items(), reverse=True))))
    assert named(ruled_out(alarms_of(bank, {}), bank, ())) == sorted(SHOWN)


def test_who_has_a_channel_is_cleared_by_all_its_faults_that_a_test_holds():
    """The wing's lift enters a balance of what the camera and the laser show."""
    more = "equations:\n  a: {text: z = y, solves: [z], fault: wing.lift, component: wing}\n"
    text = model({**SHOWN, "camera": ["z"], "wing": ["w"], "laser": ["w"]}, more=more)
    bank = bank_of(text)
    found = cleared(alarms_of(bank, {}))["wing"]
    assert {one.fault: one.unit for one in found.would_show} == {"WING.w": "m", "wing.lift": "m"}
    assert [one.size for one in found.would_show] == pytest.approx([2.0, 2.0])
    raised = {row(bank, "CAMERA.z", "SUN.y", "wing.lift"): [(40, 42)]}
    assert "wing" not in cleared(alarms_of(bank, raised))


@pytest.mark.parametrize(("threshold", "is_cleared"), [(0.78, True), (0.8, False)])
def test_a_direction_that_is_further_off_than_an_eighth_of_a_turn_brings_a_vehicle_down(
    threshold, is_cleared
):
    more = "equations:\n  a: {text: z = y, solves: [z], fault: wing.lean, component: wing}\n"
    text = model({"camera": ["z"], "sun": ["y"], "wing": ["w"], "laser": ["w"]}, more=more)
    bank = bank_of(text.replace("{unit: m}", "{unit: rad}").replace("1 m}", "1 rad}"))
    alarms = alarms_of(bank, {})
    near = replace(alarms, threshold=np.full(alarms.state.shape, threshold))
    assert ("wing" in cleared(near)) == is_cleared
