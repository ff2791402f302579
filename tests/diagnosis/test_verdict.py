"""How the answer is put in words: what fits, times, and what the tests did."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fdi.diagnosis import Size
from fdi.diagnosis.values import MOST_LETTERS
from fdi.diagnosis.verdict import _fitted, _moment, _quantity, _time, count_tests
from fdi.telemetry import Flight

from .build import alarms_of, bank_of, model, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
SKY = row(BANK, "SUN.y", "STAR.y")
BARO, RADAR = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")


def test_an_optional_part_of_its_own_stands_before_the_last_sentence():
    assert _fitted(["One.", "Two."], ["Then."]) == "One. Then. Two."


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
    """Of what was beyond its threshold for less than 0.75 s, three samples, nothing is said."""
    alarms = alarms_of(BANK, {SKY: [(40, 60)]}, unknown={BARO: [(0, 100)]})
    assert (found := count_tests(alarms)).all == len(BANK.generators)
    assert (found.ran, found.raised, found.strayed) == (found.all - 1, 1, 0)
    for samples, strayed in ((2, 0), (3, 1)):
        state = alarms.state.copy()
        state[RADAR, 100 : 100 + samples] = 1
        assert count_tests(replace(alarms, state=state)).strayed == strayed


def test_what_the_tests_did_on_the_ground_is_not_counted():
    flights = (Flight(0, 100, takeoff=20.0, landing=90.0),)
    alarms = alarms_of(BANK, {SKY: [(2, 12)]}, flights=flights)
    state = alarms.state.copy()
    state[RADAR, np.arange(380, 390)] = 1
    found = count_tests(replace(alarms, state=state))
    assert (found.raised, found.strayed) == (0, 0)
