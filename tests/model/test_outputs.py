"""Motors on outputs of another number, and vehicles without a model of their own, are told."""

import math

import pytest
from telemetry.build import Flight, mav, record

import fdi
from fdi.model.outputs import moved_motors


@pytest.mark.parametrize(
    ("functions", "moved"),
    [
        ({1: 33, 2: 34, 3: 35, 4: 36}, {}),
        ({1: 34, 2: 33, 3: 35, 4: 36}, {1: 2, 2: 1}),
        ({1: 0, 5: 33, 6: 34, 13: 82, 9: 83}, {1: 5, 2: 6, 9: 13, 10: 9}),
        ({1: 70, 2: math.nan, 3: math.inf}, {}),
    ],
)
def test_motors_on_outputs_of_another_number_are_found(functions, moved):
    for prefix in ("SERVO", "RC"):
        named = {f"{prefix}{n}_FUNCTION": float(what) for n, what in functions.items()}
        assert moved_motors({**named, "SERVO1_FUNCTIONS": 40.0, "SERVO99999_MIN": 33.0}) == moved


def sent(t: float, output: int, function: int) -> bytes:
    name = f"SERVO{output}_FUNCTION".encode()
    return record(t, mav.MAVLink_param_value_message(name, float(function), 9, 900, output))


def warnings_of(path, *, kind: int, functions: dict[int, int], later: dict[int, int]) -> str:
    flight = Flight(kind=kind).records()
    functions = [sent(0.5, *pair) for pair in functions.items()]
    changes = [sent(9.0, *pair) for pair in later.items()]
    parts = sorted([*flight, *functions, *changes], key=lambda part: part[:8])
    path.write_bytes(b"".join(parts))
    return " / ".join(fdi.analyze(path).warnings)


def test_only_what_was_set_before_the_flight_says_where_a_motor_is(tmp_path):
    """A function that is changed in flight stops an output, and does not move a motor."""
    kind, path = mav.MAV_TYPE_QUADROTOR, tmp_path / "quad.tlog"
    wired = {1: 33, 2: 34, 3: 36, 4: 35}
    told = warnings_of(path, kind=kind, functions=wired, later={1: 0, 2: 33})
    assert "motor 3 is on output 4, motor 4 is on output 3" in told
    assert "motor 1 is" not in told
    assert "no shipped model" not in told


def test_vehicle_without_a_model_of_its_own_is_told(tmp_path):
    kind = mav.MAV_TYPE_OCTOROTOR
    told = warnings_of(tmp_path / "octa.tlog", kind=kind, functions={1: 34}, later={})
    assert "no shipped model is made for a vehicle of type octa" in told
    assert "output" not in told
