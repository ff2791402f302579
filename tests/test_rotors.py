"""What motor controllers say of how fast motors turn: flights made here, and one recorded.

The rates follow the outputs as propellers do (thrust as the square of the rate); of the model they
know nothing.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from flights import SHARED
from telemetry.build import Flight, mav

import fdi

pytestmark = pytest.mark.flights

ONSET = 60.0
HOVER, MOST = 0.45, 1200.0
"""Output as a share of its range; rate at full output, rad/s."""
ALL = (1, 2, 3, 4)
RPM = 60 / (2 * np.pi)
SAID = ("stands_still", "turns_otherwise", "draws_otherwise", "is_silent")
"""The statements about a motor by its controller."""


@dataclass(frozen=True)
class Turning(Flight):
    """A flight in wind whose controllers say how fast their motors turn.

    From ``ONSET`` on ``motor`` turns at ``turns`` of the rate that its output gives, for ``draws``
    of the current that its rate takes; the controllers ``silent`` report nothing any more.
    """

    hover: float = 110.0
    motor: int = 3
    turns: float = 1.0
    told: tuple[int, ...] = ALL
    every: int = 1  # records of the outputs for one of the rates
    down_too: float = 0.0  # of its output that the autopilot takes away with it
    draws: float = 1.0
    measures: bool = False  # currents
    silent: tuple[int, ...] = ()
    counts: bool = False  # the reports

    def outputs(self, t):
        wind = 0.06 * np.sin([0.31 * t, 0.31 * t + np.pi, 0.4 * t + 2, 0.4 * t + 2 + np.pi])
        own = HOVER + wind + [0.02, -0.02, 0.01, -0.01]
        own[self.motor - 1] *= 1 - self.down_too * (t >= ONSET)
        return own

    def messages(self, t, tick):
        made = super().messages(t, tick)
        at = next(i for i, m in enumerate(made) if m.get_type() == "SERVO_OUTPUT_RAW")
        flying = self.phases()[0] <= t < self.phases()[3]
        own = self.outputs(t) if flying else np.zeros(4)
        pulses = [round(1000 + 1000 * u) for u in own]
        made[at] = mav.MAVLink_servo_output_raw_message(made[at].time_usec, 0, *pulses, *[0] * 4)
        if tick % self.every:
            return made
        rates = MOST * np.sqrt(0.35 * own + 0.65 * own**2) * [1.02, 0.98, 1.0, 0.99]
        failed = t >= ONSET
        if failed:
            rates[self.motor - 1] *= self.turns
        told = [i for i in self.told if not (failed and i in self.silent)]
        rpm = [round(r * RPM) if i in told else 0 for i, r in enumerate(rates, 1)]
        currents = [0] * 4
        if self.measures:
            noise = 1 + 0.3 * np.sin(7.0 * tick + np.arange(4))  # one of these is no mean
            drawn = 20.0 * (rates / MOST) ** 3 * noise * [1.1, 0.9, 1.0, 1.0]
            drawn[self.motor - 1] *= self.draws if failed else 1.0
            drawn += [0.0, 0.2, 0.4, 0.1]  # their zeros
            currents = [round(100 * c) if i in told else 0 for i, c in enumerate(drawn, 1)]
        last = int(ONSET * self.rate) - 1
        counts = [min(tick, last) if i in self.silent else tick for i in ALL]
        none = [0] * 4
        said = mav.MAVLink_esc_telemetry_1_to_4_message(
            none, none, currents, none, rpm, counts if self.counts else none
        )
        return [*made, said]

    def analysed(self, folder):
        path = folder / "turning.tlog"
        path.write_bytes(self.bytes())
        return fdi.analyze(path)


def accused(found):
    return [finding.component for finding in found.diagnosis.findings]


def alarmed(found):
    """Return the statements that tests in alarm are about."""
    equations, rows = found.system.equations, found.alarms.alarm.any(axis=1)
    return {
        equations[g.residual].name
        for g, alarm in zip(found.bank.generators, rows, strict=True)
        if alarm
    }


@pytest.mark.parametrize("motor", ALL)
def test_a_motor_that_its_controller_stops_is_named_soon(motor, tmp_path):
    found = Turning(motor=motor, turns=0.0).analysed(tmp_path)
    assert accused(found) == [f"motor_{motor}"]
    assert ONSET - 0.5 < found.diagnosis.findings[0].onset < ONSET + 0.5
    assert found.diagnosis.findings[0].alarm < ONSET + 1.25


def test_at_one_record_a_second_a_stopped_motor_is_named(tmp_path):
    found = Turning(turns=0.0, every=5).analysed(tmp_path)
    assert accused(found) == ["motor_3"]
    assert found.diagnosis.findings[0].alarm < ONSET + 5.0


@pytest.mark.parametrize("turns", [0.8, 1.25])
def test_a_motor_that_turns_otherwise_for_its_output_is_named(turns, tmp_path):
    """A propeller that broke lets it turn faster, a bearing slower."""
    found = Turning(turns=turns).analysed(tmp_path)
    assert accused(found) == ["motor_3"]
    assert ONSET - 1 < found.diagnosis.findings[0].onset < ONSET + 2


@pytest.mark.parametrize(
    "flight",
    [
        Turning(),
        Turning(every=5),
        Turning(measures=True, counts=True),
        Turning(measures=True, down_too=0.8),
        Turning(turns=0.0, down_too=0.9),  # told to stop, and so it does: it obeys
    ],
)
def test_motors_that_turn_as_they_are_told_raise_no_alarm_by_their_controllers(flight, tmp_path):
    assert not [name for name in alarmed(flight.analysed(tmp_path)) if name.endswith(SAID)]


@pytest.mark.parametrize("told", [(), (2,), (1, 2, 3)])
def test_without_the_rates_of_all_others_nothing_is_said(told, tmp_path):
    """No sensor at all, or some controllers only, which say zero."""
    found = Turning(turns=0.0, told=told).analysed(tmp_path)
    assert {f"ROTOR_{i}" for i in told} == {k for k in found.log.messages if "ROTOR" in k}
    assert accused(found) == []


@pytest.mark.parametrize("motor", ALL)
def test_a_motor_that_lost_its_propeller_is_named_by_its_current(motor, tmp_path):
    """Its controller keeps the rate that it is told: only the current tells."""
    found = Turning(motor=motor, measures=True, draws=0.15).analysed(tmp_path)
    assert accused(found) == [f"motor_{motor}"]
    assert ONSET - 1 < found.diagnosis.findings[0].onset < ONSET + 3


def test_currents_of_propellers_that_are_a_little_unlike_accuse_nobody(tmp_path):
    found = Turning(measures=True, draws=0.8).analysed(tmp_path)
    assert not [name for name in alarmed(found) if "draws_otherwise" in name]


def test_a_controller_that_falls_silent_is_told_and_accuses_no_motor(tmp_path):
    """Its motor may turn as before: a rate of 0 that no report came with is no rate."""
    found = Turning(silent=(3,), counts=True).analysed(tmp_path)
    assert "motor_3_is_silent" in alarmed(found)
    assert accused(found) == []


@pytest.mark.parametrize("silent", [(1, 2), ALL])
def test_of_controllers_that_fall_silent_together_no_motor_is_suspected(silent, tmp_path):
    found = Turning(silent=silent, counts=True).analysed(tmp_path)
    assert not [name for name in alarmed(found) if "is_silent" in name or "stands" in name]


def test_a_controller_that_reports_that_its_motor_stands_is_believed(tmp_path):
    found = Turning(turns=0.0, counts=True).analysed(tmp_path)
    assert accused(found) == ["motor_3"]


RECORDED = SHARED / "crash" / "motors_cut_in_air.ulg"


@pytest.mark.skipif(not RECORDED.is_file(), reason="no ../shared")
def test_recorded_motors_turn_as_they_are_told():
    found = fdi.analyze(RECORDED)
    equations, alarms = found.system.equations, found.alarms
    for row, generator in enumerate(found.bank.generators):
        name = equations[generator.residual].name
        if name.startswith("motor_") and name.endswith(SAID):
            assert (alarms.state[row] == 0).any()
            assert not alarms.alarm[row].any()
