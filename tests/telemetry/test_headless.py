"""DataFlash logs that have lost their head: no greeting, some of the parameters or none."""

import pytest

from fdi.telemetry import read


def _lines(parameters, fields, outputs):
    yield "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"
    yield "FMT, 129, 23, PARM, QNf, TimeUS,Name,Value"
    yield f"FMT, 4, 20, CTUN, QfH, TimeUS,ThI,{fields}"
    channels = ",".join(f"C{i + 1}" for i in range(8))
    yield f"FMT, 5, 30, RCOU, QHHHHHHHH, TimeUS,{channels}"
    yield from (f"PARM, 1000000, {name}, {value}" for name, value in parameters.items())
    for i in range(40):
        yield f"CTUN, {1000000 + 100000 * i}, 0.5, 1"
        given = [rest if i < 10 else flies for rest, flies in outputs]
        given += [0] * (8 - len(given))
        yield f"RCOU, {1000000 + 100000 * i}, " + ", ".join(map(str, given))


MOTOR, SERVO, THRUSTER = (1000, 1500), (1500, 1550), (1500, 1700)


@pytest.mark.parametrize(
    ("parameters", "field", "outputs", "vehicle"),
    [
        ({"RATE_RLL_P": 0.15}, "AngBst", (), "quad"),
        ({"FRAME_CLASS": 2, "MOT_SPIN_ARM": 0.1}, "ABst", (), "hexa"),
        ({"ATC_RAT_RLL_P": 0.1, "H_SWASH_TYPE": 0}, "ABst", (), "helicopter"),
        ({"ATC_RAT_RLL_P": 0.1, "JS_GAIN_DEFAULT": 0.5}, "ABst", (), "sub"),
        ({"RLL2SRV_TCONST": 0.5}, "NavRoll", (), "plane"),
        ({"RLL2SRV_TCONST": 0.5, "ATC_RAT_RLL_P": 0.1, "Q_ENABLE": 1}, "NavRoll", (), "vtol"),
        ({"ATC_STR_RAT_P": 0.2}, "ABst", (), "rover"),
        ({"SYSID_THISMAV": 1}, "ABst", [MOTOR] * 4, "other"),  # parameters, and none that tells
        ({}, "NavRoll", [SERVO, SERVO, MOTOR, SERVO], "plane"),
        ({}, "ABst", [MOTOR] * 4, "quad"),
        ({}, "AngBst", [MOTOR] * 6 + [SERVO], "hexa"),
        ({}, "ABst", [MOTOR] * 5, "other"),
        ({}, "ABst", [THRUSTER] * 6, "other"),  # a submarine records the same
        ({}, "Unknown", [MOTOR] * 4, "other"),
    ],
)
def test_the_vehicle_is_known_without_its_greeting(tmp_path, parameters, field, outputs, vehicle):
    path = tmp_path / "headless.log"
    path.write_text("\n".join(_lines(parameters, field, outputs)))
    assert read(path).vehicle == vehicle


def _in_the_air(outputs, height):
    """Yield a log without parameters that begins in the air; of each output how often it moves."""
    yield "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"
    yield "FMT, 4, 24, CTUN, Qfff, TimeUS,ThI,ABst,Alt"
    yield f"FMT, 5, 30, RCOU, QHHHHHHHH, TimeUS,{','.join(f'C{i + 1}' for i in range(8))}"
    for i in range(60):
        at = 1000000 + 100000 * i
        yield f"CTUN, {at}, 0.5, 0, {height}"
        given = [1500 + i % 2 if i % every == 0 else 1500 for every in outputs]
        yield f"RCOU, {at}, " + ", ".join(map(str, given + [0] * (8 - len(given))))


@pytest.mark.parametrize(
    ("outputs", "height", "vehicle"),
    [
        ([1] * 4, 12.0, "quad"),
        ([1] * 6, 12.0, "hexa"),
        ([1] * 8, 12.0, "octa"),
        ([1, 1, 60, 1], 12.0, "quad"),  # one has failed
        ([1] * 4 + [5, 7], 12.0, "quad"),  # and a gimbal
        ([1] * 6, -3.0, "other"),  # a submarine
        ([1] * 5, 12.0, "other"),
        ([1, 60, 60, 1], 12.0, "other"),
    ],
)
def test_a_copter_that_flies_from_the_first_record_on_is_known_by_its_outputs(
    tmp_path, outputs, height, vehicle
):
    path = tmp_path / "late.log"
    path.write_text("\n".join(_in_the_air(outputs, height)))
    assert read(path).vehicle == vehicle
