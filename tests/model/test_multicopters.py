"""What the multicopter models say of outputs, against the geometry of ArduPilot's frames."""

import re
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.model.expression import Number, Symbol, symbols, to_text
from fdi.model.parts import Kind
from fdi.telemetry.motors import motors_of

from .mixers import FRAMES, asked, mixer, outputs

MOTORS = [(name, k) for name, (angles, _) in FRAMES.items() for k in range(1, len(angles) + 1)]
EACH_MOTOR = pytest.mark.parametrize(("name", "motor"), MOTORS)
NONE = Number(1.0)
model = cache(load_airframe)


def computed(name, given, wanted):
    """Compute variables of a model from others by its equations, each solved for its left side."""
    relations = [e for e in model(name).equations if e.kind is Kind.RELATION]
    by_left = {e.left.name: e for e in relations if isinstance(e.left, Symbol)}
    columns = {k: np.float64(p.value) for k, p in model(name).parameters.items()}
    columns |= {k: np.atleast_1d(np.asarray(v, float)) for k, v in given.items()}

    def column(variable):
        if variable not in columns:
            equation = by_left[variable]
            for needed in set(symbols(equation.right)):
                column(needed)
            columns[variable] = evaluate(equation.right, columns)
        return columns[variable]

    return {variable: float(np.ravel(column(variable))[0]) for variable in wanted}


def extras(name, u, mix=None):
    """What motors are given beyond their share, by the mixer of the model or another one."""
    count = len(FRAMES[name][0])
    given = {f"thrust_{i}": u[i - 1] for i in range(1, count + 1)}
    if mix is not None:
        for place, axis in enumerate(("roll", "pitch", "yaw"), 1):
            given |= {f"mix_{axis}_{i}": mix[i - 1, place] for i in range(1, count + 1)}
    return np.array(
        list(computed(name, given, [f"extra_{i}" for i in range(1, count + 1)]).values())
    )


@EACH_MOTOR
@pytest.mark.parametrize("gives", [0.8, 0.6])
@pytest.mark.parametrize("turned", [0.0, 45.0])
def test_of_a_weak_motor_alone_it_is_said_that_it_is_given_more(name, motor, gives, turned):
    works = np.ones(len(FRAMES[name][0]))
    works[motor - 1] = gives
    mix = mixer(name, turned) if turned else None
    found = extras(name, outputs(name, works, turned=turned), mix)
    assert np.argmax(found) == motor - 1
    assert found[motor - 1] > 0.05
    assert (np.delete(found, motor - 1) < 0.02).all()


def mixer_of(frame_type):
    told = {"FRAME_CLASS": 1.0, "FRAME_TYPE": float(frame_type)}
    motors = motors_of(told, "ardupilot", "quad")
    return np.array([[1.0, motor.roll, motor.pitch, motor.yaw] for motor in motors])


@pytest.mark.parametrize("motor", [1, 2, 3, 4])
@pytest.mark.parametrize("frame_type", [0, 1, 3, 12, 13, 14])
def test_motors_of_another_order_are_judged_by_their_own_geometry(frame_type, motor):
    """Betaflight 12, DJI 13, clockwise 14: there another motor stands opposite."""
    mix, works = mixer_of(frame_type), np.ones(4)
    works[motor - 1] = 0.7
    found = extras("quadcopter", asked(mix, works), mix)
    assert np.argmax(found) == motor - 1
    assert (np.delete(found, motor - 1) < 0.02).all()


@pytest.mark.parametrize("motor", range(1, 9))
@pytest.mark.parametrize("gives", [0.8, 0.6])
def test_of_two_motors_on_one_arm_the_weak_one_is_told_by_its_yaw(gives, motor):
    """Of an octaquad, whose motors 1 and 6 share an arm; for a model of one's own."""
    motors = motors_of({"FRAME_CLASS": 4.0, "FRAME_TYPE": 1.0}, "ardupilot", "other")
    mix = np.array([[1.0, one.roll, one.pitch, one.yaw] for one in motors])
    works = np.ones(8)
    works[motor - 1] = gives
    found = extras("octocopter", asked(mix, works), mix)
    assert np.argmax(found) == motor - 1
    assert (np.delete(found, motor - 1) < 0.02).all()


def test_a_motor_that_makes_no_yaw_is_not_judged_by_it():
    """The front motors of a V-tail: nothing is said of them rather than something wrong."""
    mix = mixer_of(4)
    found = extras("quadcopter", mix @ [0.4, 0.0, 0.0, 0.02], mix)
    assert np.isnan(found[mix[:, 3] == 0]).all()


