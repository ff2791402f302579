"""A quadplane in hover: its lifting motors are judged, by its frame, where there is little wind.

The outputs are what holds it level by ArduPilot's mixer and thrust curve (``model.mixers``).
"""

from dataclasses import dataclass

import numpy as np
import pytest
from model.mixers import outputs
from telemetry.build import Flight, mav, record

import fdi

pytestmark = pytest.mark.flights

LOW, HIGH, EXPO = 0.15, 0.95, 0.65
ONSET = 60.0
HEALTHY = (1.0,) * 4
FRAME = ("Q_ENABLE", 1.0), ("Q_FRAME_CLASS", 1.0), ("Q_FRAME_TYPE", 1.0)
WIRING = tuple((f"SERVO{5 + i}_FUNCTION", 33.0 + i) for i in range(4))
SPIN = ("Q_M_SPIN_MIN", LOW), ("Q_M_SPIN_MAX", HIGH), ("Q_M_THST_EXPO", EXPO)
CRUISE = ("AIRSPEED_CRUISE", 20.0)
ROTORS, WINGS = 3, 4  # MAV_VTOL_STATE


@dataclass(frozen=True)
class Quadplane(Flight):
    """A hover in wind whose motors give shares ``works`` of their thrust from ``ONSET`` on."""

    kind: int = mav.MAV_TYPE_VTOL_QUADROTOR
    hover: float = 110.0
    works: tuple[float, ...] = HEALTHY
    fin: float = 0.0  # yaw from ONSET on that wind makes, of a motor's thrust
    airspeed: float = 2.0
    state: int = ROTORS
    parameters: tuple[tuple[str, float], ...] = (*FRAME, *WIRING, *SPIN, CRUISE)

    def messages(self, t, tick):
        made = super().messages(t, tick)
        names = [m.get_type() for m in made]
        flying = self.phases()[0] <= t < self.phases()[3]
        pulses = self.pulses(t) if flying else [1000] * 4
        servos, hud = names.index("SERVO_OUTPUT_RAW"), names.index("VFR_HUD")
        made[servos] = mav.MAVLink_servo_output_raw_message(
            made[servos].time_usec, 0, 1500, 1500, 1000, 1500, *pulses
        )
        made[hud].airspeed = self.airspeed if flying else 0.0
        return [*made, mav.MAVLink_extended_sys_state_message(self.state, 2 if flying else 1)]

    def pulses(self, t):
        wind = 0.06 * np.sin([0.31 * t, 0.23 * t + 1, 0.4 * t + 2]) * [1, 1, 0.3]
        wind += [0.1, -0.05, 0.01]
        wind += [0, 0, self.fin * (t >= ONSET)]
        works = self.works if t >= ONSET else HEALTHY
        thrust = np.maximum(outputs("quadcopter", np.array(works), 0.3, torque=wind), 0)
        share = (np.sqrt((1 - EXPO) ** 2 + 4 * EXPO * thrust) - (1 - EXPO)) / (2 * EXPO)
        return [round(1000 + 1000 * (LOW + (HIGH - LOW) * one)) for one in share]

    def write(self, path):
        told = [
            record(0.5, mav.MAVLink_param_value_message(name.encode(), value, 9, 900, i))
            for i, (name, value) in enumerate(self.parameters)
        ]
        path.write_bytes(b"".join(sorted([*self.records(), *told], key=lambda one: one[:8])))
        return path


def analysed(flight, folder):
    found = fdi.analyze(flight.write(folder / "quadplane.tlog"))
    assert found.system.name == "vtol"
    return found


def accused(found):
    return [finding.component for finding in found.diagnosis.findings]


def weak(motor, gives=0.35):
    return tuple(gives if i == motor else 1.0 for i in range(1, 5))


@pytest.mark.parametrize("motor", [1, 4])
def test_a_lifting_motor_that_gives_a_third_is_named_in_hover(motor, tmp_path):
    """It is on output 4 + n, where the log says so."""
    found = analysed(Quadplane(works=weak(motor)), tmp_path)
    assert set(accused(found)) == {f"motor_{motor}"}
    assert ONSET < found.diagnosis.findings[0].onset < ONSET + 3


@pytest.mark.parametrize("fin", [0.0, 1.2, -1.2])
def test_wind_on_its_fin_is_no_fault_of_a_motor(fin, tmp_path):
    """Even if it takes so much yaw that two motors are stopped for it."""
    assert accused(analysed(Quadplane(fin=fin), tmp_path)) == []


def test_in_wind_the_moments_of_lifting_motors_are_not_judged(tmp_path):
    assert accused(analysed(Quadplane(works=weak(1), airspeed=6.0), tmp_path)) == []


def test_on_its_wings_no_lifting_motor_is_judged(tmp_path):
    found = analysed(Quadplane(works=weak(1), state=WINGS), tmp_path)
    told = {one.component: one.text for one in found.diagnosis.not_testable}
    assert accused(found) == []
    assert told["motor_1"] == "its tests hold on rotors only, which never carried it for long"


def test_of_a_hover_it_is_told_that_wings_were_not_tested(tmp_path):
    found = analysed(Quadplane(), tmp_path)
    told = {one.component: one.text for one in found.diagnosis.not_testable}
    assert told["engine"] == "its tests hold on wings only, which never carried it for long"


@pytest.mark.parametrize(
    "parameters",
    [
        (*FRAME, *SPIN, CRUISE),  # the outputs are not told
        (*WIRING, *SPIN, CRUISE, FRAME[0]),  # the frame is not told
        (*FRAME, *WIRING, *SPIN, CRUISE, ("Q_TILT_MASK", 3.0)),  # motors that tilt
    ],
)
def test_motors_that_the_log_does_not_place_are_not_judged_and_it_says_so(parameters, tmp_path):
    found = analysed(Quadplane(works=weak(1), parameters=parameters), tmp_path)
    assert accused(found) == []
    assert any(
        "nothing is said" in one or "none of them is judged" in one for one in found.warnings
    )
    assert "motors stand and turn as in the model" not in " ".join(found.warnings)
    assert "motor_1" in {one.component for one in found.diagnosis.not_testable}
