"""Surfaces of a plane that is flown by hand: what turns it, and what turns it backwards."""

from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from telemetry.build import record

from fdi import analyze
from fdi.methods.columns import Columns
from fdi.methods.response import response_columns
from fdi.methods.setup import Check
from fdi.methods.setup.records import Series
from fdi.methods.setup.surfaces import check_surfaces, meant, turned_against_surface
from fdi.telemetry import read

NAMES = ("ailerons", "elevator", "rudder")
OUTPUTS = (1, 2, 4)
FUNCTIONS = (4, 19, 21)
STEP = 0.01
EFFECT, DAMPING = np.array([25.0, 12.0, 6.0]), np.array([6.0, 4.0, 2.0])


def flown(
    path: Path, linkage: tuple[int, int, int], turned_round: tuple[int, int, int], told: bool = True
) -> dict[str, Check]:
    """Fly a minute by hand and check: ``linkage`` is -1 where a surface moves the wrong way."""
    rng = np.random.default_rng(3)
    parts = [
        record(0.0, mav.MAVLink_param_value_message(name.encode(), float(value), 9, 6, i))
        for i, (name, value) in enumerate(_told(turned_round, told))
    ]
    rates, angles, gust = np.zeros(3), np.zeros(3), np.zeros(3)
    meant = np.zeros(3)
    for k in range(int(60 / STEP)):
        t = k * STEP
        flies = float(np.clip(t - 4, 0, 1))
        if k % 80 == 0:
            # a pilot who has got used to it, and so comes home to tell
            level = -0.4 * angles * linkage * [1, 1, 0]
            meant = flies * np.clip(rng.uniform(-0.3, 0.3, 3) + level, -1, 1)
        gust += -gust * STEP / 0.3 + rng.normal(0, 2.0, 3) * STEP**0.5 * flies
        rates = rates + (EFFECT * meant * linkage - DAMPING * rates + gust) * STEP
        angles = angles + rates * STEP
        if k % 10 == 0:
            outputs = 1500 + 400 * meant * np.where(turned_round, -1, 1)
            parts += _at(t, angles, rates, outputs, flies)
    path.write_bytes(b"".join(parts))
    return {check.name: check for check in check_surfaces(read(path))}


def _told(turned_round: tuple[int, int, int], told: bool) -> list[tuple[str, int]]:
    functions = [(f"SERVO{n}_FUNCTION", f) for n, f in zip(OUTPUTS, FUNCTIONS, strict=True)]
    turned = [(f"SERVO{n}_REVERSED", r) for n, r in zip(OUTPUTS, turned_round, strict=True)]
    return functions + (turned if told else [])


def _at(t: float, angles, rates, outputs, flies: float) -> list[bytes]:
    stamp, height, speed = round(1000 * t), 50 * flies, 18 * flies
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    kind, pilot = mav.MAV_TYPE_FIXED_WING, mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    wrapped = (angles + np.pi) % (2 * np.pi) - np.pi
    first, second, rudder = (round(float(x)) for x in outputs)
    pulses = (first, second, 1600, rudder, 0, 0, 0, 0)
    where = (470000000, 80000000, round(1000 * (400 + height)), round(1000 * height))
    messages = [
        mav.MAVLink_heartbeat_message(kind, pilot, armed, 0, 4, 3),
        mav.MAVLink_attitude_message(stamp, *wrapped, *rates),
        mav.MAVLink_servo_output_raw_message(1000 * stamp, 0, *pulses),
        mav.MAVLink_global_position_int_message(stamp, *where, round(100 * speed), 0, 0, 0),
        mav.MAVLink_vfr_hud_message(speed, speed, 0, 60, 400 + height, 0.0),
    ]
    return [record(t, message) for message in messages]


def test_surfaces_that_turn_the_plane_as_meant_are_in_order(tmp_path: Path) -> None:
    found = flown(tmp_path / "plane.tlog", (1, 1, 1), (0, 0, 0))
    assert [found[name].verdict for name in NAMES] == ["in order"] * 3


@pytest.mark.parametrize("axis", range(3))
def test_a_reversed_surface_is_named_and_no_other(tmp_path: Path, axis: int) -> None:
    linkage = tuple(-1 if i == axis else 1 for i in range(3))
    found = flown(tmp_path / "plane.tlog", linkage, (0, 0, 0))
    assert {name for name in NAMES if found[name].verdict == "wrong"} == {NAMES[axis]}
    assert "reversed" in found[NAMES[axis]].text


def test_a_servo_that_is_turned_round_by_its_parameter_is_in_order(tmp_path: Path) -> None:
    """The pulse goes the other way, and SERVOn_REVERSED says so."""
    found = flown(tmp_path / "plane.tlog", (1, 1, 1), (1, 0, 1))
    assert [found[name].verdict for name in NAMES] == ["in order"] * 3


def test_nothing_is_said_where_no_parameter_tells_the_direction(tmp_path: Path) -> None:
    found = flown(tmp_path / "plane.tlog", (-1, 1, 1), (0, 0, 0), told=False)
    assert {found[name].verdict for name in NAMES} == {"not known"}


