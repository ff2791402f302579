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
        told("quad", "ardupilot", FRAME_CLASS=2, FRAME_TYPE=1),  # of six motors
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


@pytest.mark.parametrize(
    "wiring", [{"SERVO1_FUNCTION": 34.0, "SERVO2_FUNCTION": 33.0}, {"SERVO9_FUNCTION": 33.0}]
)
def test_place_is_that_of_the_motor_whatever_output_drives_it(wiring):
    log = told("quad", "ardupilot", FRAME_CLASS=1, FRAME_TYPE=1, **wiring)
    assert places(log, 4) == X
    log = told("quad", "px4", SYS_AUTOSTART=4001, PWM_MAIN_FUNC1=102.0)
    assert places(log, 5) == [*X, ""]


def test_motors_of_an_octocopter_are_beside_the_nose_alike():
    """Halfway between two directions, left and right are told the same way."""
    log = told("octa", "ardupilot", FRAME_CLASS=3, FRAME_TYPE=1)
    beside = ["front right", "rear left", "front right", "rear right"]
    assert places(log, 8) == [*beside, "front left", "rear left", "front left", "rear right"]


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
