"""Motors on outputs of another number, and vehicles without a model of their own, are told."""

import pytest
from telemetry.build import Flight, mav, record

import fdi


def sent(t: float, output: int, function: int) -> bytes:
    name = f"SERVO{output}_FUNCTION".encode()
    return record(t, mav.MAVLink_param_value_message(name, float(function), 9, 900, output))


def analysed(path, *, kind: int, functions: dict[int, int], later: dict[int, int]) -> fdi.Analysis:
    flight = Flight(kind=kind).records()
    functions = [sent(0.5, *pair) for pair in functions.items()]
    changes = [sent(9.0, *pair) for pair in later.items()]
    parts = sorted([*flight, *functions, *changes], key=lambda part: part[:8])
    path.write_bytes(b"".join(parts))
    return fdi.analyze(path)


def test_only_what_was_set_before_the_flight_says_where_a_motor_is(tmp_path):
    """A function that is changed in flight stops an output, and does not move a motor."""
    kind, path = mav.MAV_TYPE_QUADROTOR, tmp_path / "quad.tlog"
    wired = {1: 33, 2: 34, 3: 36, 4: 35}
    found = analysed(path, kind=kind, functions=wired, later={1: 0, 2: 33})
    motors, servos = (found.log[name] for name in ("MOTORS", "SERVO_OUTPUT_RAW"))
    for motor, output in {1: 1, 2: 2, 3: 4, 4: 3}.items():
        share = (servos.si(f"servo{output}_raw") - 1000) / 1000
        assert motors.si(f"motor_{motor}") == pytest.approx(share)
    told = " / ".join(found.warnings)
    assert "output" not in told
    assert "no shipped model" not in told


def test_a_motor_on_two_outputs_is_told(tmp_path):
    """Nobody says which of them it is, and what needs it is left out."""
    kind, wired = mav.MAV_TYPE_QUADROTOR, {1: 33, 2: 34, 3: 33, 4: 36}
    found = analysed(tmp_path / "quad.tlog", kind=kind, functions=wired, later={})
    told = " / ".join(found.warnings)
    assert "SERVO1_FUNCTION and SERVO3_FUNCTION are both motor 1: nothing is said of" in told
    assert "no output is motor 3: nothing is said of what it is given" in told
    equations = found.system.equations
    assert not {"mot_0", "thr_0", "bal_roll", "bal_yaw"} & {e.name for e in equations}
    used = {equations[i].name for g in found.bank.generators for i in g.equations}
    assert not {"ext_1", "ext_2", "idl_1", "motor_1_given_more"} & used


def test_vehicle_without_a_model_of_its_own_is_told(tmp_path):
    kind = mav.MAV_TYPE_HELICOPTER
    found = analysed(tmp_path / "heli.tlog", kind=kind, functions={1: 34}, later={})
    told = " / ".join(found.warnings)
    assert "no shipped model is made for a vehicle of type helicopter" in told
    assert "output" not in told
