"""Which motor is weak, by the signs of the rates' residuals."""

import numpy as np
import pytest

from fdi.methods.observer.motor import motor_of
from fdi.methods.observer.vehicle import REFERENCE_QUADROTOR, mixing
from fdi.telemetry.motors import motors_of

QUAD_X = motors_of({"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0}, "ardupilot", "quad")
FRAMES = [(1.0, 1.0, "quad"), (1.0, 0.0, "quad"), (2.0, 1.0, "hexa"), (3.0, 1.0, "octa")]


@pytest.mark.parametrize(
    ("signs", "number"),
    [((1, -1, -1), 1), ((-1, 1, -1), 2), ((-1, -1, 1), 3), ((1, 1, 1), 4)],
)
def test_signs_name_the_motor_of_a_quad_x(signs, number):
    torque = np.array(signs, float) * [0.2, 0.2, 0.06]
    assert motor_of(torque, REFERENCE_QUADROTOR, QUAD_X) == number


@pytest.mark.parametrize("signs", [(1, -1, 1), (-1, 1, 1), (-1, -1, -1), (1, 1, -1)])
def test_a_turn_that_no_motor_makes_names_none(signs):
    torque = np.array(signs, float) * [0.2, 0.2, 0.06]
    assert motor_of(torque, REFERENCE_QUADROTOR, QUAD_X) is None


@pytest.mark.parametrize(("kind", "order", "vehicle"), FRAMES)
def test_what_a_motor_does_not_give_names_it_on_every_frame(kind, order, vehicle):
    motors = motors_of({"FRAME_CLASS": kind, "FRAME_TYPE": order}, "ardupilot", vehicle)
    rows = mixing(REFERENCE_QUADROTOR, motors)
    for place, motor in enumerate(motors):
        assert motor_of(-rows[1:, place], REFERENCE_QUADROTOR, motors) == motor.number


@pytest.mark.parametrize(("kind", "order", "vehicle"), FRAMES)
def test_all_arms_of_a_ring_are_as_long_as_stated(kind, order, vehicle):
    motors = motors_of({"FRAME_CLASS": kind, "FRAME_TYPE": order}, "ardupilot", vehicle)
    arms = np.hypot(*mixing(REFERENCE_QUADROTOR, motors)[1:3])
    assert np.allclose(arms, REFERENCE_QUADROTOR.arm, rtol=1e-6)