@pytest.mark.parametrize("name", FRAMES)
@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.3, 0.7))
def test_wind_that_asks_for_tilt_alone_makes_no_motor_weak(name, roll, pitch, thrust):
    mix = mixer(name)
    assert (extras(name, mix @ [thrust, roll, pitch, 0.0]) < 1e-9).all()


@pytest.mark.parametrize("name", FRAMES)
@given(st.floats(-0.1, 0.1), st.floats(0.3, 0.7))
def test_yaw_alone_makes_no_motor_weak(name, yaw, thrust):
    assert (extras(name, mixer(name) @ [thrust, 0.0, 0.0, yaw]) < 1e-9).all()


@EACH_MOTOR
def test_an_output_that_stands_still_among_moving_ones_is_stuck_and_no_other(name, motor):
    count = len(FRAMES[name][0])
    given = {f"u_{i}": 0.3 + 0.3 * i / count for i in range(1, count + 1)}
    given |= {f"held_{i}": 0.05 for i in range(1, count + 1)} | {f"held_{motor}": 3.0}
    given |= {f"moves_{i}": 1.0 for i in range(1, count + 1)} | {f"moves_{motor}": 0.0}
    found = computed(name, given, [f"stuck_{i}" for i in range(1, count + 1)])
    assert found.pop(f"stuck_{motor}") == 3.0
    assert max(found.values()) <= 0.05


@pytest.mark.parametrize("name", FRAMES)
def test_outputs_that_all_stand_still_are_not_stuck(name):
    """A log that shows outputs once a second, or a vehicle that waits."""
    count = len(FRAMES[name][0])
    given = {f"u_{i}": 0.3 + 0.3 * i / count for i in range(1, count + 1)}
    given |= {f"held_{i}": 3.0 for i in range(1, count + 1)}
    given |= {f"moves_{i}": 0.0 for i in range(1, count + 1)} | {"moves_1": 1.0}
    assert set(computed(name, given, [f"stuck_{i}" for i in range(1, count + 1)]).values()) == {0.0}


@EACH_MOTOR
def test_an_output_is_told_against_the_mean_of_all(name, motor):
    count = len(FRAMES[name][0])
    opposite = motor + 1 if motor % 2 else motor - 1  # taken back, as it would turn the vehicle
    given = {f"u_{i}": 0.6 for i in range(1, count + 1)} | {f"u_{motor}": 0.02}
    given[f"u_{opposite}"] = 0.2
    found = computed(name, given, [f"idle_{i}" for i in range(1, count + 1)])
    mean = (0.6 * (count - 2) + 0.22) / count
    assert found[f"idle_{motor}"] == pytest.approx(0.02 / mean)
    other = next(i for i in range(1, count + 1) if i not in (motor, opposite))
    assert found[f"idle_{other}"] > 0.5


@EACH_MOTOR
def test_an_output_is_taken_back_by_the_controller_only_where_its_opposite_gives_the_double(
    name, motor
):
    angles = FRAMES[name][0]
    (opposite,) = (k for k, angle in enumerate(angles, 1) if abs(angle - angles[motor - 1]) == 180)
    for busy in set(range(1, len(angles) + 1)) - {motor}:
        given = {f"u_{i}": 0.3 for i in range(1, len(angles) + 1)}
        given |= {f"u_{busy}": 0.6, f"u_{motor}": 0.0}
        own = computed(name, given, [f"own_{motor}"])[f"own_{motor}"]
        assert own == (1.0 if busy == opposite else 0.0)


@pytest.mark.parametrize("name", FRAMES)
def test_where_no_frame_is_told_the_motors_are_those_of_the_x(name):
    mix = mixer(name)[:, 1:3]
    values = {k: p.value for k, p in model(name).parameters.items() if k.startswith("mix_")}
    for place, axis in enumerate(("roll", "pitch")):
        told = [values[f"mix_{axis}_{i}"] for i in range(1, len(mix) + 1)]
        assert told == pytest.approx(mix[:, place] / abs(mix[:, place]).max())
    turns = np.array([values[f"mix_yaw_{i}"] for i in range(1, len(mix) + 1)])
    assert abs(turns @ mixer(name)[:, 3]) == len(mix)


@EACH_MOTOR
def test_every_motor_has_the_same_statements_limits_and_effects(name, motor):
    """The model is the same for each motor, but for the numbers."""
    airframe = model(name)

    def of(number):
        own = [e for e in airframe.equations if e.component == f"motor_{number}"]

        def named(text):
            return re.sub(r"_\d+", "_N", text)

        return [
            (named(e.name), e.kind, e.tolerance, e.offset, e.side, named(to_text(e.when or NONE)))
            for e in own
        ]

    assert of(motor) == of(1)
    component, first = (airframe.components[f"motor_{i}"] for i in (motor, 1))
    assert (component.group, component.affects) == (first.group, first.affects)
