"""What a flight tells of its vehicle: known answers, and silence where it tells nothing."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from report.build import small_log

from fdi.telemetry import Flight, Message
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.message import Column
from fdi.trends import trends_of
from fdi.trends.battery import resistance
from fdi.trends.blocks import block_edges, block_means, mean_of
from fdi.units import Conversion

T = np.arange(0.0, 90.0, 0.1)
IN_AIR = (10.0, 85.0)
NONE = (FlightEnd(0, "landed", 85.0),)


def message(name, fields, t=T, unit=""):
    columns = {n: Column(partial(np.array, v), Conversion(unit)) for n, v in fields.items()}
    return Message(name, None, t, t, np.arange(len(t)), columns)


def analysis(*messages, ends=NONE, parameters=None, end=85.0):
    flights = (Flight(5.0, 88.0, takeoff=10.0, landing=end),)
    log = replace(
        small_log(),
        messages={one.key: one for one in messages},
        _cache={"flights": flights, "ends": ends},
    )
    told = {"motor_low": 0.0, "motor_high": 1.0, "thrust_curve": 0.0, **(parameters or {})}
    values = {n: SimpleNamespace(value=v, source="default", std=None) for n, v in told.items()}
    return SimpleNamespace(log=log, system=SimpleNamespace(parameters=values))


def by_part(found):
    return {one.part: one for one in found}


def motors(*shares, wobble=0.02, t=T):
    rng = np.random.default_rng(3)
    lift = 0.4 + wobble * np.sin(t / 2.0)
    return message(
        "MOTORS",
        {f"motor_{i}": s * lift + rng.normal(0, 0.002, len(t)) for i, s in enumerate(shares, 1)},
        t,
    )


def test_a_motor_that_is_asked_for_a_fifth_more_has_that_share():
    found = by_part(trends_of(analysis(motors(1.2, 0.9, 1.0, 0.9))))
    for part, share in (("motor_1", 1.2), ("motor_2", 0.9), ("motor_3", 1.0)):
        one = found[part]
        assert one.quantity == "thrust_share"
        assert abs(one.value - share) < max(3 * one.std, 1e-3)
        assert 0 < one.std < 0.01


def test_thrust_grows_with_the_square_of_an_output_whose_curve_says_so():
    flown = analysis(motors(1.2, 0.8, 1.0, 1.0, wobble=0.0), parameters={"thrust_curve": 1.0})
    squares = np.array([1.44, 0.64, 1.0, 1.0])
    assert by_part(trends_of(flown))["motor_1"].value == pytest.approx(
        1.44 / squares.mean(), abs=0.003
    )


def test_what_comes_after_control_is_lost_is_not_the_vehicles_condition():
    t, u = T, np.full(len(T), 0.4)
    tumbling = np.where(t > 60.0, 1.0, 0.4)
    both = message("MOTORS", {"motor_1": tumbling, "motor_2": u, "motor_3": u, "motor_4": u})
    end = FlightEnd(0, "impact", 62.0, lost_control=60.0)
    found = by_part(trends_of(analysis(both, ends=(end,))))
    assert found["motor_1"].value == pytest.approx(1.0)


@pytest.mark.parametrize("end", [36.0, 20.0, 11.0])
def test_a_short_flight_tells_nothing_rather_than_zero(end):
    assert not trends_of(analysis(motors(1.0, 1.0, 1.0, 1.0), end=end))


def test_an_output_that_is_unknown_makes_the_shares_of_all_unknown():
    u = np.full(len(T), 0.4)
    gone = np.full(len(T), np.nan)
    lost = message("MOTORS", {"motor_1": u, "motor_2": gone, "motor_3": u, "motor_4": u})
    assert not trends_of(analysis(lost))


def test_vibration_is_that_of_all_axes_and_zeros_are_no_measurement():
    shaken = {"vibration_x": 3.0, "vibration_y": 4.0, "vibration_z": 12.0}
    told = message("VIBRATION", {n: np.full(len(T), v) for n, v in shaken.items()}, unit="m/s^2")
    (one,) = trends_of(analysis(told))
    assert (one.part, one.value, one.unit) == ("vibration_1", pytest.approx(13.0), "m/s^2")
    nothing = message("VIBRATION", {n: np.zeros(len(T)) for n in shaken}, unit="m/s^2")
    assert not trends_of(analysis(nothing))


def battery(ohm, *, noise=0.02, load=8.0, seed=1):
    rng = np.random.default_rng(seed)
    slow = np.convolve(rng.normal(0, 1, len(T) + 40), np.ones(41) / 41, "valid") * 6
    current = 20.0 + load * slow
    voltage = 16.4 - 0.004 * T - ohm * current + rng.normal(0, noise, len(T))
    return voltage, current


@pytest.mark.parametrize("ohm", [0.005, 0.03, 0.08])
def test_a_resistance_is_found_within_what_it_says_of_itself(ohm):
    voltage, current = battery(ohm)
    told = message("BATTERY_STATUS", {"voltages[0]": voltage, "current_battery": current}, unit="V")
    (one,) = trends_of(analysis(told))
    assert (one.quantity, one.part, one.unit) == ("battery_resistance", "battery", "ohm")
    assert abs(one.value - ohm) < 3 * one.std
    assert one.std < 0.004


def test_two_errors_hold_a_resistance_in_nine_of_ten_flights_at_least():
    hit = 0
    for seed in range(60):
        voltage, current = battery(0.03, noise=0.1, seed=seed)
        found = resistance(T, voltage, current, *IN_AIR)
        hit += abs(found.value - 0.03) < 2 * found.std
    assert hit >= 54


def test_a_current_that_shows_nothing_but_noise_tells_no_resistance():
    rng = np.random.default_rng(2)
    voltage, _ = battery(0.03)
    assert resistance(T, voltage, 20.0 + rng.normal(0, 0.3, len(T)), *IN_AIR) is None
    assert resistance(T, voltage, np.full(len(T), np.nan), *IN_AIR) is None
    assert resistance(T, voltage, np.full(len(T), 20.0), *IN_AIR) is None


def test_a_voltage_that_stands_still_is_no_battery_without_resistance():
    assert resistance(T, np.full(len(T), 12.6), battery(0.03)[1], *IN_AIR) is None


def test_a_battery_that_nobody_measures_tells_no_resistance():
    current = battery(0.03)[1]
    told = {"voltages[0]": np.full(len(T), 0.05), "current_battery": current}
    assert not trends_of(analysis(message("BATTERY_STATUS", told, unit="V")))


def compass(deviation, t=T):
    """Return a compass in a level vehicle that turns, in a field without declination."""
    yaw = 0.05 * t
    off = yaw - deviation
    readings = {"xmag": 2e-5 * np.cos(off), "ymag": -2e-5 * np.sin(off), "zmag": 4e-5 + 0 * t}
    level = {"roll": 0 * t, "pitch": 0 * t, "yaw": yaw}
    return message("RAW_IMU", readings, t, "T"), message("ATTITUDE", level, t, "rad")


@pytest.mark.parametrize("deviation", [-0.2, 0.0, 0.3, 3.0])
def test_a_compass_that_shows_north_aside_has_that_deviation(monkeypatch, deviation):
    field = np.array([2e-5, 0.0, 4e-5])
    monkeypatch.setattr("fdi.trends.quantities.earth_field", lambda log: field)
    (one,) = trends_of(analysis(*compass(deviation)))
    assert (one.quantity, one.part) == ("compass_deviation", "compass_1")
    assert one.value == pytest.approx(deviation, abs=1e-3)


def test_a_compass_without_a_place_tells_nothing():
    assert not trends_of(analysis(*compass(0.1)))


@given(st.floats(30.0, 5000.0))
def test_blocks_are_ten_seconds_or_longer_and_cover_the_flight(length):
    edges = block_edges(0.0, length)
    assert edges[0] == 0.0
    assert edges[-1] == pytest.approx(length)
    assert np.diff(edges).min() >= 10.0 - 1e-6


def test_samples_that_err_alike_do_not_make_a_mean_look_better_known():
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 600.0, 0.05)
    wind = np.repeat(rng.normal(0, 1, 120), len(t) // 120)  # 5 s each, 100 samples alike
    edges = block_edges(0.0, 600.0)
    mean = mean_of(block_means(t, wind[None], edges)[0])
    assert 0.06 < mean.std < 0.13  # 1 / sqrt(120) is 0.09; that of all samples would be 0.009


def test_a_block_of_which_little_is_known_is_unknown():
    values = np.where(T > 42.0, np.nan, 1.0)
    means = block_means(T, values[None], np.array([10.0, 40.0, 70.0]))
    assert np.isnan(means[0]).tolist() == [False, True]


def test_a_real_flight_tells_of_its_motors_battery_and_compass():
    path = Path("../shared/flights/propeller_cut/25mm_hover_1.bin")
    if not path.exists():
        pytest.skip("the reference flights are not here")
    import fdi

    found = by_part(trends_of(fdi.analyze(path)))
    # a shortened propeller: the source names no motor, its outputs say motor 1
    assert found["motor_1"].value - 2 * found["motor_1"].std > 1.0
    assert max(found[f"motor_{i}"].value for i in (2, 3, 4)) < found["motor_1"].value
    assert 0.01 < found["battery"].value < 0.15
    assert abs(found["compass_1"].value) < 0.1
