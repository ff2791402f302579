from types import SimpleNamespace
from typing import Any

import pytest

from fdi.model import load_airframe, shipped_models
from fdi.model.naming import component_words, place_of
from fdi.telemetry import read
from tests.flights import SHARED


class _Told(SimpleNamespace):
    """What a log says of its frame."""

    def __contains__(self, message: str) -> bool:
        return message in self.messages


def told(vehicle: str, autopilot: str, messages: Any = (), **parameters: float) -> Any:
    return _Told(vehicle=vehicle, autopilot=autopilot, messages=messages, parameters=parameters)


def places(log: Any, count: int) -> list[str]:
    return [place_of(f"motor_{i}", log) for i in range(1, count + 1)]


X = ["front right", "rear left", "front left", "rear right"]
PLUS = ["right", "left", "front", "rear"]
HEXA_X = ["right", "left", "front left", "rear right", "front right", "rear left"]
HEXA_PLUS = ["front", "rear", "rear left", "front right", "front left", "rear right"]


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        (told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=1), X),
        (told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=3), X),
        (told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=0), PLUS),
        (told("hexa", "ardupilot", FRAME_CLASS=2, FRAME_TYPE=1), HEXA_X),
        (told("hexa", "ardupilot", FRAME_CLASS=2, FRAME_TYPE=0), HEXA_PLUS),
        (told("quad", "ardupilot", FRAME=1), X),
        (told("hexa", "ardupilot", FRAME=0), HEXA_PLUS),
        (told("quad", "px4", SYS_AUTOSTART=4050), X),
        (told("quad", "px4", SYS_AUTOSTART=5001), PLUS),
        (told("hexa", "px4", SYS_AUTOSTART=6001), HEXA_X),
        (told("hexa", "px4", SYS_AUTOSTART=7001), HEXA_PLUS),
    ],
)
def test_motors_sit_where_the_autopilot_has_them(log, expected):
    """As ../shared/flights/sitl/README.md lists them for the simulated vehicles."""
    assert places(log, len(expected)) == expected


def test_motors_of_betaflight_order_begin_at_the_rear():
    log = told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=12)
    assert places(log, 4) == ["rear right", "front right", "rear left", "front left"]


@pytest.mark.parametrize(
    "log",
    [
        told("quad", "ardupilot"),
        told("quad", "ardupilot", FRAME=10),  # Y6
        told("quad", "ardupilot", FRAME_CLASS=7, FRAME_TYPE=1),  # tricopter
        told("quad", "px4"),
        told("plane", "px4", SYS_AUTOSTART=2100),
        told("quad", "other", FRAME_CLASS=1, FRAME_TYPE=1),
    ],
)
def test_a_log_that_does_not_tell_the_frame_gives_no_place(log):
    assert places(log, 4) == ["", "", "", ""]


def test_positions_of_rotors_tell_the_place():
    at = [(0.1, 0.25), (-0.1, -0.2), (0.1, -0.25), (-0.1, 0.2)]
    rotors = {f"CA_ROTOR{n}_P{axis}": at[n]["XY".index(axis)] for n in range(4) for axis in "XY"}
    log = told("quad", "px4", CA_ROTOR_COUNT=4, SYS_AUTOSTART=5001, **rotors)
    assert places(log, 4) == X


def test_place_is_that_of_the_motor_on_the_output():
    swapped = {"SERVO1_FUNCTION": 34.0, "SERVO2_FUNCTION": 33.0}
    log = told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=1, **swapped)
    assert places(log, 4) == ["rear left", "front right", "front left", "rear right"]


def test_outputs_by_motor_need_no_functions_of_outputs():
    frame = {"SYS_AUTOSTART": 4001.0, "PWM_MAIN_FUNC1": 102.0}
    assert place_of("motor_1", told("quad", "px4", **frame)) == "rear left"
    assert place_of("motor_1", told("quad", "px4", ("actuator_motors",), **frame)) == "front right"


@pytest.mark.parametrize(
    ("function", "place"),
    [(101.0, "front right"), (104.0, "rear right"), (112.0, ""), (113.0, "front left")],
)
def test_an_output_is_of_the_motor_that_its_function_says_and_else_of_its_own(function, place):
    """PX4's functions 101 to 112 are motors 1 to 12; a quadcopter has four."""
    frame = {"SYS_AUTOSTART": 4001.0, "PWM_MAIN_FUNC3": function}
    assert place_of("motor_3", told("quad", "px4", **frame)) == place


def test_what_is_no_motor_has_no_place():
    assert place_of("gps", told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=1)) == ""


@pytest.mark.parametrize("name", shipped_models())
def test_names_of_shipped_components_are_words(name):
    components = load_airframe(name).components
    words = {component: component_words(component, components) for component in components}
    assert all("_" not in word and word[0].isupper() for word in words.values()), words
    assert words["gps"] == "GPS receiver"
    assert words["attitude_control"] == "Attitude control"


@pytest.mark.skipif(not SHARED.is_dir(), reason="no flights beside the repository")
def test_motor_of_a_recorded_flight_is_named_with_its_place():
    log = read(SHARED / "crash" / "motor2_lost.bin")
    components = load_airframe("quadcopter").observe(log).components
    assert component_words("motor_2", components) == "Motor 2 (rear left)"
