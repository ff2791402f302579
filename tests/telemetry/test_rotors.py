"""Which controller's rate belongs to which motor, what it reports, and which have a sensor."""

import struct

import numpy as np
import pytest

from fdi.telemetry.meaning import ROTORS, with_motors
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

from .test_dataflash import fmt

T = np.arange(0.0, 10.0, 0.1)
OUTPUTS = {f"servo{n}_raw": 1500.0 for n in range(1, 17)}


def message(key, fields, t=T):
    name, _, instance = key.rstrip("]").partition("[")
    columns = {
        field: Column(lambda v=value: np.broadcast_to(np.float64(v), t.shape), Conversion(""))
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


def test_rates_are_known_where_outputs_are_not():
    made = with_motors(told(1, 2, 3, 4), {}, "ardupilot", "quad")
    assert [key for key in made if key in (*ROTORS, "MOTORS")] == list(ROTORS[:4])


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


def reported(messages, autopilot="ardupilot"):
    """Return at which times the controller of motor 1 has reported."""
    servos = message("SERVO_OUTPUT_RAW", OUTPUTS)
    return with_motors({**servos, **messages}, {}, autopilot, "quad")["ROTOR_1"].t.tolist()


FELL_SILENT = T < 6.0
RPM = np.where(FELL_SILENT, 4000.0, 0.0)
COUNT = np.where(FELL_SILENT, 10 * T, 59.0)


@pytest.mark.parametrize(
    ("rpm", "count", "last"),
    [
        (RPM, COUNT, 5.9),
        (RPM, COUNT * FELL_SILENT, 5.9),  # before 4.1 the count goes to zero as well
        (RPM, 10 * T, 9.9),  # it reports that its motor stands
        (RPM, 0 * T, 9.9),  # nobody counts: a rate by the wire of its output
        (RPM * (T > 2), 10 * T, 9.9),
        (4000.0, COUNT, 9.9),
    ],
)
def test_a_rate_of_zero_that_no_report_came_with_is_none(rpm, count, last):
    told = message("ESC_TELEMETRY_1_TO_4", {"rpm[0]": rpm, "count[0]": count})
    t = reported(told)
    assert (t[0], t[-1]) == (0.0, pytest.approx(last))
    assert len(t) == round(10 * last) + 1


def test_a_report_that_px4_repeats_is_told_once():
    stamps = {"esc[0].timestamp": np.floor(5 * np.minimum(T, 6.0) + 1e-6)}
    own = {**told(4000), **message("esc_status", stamps)}
    assert reported(own, "px4") == pytest.approx(np.arange(0.0, 6.1, 0.2))


def test_currents_are_told_where_they_are_measured():
    own = message(
        "ESC_TELEMETRY_1_TO_4",
        {"rpm[0]": 4000, "rpm[1]": 4000, "current[0]": 7.5, "current[1]": 0},
    )
    made = with_motors({**message("SERVO_OUTPUT_RAW", OUTPUTS), **own}, {}, "ardupilot", "quad")
    assert made["ROTOR_1"].si("current")[0] == 7.5
    assert "current" not in made["ROTOR_2"]


def test_controllers_that_old_firmware_numbers_in_the_name_are_read(load):
    """Until 4.0 they are ``ESC1`` to ``ESC8``."""
    out = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        fmt(20, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4"),
        fmt(21, "MSG", "QZ", "TimeUS,Message"),
        *(fmt(30 + n, f"ESC{n}", "QeCCcH", "TimeUS,RPM,Volt,Curr,Temp,CTot") for n in range(1, 5)),
    ]

    def add(number, form, *values):
        out.append(b"\xa3\x95" + bytes([number]) + struct.pack("<" + form, *values))

    add(21, "Q64s", 1_000_000, b"ArduCopter V3.6.12 (abcdef01)")
    add(21, "Q64s", 1_000_000, b"Frame: QUAD")
    for i in range(50):
        t = 1_000_000 + 100_000 * i
        add(20, "QHHHH", t, 1500, 1501, 1502, 1503)
        for n in range(1, 5):
            add(30 + n, "QiHHhH", t, 100 * 1000 * n, 1600, 250 * n, 3000, 12)
    log = load(b"".join(out))
    rates = [float(log[f"ROTOR_{n}"].si("rpm")[0]) * 30 / np.pi for n in range(1, 5)]
    assert rates == pytest.approx([1000.0, 2000.0, 3000.0, 4000.0])
    assert [float(log[f"ROTOR_{n}"].si("current")[0]) for n in (1, 4)] == [2.5, 10.0]
