"""Mid-value voting of three units of a sensor: hard-over, slow-over, and what is no departure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import SHARED
from hypothesis import given
from hypothesis import strategies as st
from report.build import message, small_log

import fdi
from fdi.decision import Alarms
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault
from fdi.methods.columns import with_columns
from fdi.methods.voting.columns import VOTING, voting_columns
from fdi.methods.voting.middle import INERTIAL, PRESSURES, SENSORS, mid_value
from fdi.telemetry import Log
from fdi.telemetry.message import Column
from fdi.units import Conversion

from ..heading.rides import FAILS, flown

MOST = {"gyroscope": 0.0873, "accelerometer": 0.75, "compass": 2e-5, "barometer": 250.0}
"""What models/shared/voting.yaml allows."""
T = np.arange(0.0, 90.0, 0.04)
FLIGHT_FROM, FAULT_AT = 10.0, 50.0
NAMES = {"press_abs": [names[0] for names in PRESSURES]}
THREE_IMUS = "propeller_cut/good_prop_hover_1.bin"


def moving() -> dict[str, np.ndarray]:
    """What a vehicle that turns, leans and climbs makes every unit show."""
    turn = 0.5 * np.sin(0.7 * T)
    return {
        **{
            f"{axis}gyro": turn * scale for axis, scale in zip("xyz", (1.0, -0.6, 0.4), strict=True)
        },
        **{f"{axis}acc": g + 2.0 * turn for axis, g in zip("xyz", (0.0, 0.0, -9.8), strict=True)},
        **{f"{axis}mag": b + 1e-5 * turn for axis, b in zip("xyz", (2e-5, 0.0, 4e-5), strict=True)},
        "press_abs": 95000.0 + 200.0 * np.sin(0.1 * T),
    }


def log_of(units: int = 3, **off: dict[int, np.ndarray]) -> Log:
    """A flight with units that have noise and zeros of their own; ``off`` of a field, by unit."""
    rng, log = np.random.default_rng(1), small_log()
    size = {"gyro": 0.01, "acc": 0.1, "mag": 5e-7, "_abs": 3.0}
    for number in range(units):
        fields: dict[str, np.ndarray] = {}
        for field, true in moving().items():
            sigma = next(own for ending, own in size.items() if field.endswith(ending))
            zero = 3 * sigma * (number - 1)
            own = true + zero + rng.normal(0.0, sigma, T.size)
            fields[field] = own + off.get(field, {}).get(number + 1, np.zeros(1))
        pressure = {"press_abs": fields.pop("press_abs")}
        log = log.with_message(message(INERTIAL[number][0], fields, T))
        log = log.with_message(message(PRESSURES[number][0], pressure, T))
    return log


def peaks(log: Log) -> dict[str, float]:
    """The largest of every column that is known."""
    made = voting_columns(log)
    assert made is not None
    known = {name: own[np.isfinite(own)] for name, own in made.values.items()}
    return {name: float(own.max()) for name, own in known.items() if own.size}


def compared(log: Log) -> set[str]:
    return {name.partition("_")[0] for name in peaks(log)}


def departed(found: dict[str, float]) -> set[str]:
    return {name for name, peak in found.items() if peak > MOST[name.partition("_")[0]]}


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=2), st.floats(allow_nan=False))
def test_no_single_unit_moves_the_middle_of_three_beyond_the_two_others(
    good: list[float], bad: float
) -> None:
    assert min(good) <= mid_value(np.array([*good, bad])) <= max(good)


def test_units_with_zeros_and_noise_of_their_own_stay_beside_the_middle() -> None:
    found = peaks(log_of())
    assert set(found) == {f"{sensor.name}_{k}" for sensor in SENSORS for k in (1, 2, 3)}
    assert departed(found) == set()


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize(
    ("field", "name", "limit"),
    [
        ("ygyro", "gyroscope", 4.36),  # 250 deg/s
        ("zacc", "accelerometer", 19.6),
        ("xmag", "compass", -1e-4),
        ("press_abs", "barometer", 5000.0),
    ],
)
def test_a_unit_that_goes_hard_over_is_the_one_that_departs(
    field: str, name: str, limit: float, number: int
) -> None:
    off = np.where(T >= FAULT_AT, limit - moving()[field], 0.0)
    assert departed(peaks(log_of(**{field: {number: off}}))) == {f"{name}_{number}"}


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize(
    ("field", "name"),
    [
        ("xgyro", "gyroscope"),
        ("xacc", "accelerometer"),
        ("zmag", "compass"),
        ("press_abs", "barometer"),
    ],
)
def test_a_unit_that_goes_slow_over_is_the_one_that_departs(
    field: str, name: str, number: int
) -> None:
    """Within half a minute to three times of what is allowed."""
    off = np.clip((T - FAULT_AT) / 30.0, 0.0, 1.0) * 3 * MOST[name]
    found = peaks(log_of(**{field: {number: off}}))
    assert departed(found) == {f"{name}_{number}"}
    assert found[f"{name}_{number}"] < 3 * MOST[name]


def test_what_moves_all_units_alike_departs_from_nothing() -> None:
    off = np.where(T >= FAULT_AT, 1.0, 0.0)
    assert departed(peaks(log_of(xgyro=dict.fromkeys((1, 2, 3), off)))) == set()


def test_a_unit_that_only_shakes_does_not_depart() -> None:
    """Its mean over 4 s is off by up to as much as it shakes; see `motor2_lost.bin`, unit 3."""
    shaking = np.where(T >= FAULT_AT, 5.0, 0.0) * np.random.default_rng(2).normal(0, 1, T.size)
    assert departed(peaks(log_of(yacc={3: shaking + np.where(T >= FAULT_AT, 3.0, 0.0)}))) == set()


def test_scales_and_moments_that_differ_a_little_make_no_departure() -> None:
    rate = moving()["xgyro"]
    late = np.interp(T + 0.0025, T, rate) - rate
    assert departed(peaks(log_of(xgyro={2: 0.02 * rate + late}))) == set()


def test_two_units_have_no_middle_and_nobody_is_told_so() -> None:
    log, silent = with_columns(log_of(units=2), [VOTING])
    assert silent == ()
    assert "voting" not in log


def test_a_unit_that_is_said_twice_has_no_second_vote() -> None:
    log = log_of()
    again = replace(log["SCALED_IMU2"], name="SCALED_IMU3", _cache={})
    assert compared(log.with_message(again)) == {"barometer"}


def test_what_the_autopilot_selects_has_no_vote() -> None:
    log = log_of()
    selected = replace(log["SCALED_PRESSURE"], made_from="vehicle_air_data")
    assert "barometer" in compared(log)
    assert "barometer" not in compared(log.with_message(selected))


def test_units_that_are_recorded_apart_are_not_compared() -> None:
    log = log_of()
    own = {"press_abs": log["SCALED_PRESSURE3"].si("press_abs")}
    assert "barometer" not in compared(log.with_message(message("SCALED_PRESSURE3", own, T + 0.02)))


def with_two_more(log: Log, off: np.ndarray) -> Log:
    """Return a log with units 2 and 3 that read what the first one reads; the third more, rad/s."""
    first = log["RAW_IMU"]
    rng = np.random.default_rng(3)
    for name, more in (("SCALED_IMU2", 0.0 * off), ("SCALED_IMU3", off)):
        fields = {
            f"{axis}gyro": first.si(f"{axis}gyro") + rng.normal(0.0, 2e-3, first.t.size)
            for axis in "xyz"
        }
        fields["ygyro"] = fields["ygyro"] + more
        made = message(name, {}, first.t)
        columns = {
            field: Column(load=lambda own=own: own, conversion=Conversion("rad/s"))
            for field, own in fields.items()
        }
        log = log.with_message(replace(made, columns=columns, _cache={}))
    return log


def voted(alarms: Alarms) -> set[str]:
    """The statements of the voting that raised alarms."""
    bank = alarms.residuals.bank
    raised = zip(bank.generators, bank.methods(), alarms.alarm.any(axis=1), strict=True)
    return {
        bank.system.equations[one.residual].name
        for one, method, alarmed in raised
        if alarmed and method == "voting"
    }


@pytest.mark.parametrize("shape", ["hard-over", "slow-over"])
def test_a_model_states_which_gyroscope_the_other_two_outvote(tmp_path: Path, shape: str) -> None:
    log = flown(tmp_path / "ride.tlog")
    t = log["RAW_IMU"].t
    off = {"hard-over": 4.36 * (t >= FAILS), "slow-over": 0.02 * np.maximum(t - FAILS, 0.0)}[shape]
    chain = fdi.residuals_of(with_two_more(log, off))
    assert voted(chain.policy.decide(chain.residuals)) == {"gyroscope_3_departs"}


@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
@pytest.mark.parametrize(
    ("fault", "component", "unit"),
    [
        ("SCALED_IMU3.xgyro:bias=0.3@40", "gyroscope", "gyroscope_3"),
        ("SCALED_IMU3.zacc:drift=0.3@40", "accelerometer", "accelerometer_3"),
        ("SCALED_IMU2.yacc:bias=2@40", "accelerometer", "accelerometer_2"),
        ("RAW_IMU.zgyro:drift=0.02@40", "gyroscope", "gyroscope_1"),
    ],
)
def test_a_fault_of_one_of_three_recorded_units_is_named_by_its_unit(
    tmp_path: Path, fault: str, component: str, unit: str
) -> None:
    log = fdi.read(SHARED / THREE_IMUS)
    path = tmp_path / "faulty.bin"
    path.write_bytes(injected(log, parse_fault(fault)))
    analysis = fdi.analyze(path)
    assert [one.component for one in analysis.diagnosis.findings] == [component]
    assert voted(analysis.alarms) == {f"{unit}_departs"}
