"""Which controller's rate belongs to which motor, and which controllers have a sensor."""

import numpy as np
import pytest

from fdi.telemetry.meaning import ROTORS, with_motors
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

T = np.arange(0.0, 10.0, 0.1)
OUTPUTS = {f"servo{n}_raw": 1500.0 for n in range(1, 17)}


def message(key, fields, t=T):
    name, _, instance = key.rstrip("]").partition("[")
    columns = {
        field: Column(lambda v=value: np.full(t.size, float(v)), Conversion(""))
        for field, value in fields.items()
    }
    number = int(instance) if instance else None
    return {key: Message(name, number, t, t, np.arange(t.size), columns)}


def rates(messages, parameters=None, autopilot="ardupilot", vehicle="quad"):
    servos = message("SERVO_OUTPUT_RAW", OUTPUTS)
    made = with_motors({**servos, **messages}, parameters or {}, autopilot, vehicle)
    return {key: float(made[key].si("rpm")[0]) for key in ROTORS if key in made}


def told(*rpm, first=1):
    return message(
        f"ESC_TELEMETRY_{first}_TO_{first + 3}", {f"rpm[{i}]": r for i, r in enumerate(rpm)}
    )


def test_a_controller_is_that_of_the_output_of_its_motor():
    moved = {f"SERVO{5 + i}_FUNCTION": 33.0 + i for i in range(4)}
    both = {**told(1, 2, 3, 4), **told(5, 6, 7, 8, first=5)}
    assert rates(both) == {"ROTOR_1": 1, "ROTOR_2": 2, "ROTOR_3": 3, "ROTOR_4": 4}
    assert rates(both, moved) == {"ROTOR_1": 5, "ROTOR_2": 6, "ROTOR_3": 7, "ROTOR_4": 8}


def test_a_motor_that_two_outputs_drive_has_no_rate():
    assert list(rates(told(1, 2, 3, 4), {"SERVO1_FUNCTION": 33.0, "SERVO5_FUNCTION": 33.0})) == [
        "ROTOR_2",
        "ROTOR_3",
        "ROTOR_4",
    ]


@pytest.mark.parametrize("rpm", [(0, 0, 0, 0), (0, 2, 0, 0)])
def test_a_controller_that_never_sees_it_turn_has_no_sensor(rpm):
    assert rates(told(*rpm)) == {f"ROTOR_{i}": r for i, r in enumerate(rpm, 1) if r}


def test_every_controller_of_a_dataflash_log_has_its_own_records():
    short = T[:30]
    own = {**message("ESC", {"RPM": 10}, short), **message("ESC[2]", {"RPM": 30})}
    made = with_motors({**message("SERVO_OUTPUT_RAW", OUTPUTS), **own}, {}, "ardupilot", "quad")
    assert made["ROTOR_1"].t.size == 30
    assert made["ROTOR_3"].t.size == T.size
    assert "ROTOR_2" not in made


def test_px4_says_itself_which_motor_a_controller_drives():
    status = {"esc[0].actuator_function": 103.0, "esc[1].actuator_function": 101.0,
              "esc[2].actuator_function": 0.0}  # fmt: skip
    messages = {**told(1, 2, 3, 4), **message("esc_status", status)}
    assert rates(messages, autopilot="px4") == {"ROTOR_1": 2, "ROTOR_3": 1}