def test_a_reversed_surface_names_the_parameter_that_turns_it_round(tmp_path: Path) -> None:
    found = flown(tmp_path / "plane.tlog", (1, -1, 1), (0, 0, 0))["elevator"]
    (setting,) = found.settings
    assert (setting.name, setting.now, setting.suggested) == ("SERVO2_REVERSED", 0.0, 1.0)


def launched(path: Path, linkage: int, rate: float = 10.0, axis: int = 0) -> Path:
    """Throw a plane whose autopilot holds wings or nose level; it lies on the ground after 8 s."""
    parts = [
        record(0.0, mav.MAVLink_param_value_message(name.encode(), float(value), 9, 6, i))
        for i, (name, value) in enumerate(_told((0, 0, 0), told=True))
    ]
    rng, rates, angles = np.random.default_rng(5), np.zeros(3), np.zeros(3)
    for k in range(int(14 / STEP)):
        t = k * STEP
        flies = float(np.clip(t - 4, 0, 1)) * (t < 12)
        meant = np.zeros(3)
        meant[axis] = np.clip(-1.5 * angles[axis] - 0.2 * rates[axis], -1, 1) * flies
        turning = EFFECT * meant * linkage - DAMPING * rates
        turning[axis] += rng.normal(0, 3.0) * flies
        rates = (rates + turning * STEP) * (flies > 0)
        angles = angles + rates * STEP
        if k % round(1 / rate / STEP) == 0:
            parts += _at(t, angles, rates, 1500 + 400 * meant, flies)
    path.write_bytes(b"".join(parts))
    return path


@pytest.mark.parametrize("rate", [4.0, 10.0, 25.0])
@pytest.mark.parametrize(("axis", "component"), [(0, "aileron"), (1, "elevator")])
def test_a_plane_that_turns_over_as_it_is_launched_has_that_surface_reversed(
    tmp_path: Path, rate: float, axis: int, component: str
) -> None:
    found = analyze(launched(tmp_path / "plane.tlog", -1, rate, axis))
    assert found.findings[0].component == component
    assert found.findings[0].onset == pytest.approx(5.5, abs=1.5)
    (check,) = (one for one in found.setup if one.name == NAMES[axis])
    assert check.verdict == "wrong"
    assert [setting.name for setting in check.settings] == [f"SERVO{OUTPUTS[axis]}_REVERSED"]


@pytest.mark.parametrize(("axis", "name"), [(0, "rolled_against"), (1, "pitched_against")])
def test_an_angle_against_a_surface_counts_from_when_it_is_turned(
    tmp_path: Path, axis: int, name: str
) -> None:
    found = response_columns(read(launched(tmp_path / "plane.tlog", -1, axis=axis)))
    assert isinstance(found, Columns)
    angle = found.values[name]
    assert (angle[found.t < 4.5] == 0).all()  # it lies in a hand
    assert angle[(found.t > 11.0) & (found.t < 13.0)].min() > np.pi / 2


@pytest.mark.parametrize("rate", [4.0, 25.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_plane_that_is_held_level_turns_with_its_surfaces(
    tmp_path: Path, rate: float, axis: int
) -> None:
    found = analyze(launched(tmp_path / "plane.tlog", 1, rate, axis))
    assert {"aileron", "elevator"}.isdisjoint(one.component for one in found.findings)
    (check,) = (one for one in found.setup if one.name == NAMES[axis])
    assert check.verdict != "wrong"


@pytest.mark.parametrize(
    ("told", "asked"),
    [
        ({}, 0.375),
        ({"SERVO1_TRIM": 1650, "RC1_TRIM": 1500}, 0.0),
        ({"SERVO1_TRIM": None, "SERVO1_REVERSED": None, "RC1_REV": 1, "RC1_TRIM": 1650}, 0.0),
    ],
)
def test_a_pulse_asks_for_nothing_at_its_trim(
    tmp_path: Path, told: dict[str, int | None], asked: float
) -> None:
    known = dict(_told((0, 0, 0), told=True)) | told
    parts = [
        record(0.0, mav.MAVLink_param_value_message(name.encode(), float(value), 9, 6, 0))
        for name, value in known.items()
        if value is not None
    ]
    for t in np.arange(0.0, 3.0, 0.1):
        parts += _at(t, np.zeros(3), np.zeros(3), np.full(3, 1650.0), 0.0)
    (tmp_path / "plane.tlog").write_bytes(b"".join(parts))
    found = meant(read(tmp_path / "plane.tlog"), "aileron")
    assert not isinstance(found, str)
    assert found.values[0] == pytest.approx(asked)


@pytest.mark.parametrize(("rolled_before", "against"), [(2.8, 4.0), (3.6, 0.0)])
def test_a_surface_that_has_done_as_meant_is_not_reversed_later(
    rolled_before: float, against: float
) -> None:
    """At 2 rad/s as meant for a while, then the other way for 2 s: the ailerons of a spin."""
    t = np.arange(0.0, 20.0, 0.05)
    as_meant = (t > 2.0) & (t <= 2.0 + rolled_before / 2)
    rate = 2.0 * as_meant - 2.0 * ((t > 10.0) & (t <= 12.0))
    given = Series(t, np.full((1, t.size), 0.5))
    found = turned_against_surface("aileron", Series(t, rate * np.eye(3)[:, :1]), given)
    assert found.max() == pytest.approx(against, abs=0.2)
