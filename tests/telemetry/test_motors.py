"""Where the motors of a frame stand and which way they turn, as the autopilots' sources say."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.motors import MOST, ROTORS, motors_of
from tests.flights import SHARED

FRAMES = [
    (kind, order) for kind, types in data_table("motors")["ardupilot"].items() for order in types
]
COUNTS = {"1": 4, "2": 6, "3": 8, "4": 8, "5": 6, "12": 12, "14": 10}
TILTED = {("1", "4"), ("1", "5")}  # V-tail and A-tail: their rear motors push sideways
UNEVEN = {("3", "2")}  # the octocopter V of ArduPilot pitches by 0.04 of a motor
HALF, ROOT = 0.5, round(math.sqrt(0.5), 9)


def of_class(kind, order, vehicle=None):
    vehicle = vehicle or data_table("frames")["class"][kind][0]
    told = {"FRAME_CLASS": float(kind), "FRAME_TYPE": float(order or 0)}
    return motors_of(told, "ardupilot", vehicle)


@pytest.mark.parametrize(
    ("kind", "order", "number", "roll", "pitch", "yaw"),
    [  # AP_MotorsMatrix.cpp, motor by motor; the largest of a frame is 1
        ("1", "1", 1, -1, 1, 1),  # front right, counter-clockwise
        ("1", "1", 4, -1, -1, -1),  # rear right, clockwise
        ("1", "0", 3, 0, 1, -1),  # front
        ("1", "3", 1, -1, 1, -1),  # H turns the other way
        ("1", "2", 3, 1, 1, -0.7981),  # V
        ("1", "12", 1, -1, -1, -1),  # BetaFlight begins at the rear right
        ("1", "18", 1, -1, -1, 1),
        ("1", "13", 2, 1, 1, -1),  # DJI goes on counter-clockwise
        ("1", "14", 2, -1, -1, -1),  # and this one clockwise
        ("1", "19", 2, 0, -1, -1),  # Y4
        ("2", "1", 1, -1, 0, -1),
        ("2", "1", 5, -HALF, 1, 1),
        ("2", "0", 3, 1, -HALF, -1),
        ("2", "3", 6, 1, -1, -1),
        ("3", "0", 3, -ROOT, ROOT, 1),
        ("3", "1", 8, -1, -0.414213562, -1),
        ("3", "15", 7, -1, -1, -1),
        ("4", "1", 5, 1, 1, 1),
        ("5", "10", 3, 0, -1, -1),
        ("5", "0", 4, 0, -1, -1),  # any other Y6
        ("12", "1", 12, HALF, 1, 1),
        ("14", "0", 6, 0, -1, -1),
    ],
)
def test_motors_stand_and_turn_as_ardupilot_has_them(kind, order, number, roll, pitch, yaw):
    assert of_class(kind, order)[number - 1] == pytest.approx((number, roll, pitch, yaw), abs=1e-3)


@pytest.mark.parametrize(("kind", "order"), FRAMES)
def test_a_frame_is_balanced(kind, order):
    """Equal thrust of all motors turns no vehicle, and lifts it."""
    motors = of_class(kind, order)
    roll, pitch, yaw = (sum(motor[axis] for motor in motors) for axis in (1, 2, 3))
    assert [m.number for m in motors] == list(range(1, COUNTS[kind] + 1))
    assert (roll, yaw) == pytest.approx((0, 0), abs=1e-9)
    if (kind, order) not in TILTED | UNEVEN:
        assert pitch == pytest.approx(0, abs=0.003)
    for axis in (1, 2):
        assert max(abs(motor[axis]) for motor in motors) == 1


@pytest.mark.parametrize(("kind", "order"), FRAMES)
def test_roll_and_pitch_are_told_apart_by_the_motors(kind, order):
    mix = np.array([(1, m.roll, m.pitch) for m in of_class(kind, order)])
    assert np.linalg.matrix_rank(mix) == 3


@pytest.mark.skipif(not SHARED.is_dir(), reason="no reference data beside the repository")
def test_signs_are_those_of_the_reference_mixing():
    """More thrust of one motor moves roll, pitch and yaw (FRD) as the reference's vectors do."""
    path = SHARED.parent / "methods" / "observer_vectors.json"
    base, *others = json.loads(path.read_text("utf-8"))["mixing"]
    for motor, row in zip(of_class("1", "1"), others[:4], strict=True):
        moved = np.sign(np.round(np.subtract(row["u"], base["u"])[1:], 9))
        assert tuple(moved) == tuple(np.sign(motor[1:]))


