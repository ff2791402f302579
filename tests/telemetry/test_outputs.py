"""Every output under the name of what it drives, whichever autopilot wired it."""

import numpy as np
import pytest

from fdi.telemetry.meaning.outputs import drives_of, with_outputs
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

T = np.arange(0.0, 40.0, 0.2)
AERT = {"PWM_MAIN_FUNC1": 201, "PWM_MAIN_FUNC2": 202, "PWM_MAIN_FUNC3": 203, "PWM_MAIN_FUNC4": 101,
        "CA_SV_CS0_TYPE": 15, "CA_SV_CS1_TYPE": 3, "CA_SV_CS2_TYPE": 4}  # fmt: skip
OWN = [(1, "aileron"), (2, "elevator"), (4, "rudder"), (5, "aileron"), (6, "aileron")]
SECOND = (3, "aileron")


def message(key, unit, **values):
    columns = {
        name.replace("__", "[").replace("_e", "]"): Column(
            lambda v=v: np.broadcast_to(v, T.shape).astype(float), Conversion(unit)
        )
        for name, v in values.items()
    }
    return Message(key, None, T, T, np.arange(T.size), columns)


def log(*messages):
    return {m.key: m for m in messages}


@pytest.mark.parametrize(
    ("autopilot", "parameters", "drives"),
    [
        ("ardupilot", {}, OWN),
        ("ardupilot", {"SERVO1_FUNCTION": 21, "SERVO3_FUNCTION": 4}, [(1, "rudder"), SECOND]),
        ("ardupilot", {"SERVO1_FUNCTION": 77, "SERVO2_FUNCTION": 78},
         [(1, "elevon_left"), (2, "elevon_right")]),
        ("ardupilot", {"ELEVON_OUTPUT": 1}, []),
        ("ardupilot", {"RCMAP_ROLL": 2, "RCMAP_PITCH": 3, "RC5_FUNCTION": 0, "RC6_FUNCTION": 0},
         [(2, "aileron"), (3, "elevator"), (4, "rudder")]),
        ("px4", AERT, [(1, "aileron"), (2, "elevator"), (3, "rudder")]),
        ("px4", {}, []),
    ],
)  # fmt: skip
def test_parameters_say_what_an_output_drives(autopilot, parameters, drives):
    assert drives_of(parameters, autopilot) == drives


AILERON, OTHER = 0.3 * np.sin(T), 0.2 * np.sin(0.37 * T)


@pytest.mark.parametrize(
    ("functions", "left", "right", "names"),
    [
        ((77, 78), OTHER - AILERON, OTHER + AILERON, ("aileron", "elevator")),
        ((79, 80), OTHER + AILERON, OTHER - AILERON, ("rudder", "elevator")),
        ((24, 25), AILERON + OTHER / 9, AILERON - OTHER / 9, ("aileron", None)),  # to 4.4
        ((24, 25), -AILERON - OTHER / 9, AILERON - OTHER / 9, ("aileron", None)),
    ],
)
def test_what_was_mixed_into_two_surfaces_is_told_apart(functions, left, right, names):
    """As ArduPilot mixes, with one servo reversed, and another throw and trim."""
    parameters = {f"SERVO{n}_FUNCTION": float(f) for n, f in zip((1, 2), functions, strict=True)}
    parameters |= {"SERVO2_REVERSED": 1.0, "SERVO2_MIN": 1000, "SERVO2_MAX": 1800}
    parameters |= {"SERVO2_TRIM": 1420}
    outputs = message(
        "SERVO_OUTPUT_RAW", "us", servo1_raw=1500 + 400 * left, servo2_raw=1420 - 400 * right
    )
    made = with_outputs(log(outputs), parameters, "ardupilot", "plane")["OUTPUTS"]
    first, second = names
    assert set(made.columns) == {name for name in names if name}
    assert np.abs(made.si(first)) == pytest.approx(np.abs(AILERON), abs=1e-9)
    if second:
        assert made.si(second) == pytest.approx(OTHER, abs=1e-9)


def test_one_side_alone_tells_nothing():
    outputs = message("SERVO_OUTPUT_RAW", "us", servo1_raw=1500 + 400 * AILERON)
    assert "OUTPUTS" not in with_outputs(
        log(outputs), {"SERVO1_FUNCTION": 77}, "ardupilot", "plane"
    )


@pytest.mark.parametrize("engine", [3, 4])
def test_an_engine_on_output_4_is_no_rudder(engine):
    """PX4 without its parameters: the output that follows the throttle is the engine."""
    throttle = 0.5 + 0.3 * np.sin(T / 5)
    outputs = {f"servo{n}_raw": 1500 + 20 * np.sin(n * T) for n in (1, 2, 3, 4)}
    outputs[f"servo{engine}_raw"] = 1000 + 1000 * throttle
    made = with_outputs(
        log(
            message("SERVO_OUTPUT_RAW", "us", **outputs), message("VFR_HUD", "", throttle=throttle)
        ),
        {},
        "px4",
        "plane",
    )["OUTPUTS"]
    rudder = outputs[f"servo{7 - engine}_raw"]
    assert made.si("rudder") == pytest.approx((rudder - 1500) / 500)
    assert set(made.fields) == {"aileron", "elevator", "rudder"}


def test_nothing_is_guessed_where_no_output_follows_the_throttle():
    outputs = {f"servo{n}_raw": 1500 + 20 * np.sin(n * T) for n in (1, 2, 3, 4)}
    known = log(
        message("SERVO_OUTPUT_RAW", "us", **outputs),
        message("VFR_HUD", "", throttle=0.5 + 0.3 * np.sin(T / 5)),
    )
    assert "OUTPUTS" not in with_outputs(known, {}, "px4", "plane")


def test_servos_of_px4_are_named_by_the_allocation():
    servos = message("actuator_servos", "", **{f"control__{n}_e": n / 10 for n in range(3)})
    made = with_outputs(log(servos), AERT, "px4", "plane")["OUTPUTS"]
    assert made.si("rudder") == pytest.approx(0.2)
    assert made.made_from == "actuator_servos"


def test_a_multicopter_has_no_surfaces():
    assert "OUTPUTS" not in with_outputs(
        log(message("SERVO_OUTPUT_RAW", "us", servo1_raw=1500.0)), {}, "ardupilot", "quad"
    )
