"""Motors above each other: a weak one is named, by the yaw, and not the one on its arm.

The outputs are what holds the vehicle level in wind, by ArduPilot's mixers (AP_MotorsMatrix.cpp),
which stand here once more.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from model.mixers import asked
from telemetry.build import Flight, mav, record

import fdi

pytestmark = pytest.mark.flights

EXPO = 0.65
ONSET = 60.0
# roll, pitch, yaw of every motor
OCTAQUAD = np.array([[-1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, -1, -1],
                     [1, 1, 1], [-1, 1, -1], [-1, -1, 1], [1, -1, -1]])  # fmt: skip
Y6B = np.array([[-1, 0.5, -1], [-1, 0.5, 1], [0, -1, -1], [0, -1, 1], [1, 0.5, -1], [1, 0.5, 1]])
FRAMES = {
    "octaquad": (mav.MAV_TYPE_OCTOROTOR, 4.0, 1.0, OCTAQUAD),
    "y6": (mav.MAV_TYPE_HEXAROTOR, 5.0, 10.0, Y6B),
}


@dataclass(frozen=True)
class Coaxial(Flight):
    """A flight in wind of which ``motor`` gives a share ``works`` of its thrust from ``ONSET``."""

    frame: str = "octaquad"
    hover: float = 110.0
    motor: int = 1
    works: float = 1.0

    def messages(self, t, tick):
        made = super().messages(t, tick)
        at = next(i for i, m in enumerate(made) if m.get_type() == "SERVO_OUTPUT_RAW")
        flying = self.phases()[0] <= t < self.phases()[3]
        factors = FRAMES[self.frame][3]
        pulses = self.pulses(t, factors) if flying else [1000] * len(factors)
        pulses += [0] * (8 - len(pulses))
        made[at] = mav.MAVLink_servo_output_raw_message(made[at].time_usec, 0, *pulses)
        return made

    def pulses(self, t, factors):
        wind = 0.06 * np.sin([0.31 * t, 0.23 * t + 1, 0.4 * t + 2]) * [1, 1, 0.3]
        wind += [0.1, -0.05, 0.01]
        works = np.ones(len(factors))
        works[self.motor - 1] = self.works if t >= ONSET else 1.0
        mix = np.column_stack([np.ones(len(factors)), factors])
        thrust = asked(mix, works, 0.35, wind)
        share = (np.sqrt((1 - EXPO) ** 2 + 4 * EXPO * thrust) - (1 - EXPO)) / (2 * EXPO)
        return [round(1000 + 1000 * one) for one in share]

    def analysed(self, folder):
        _, kind, order, _ = FRAMES[self.frame]
        told = {"FRAME_CLASS": kind, "FRAME_TYPE": order, "MOT_SPIN_MIN": 0.0, "MOT_SPIN_MAX": 1.0,
                "MOT_THST_EXPO": EXPO}  # fmt: skip
        parameters = [
            record(0.5, mav.MAVLink_param_value_message(name.encode(), value, 9, 900, i))
            for i, (name, value) in enumerate(told.items())
        ]
        path = folder / "coaxial.tlog"
        path.write_bytes(b"".join(sorted([*self.records(), *parameters], key=lambda r: r[:8])))
        return fdi.analyze(path)


def flight(frame, **changes):
    return Coaxial(frame=frame, kind=FRAMES[frame][0], **changes)


@pytest.mark.parametrize(
    ("frame", "motor"), [("octaquad", 1), ("octaquad", 6), ("y6", 3), ("y6", 6)]
)
def test_the_weak_one_of_two_motors_on_an_arm_is_named(frame, motor, tmp_path):
    found = flight(frame, motor=motor, works=0.6).analysed(tmp_path)
    assert found.system.name == frame
    assert {finding.component for finding in found.diagnosis.findings} == {f"motor_{motor}"}
    assert ONSET < found.diagnosis.findings[0].onset < ONSET + 3


@pytest.mark.parametrize("frame", FRAMES)
def test_in_health_nobody_is_named(frame, tmp_path):
    found = flight(frame).analysed(tmp_path)
    assert found.diagnosis.findings == ()
    names = {found.system.equations[g.residual].name for g in found.bank.generators}
    assert "motor_1_given_more" in names
    assert not [name for name in names if "output_stopped" in name]
