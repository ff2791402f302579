"""An octocopter's weak motor is named, not its neighbours: a flight made from the frame's geometry.

The outputs are what holds the vehicle level in wind, by ArduPilot's mixer and thrust curve
(``model.mixers``); of the model they know nothing.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from model.mixers import outputs
from telemetry.build import Flight, mav, record

import fdi
from fdi.model.choose import choose_model

pytestmark = pytest.mark.flights

LOW, HIGH, EXPO = 0.15, 0.95, 0.65
"""MOT_SPIN_MIN, MOT_SPIN_MAX, MOT_THST_EXPO."""
ONSET = 60.0
HEALTHY = (1.0,) * 8
SPIN = ("MOT_SPIN_MIN", LOW), ("MOT_SPIN_MAX", HIGH), ("MOT_THST_EXPO", EXPO)
FRAME = ("FRAME_CLASS", 3.0), ("FRAME_TYPE", 1.0)


@dataclass(frozen=True)
class Octocopter(Flight):
    """A flight in wind whose motors give shares ``works`` of their thrust from ``ONSET`` on."""

    kind: int = mav.MAV_TYPE_OCTOROTOR
    hover: float = 110.0
    works: tuple[float, ...] = HEALTHY
    turned: float = 0.0  # degrees
    parameters: tuple[tuple[str, float], ...] = (*FRAME, *SPIN)

    def messages(self, t, tick):
        made = super().messages(t, tick)
        at = next(i for i, m in enumerate(made) if m.get_type() == "SERVO_OUTPUT_RAW")
        flying = self.phases()[0] <= t < self.phases()[3]
        pulses = self.pulses(t) if flying else [1000] * 8
        made[at] = mav.MAVLink_servo_output_raw_message(made[at].time_usec, 0, *pulses)
        return made

    def pulses(self, t):
        wind = 0.06 * np.sin([0.31 * t, 0.23 * t + 1, 0.4 * t + 2]) * [1, 1, 0.3]
        wind += [0.1, -0.05, 0.01]  # from one side, and a propeller unlike the others
        works = self.works if t >= ONSET else HEALTHY
        thrust = outputs("octocopter", np.array(works), 0.35, self.turned, torque=wind)
        share = (np.sqrt((1 - EXPO) ** 2 + 4 * EXPO * thrust) - (1 - EXPO)) / (2 * EXPO)
        return [round(1000 + 1000 * (LOW + (HIGH - LOW) * one)) for one in share]

    def write(self, path):
        told = [
            record(0.5, mav.MAVLink_param_value_message(name.encode(), value, 9, 900, i))
            for i, (name, value) in enumerate(self.parameters)
        ]
        path.write_bytes(b"".join(sorted([*self.records(), *told], key=lambda one: one[:8])))
        return path


def weak(motor, gives=0.6):
    return tuple(gives if i == motor else 1.0 for i in range(1, 9))


def accused(flight, folder):
    found = fdi.analyze(flight.write(folder / "octa.tlog"))
    assert found.system.name == "octocopter"
    return [finding.component for finding in found.diagnosis.findings]


@pytest.mark.parametrize("motor", [3, 6])
def test_the_motor_that_gives_60_percent_is_named_and_no_neighbour(motor, tmp_path):
    assert accused(Octocopter(works=weak(motor)), tmp_path) == [f"motor_{motor}"]


def test_on_a_plus_frame_as_well(tmp_path):
    """It is the X, turned to the left until its first motor is in front."""
    plus = (FRAME[0], ("FRAME_TYPE", 0.0), *SPIN)
    flight = Octocopter(works=weak(3), turned=-22.5, parameters=plus)
    assert accused(flight, tmp_path) == ["motor_3"]


def test_where_the_motors_have_other_numbers_than_told_nobody_is_named(tmp_path):
    """What the outputs say then fits no motor: of an X that says it is numbered around."""
    around = (FRAME[0], ("FRAME_TYPE", 14.0), *SPIN)
    assert accused(Octocopter(works=weak(3), parameters=around), tmp_path) == []


def test_in_health_nobody_is_named(tmp_path):
    assert accused(Octocopter(), tmp_path) == []


def test_every_test_of_a_motor_runs(tmp_path):
    found = fdi.analyze(Octocopter().write(tmp_path / "octa.tlog"))
    names = {found.system.equations[g.residual].name for g in found.bank.generators}
    for motor in range(1, 9):
        for test in ("given_more", "output_held", "output_stopped"):
            assert f"motor_{motor}_{test}" in names


@pytest.mark.parametrize(
    ("parameters", "model"),
    [
        (FRAME, "octocopter"),
        ((), "octocopter"),  # by its MAV_TYPE alone
        ((("FRAME_CLASS", 4.0),), "octaquad"),  # two motors on each of four arms
        ((("FRAME_CLASS", 15.0),), "any_vehicle"),  # defined by a script
    ],
)
def test_the_model_is_taken_for_octocopters_with_eight_arms(parameters, model, tmp_path):
    path = Octocopter(parameters=parameters).write(tmp_path / "octa.tlog")
    assert choose_model(fdi.read(path)) == model
