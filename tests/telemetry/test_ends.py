"""How a flight ends: with a blow, out of control, landed, in the air."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import Event, Flight, read
from fdi.telemetry.ends import FlightEnd, find_ends, gravest

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "flights"
T = np.arange(0.0, 60.0, 0.1)
UP = Flight(2.0, 60.0, takeoff=3.0)


class Made(dict):
    """A message of columns in SI: what `find_ends` asks of one."""

    t = T
    kept = np.arange(T.size)

    def si(self, name):
        return self[name]

    raw = si

    def __len__(self):
        return self.t.size

    def has_known(self, name):
        return bool(np.isfinite(self[name]).any())

    @property
    def fields(self):
        return tuple(self)


def ends(flight=UP, vehicle="quad", mode="LOITER", events=(), **columns):
    """How a flight of 60 s ends with some of its columns given."""
    level = np.zeros(Made.t.size)
    attitude = Made(roll=columns.get("roll", level), pitch=columns.get("pitch", level))
    if "yaw_rate" in columns:
        attitude |= {"rollspeed": level, "pitchspeed": level, "yawspeed": columns["yaw_rate"]}
    messages = {"ATTITUDE": attitude}
    if "nav_roll" in columns:
        messages["NAV_CONTROLLER_OUTPUT"] = Made(
            nav_roll=columns["nav_roll"], nav_pitch=level + 1e-3
        )
    if "outputs" in columns:
        messages["MOTORS"] = Made({f"motor_{i}": columns["outputs"] for i in range(1, 5)})
        messages["VFR_HUD"] = Made(climb=columns["climb"])
    said = [Event(0.0, "mode", mode), *events]
    (end,) = find_ends(messages, said, [flight], has_rotors=vehicle != "plane")
    return end


def after(t, value):
    """Zero, and from a time on a value."""
    return np.where(t <= T, value, 0.0)


def test_a_level_flight_ends_as_its_motion_says():
    landed = Flight(2.0, 60.0, takeoff=3.0, landing=55.0)
    assert (ends().how, ends(landed).how) == ("in_air", "landed")
    assert ends(Flight(2.0, 60.0, flew=False)).how == "on_ground"
    blow = ends(Flight(2.0, 60.0, takeoff=3.0, impact=58.0, impact_speed=9.0))
    assert (blow.how, blow.at, blow.speed, blow.lost_control) == ("impact", 58.0, 9.0, None)
    assert blow.is_seen
    assert not ends(Flight(2.0, 58.0, takeoff=3.0, impact=58.0, impact_speed=9.0)).is_seen


LANDS = Flight(2.0, 60.0, takeoff=3.0, landing=50.0)


@pytest.mark.parametrize("since", [49.2, 51.0, 54.0])
def test_who_falls_on_its_side_as_it_touches_the_ground_tips_over(since):
    end = ends(LANDS, roll=after(since, 1.6))
    assert (end.how, end.at, end.lost_control) == ("tipped_over", 50.0, None)
    assert end.is_bad


@pytest.mark.parametrize(("side", "how"), [(0.0, "landed"), (9.8, "tipped_over")])
def test_an_attitude_that_a_blow_upset_tips_nobody_over(side, how):
    """At rest the accelerometer feels the ground below its legs, or at its side."""
    rest = Made(xacc=np.zeros(T.size), yacc=np.full(T.size, side), zacc=np.full(T.size, side - 9.8))
    messages = {"ATTITUDE": Made(roll=after(50.5, 1.6), pitch=np.zeros(T.size)), "RAW_IMU": rest}
    (end,) = find_ends(messages, [Event(0.0, "mode", "LOITER")], [LANDS], has_rotors=True)
    assert end.how == how


@pytest.mark.parametrize(
    ("speeds", "told"),
    [((2.2, 3.4, 2.1), 1), ((2.2, 5.0, 3.0), 1), ((6.0, 3.0, 5.0), 2), ((None, 2.5, None), 1)],
)
def test_the_crash_is_told_and_not_the_last_hard_landing(speeds, told):
    """The last one that breaks a vehicle; where none does, the hardest."""
    made = [FlightEnd(n, "impact", 10.0 * n, speed) for n, speed in enumerate(speeds)]
    found = gravest([*made, FlightEnd(3, "landed", 40.0)])
    assert found is made[told]
    assert gravest([FlightEnd(0, "landed", 1.0)]) is None
    lost = FlightEnd(4, "control_lost", 50.0, lost_control=49.0)
    assert gravest([*made, lost]) is lost


def test_who_is_turned_over_by_hand_later_has_landed():
    assert ends(LANDS, roll=after(57.0, 1.6)).how == "landed"


def test_who_is_turned_over_after_disarming_has_landed_too():
    off = Event(50.5, "disarm", "")
    assert ends(LANDS, roll=after(53.0, 1.6), events=[off]).how == "landed"
    assert ends(LANDS, roll=after(51.0, 1.6), events=[off]).how == "tipped_over"


def test_who_rocks_as_it_touches_the_ground_has_landed():
    assert ends(LANDS, roll=after(50.5, 1.6) - after(51.0, 1.6)).how == "landed"


def test_control_that_was_lost_long_before_is_not_the_grounds_doing():
    end = ends(LANDS, roll=after(40.0, 1.6))
    assert (end.how, end.lost_control) == ("control_lost", pytest.approx(40.0, abs=0.11))


def test_control_is_lost_since_it_leans_where_nobody_wants_it():
    end = ends(roll=after(57.0, 1.5))
    assert end.how == "control_lost"
    assert end.lost_control == pytest.approx(57.0, abs=0.11)


@pytest.mark.parametrize(
    ("mode", "rate", "lost"),
    [("LOITER", 25.0, 40.0), ("LOITER", 8.0, None), ("ACRO", 25.0, None), ("LOITER", -25.0, 40.0)],
)
def test_who_spins_to_the_end_has_lost_control_as_it_began(mode, rate, lost):
    """Nobody asks for 10 rad/s of yaw; whoever flies acrobatics may."""
    spun = ends(mode=mode, yaw_rate=rate * np.clip((T - 40.0) / 0.3, 0.0, 1.0))
    assert spun.lost_control == (lost if lost is None else pytest.approx(lost, abs=0.2))
    assert spun.lost_by == (None if lost is None else "spin")
    assert spun.loss == ("control was lost" if lost is None else "it began to spin")


@pytest.mark.parametrize(("before", "since"), [(0.5, 40.1), (2.0, 40.3)])
def test_a_spin_begins_where_the_turning_does_unless_it_turned_before(before, since):
    """By 5 rad/s^2 from 40 s on; who turned by 2 rad/s for 10 s did so for another reason."""
    rate = np.where(T > 30.0, before, 0.0) + np.clip(5.0 * (T - 40.0), 0.0, 25.0)
    spun = ends(yaw_rate=rate)
    assert spun.lost_by == "spin"
    assert spun.lost_control == pytest.approx(since, abs=0.11)


def test_who_spun_and_stopped_has_control():
    assert ends(yaw_rate=np.where((T > 30) & (T < 40), 25.0, 0.1)).lost_control is None


@pytest.mark.parametrize(("pause", "since"), [(1.5, 40.0), (5.0, 50.0)])
def test_a_recorder_that_pauses_shows_no_recovery_unless_for_long(pause, since, monkeypatch):
    kept = T[(T < 45.0) | (45.0 + pause <= T)]
    monkeypatch.setattr(Made, "t", kept)
    rate = np.where(kept >= 40.0, 25.0, 0.1)
    level = np.zeros(kept.size)
    assert ends(roll=level, pitch=level, yaw_rate=rate).lost_control == pytest.approx(
        since, abs=0.2
    )


def test_who_recovers_has_control():
    assert ends(roll=after(40.0, 1.5) - after(42.0, 1.5)).lost_control is None


def test_a_lean_that_is_wanted_is_no_loss():
    wanted = after(50.0, 1.2)
    assert ends(roll=wanted, nav_roll=wanted + 1e-3, vehicle="plane").how == "in_air"
    assert ends(roll=after(57.0, 1.5), mode="ACRO").how == "in_air"


def test_a_multicopter_on_its_back_flies_in_no_mode():
    assert ends(roll=after(50.0, 3.0), mode="ACRO").lost_control == pytest.approx(50.0, abs=0.11)
    assert ends(roll=after(50.0, 3.0), mode="ACRO", vehicle="plane").lost_control is None


def test_who_leans_has_not_turned_over():
    assert ends(roll=after(50.0, 3.0)).overturned == pytest.approx(50.0, abs=0.11)
    leans = ends(roll=after(57.0, 1.5))
    assert (leans.lost_by, leans.overturned) == ("lean", None)


def test_control_is_lost_where_the_demand_is_not_followed_to_the_end():
    demand = np.full_like(T, 0.1)
    apart = after(50.0, 0.9)
    assert ends(roll=apart, nav_roll=demand).lost_control == pytest.approx(50.0, abs=0.11)
    short = after(58.9, 0.9)  # a reversal of the bank that the log cuts off
    assert ends(roll=short, nav_roll=demand, vehicle="plane").lost_control is None


def test_a_fall_with_all_motors_at_their_stop_is_a_loss():
    outputs = np.where(T < 57.0, 1400.0 + 50.0 * np.sin(T), 1000.0)
    falling = after(57.0, -1.0) * (T - 57.0) * 9.8
    assert ends(outputs=outputs, climb=falling).lost_control == pytest.approx(57.0, abs=0.11)
    assert ends(outputs=outputs, climb=np.zeros_like(T)).lost_control is None


def test_a_frame_with_a_name_of_its_own_falls_like_any_other():
    """A Y6 or an octaquad is ``other`` by its type, and its rotors carry it all the same."""
    path = SHARED / "crash" / "motors_cut_in_air.ulg"
    if not path.is_file():
        pytest.skip("no ../shared")
    log = read(path)
    named = replace(log, vehicle="other", frame="Y6", _cache={})
    assert named.ends == log.ends
    assert log.ends[0].lost_by == "stop"


def test_only_a_failsafe_that_acts_ends_a_flight_as_one():
    said = Event(30.0, "failsafe", "Battery Failsafe")
    assert ends(events=[said]).how == "failsafe"
    assert ends(events=[Event(30.0, "failsafe", "GPS Glitch or Compass error")]).how == "in_air"
    assert ends(events=[Event(1.0, "failsafe", "Radio Failsafe")]).how == "in_air"  # on the ground


def _labelled(healthy):
    path = SHARED / "labels.json"
    flights = json.loads(path.read_text())["flights"] if path.is_file() else {}
    return [
        name
        for name, label in flights.items()
        if label["use"] == "diagnosis"
        and (not label["faults"]) == healthy
        and name.startswith(("sitl/", "healthy/", "crash/", "px4_motor/"))
    ]


@pytest.mark.parametrize("name", _labelled(healthy=True))
def test_no_healthy_flight_loses_control(name):
    assert [end.lost_control for end in read(SHARED / name).ends if end.lost_control] == []


@pytest.mark.parametrize("name", [n for n in _labelled(healthy=False) if "px4_motor" in n])
def test_a_quadcopter_without_a_motor_loses_control_within_a_second(name):
    label = json.loads((SHARED / "labels.json").read_text())["flights"][name]
    (end,) = read(SHARED / name).ends
    assert 0.0 < end.lost_control - label["faults"][0]["onset"] < 1.0


def test_who_stays_level_while_a_demand_goes_astray_has_control():
    """Sticks that are moved on the ground, and set points of a module that does not fly."""
    assert ends(nav_roll=after(50.0, np.radians(45.0)) + 1e-3).how == "in_air"


def test_a_demand_of_nothing_is_one_to_be_level_where_the_mode_levels():
    """Between 35 and 60 degrees the lean alone tells nothing."""
    messages = {
        "ATTITUDE": Made(roll=after(50.0, np.radians(50.0)), pitch=np.zeros_like(T)),
        "NAV_CONTROLLER_OUTPUT": Made(
            nav_roll=np.where(T < 40.0, 0.1, 0.0), nav_pitch=np.zeros_like(T)
        ),
    }
    for mode, how in (("STABILIZE", "control_lost"), ("ACRO", "in_air")):
        (end,) = find_ends(messages, [Event(0.0, "mode", mode)], [UP], has_rotors=True)
        assert end.how == how


@pytest.mark.parametrize(
    ("by_pressure", "told"), [(None, 7.0), (7.0, 7.0), (6.0, 7.0), (0.5, None)]
)
def test_how_fast_it_came_down_is_told_only_where_the_air_pressure_says_no_other(by_pressure, told):
    """By more than the wash of rotors makes of it: an estimator may sink by metres as it stands."""
    sinks = LANDS.landing > T
    messages = {
        "ATTITUDE": Made(roll=np.zeros_like(T), pitch=np.zeros_like(T)),
        "VFR_HUD": Made(climb=np.where(sinks, -7.0, 0.0)),
    }
    if by_pressure is not None:
        height = np.where(sinks, by_pressure * (LANDS.landing - T), 0.0)
        messages["SCALED_PRESSURE"] = Made(press_abs=101325.0 - 12.0 * height)  # 12 Pa a metre
    (end,) = find_ends(messages, [Event(0.0, "mode", "LOITER")], [LANDS], has_rotors=True)
    assert end.how == "landed"
    assert end.speed == (None if told is None else pytest.approx(told, abs=0.1))
