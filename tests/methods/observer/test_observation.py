"""A flight as a whole: weak motors by name, nothing on healthy ones, what cannot be observed."""

from dataclasses import replace

import numpy as np
import pytest
from flights import shared
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.errors import LogError, UsageError
from fdi.methods.observer import observe
from fdi.methods.observer.states import RESIDUALS
from fdi.telemetry import read

from .build import write

pytestmark = pytest.mark.flights

ONSET, END = 30.0, 45.0
WITHIN_S = 1.5


def observed(path, **options):
    return observe(read(path), **options)


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    return write(tmp_path_factory.mktemp("healthy") / "healthy.tlog")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_nothing_is_beyond_on_a_healthy_flight(tmp_path, seed):
    assert not observed(write(tmp_path / "healthy.tlog", seed=seed)).alarms


@pytest.mark.parametrize("motor", [1, 2, 3, 4])
def test_a_weak_motor_is_named_within_seconds_and_till_it_recovers(tmp_path, motor):
    seen = observed(write(tmp_path / "weak.tlog", weak=(motor, 0.7, ONSET, END)))
    (named,) = seen.motors
    assert named.number == motor
    assert named.start == pytest.approx(ONSET, abs=WITHIN_S)
    assert named.end == pytest.approx(END, abs=WITHIN_S)
    assert {"p", "q", "r", "vz"} <= {alarm.residual for alarm in seen.alarms}


def test_the_inertia_of_the_simulated_vehicle_is_found_within_a_third(tmp_path):
    """Where the flight does not tell it, the reference's stays, which is the simulated one."""
    found = observed(write(tmp_path / "weak.tlog", weak=(2, 0.7, ONSET, END))).observer.vehicle
    assert np.allclose(found.inertia, (0.008154, 0.008154, 0.017458), rtol=1 / 3)


@pytest.mark.parametrize("gain", ["poles", "kalman"])
def test_any_outputs_that_tell_all_states_do(healthy, gain):
    outputs = ("x", "y", "z", "phi", "theta", "psi")
    seen = observed(healthy, outputs=outputs, gain=gain)
    known = np.isfinite(seen.residuals).any(axis=1)
    assert known.tolist() == [name in outputs for name in RESIDUALS]


def test_unobservable_outputs_are_refused_in_a_sentence(healthy):
    with pytest.raises(UsageError, match="do not tell x, y, z"):
        observed(healthy, outputs=("vx", "vy", "vz", "psi"))


def test_a_plane_is_refused(tmp_path):
    path = write(tmp_path / "plane.tlog", kind=mav.MAV_TYPE_FIXED_WING, seconds=20.0)
    with pytest.raises(LogError, match="is of a plane"):
        observed(path)


def test_a_log_without_attitude_is_refused(tmp_path):
    with pytest.raises(LogError, match="holds no attitude"):
        observed(write(tmp_path / "blind.tlog", attitude=False, seconds=20.0))


def test_one_record_a_second_is_refused(tmp_path):
    with pytest.raises(LogError, match=r"every 1\.0 s"):
        observed(write(tmp_path / "slow.tlog", rate=1.0))


def test_that_a_vehicle_turned_over_is_told_where_a_linear_model_bounds_nothing(healthy):
    log = read(healthy)
    attitude = log["ATTITUDE"]
    lying = attitude.raw("roll").copy()
    lying[int(0.5 * lying.size) : int(0.6 * lying.size)] = 1.3
    columns = {**attitude.columns, "roll": attitude.columns["roll"]._replace(load=lambda: lying)}
    told = replace(attitude, columns=columns, _cache={})
    over = replace(log, messages={**log.messages, "ATTITUDE": told})
    said = "it leans by more than 60 degrees"
    assert any(said in note for note in observe(over).notes)
    assert not any(said in note for note in observe(log).notes)


def test_there_is_no_such_flight(healthy):
    with pytest.raises(UsageError, match="has no flight 8"):
        observed(healthy, flight=7)


def test_a_vehicle_that_was_only_armed_did_not_fly(healthy):
    log = read(healthy)
    armed = tuple(replace(one, flew=False) for one in log.flights)
    held = replace(log, _cache={**log._cache, "flights": armed})
    with pytest.raises(LogError, match="shows no flight"):
        observe(held)


COPTER = "sitl/copter/"


@pytest.mark.parametrize(
    "case",
    shared(
        *(
            f"{COPTER}{name}{kind}"
            for name in ("c01_ref_slow_line", "c03_ref_square_wind", "c07_ref_aggressive")
            for kind in (".tlog", ".BIN")
        )
    ),
)
def test_nothing_is_beyond_on_the_reference_flights(case):
    assert not observed(case.path).alarms


def edges(seen, residual):
    """Return when alarms of a residual begin and when they end."""
    own = [alarm for alarm in seen.alarms if alarm.residual == residual]
    return [a.start for a in own], [a.end for a in own]


def near(times, when):
    return any(abs(t - when) <= WITHIN_S for t in times)


@pytest.mark.parametrize(
    "case", shared(*(f"{COPTER}c10_motor1_x0.7_20s{k}" for k in (".tlog", ".BIN")))
)
def test_the_reference_motor_is_named_from_onset_to_end(case):
    seen, (fault,) = observed(case.path), case.label["faults"]
    (named,) = seen.motors
    assert named.number == 1
    for residual in ("p", "q", "r", "vz"):
        starts, ends = edges(seen, residual)
        assert near(starts, fault["onset"])
        assert near(ends, fault["end"])


@pytest.mark.parametrize(
    "case", shared(*(f"{COPTER}c20_gps_glitch_11m{k}" for k in (".tlog", ".BIN")))
)
def test_the_reference_receiver_jumps_and_jumps_back(case):
    seen, (fault,) = observed(case.path, source="sensors"), case.label["faults"]
    starts, _ = edges(seen, "y")
    assert {alarm.residual for alarm in seen.alarms} == {"y"}
    assert near(starts, fault["onset"])
    assert near(starts, fault["end"])


@pytest.mark.parametrize(
    "case", shared(*(f"{COPTER}c30_accel_bias_y_both{k}" for k in (".tlog", ".BIN")))
)
def test_the_reference_accelerometer_is_seen_from_onset_to_end(case):
    seen, (fault,) = observed(case.path), case.label["faults"]
    assert not seen.motors
    for residual in ("vy", "vh"):
        starts, ends = edges(seen, residual)
        assert near(starts, fault["onset"])
        assert near(ends, fault["end"])
