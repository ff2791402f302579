"""Who is the odd one out, as numbers: a vehicle that moves as it should, one sensor that lies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.methods.columns import Columns, Method, with_columns
from fdi.methods.heading.columns import FIELDS, heading_columns
from fdi.methods.heading.forces import BIAS, LEANS, force_pair
from fdi.methods.heading.increments import STATED, WINDOW_S
from fdi.methods.heading.motion import FIX_LATE_S, Ride
from fdi.methods.heading.tilt import G
from fdi.methods.heading.twins import LATE, LOOP_S, twins_growth
from fdi.telemetry import Log, Message
from fdi.telemetry.message import Column
from fdi.units import si

from ..setup.sensors import Ride as Flown
from .rides import FAILS, altered, flown, later

LANDS = 50.0
MOST = 3.0
"""Deviations that the models allow."""
SENSORS = ("compass_alone", "compass_against_gravity", "gyroscope_alone", "forces")


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return flown(tmp_path_factory.mktemp("ride") / "healthy.tlog")


def peaks(log: Log) -> dict[str, float]:
    """The largest of every column after the failure; -1 where it is unknown throughout."""
    made = heading_columns(log)
    assert isinstance(made, Columns)
    after = (made.t > FAILS) & (made.t < LANDS)
    return {name: float(np.nanmax([-1.0, *own[after]])) for name, own in made.values.items()}


def test_nothing_is_far_from_the_others_where_nothing_failed(healthy: Log) -> None:
    found = peaks(healthy)
    assert set(found) == set(FIELDS)
    assert max(found[name] for name in FIELDS if name != "twins") < MOST
    assert found["twins"] == -1.0  # there is no second unit


@pytest.mark.parametrize("axis", ["xgyro", "ygyro"])
def test_a_gyroscope_is_odd_against_gravity_and_field(healthy: Log, axis: str) -> None:
    found = peaks(altered(healthy, "RAW_IMU", **{axis: later(0.15)}))
    assert found["gyroscope_against_gravity"] > MOST
    assert max(found[name] for name in SENSORS[:2]) < MOST


def test_a_compass_is_odd_by_heading_and_by_gravity(healthy: Log) -> None:
    found = peaks(altered(healthy, "RAW_IMU", ymag=later(6e-5)))
    assert min(found["compass_alone"], found["compass_against_gravity"]) > MOST
    assert max(found["gyroscope_alone"], found["gyroscope_against_gravity"]) < MOST


@pytest.mark.parametrize("axis", ["xacc", "yacc"])
def test_a_force_that_no_velocity_follows_is_odd_and_no_turn(healthy: Log, axis: str) -> None:
    found = peaks(altered(healthy, "RAW_IMU", **{axis: later(2.0)}))
    assert min(found["forces"], found["forces_beyond_turns"]) > MOST
    assert max(found[n] for n in ("compass_alone", "gyroscope_against_gravity")) < MOST


def test_a_wrong_force_is_off_by_itself_times_the_window_in_its_predicted_deviation() -> None:
    """Level, at rest, 1 m/s2 too much along the nose: 5 m/s in 5 s."""
    t = np.arange(0.0, 40.0, 0.1)
    force = np.array([np.ones(t.size), np.zeros(t.size), np.full(t.size, -G)])
    still = np.zeros((3, t.size))
    fixes = _fixes(t)
    ride = Ride(
        t,
        still,
        force,
        None,
        still,
        fixes,
        None,
        (0.0, 40.0),
        0,
        0.2,
        0.0,
        0.0,
        1.1,
        np.nan,
        False,
        {},
        {},
        0 * t,
    )
    pair = force_pair(ride, np.array([28.0, 35.0]))
    assert pair is not None
    assert pair.off == pytest.approx(WINDOW_S)
    window = np.hypot(LEANS * G, BIAS) * WINDOW_S
    ends = np.sqrt(2) * np.hypot(STATED["doppler"], FIX_LATE_S)
    assert pair.sigma == pytest.approx(np.hypot(window, ends), rel=1e-9)


def test_a_wrong_heading_turns_a_change_of_velocity_and_keeps_its_length() -> None:
    """3 m/s2 to the north, felt along the nose, which is told to point east."""
    t = np.arange(0.0, 40.0, 0.1)
    felt = np.array([np.full(t.size, 3.0), np.zeros(t.size), np.full(t.size, -G)])
    east = np.array([np.zeros(t.size), np.zeros(t.size), np.full(t.size, np.pi / 2)])
    fixes = _fixes(t)
    fixes = replace(fixes, north=3.0 * fixes.t)
    turns = np.zeros((3, t.size))
    ride = Ride(
        t,
        turns,
        felt,
        None,
        east,
        fixes,
        None,
        (0.0, 40.0),
        0,
        0.2,
        0.0,
        0.0,
        1.1,
        np.nan,
        False,
        {},
        {},
        0 * t,
    )
    whole = force_pair(ride, np.array([28.0]))
    lengths = force_pair(ride, np.array([28.0]), any_heading=True)
    assert whole is not None
    assert lengths is not None
    assert whole.off == pytest.approx(np.sqrt(2) * 3.0 * WINDOW_S)
    assert lengths.off == pytest.approx(0.0, abs=1e-9)


def test_forces_are_unknown_over_a_gap_and_without_a_receiver(healthy: Log) -> None:
    gone = altered(healthy, "GPS_RAW_INT", vel=lambda t, own: np.where(t > 35, np.nan, own))
    made = heading_columns(gone)
    assert isinstance(made, Columns)
    assert np.isnan(made.values["forces"][made.t > 37]).all()
    assert np.isfinite(made.values["forces"][made.t < 34]).any()
    never = altered(healthy, "GPS_RAW_INT", fix_type=lambda t, own: 0 * own)
    made = heading_columns(never)
    assert isinstance(made, Columns)
    assert np.isnan(made.values["forces"]).all()
    assert np.isfinite(made.values["compass_alone"]).any()


def test_forces_need_no_compass(healthy: Log) -> None:
    zero = {f"{axis}mag": lambda t, own: 0 * own for axis in "xyz"}
    made = heading_columns(altered(healthy, "RAW_IMU", **zero))
    assert isinstance(made, Columns)
    assert np.isfinite(made.values["forces"]).any()
    assert np.isnan(made.values["forces_beyond_turns"]).all()
    assert np.isnan(made.values["compass_against_gravity"]).all()


def test_a_slow_log_is_left_out_in_one_sentence(tmp_path: Path) -> None:
    log, silent = with_columns(
        flown(tmp_path / "slow.tlog", Flown(rate=1.0)), [Method("heading", heading_columns)]
    )
    assert "heading" not in log
    (said,) = silent
    assert said == (
        "the method heading is not weighed: the log's inertial records are 1.0 s apart: turns "
        "between them cannot be seen"
    )


def with_second(log: Log, off: np.ndarray, late: float = 0.0) -> Log:
    """A second unit that reads what the first one reads, and this much more, rad/s (3, n)."""
    first = log["RAW_IMU"]
    t = first.t + late
    own = {
        axis: first.si(axis) + more
        for axis, more in zip(("xgyro", "ygyro", "zgyro"), off, strict=True)
    }
    columns = {
        name: Column(load=lambda x=values: x, conversion=si("rad/s"))
        for name, values in own.items()
    }
    return log.with_message(Message("SCALED_IMU2", None, t, t, np.arange(t.size), columns))


def growth(log: Log) -> tuple[np.ndarray, np.ndarray]:
    found = twins_growth(log, (5.0, 55.0))
    assert found is not None
    return found


def test_noise_of_one_gyroscope_grows_by_its_share_over_the_least_level(healthy: Log) -> None:
    t = healthy["RAW_IMU"].t
    noise = np.random.default_rng(0).normal(0, 0.2, (3, t.size)) * (t >= FAILS)
    at, grown = growth(with_second(healthy, noise))
    assert np.nanmax(grown[at < FAILS]) < 1.0
    assert np.nanmin(grown[at > FAILS + 5]) > 12.0


def test_units_that_differ_in_scale_do_not_grow_apart_in_turns(healthy: Log) -> None:
    first = healthy["RAW_IMU"]
    rates = np.array([first.si(axis) for axis in ("xgyro", "ygyro", "zgyro")])
    _, grown = growth(with_second(healthy, 0.02 * rates))
    assert np.nanmax(grown) < 6.0


def test_units_that_are_read_within_a_loop_of_each_other_do_not_grow_apart_in_a_shaking(
    healthy: Log,
) -> None:
    """An oscillation of 1 rad/s at 4 Hz, read 2.5 ms apart, differs by 0.06 rad/s."""
    t = healthy["RAW_IMU"].t
    shaking = (t >= FAILS) * np.exp(2j * np.pi * 4.0 * t)
    later_read = shaking * np.exp(2j * np.pi * 4.0 * LOOP_S)
    axes = ("xgyro", "ygyro", "zgyro")
    log = altered(healthy, "RAW_IMU", **{axis: lambda _, own: own + shaking.real for axis in axes})
    differ = np.tile(later_read.real - shaking.real, (3, 1))
    at, grown = growth(with_second(log, differ))
    assert np.nanmax(grown) < 6.0
    _, alone = growth(with_second(healthy, np.tile(later_read.real, (3, 1))))
    assert np.nanmin(alone[at > FAILS + 5]) > 12.0  # one of them shakes, the vehicle does not


def test_units_that_are_read_apart_tell_nothing(healthy: Log) -> None:
    period = float(np.median(np.diff(healthy["RAW_IMU"].t)))
    apart = with_second(healthy, np.zeros((3, len(healthy["RAW_IMU"]))), late=2 * LATE * period)
    assert twins_growth(apart, (5.0, 55.0)) is None


def _fixes(t: np.ndarray):
    from fdi.methods.heading.motion import Fixes

    at, none = t[::2], np.zeros(t[::2].size)
    return Fixes(at, at, none, none, none, none, none)
