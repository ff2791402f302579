"""How the answer is put in words: what fits, times, and what the tests did."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fdi.diagnosis import Size
from fdi.diagnosis.values import MOST_LETTERS, Ending
from fdi.diagnosis.verdict import (
    Tests as Counted,
)
from fdi.diagnosis.verdict import (
    _amount,
    _end_words,
    _fitted,
    _moment,
    _quantity,
    _quiet,
    _time,
    count_tests,
    outlook,
)
from fdi.telemetry import Flight
from fdi.telemetry.ends import FlightEnd

from .build import alarms_of, bank_of, model, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
SKY = row(BANK, "SUN.y", "STAR.y")
BARO, RADAR = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")


def test_an_optional_sentence_stands_last_and_is_given_up():
    assert _fitted(["One.", "Two."], ["Then."], "Then.") == "One. Two. Then."
    assert _fitted(["x" * 238 + "."], ["Then."], "Then.") == "x" * 238 + "."


def test_an_optional_part_that_is_said_already_is_not_said_again():
    assert _fitted(["One at 5 m.", "Two."], [" at 5 m", ""]) == "One at 5 m. Two."


@pytest.mark.parametrize(
    ("letters", "kept"), [(219, " at 5 m in LOITER"), (220, " in LOITER"), (227, "")]
)
def test_what_does_not_fit_is_given_up_in_its_order(letters, kept):
    """With all it has 20 letters more, and 13 without the height."""
    long = "x" * (letters + 1)
    found = _fitted([f"{long} at 5 m in LOITER", "B."], [" at 5 m", " in LOITER"])
    assert found == f"{long}{kept} B."
    assert len(found) <= MOST_LETTERS


def test_what_never_fits_is_cut_after_a_word():
    assert _fitted(["word " * 80], []) == "word " * 47 + "..."


def test_a_size_says_which_quantity_is_off_by_it():
    """Another ground speed, about 22 deg off: that mixed two of them."""
    text = model({"gps": ["x"]}).replace("{unit: m}", "{unit: m, description: Way to the north}")
    bank = bank_of(text, "cross_checks")
    size = Size(("GPS.x",), (), "bias", 3.0, 0.1, "m", 40.0)
    assert _quantity(size, bank) == "way to the north"
    assert _quantity(replace(size, shown=2.0, shown_unit="rad"), bank) == ""
    on_the_ground = replace(size, unit="rad", shown=2.0, shown_unit="m")
    assert _quantity(on_the_ground, bank) == "way to the north"


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (0.0, "0.0 s"),
        (12.34, "12.3 s"),
        (59.94, "59.9 s"),
        (59.96, "1 min 0 s"),
        (119.4, "1 min 59 s"),
        (119.7, "2 min 0 s"),
        (125.0, "2 min 5 s"),
        (3725.0, "62 min 5 s"),
    ],
)
def test_a_length_of_time_is_told_in_seconds_and_above_one_in_minutes(seconds, said):
    assert _time(seconds) == said


def test_a_vehicle_on_the_ground_has_no_height_and_no_time_in_flight():
    signals = replace(
        alarms_of(BANK, {}).residuals.signals,
        height=np.zeros(len(alarms_of(BANK, {}).residuals.signals.t)),
        flights=(Flight(10, 100, flew=False),),
    )
    finding = SimpleNamespace(onset=40.0, flight=0)
    assert _moment(finding, signals)[:2] == ("40.0 s into the log", "")
    flown = replace(signals, flights=(Flight(10, 100, takeoff=20.0),))
    assert _moment(finding, flown)[:2] == ("20.0 s into flight (log 40.0 s)", ", at 0 m")


def test_tests_are_counted_that_ran_that_raised_an_alarm_and_that_strayed():
    """What was beyond its threshold for less than 0.75 s, three samples, is counted as a moment."""
    alarms = alarms_of(BANK, {SKY: [(40, 60)]}, unknown={BARO: [(0, 100)]})
    assert (found := count_tests(alarms)).all == len(BANK.generators)
    assert (found.ran, found.raised, found.strayed, found.touched) == (found.all - 1, 1, 0, 0)
    for samples, strayed, touched in ((2, 0, 1), (3, 1, 0)):
        state = alarms.state.copy()
        state[RADAR, 100 : 100 + samples] = 1
        found = count_tests(replace(alarms, state=state))
        assert (found.strayed, found.touched) == (strayed, touched)


def test_a_flight_without_accusation_tells_the_moments_in_which_a_test_left_health():
    """ "All tests stayed within what health explains" is untrue as long as one did not."""
    alarms = alarms_of(BANK, {})
    whole = f"all {len(BANK.generators)} tests stayed within what health explains"
    assert _quiet(count_tests(alarms)) == f"No component is accused: {whole}."
    state = alarms.state.copy()
    state[RADAR, 100:102] = 1
    one = _quiet(count_tests(replace(alarms, state=state)))
    assert one.endswith(f"{whole}, moments of less than 0.75 s in one of them aside.")
    state[SKY, 100:102] = 1
    two = _quiet(count_tests(replace(alarms, state=state)))
    assert two.endswith(f"{whole}, moments of less than 0.75 s in 2 tests aside.")


def test_what_the_tests_did_on_the_ground_is_not_counted():
    flights = (Flight(0, 100, takeoff=20.0, landing=90.0),)
    alarms = alarms_of(BANK, {SKY: [(2, 12)]}, flights=flights)
    state = alarms.state.copy()
    state[RADAR, np.arange(380, 390)] = 1
    found = count_tests(replace(alarms, state=state))
    assert (found.raised, found.strayed) == (0, 0)


@pytest.mark.parametrize(
    ("end", "said"),
    [
        (FlightEnd(0, "impact", 90.0), "Hit the ground (log 90.0 s)"),
        (FlightEnd(0, "impact", 90.0, 12.94), "Hit the ground at 12.9 m/s (log 90.0 s)"),
        (
            FlightEnd(0, "impact", 90.0, 12.94, over_ground=5.0),
            "Hit the ground at 12.9 m/s (log 90.0 s)",
        ),
        (
            FlightEnd(0, "impact", 90.0, 3.0, over_ground=4.0),
            "Hit the ground at 5.0 m/s, 3.0 m/s of it downwards (log 90.0 s)",
        ),
        (
            FlightEnd(0, "impact", 90.0, 3.0, 88.5, "lean"),
            "Hit the ground at 3.0 m/s (log 90.0 s), 1.5 s after control was lost",
        ),
        (
            FlightEnd(0, "impact", 90.0, None, 88.5, "stop"),
            "Hit the ground (log 90.0 s), 1.5 s after all motors were told to stop",
        ),
        (
            FlightEnd(0, "impact", 90.0, None, 78.5, "spin"),
            "Hit the ground (log 90.0 s), 11.5 s after it began to spin",
        ),
        (
            FlightEnd(0, "control_lost", 90.0, None, 80.0, "spin"),
            "It began to spin (log 80.0 s), and the flight ends 10.0 s later",
        ),
        (FlightEnd(0, "impact", 90.0, None, 89.95), "Hit the ground (log 90.0 s)"),
        (
            FlightEnd(0, "impact", 90.0, 2.94, 88.5, "lean", is_seen=False),
            "Fell at 2.9 m/s (log 90.0 s, its end), 1.5 s after control was lost",
        ),
        (
            FlightEnd(0, "control_lost", 90.0, None, 80.0, "demand"),
            "Control was lost (log 80.0 s), and the flight ends 10.0 s later",
        ),
        (
            FlightEnd(0, "in_air", 90.0, None, 80.0, "stop"),
            "All motors were told to stop in the air (log 80.0 s), "
            "and the flight ends 10.0 s later",
        ),
        (FlightEnd(0, "in_air", 90.0), "The recording stops in flight (log 90.0 s)"),
        (FlightEnd(0, "landed", 90.0), "Landed (log 90.0 s)"),
    ],
)
def test_how_a_flight_ended_is_told(end, said):
    assert _end_words(end) == said


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ((9, 0, 0, 0), "Nothing in this telemetry could be tested."),
        ((1, 0, 0, 0, 0, 1), "the only test is violated from the beginning of the flight on"),
        ((9, 0, 0, 0, 0, 2), "2 of 9 tests are violated from the beginning of the flight on"),
        ((9, 8, 2, 1), "2 of 9 tests raised alarms"),
        ((9, 8, 0, 3), "3 of 9 tests left what health explains"),
        ((9, 8, 0, 0), "8 of 9 tests could run and stayed within"),
        ((9, 9, 0, 0), "all 9 tests stayed within"),
    ],
)
def test_where_nobody_is_accused_it_is_said_what_the_tests_did(counts, said):
    assert said in _quiet(Counted(*counts))


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (Size(("A.x",), (), "bias", -3.14, 0.1, "m", 0.0), "about 3.1 m off"),
        (Size(("A.x",), (), "drift", 0.5, 0.1, "m", 0.0), "about 0.5 m a second off"),
        (Size(("A.x",), (), "bias", 0.25, 0.1, "1", 0.0), "about 0.25 off"),
        (Size(("A.x",), (), "bias", 95.0, 0.1, "Pa", 0.0, 8.2, "m"), "about 8.2 m off"),
        (Size(("A.x",), (), "bias", 950.0, 0.1, "Pa", 0.0), "about 9.5 hPa off"),
    ],
)
def test_a_size_is_told_in_short(size, said):
    assert _amount(size) == said


def accused(confidence):
    return SimpleNamespace(component="gps", confidence=confidence, rivals=(), inseparable_from=())


def outlook_of(tests=(3, 3, 0, 0), *, findings=(), how="landed", landing=95.0, parts="", **more):
    text = model(SHOWN).replace("sun: {", f"sun: {{{parts}")
    flights = (Flight(0, 100, takeoff=5.0, landing=landing),)
    ends = (FlightEnd(0, how, 95.0),)
    alarms = alarms_of(bank_of(text), {}, flights=flights, ends=ends, **more)
    return outlook(findings, [Ending(end) for end in ends], Counted(*tests), alarms)


def test_a_glance_tells_the_worst_that_is_known():
    motor = "group: propulsion, "
    assert outlook_of(findings=[accused(0.99)], how="impact") == "accused"
    assert outlook_of(findings=[accused(0.71)]) == "accused"
    assert outlook_of(findings=[accused(0.69)]) == "suspected"
    assert outlook_of(findings=[accused(0.69)], how="impact") == "ended badly"
    assert outlook_of(how="impact", parts=motor) == "ended badly"
    assert outlook_of((3, 0, 0, 0), parts=motor) == "untested"
    assert outlook_of((3, 3, 1, 0), parts=motor) == "alarms"
    assert outlook_of((3, 3, 0, 1), parts=motor) == "alarms"
    assert outlook_of(how="failsafe", parts=motor) == "alarms"
    assert outlook_of(how="in_air", landing=None, parts=motor) == "untested"
    assert outlook_of(parts=motor) == "healthy"
    assert outlook_of() == "untested"  # nothing that keeps it in the air is tested
    sky = {row(bank_of(model(SHOWN)), "SUN.y", "STAR.y"): [(0, 100)]}
    assert outlook_of(parts=motor, unknown=sky) == "untested"


@pytest.mark.parametrize(("onset", "height"), [(0.0, 0), (40.0, 40), (99.75, 100), (500.0, 100)])
def test_a_height_is_that_of_the_onset(onset, height):
    signals = alarms_of(BANK, {}).residuals.signals
    signals = replace(signals, height=signals.t.copy(), flights=(Flight(0, 100, takeoff=0.0),))
    found = SimpleNamespace(onset=onset, flight=0)
    assert _moment(found, signals)[1] == f", at {height} m"


def test_a_time_in_flight_is_from_its_take_off_if_the_log_holds_it():
    signals = alarms_of(BANK, {}).residuals.signals
    two = (Flight(0, 30, takeoff=5.0), Flight(40, 100, takeoff=None))
    signals = replace(signals, flights=two)
    for onset, flight, said in (
        (25.0, 0, "20.0 s into flight 1 (log 25.0 s)"),
        (3.0, 0, "3.0 s into the log"),
        (45.0, 1, "at least 5.0 s into flight 2 (log 45.0 s)"),
    ):
        assert _moment(SimpleNamespace(onset=onset, flight=flight), signals)[0] == said
    one = replace(signals, flights=two[:1])
    found = SimpleNamespace(onset=25.0, flight=0)
    assert _moment(found, one)[0] == "20.0 s into flight (log 25.0 s)"
