"""Inputs of tests that earn their use, and such that do not, by messages made for it."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.telemetry.events import Event
from fdi.telemetry.inputs import believed, inputs_of
from fdi.telemetry.inputs.values import turning
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

T = np.arange(0.0, 60.0, 0.1)
RNG = np.random.default_rng(3)
SWINGS = 0.2 * np.sin(2 * np.pi * 0.4 * T)  # rad, what roll and pitch do
ARMED = (Event(0.0, "mode", "STABILIZE"), Event(1.0, "arm", "armed"))


def message(name, values, scale=1.0, invalid=()):
    columns = {
        field: Column(lambda own=own: own, Conversion("", scale), invalid)
        for field, own in values.items()
    }
    return Message(name, None, T, T, np.arange(T.size), columns)


def flying(turns=1.0):
    rates = {axis: turns * np.full(T.size, 0.3) for axis in ("rollspeed", "pitchspeed", "yawspeed")}
    return message("ATTITUDE", {"roll": SWINGS, "pitch": SWINGS, **rates})


def judged(*messages, wings=True, autopilot=""):
    by_key = {m.key: m for m in messages}
    found, judge = believed(by_key, ARMED, wings=wings, autopilot=autopilot)
    return found, {one.name: one for one in inputs_of(judge())}


def outputs(shares):
    """Outputs of four motors, 1000 to 2000 us, from shares (n, 4) of that."""
    us = {f"motor_{i + 1}": np.round(1000 + 1000 * shares[:, i]) for i in range(4)}
    columns = {k: Column(lambda v=v: v, Conversion("", 0.001, -1.0), (0.0,)) for k, v in us.items()}
    return Message("MOTORS", None, T, T, np.arange(T.size), columns)


def own():
    return 0.5 + 0.05 * RNG.standard_normal((T.size, 4))


def test_outputs_that_move_are_believed():
    found, told = judged(flying(), outputs(own()))
    assert told["outputs to the motors"].believed is True
    assert np.isfinite(found["MOTORS"].si("motor_1")).all()


def test_outputs_that_stand_while_the_vehicle_turns_are_not_its_own():
    found, told = judged(flying(), outputs(np.tile([0.93, 0.5, 0.5, 0.5], (T.size, 1))))
    assert told["outputs to the motors"].believed is False
    assert told["outputs to the motors"].channels[0] == "MOTORS.motor_1"
    assert not found["MOTORS"].has_known("motor_3")


def test_outputs_that_stand_while_it_rests_tell_nothing():
    _, told = judged(flying(turns=0.0), outputs(np.full((T.size, 4), 0.5)))
    assert told["outputs to the motors"].believed is None


@pytest.mark.parametrize(("idle", "is_own"), [(0.2, True), (0.6, False)])
def test_who_turns_a_vehicle_whose_rotors_idle_is_a_person(idle, is_own):
    """Armed for 30 s with all outputs at their lowest, and carried about; then it flies."""
    shares = own()
    shares[T < 30.0] = idle
    _, told = judged(flying(), outputs(shares))
    assert told["outputs to the motors"].believed is is_own


def test_outputs_that_freeze_in_the_second_half_were_its_own():
    shares = own()
    shares[T > 35.0] = shares[T > 35.0][0]
    found, told = judged(flying(), outputs(shares))
    assert told["outputs to the motors"].believed is True
    assert np.isfinite(found["MOTORS"].si("motor_1")).all()


def test_records_of_a_second_publisher_are_left_out_and_no_others():
    shares = own()
    second = np.arange(T.size) % 4 == 2
    shares[second] = [0.95, 0.5, 0.5, 0.5]
    found, told = judged(flying(), outputs(shares))
    assert told["outputs to the motors"].believed is True
    assert told["outputs to the motors"].left_out == pytest.approx(0.25)
    np.testing.assert_array_equal(np.isnan(found["MOTORS"].si("motor_2")), second)


def test_a_calm_hover_that_comes_back_to_its_outputs_is_no_second_publisher():
    shares = 0.5 + 0.001 * RNG.integers(-1, 2, (T.size, 4))
    _, told = judged(flying(), outputs(shares))
    assert told["outputs to the motors"].left_out == 0.0


def test_outputs_at_their_ends_again_and_again_are_a_controller_at_its_limit():
    shares = np.clip(own(), 0.0, 0.95)
    shares[np.arange(T.size) % 4 == 2] = [0.95, 0.0, 0.95, 0.0]
    _, told = judged(flying(), outputs(shares))
    assert told["outputs to the motors"].left_out == 0.0


def test_outputs_far_outside_their_range_are_not_that():
    _, told = judged(flying(), outputs(1.0 + own()))
    assert told["outputs to the motors"].believed is False
    assert "range" in told["outputs to the motors"].why


def demand(roll, pitch):
    return message("NAV_CONTROLLER_OUTPUT", {"nav_roll": roll, "nav_pitch": pitch})


def test_a_demand_that_is_followed_is_believed():
    late = np.interp(T - 0.2, T, SWINGS)
    _, told = judged(flying(), demand(late, late))
    assert told["demanded attitude"].believed is True


def test_a_demand_that_nothing_follows_is_not_used():
    other = 0.5 * np.sin(2 * np.pi * 0.07 * T) + 0.4
    calm = flying()
    still = dict.fromkeys(("roll", "pitch"), 0.05 * SWINGS)
    rates = {name: calm.si(name) for name in ("rollspeed", "pitchspeed", "yawspeed")}
    found, told = judged(message("ATTITUDE", {**still, **rates}), demand(other, -other))
    assert told["demanded attitude"].believed is False
    assert not found["NAV_CONTROLLER_OUTPUT"].has_known("nav_roll")


@pytest.mark.parametrize("fails", ["one axis", "later"])
def test_a_fault_is_not_a_demand_of_nobody(fails):
    off = SWINGS + np.where({"one axis": 0.0, "later": 35.0}[fails] < T, 1.0, 0.0)
    _, told = judged(flying(), demand(off, SWINGS if fails == "one axis" else off))
    assert told["demanded attitude"].believed is True


@pytest.mark.parametrize(
    ("axis", "off", "used"), [(0, 1.0, False), (1, 1.0, False), (0, 0.1, True)]
)
def test_rotors_that_follow_about_one_axis_follow_about_both(axis, off, used):
    both = [SWINGS, SWINGS]
    both[axis] = SWINGS + off
    _, told = judged(flying(), demand(*both), wings=False)
    assert told["demanded attitude"].believed is used


def test_a_demand_that_stands_still_is_not_judged():
    _, told = judged(flying(), demand(np.zeros(T.size), np.zeros(T.size)))
    assert told["demanded attitude"].believed is None


def battery(left, current):
    values = {"battery_remaining": left, "current_battery": current}
    power = message("VFR_HUD", {"throttle": np.full(T.size, 0.5)})
    return power, message("SYS_STATUS", values, invalid=(-1.0,))


def test_a_charge_that_comes_back_is_a_voltage():
    left = np.interp(T, [0, 5, 8, 50, 55, 60], [1.0, 1.0, 0.4, 0.3, 0.9, 0.9])
    found, told = judged(*battery(left, np.full(T.size, 12.0)))
    assert told["charge of battery 1"].believed is False
    assert not found["SYS_STATUS"].has_known("battery_remaining")
    assert found["SYS_STATUS"].has_known("current_battery")


def test_a_charge_that_only_falls_is_believed_though_it_falls_fast():
    left = np.interp(T, [0, 30, 33, 60], [1.0, 0.9, 0.1, 0.1])
    _, told = judged(*battery(left, np.full(T.size, 12.0)))
    assert told["charge of battery 1"].believed is True


def test_a_current_of_nothing_under_power_is_unknown():
    found, told = judged(*battery(np.full(T.size, -1.0), np.zeros(T.size)))
    assert told["current of battery 1"].believed is False
    assert not found["SYS_STATUS"].has_known("current_battery")
    assert "charge of battery 1" not in told


def test_a_current_that_drops_out_is_known_in_between():
    current = np.where(np.arange(T.size) % 5 == 0, 0.0, 12.0)
    found, told = judged(*battery(np.full(T.size, -1.0), current))
    known = found["SYS_STATUS"].si("current_battery")
    assert told["current of battery 1"].believed is True
    np.testing.assert_array_equal(np.isnan(known[T > 1.0]), current[T > 1.0] == 0.0)


def test_a_current_that_goes_later_is_a_fault_and_stays():
    current = np.where(T > 50.0, 0.0, 12.0)
    found, _ = judged(*battery(np.full(T.size, -1.0), current))
    assert np.isfinite(found["SYS_STATUS"].si("current_battery")).all()


def felt(roll_rad):
    """Return what an accelerometer at rest feels that leans by so much, and shakes."""
    force = 9.81 * np.array([0.0, -np.sin(roll_rad), -np.cos(roll_rad)])
    shaken = force[:, None] + RNG.standard_normal((3, T.size))
    columns = {
        axis: Column(lambda own=own: own, Conversion("m/s^2"))
        for axis, own in zip(("xacc", "yacc", "zacc"), shaken, strict=True)
    }
    return Message("RAW_IMU", None, T, T, np.arange(T.size), columns)


def leaning(roll_rad):
    angles = {"roll": np.full(T.size, roll_rad), "pitch": np.zeros(T.size)}
    return message("ATTITUDE", angles)


@pytest.mark.parametrize(
    ("estimated", "real", "is_believed"),
    [(0.1, 0.1, True), (1.2, 1.2, True), (1.2, 0.0, False), (0.3, 0.0, True)],
)
def test_an_attitude_is_believed_where_the_accelerometer_feels_the_same_down(
    estimated, real, is_believed
):
    found, told = judged(leaning(estimated), felt(real))
    assert told["estimated attitude"].believed is is_believed
    assert found["ATTITUDE"].has_known("roll") is is_believed


@pytest.mark.parametrize("scale", [0.6, 1.5])
def test_an_accelerometer_that_reads_too_much_does_not_cost_the_attitude_its_belief(scale):
    level = felt(0.0)
    columns = {
        axis: column._replace(load=lambda own=column: scale * own.load())
        for axis, column in level.columns.items()
    }
    wrong = Message("RAW_IMU", None, T, T, np.arange(T.size), columns)
    _, told = judged(leaning(0.0), wrong)
    assert told["estimated attitude"].believed is True


def estimated(sinks=0.0):
    """Return what an estimator says of where it goes, and its second attitude."""
    zero = np.zeros(T.size)
    position = dict.fromkeys(("x", "y", "z", "vx", "vy"), zero) | {"vz": zero + sinks}
    return (
        message("LOCAL_POSITION_NED", position),
        message("AHRS2", {"roll": zero, "pitch": zero, "yaw": zero}),
    )


def receiver(fix):
    return message("GPS_RAW_INT", {"fix_type": np.broadcast_to(np.float64(fix), T.size)})


OVER_GROUND = "estimated velocity over ground"


@pytest.mark.parametrize("aid", [(), ("OPTICAL_FLOW",)])
def test_where_it_goes_nobody_knows_without_a_fix(aid):
    flow = (message(name, {"flow_x": T}) for name in aid)
    found, told = judged(*estimated(), receiver(1), *flow)
    assert found["LOCAL_POSITION_NED"].has_known("vx") is bool(aid)
    assert found["LOCAL_POSITION_NED"].has_known("vz")  # by the barometer
    assert found["AHRS2"].has_known("roll")
    assert (OVER_GROUND in told) is not bool(aid)
    if not aid:
        assert "a position in 0 % of the armed time" in told[OVER_GROUND].why


def test_a_height_alone_is_no_velocity():
    sinks = message("GLOBAL_POSITION_INT", {"vz": np.zeros(T.size)})
    _, told = judged(sinks, receiver(3))
    assert told == {}


@pytest.mark.parametrize(("on_board", "is_read"), [(True, False), (False, True)])
def test_a_log_on_board_without_a_receiver_has_no_position(on_board, is_read):
    """A link may leave the receiver out."""
    own = [message("ATT", {"Roll": T})] if on_board else []
    found, _ = judged(*estimated(), *own)
    assert found["LOCAL_POSITION_NED"].has_known("vx") is is_read


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_a_fix_that_is_lost_in_flight_costs_no_belief(share):
    found, told = judged(*estimated(), receiver(np.where(60.0 * share > T, 3, 0)))
    assert told[OVER_GROUND].believed is True
    assert np.isfinite(found["LOCAL_POSITION_NED"].si("x")).all()


def test_an_estimator_that_falls_faster_than_anything_is_not_read():
    runs = np.where((T > 10.0) & (T < 20.0), 229.0, 0.0)
    found, told = judged(*estimated(runs), receiver(3))
    assert told["estimates beside the attitude"].believed is False
    assert "flies with up to 229 m/s" in told["estimates beside the attitude"].why
    assert not found["LOCAL_POSITION_NED"].has_known("vx")
    assert not found["AHRS2"].has_known("roll")


@pytest.mark.parametrize("runs", [np.where(T > 50.0, 500.0, 0.0), np.full(T.size, 120.0)])
def test_an_estimator_that_fails_later_and_a_fast_vehicle_are_read(runs):
    found, _ = judged(*estimated(runs), receiver(3))
    assert found["LOCAL_POSITION_NED"].has_known("vz")
    assert found["AHRS2"].has_known("roll")


def lying(offset, scatter=0.0005):
    """Return an attitude that turns in the first half and lies in the second; rates, rad/s."""
    half = T < 30.0
    rates = (
        offset + np.where(half, 0.3 * np.sin(3 * T), 0.0) + scatter * RNG.standard_normal(T.size)
    )
    zero = np.zeros(T.size)
    return message("ATTITUDE", {"rollspeed": rates, "pitchspeed": zero, "yawspeed": zero})


@pytest.mark.parametrize(
    ("offset", "scatter", "told"),
    [(0.03, 0.0005, 0.0), (0.0, 0.0005, 0.0), (0.03, 0.01, 0.03), (0.5, 0.0005, 0.5)],
)
def test_what_lies_does_not_turn_by_the_offset_of_its_gyroscope(offset, scatter, told):
    """What scatters as in flight has no offset that is known, nor is one that large an offset."""
    turns = turning({"ATTITUDE": lying(offset, scatter)}, T)
    assert np.median(turns[T > 40.0]) == pytest.approx(told, abs=0.005)


def turned(unit):
    """Return the message of a gyroscope that turns at 2 rad/s about all axes together."""
    values = np.full(T.size, 2.0)
    conversion = Conversion(unit)
    axes = {n: Column(lambda: values / np.sqrt(3), conversion) for n in ("xgyro", "ygyro", "zgyro")}
    return Message("RAW_IMU", None, T, T, np.arange(T.size), axes)


def test_who_tells_no_rates_turns_as_its_gyroscope_says():
    zero = np.zeros(T.size)
    attitude = message("ATTITUDE", {"roll": zero, "pitch": zero, "yaw": zero})
    found = turning({"ATTITUDE": attitude, "RAW_IMU": turned("rad/s")}, T)
    assert found == pytest.approx(2.0)
    raw = turning({"ATTITUDE": attitude, "RAW_IMU": turned("")}, T)
    assert raw == pytest.approx(0.0)


@pytest.mark.parametrize("nose", [0.0, 0.5, -1.2])
def test_without_a_gyroscope_the_attitude_tells_how_it_turns(nose):
    """Of a nose that is raised or lowered, a roll and a yaw add up along its axis, or take away."""
    roll, yaw = (np.array(angle) for angle in (1.5 * T, (2.0 * T + np.pi) % (2 * np.pi) - np.pi))
    attitude = message("ATTITUDE", {"roll": roll, "pitch": np.full(T.size, nose), "yaw": yaw})
    body = 1.5 - 2.0 * np.sin(nose), 2.0 * np.cos(nose)
    assert turning({"ATTITUDE": attitude}, T) == pytest.approx(np.hypot(*body))
    assert np.isnan(turning({}, T)).all()


def recorded(pulses, turns=1.0):
    """What an autopilot records of a flight: its outputs, a demand of its own, and a throttle."""
    silent = np.where(pulses, 1500.0, 0.0)
    servos = message("SERVO_OUTPUT_RAW", {"servo1_raw": 0 * T, "servo3_raw": silent}, 1.0, (0.0,))
    hud = message("VFR_HUD", {"throttle": 0 * T, "airspeed": 20 + T})
    return flying(turns), demand(SWINGS, SWINGS), servos, hud


def test_who_gives_no_output_a_pulse_steers_nothing():
    found, told = judged(*recorded(T < 0.0), autopilot="ardupilot")
    assert told["demands, throttle and surfaces"].believed is False
    assert "demanded attitude" not in told
    assert not found["NAV_CONTROLLER_OUTPUT"].has_known("nav_pitch")
    assert not found["VFR_HUD"].has_known("throttle")
    assert found["VFR_HUD"].has_known("airspeed")


@pytest.mark.parametrize(
    ("pulses", "turns", "autopilot"),
    [(T > 40.0, 1.0, "ardupilot"), (T < 0.0, 0.0, "ardupilot"), (T < 0.0, 1.0, "px4")],
)
def test_who_gives_one_a_pulse_or_rests_or_logs_another_board_may_steer(pulses, turns, autopilot):
    found, told = judged(*recorded(pulses, turns), autopilot=autopilot)
    assert "demands, throttle and surfaces" not in told
    assert found["VFR_HUD"].has_known("throttle")


LONG = np.arange(0.0, 240.0, 0.4)  # as many records, for as long as a flight takes


@pytest.mark.parametrize(
    ("roll", "pitch", "wings", "lasts", "steers"),
    [
        (0.8, 0.4, True, 240.0, False),
        (0.8, 0.02, True, 240.0, True),  # a surface that is stuck leaves an axis
        (0.8, 0.4, True, 50.0, True),  # one that falls
        (0.8, 0.4, False, 240.0, True),  # rotors do not go on so: what misses its demand falls
    ],
)
def test_wings_that_miss_a_still_demand_for_minutes_are_steered_by_others(
    roll, pitch, wings, lasts, steers
):
    """The demand stands at level; the vehicle goes about on its own."""
    t = LONG * lasts / 240.0
    sweep = np.sin(2 * np.pi * 0.05 * LONG) * 1.4
    turns = dict.fromkeys(("rollspeed", "pitchspeed", "yawspeed"), np.full(t.size, 0.3))
    own = {"roll": roll * sweep, "pitch": pitch * sweep, **turns}
    still = {"nav_roll": 0 * t, "nav_pitch": 0 * t + 1e-3}
    messages = [
        replace(message(name, values), t=t, stamp=t)
        for name, values in (
            ("ATTITUDE", own),
            ("NAV_CONTROLLER_OUTPUT", still),
            ("OUTPUTS", {"aileron": sweep}),
            ("VFR_HUD", {"throttle": 0 * t}),
        )
    ]
    found, told = judged(*messages, wings=wings)
    assert ("demands, throttle and surfaces" in told) is not steers
    assert found["OUTPUTS"].has_known("aileron") is steers
    assert found["VFR_HUD"].has_known("throttle") is steers
