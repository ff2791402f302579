"""Every output of a multicopter under the number of the motor that it drives, as a share."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry import read
from fdi.telemetry.meaning import unwired, with_motors
from fdi.telemetry.message import Column, Message
from fdi.telemetry.motors import ROTORS
from fdi.units import Conversion
from tests.flights import SHARED

T = np.arange(0.0, 4.0, 0.5)
USUAL = {n: 1000.0 + 100 * n for n in range(1, 17)}
"""Outputs that show their own number: 1100 us on the first."""


def message(key, field, values):
    columns = {
        field.format(n): Column(lambda v=v: np.broadcast_to(v, T.shape).astype(float),
                                Conversion("us"))
        for n, v in values.items()
    }  # fmt: skip
    name, _, instance = key.partition("[")
    return Message(name, int(instance[:-1]) if instance else None, T, T, np.arange(T.size), columns)


SERVOS = message("SERVO_OUTPUT_RAW", "servo{}_raw", USUAL)


def given_to(parameters, autopilot="ardupilot", vehicle="quad", *more, servos=SERVOS):
    """What MOTORS says of every motor, as the outputs' own numbers where they span 1000 us."""
    messages = {m.key: m for m in (servos, *more)}
    made = with_motors(messages, parameters, autopilot, vehicle).get("MOTORS")
    fields = made.fields if made is not None else ()
    return {int(name[6:]): round(10 * made.si(name)[0], 6) for name in fields}


def functions(prefix, by_output):
    return {prefix.format(n): float(function) for n, function in by_output.items()}


OWN = {1: 1, 2: 2, 3: 3, 4: 4}


@pytest.mark.parametrize(
    ("autopilot", "vehicle", "parameters", "outputs"),
    [
        ("ardupilot", "quad", {}, OWN),
        ("ardupilot", "hexa", {}, {n: n for n in range(1, 7)}),
        ("ardupilot", "octa", {}, {n: n for n in range(1, 9)}),
        ("other", "quad", {"SERVO1_FUNCTION": 34.0}, OWN),
        ("ardupilot", "quad", functions("SERVO{}_FUNCTION", {1: 34, 2: 33, 3: 35, 4: 36}),
         {1: 2, 2: 1, 3: 3, 4: 4}),
        ("ardupilot", "quad", functions("RC{}_FUNCTION", {5: 33, 6: 34, 9: 35, 14: 36}),
         {1: 5, 2: 6, 3: 9, 4: 14}),
        # a quad has four: what drives a fifth and sixth is none of its motors
        ("ardupilot", "quad", functions("SERVO{}_FUNCTION", {n: 32 + n for n in range(1, 7)}), OWN),
        # one changed output of which the log tells: the others are where they always are
        ("ardupilot", "quad", functions("SERVO{}_FUNCTION", {9: 33, 1: 0}),
         {1: 9, 2: 2, 3: 3, 4: 4}),
        ("ardupilot", "quad", functions("SERVO{}_FUNCTION", {1: 51, 2: 34}), {2: 2, 3: 3, 4: 4}),
        ("ardupilot", "quad", functions("SERVO{}_FUNCTION", {1: 33, 5: 33}), {2: 2, 3: 3, 4: 4}),
        ("ardupilot", "quad", {"SERVO1_FUNCTION": math.nan, "SERVO2_FUNCTION": math.inf}, OWN),
        ("px4", "quad", functions("PWM_MAIN_FUNC{}", {1: 104, 2: 103, 3: 102, 4: 101}),
         {1: 4, 2: 3, 3: 2, 4: 1}),
        ("px4", "quad", functions("PWM_AUX_FUNC{}", {1: 102, 2: 101, 3: 103, 4: 104}),
         {1: 2, 2: 1, 3: 3, 4: 4}),
        ("px4", "quad", functions("HIL_ACT_FUNC{}", {1: 102, 2: 101, 3: 103, 4: 104}),
         {1: 2, 2: 1, 3: 3, 4: 4}),
    ],
)  # fmt: skip
def test_a_motor_is_on_the_output_that_has_its_function(autopilot, vehicle, parameters, outputs):
    assert given_to(parameters, autopilot, vehicle) == outputs


def test_dodecarotors_have_functions_of_their_own():
    """Of motors 9 to 12 no vehicle with a type of its own has any, but they are no aux outputs."""
    told = functions("SERVO{}_FUNCTION", {1: 82, 2: 85, 8: 33, 9: 34})
    assert given_to(told) == {1: 8, 2: 9, 3: 3, 4: 4}


def test_motors_on_the_second_bank_of_px4_are_read_there():
    bank = message("actuator_outputs[1]", "output[{}]", {n: 1050.0 + 100 * n for n in range(4)})
    told = functions("PWM_AUX_FUNC{}", {1: 102, 2: 101, 3: 103, 4: 104})
    assert given_to(told, "px4", "quad", bank) == {1: 1.5, 2: 0.5, 3: 2.5, 4: 3.5}