@pytest.mark.parametrize(
    ("vehicle", "parameters", "count"),
    [
        ("quad", {"FRAME": 1.0}, 4),
        ("hexa", {"FRAME": 0.0}, 6),
        ("octa", {"FRAME": 2.0}, 8),
        ("other", {"FRAME": 10.0}, 6),  # Y6B
        ("other", {"FRAME": 1.0}, 0),
        ("quad", {}, 0),
        ("quad", {"FRAME_CLASS": 1.0}, 0),
        ("quad", {"FRAME_CLASS": 0.0, "FRAME_TYPE": 1.0}, 0),
        ("quad", {"FRAME_CLASS": 15.0, "FRAME_TYPE": 1.0}, 0),
        ("quad", {"FRAME_CLASS": 2.0, "FRAME_TYPE": 1.0}, 0),  # six motors on four
        ("hexa", {"FRAME_CLASS": 5.0, "FRAME_TYPE": 10.0}, 0),  # a Y6 is no hexacopter
        ("quad", {"FRAME_CLASS": 1.0, "FRAME_TYPE": 7.0}, 0),
        ("quad", {"FRAME_CLASS": math.nan, "FRAME_TYPE": math.inf}, 0),
        ("other", {"FRAME_CLASS": 7.0, "FRAME_TYPE": 0.0}, 0),  # a tricopter has a servo
        ("helicopter", {"FRAME_CLASS": 6.0, "FRAME_TYPE": 0.0}, 0),
        ("plane", {"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0}, 0),
    ],
)
def test_nothing_is_said_where_the_log_does_not_tell_the_frame(vehicle, parameters, count):
    assert len(motors_of(parameters, "ardupilot", vehicle)) == count


def rotors(*rows, **more):
    """CA_ROTORn_* of rotors at (forward, right), with the sign of their turn."""
    told = {f"CA_ROTOR{n}_{key}": value for n, row in enumerate(rows)
            for key, value in zip(("PX", "PY", "KM"), row, strict=False)}  # fmt: skip
    return {"CA_ROTOR_COUNT": float(len(rows)), **told, **more}


WIDE = [(0.1, 0.25, 0.05), (-0.1, -0.2, 0.05), (0.1, -0.25, -0.05), (-0.1, 0.2, -0.05)]


def test_px4_tells_where_its_rotors_are_and_which_way_they_turn():
    motors = motors_of(rotors(*WIDE), "px4", "quad")
    assert motors[0] == (1, -1, 1, 1)
    assert motors[3] == (4, -0.8, -1, -1)


@pytest.mark.parametrize(
    ("start", "vehicle", "same"),
    [
        *((4001, "quad", "1/1"), (5001, "quad", "1/0"), (6001, "hexa", "2/1")),
        *((7001, "hexa", "2/0"), (8001, "octa", "3/1"), (9001, "octa", "3/0")),
    ],
)
def test_older_px4_has_the_frames_of_ardupilot(start, vehicle, same):
    """quad_x, quad_plus, hex_x and hex_plus of its mixers."""
    told = motors_of({"SYS_AUTOSTART": float(start)}, "px4", vehicle)
    assert told == of_class(*same.split("/"))


def test_which_way_a_rotor_turns_may_be_unknown():
    motors = motors_of(rotors(*(row[:2] for row in WIDE)), "px4", "quad")
    assert motors[0].roll == -1
    assert all(math.isnan(motor.yaw) for motor in motors)


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"SYS_AUTOSTART": 10015.0},
        {"SYS_AUTOSTART": 6001.0},  # six motors on four
        rotors(*WIDE, WIDE[0]),
        rotors(*WIDE[:3], (math.nan, 0.2, 1.0)),
        rotors(*WIDE, CA_AIRFRAME=2.0),
        rotors(*WIDE, CA_ROTOR2_AZ=0.0, CA_ROTOR2_AX=1.0),  # pushes forward
        rotors(*WIDE, CA_ROTOR_COUNT=math.nan),
        rotors(*WIDE, CA_ROTOR_COUNT=1e30),
    ],
)
def test_px4_that_does_not_tell_has_no_motors(parameters):
    assert motors_of(parameters, "px4", "quad") == ()


@given(
    st.dictionaries(
        st.sampled_from(["FRAME", "FRAME_CLASS", "FRAME_TYPE", "SYS_AUTOSTART", "CA_ROTOR_COUNT"]),
        st.one_of(st.floats(), st.integers(-2, 30).map(float)),
    ),
    st.sampled_from(["ardupilot", "px4", "other"]),
    st.sampled_from([*ROTORS, "other", "plane", ""]),
)
def test_no_parameters_make_it_fail(parameters, autopilot, vehicle):
    motors = motors_of(parameters, autopilot, vehicle)
    assert len(motors) <= MOST
    assert all(-1 <= motor.roll <= 1 and -1 <= motor.pitch <= 1 for motor in motors)


STANDARD = {"CA_AIRFRAME": 2.0, "CA_ROTOR_COUNT": 5.0, "CA_ROTOR4_AX": 1.0, "CA_ROTOR4_AZ": 0.0,
            "CA_ROTOR4_PX": -0.3, "CA_ROTOR4_PY": 0.0, "CA_ROTOR4_KM": 0.05}  # fmt: skip
for _i, (_x, _y, _km) in enumerate([(1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1)]):
    STANDARD |= {f"CA_ROTOR{_i}_PX": 0.2 * _x, f"CA_ROTOR{_i}_PY": 0.2 * _y,
                 f"CA_ROTOR{_i}_KM": 0.05 * _km}  # fmt: skip
QUADPLANE = {"Q_FRAME_CLASS": 1.0, "Q_FRAME_TYPE": 1.0}
X = [(1, -1, 1, 1), (2, 1, -1, 1), (3, 1, 1, -1), (4, -1, -1, -1)]


@pytest.mark.parametrize(("told", "autopilot"), [(STANDARD, "px4"), (QUADPLANE, "ardupilot")])
def test_of_an_aeroplane_the_motors_that_lift_it_count(told, autopilot):
    """Not the one that pushes it."""
    assert [tuple(motor) for motor in motors_of(told, autopilot, "vtol")] == X


@pytest.mark.parametrize(
    ("told", "autopilot"),
    [
        ({}, "ardupilot"),
        ({}, "px4"),
        (QUADPLANE | {"Q_TILT_MASK": 3.0}, "ardupilot"),
        (QUADPLANE | {"Q_FRAME_CLASS": 2.0}, "ardupilot"),
        (STANDARD | {"CA_AIRFRAME": 3.0}, "px4"),  # a tiltrotor
        (STANDARD | {"CA_ROTOR3_AZ": 0.0}, "px4"),
        ({"SYS_AUTOSTART": 4001.0}, "px4"),
    ],
)
def test_of_an_aeroplane_lifted_otherwise_nothing_is_said(told, autopilot):
    assert motors_of(told, autopilot, "vtol") == ()
