"""An estimator that two sensors outvote was not led astray by one of them: known answers."""

import math

import pytest

from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.hypotheses import inquire

from .build import alarms_of, bank_of, model, row

DISTURBS = {"gps": ["estimator"], "baro": ["estimator"], "estimator": []}
SHOWN = {"gps": ["x", "y"], "baro": ["x"], "estimator": ["x", "y"]}
BANK = bank_of(model(SHOWN, DISTURBS))
GPS_APART = row(BANK, "GPS.x", "ESTIMATOR.x")
BARO_APART = row(BANK, "BARO.x", "ESTIMATOR.x")
SENSORS = row(BANK, "GPS.x", "BARO.x")
ELSEWHERE = row(BANK, "GPS.y", "ESTIMATOR.y")
FOLD = math.log(3)


def told(*rows, unknown=None):
    """The features of every candidate where tests alarm, all of three times their thresholds."""
    (one,) = inquire(alarms_of(BANK, {key: [(40, 60)] for key in rows}, unknown=unknown))
    case = one.case(40.0, one.runs)
    return {
        name: dict(zip(FEATURES, values, strict=True))
        for name, values in zip(case.names, case.features, strict=True)
    }


def test_neither_of_two_sensors_that_agree_has_led_the_estimator_astray():
    found = told(GPS_APART, BARO_APART)
    assert found["gps"]["explains"] == found["baro"]["explains"] == 0.0


def test_what_alarms_between_a_sensor_and_the_estimator_still_speaks_against_it():
    found = told(GPS_APART, BARO_APART)
    assert found["gps"]["tests"] == found["baro"]["tests"] == pytest.approx(math.log(2))


@pytest.mark.parametrize(
    ("rows", "unknown"),
    [
        ((GPS_APART, BARO_APART, SENSORS), None),
        ((GPS_APART, BARO_APART), {SENSORS: [(0, 100)]}),
        ((GPS_APART,), None),
    ],
)
def test_a_sensor_that_another_does_not_bear_out_may_have_led_it(rows, unknown):
    assert told(*rows, unknown=unknown)["gps"]["explains"] == pytest.approx(FOLD)


def test_another_quantity_bears_nobody_out():
    """That gps and baro agree in x says nothing of the estimator's y."""
    assert told(ELSEWHERE, BARO_APART)["baro"]["explains"] == pytest.approx(FOLD)


def test_who_is_suspected_is_not_where_a_quiet_test_denies_it():
    text = model({"gps": ["x"], "baro": ["x"], "estimator": ["e"]}, DISTURBS)
    text += "equations:\n  of: {text: e = x, solves: [e], suspects: [baro]}\n"
    bank = bank_of(text)
    apart = row(bank, "GPS.x", "ESTIMATOR.e")
    other, sensors = row(bank, "BARO.x", "ESTIMATOR.e"), row(bank, "GPS.x", "BARO.x")
    (one,) = inquire(alarms_of(bank, {key: [(40, 60)] for key in (apart, other)}))
    case = one.case(40.0, one.runs)
    ties = dict(zip(case.names, case.ties.tolist(), strict=True))
    assert ties["baro"] == ([0, 2] if apart < other else [2, 0])
    (one,) = inquire(alarms_of(bank, {key: [(40, 60)] for key in (apart, other, sensors)}))
    case = one.case(40.0, one.runs)
    assert min(case.ties[case.names.index("baro")]) > 0