def test_outputs_by_motor_need_no_functions_and_no_range():
    told = functions("PWM_MAIN_FUNC{}", {1: 102, 2: 101}) | {"PWM_MAIN_MIN": 1100.0}
    by_motor = message("actuator_motors", "control[{}]", {0: 0.1})
    assert given_to(told, "px4", "quad", by_motor) == OWN


def test_a_simulation_has_the_functions_of_its_own_outputs():
    main = functions("PWM_MAIN_FUNC{}", {1: 102, 2: 101, 3: 103, 4: 104})
    own = functions("HIL_ACT_FUNC{}", {n: 100 + n for n in range(1, 5)})
    assert given_to(main | own, "px4")[1] == 2
    assert given_to(main | own | {"SYS_HITL": 1.0, "PWM_MAIN_MIN": 1100.0}, "px4") == OWN


@pytest.mark.parametrize(
    ("autopilot", "parameters", "low", "high"),
    [
        ("ardupilot", {"MOT_PWM_MIN": 1100.0, "MOT_PWM_MAX": 1900.0, "RC3_MIN": 990.0}, 1100, 1900),
        ("ardupilot", {"MOT_PWM_MIN": 0.0, "RC3_MIN": 1100.0, "RC3_MAX": 1900.0}, 1100, 1900),
        ("ardupilot", {"MOT_PWM_MIN": 1100.0, "MOT_PWM_TYPE": 6.0}, 1000, 2000),
        ("ardupilot", {"MOT_PWM_MIN": 1100.0, "MOT_PWM_TYPE": 0.0}, 1100, 2000),
        ("ardupilot", {"PWM_MAIN_MIN": 1100.0}, 1000, 2000),
        ("ardupilot", {"Q_ENABLE": 1.0, "Q_M_PWM_MIN": 1100.0, "MOT_PWM_MAX": 1900.0}, 1100, 2000),
        ("ardupilot", {"Q_ENABLE": 1.0, "Q_THR_MAX_PWM": 1900.0, "RC3_MIN": 990.0}, 1000, 1900),
        ("ardupilot", {"Q_ENABLE": 1.0, "Q_M_PWM_MIN": 1100.0, "Q_M_PWM_TYPE": 6.0}, 1000, 2000),
        ("px4", {"PWM_MAIN_MIN1": 1075.0, "PWM_MAIN_MAX": 1950.0}, 1075, 1950),
        ("px4", {"PWM_MAIN_MIN1": -1.0, "PWM_MIN": 1050.0}, 1050, 2000),
        ("px4", {"PWM_MAIN_MIN": 1075.0, "SYS_HITL": 1.0}, 1000, 2000),
        ("px4", {"RC3_MIN": 1100.0, "PWM_MAX": math.nan}, 1000, 2000),
        ("other", {"RC3_MIN": 1100.0}, 1000, 2000),
    ],
)
def test_an_output_is_told_as_a_share_of_its_range(autopilot, parameters, low, high):
    assert given_to(parameters, autopilot)[1] / 10 == pytest.approx((1100 - low) / (high - low))


@pytest.mark.parametrize("ends", [(1500.0, 1500.0), (1900.0, 1100.0)])
def test_a_range_that_is_none_leaves_the_motors_out_and_is_told(ends):
    told = dict(zip(("MOT_PWM_MIN", "MOT_PWM_MAX"), ends, strict=True))
    assert given_to(told) == {}
    words, *others = unwired({}, told, "ardupilot", "quad")
    assert len(others) == 3
    assert (
        f"output 1 drives its motor from {ends[0]:g} to {ends[1]:g} us, which is no range" in words
    )


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({1: 33, 5: 33}, "SERVO1_FUNCTION and SERVO5_FUNCTION are both motor 1: "),
        ({1: 51, 2: 34}, "no output is motor 1: "),
    ],
)
def test_a_motor_without_one_output_is_told(told, words):
    said, _ = unwired({}, functions("SERVO{}_FUNCTION", told), "ardupilot", "quad")
    assert said == f"{words}nothing is said of what it is given"


def test_a_range_that_is_not_in_the_log_is_told_as_assumed():
    (said,) = unwired({}, {"RC3_MIN": 0.0}, "ardupilot", "quad")
    assert said == "not in this log, so assumed: MOT_PWM_MAX 2000 us"
    (said,) = unwired({}, {}, "px4", "quad")
    assert said == "not in this log, so assumed: PWM_MAIN_MIN1 1000 us, PWM_MAIN_MAX1 2000 us"


def test_nothing_is_told_of_a_plain_vehicle_or_of_one_without_motors():
    told = {"MOT_PWM_MIN": 0.0, "RC3_MAX": 1900.0}
    assert not list(unwired({}, told, "ardupilot", "quad"))
    assert not list(unwired({}, {"SYS_HITL": 1.0}, "px4", "quad"))
    assert not list(unwired({}, {"MOT_PWM_MIN": 3000.0}, "ardupilot", "plane"))


def test_an_output_of_zero_is_unknown():
    """An unused bank, or an output that is not driven."""
    values = np.array([0.0, 1100.0, 0.0, 1200.0, 1200.0, 0.0, 0.0, 0.0])
    servos = message("SERVO_OUTPUT_RAW", "servo{}_raw", {1: values, 2: 0.0})
    made = with_motors({"SERVO_OUTPUT_RAW": servos}, {}, "ardupilot", "quad")["MOTORS"]
    assert made.si("motor_1") == pytest.approx(np.where(values, (values - 1000) / 1000, np.nan),
                                               nan_ok=True)  # fmt: skip
    assert np.isnan(made.si("motor_2")).all()
    assert made.made_from == "SERVO_OUTPUT_RAW"
    assert set(made.fields) == {"motor_1", "motor_2"}


@pytest.mark.parametrize("vehicle", ["plane", "vtol", "helicopter", "other", "rover", ""])
def test_what_has_no_motors_of_known_number_has_no_message(vehicle):
    assert given_to({}, "ardupilot", vehicle) == {}
    assert "MOTORS" not in with_motors({}, {}, "ardupilot", "quad")


NAMES = ("SERVO1_FUNCTION", "SERVO3_FUNCTION", "RC2_FUNCTION", "PWM_MAIN_FUNC2", "HIL_ACT_FUNC1",
         "MOT_PWM_MIN", "MOT_PWM_MAX", "MOT_PWM_TYPE", "RC3_MIN", "PWM_MAIN_MIN1", "PWM_MAX",
         "SYS_HITL", "PWM_MAIN_MIN3")  # fmt: skip


@given(
    st.dictionaries(st.sampled_from(NAMES), st.one_of(st.floats(), st.sampled_from([33.0, 101.0]))),
    st.sampled_from(["ardupilot", "px4", "other"]),
    st.sampled_from([*ROTORS]),
)
def test_no_parameters_make_it_fail(parameters, autopilot, vehicle):
    shares = given_to(parameters, autopilot, vehicle)
    assert set(shares) <= set(range(1, ROTORS[vehicle] + 1))
    told = [x for x in unwired({}, parameters, autopilot, vehicle) if "nothing is said" in x]
    assert bool(told) == (len(shares) < ROTORS[vehicle])


LOGS = {
    "sitl/copter/c10_motor1_x0.7_20s.tlog": 4,
    "sitl/copter/c10_motor1_x0.7_20s.BIN": 4,
    "px4_motor/hil_00.ulg": 4,
    "px4_motor/sil_01.ulg": 4,
    "motor_stop/hexa-x_m1.bin": 6,
    "crash/motor2_lost.bin": 4,
    "healthy/no_battery_monitor.ulg": 4,
}


@pytest.mark.skipif(not SHARED.is_dir(), reason="no flights beside the repository")
@pytest.mark.parametrize(("name", "count"), LOGS.items())
def test_motors_of_recorded_flights_are_their_outputs(name, count):
    """Nothing is moved there: output n is motor n, over the range that the log tells."""
    log = read(SHARED / name)
    told = log.parameters
    low, high = 1000.0, 2000.0
    if log.autopilot == "ardupilot":
        low = told.get("MOT_PWM_MIN") or told.get("RC3_MIN") or low
        high = told.get("MOT_PWM_MAX") or told.get("RC3_MAX") or high
    elif not ("actuator_motors" in log or told.get("SYS_HITL")):
        low, high = (
            next(v for name in (f"PWM_MAIN_{end}1", f"PWM_MAIN_{end}", f"PWM_{end}", "")
                 if (v := told.get(name, usual if not name else -1)) not in (0, -1))
            for end, usual in (("MIN", low), ("MAX", high))
        )  # fmt: skip
    made, servos = log["MOTORS"], log["SERVO_OUTPUT_RAW"]
    assert list(made.fields) == [f"motor_{n}" for n in range(1, count + 1)]
    for n in range(1, count + 1):
        us = servos.si(f"servo{n}_raw")
        expected = (np.where(us > 0, us, np.nan) - low) / (high - low)
        assert made.si(f"motor_{n}") == pytest.approx(expected, nan_ok=True)
        assert np.nanmax(expected) > 0.1


def test_a_vehicle_that_logs_no_outputs_has_no_motors():
    assert "MOTORS" not in with_motors({"X": replace(SERVOS, name="X")}, {}, "px4", "quad")
