"""Flights that cannot tell of their motors: nobody is accused falsely, and nothing breaks."""

from dataclasses import dataclass

import pytest
from test_octocopter import HEALTHY, ONSET, Octocopter, accused, weak

import fdi

pytestmark = pytest.mark.flights


@dataclass(frozen=True)
class Trapped(Octocopter):
    """An octocopter whose outputs do something that a model has not met."""

    trap: str = ""

    def pulses(self, t):
        own = super().pulses(t)
        match self.trap:
            case "never move":
                return [1500] * 8
            case "an unused bank":
                return [0] * 8
            case "one output is never driven":
                return [*own[:7], 0]
            case "dead from take-off":
                return Octocopter(works=weak(3, 0.3)).pulses(t + ONSET)
            case "all at their limit":
                return [2000] * 8
        return own


@pytest.mark.parametrize("trap", ["never move", "an unused bank", "one output is never driven"])
def test_outputs_that_tell_nothing_accuse_nobody(trap, tmp_path):
    assert accused(Trapped(trap=trap), tmp_path) == []


def test_all_motors_at_their_limit_accuse_no_single_one(tmp_path):
    found = accused(Trapped(trap="all at their limit"), tmp_path)
    assert not any(name.startswith("motor") for name in found)


def test_a_motor_that_was_weak_from_take_off_on_accuses_nobody_else(tmp_path):
    """It is part of what the flight's beginning identifies, unless other flights taught that."""
    assert set(accused(Trapped(trap="dead from take-off"), tmp_path)) <= {"motor_3"}


@pytest.mark.parametrize("rate", [1, 2])
def test_a_slow_log_accuses_no_other_motor(rate, tmp_path):
    found = accused(Octocopter(works=weak(3), rate=rate), tmp_path)
    assert {name for name in found if name.startswith("motor")} <= {"motor_3"}


def test_a_log_that_begins_in_the_air_accuses_no_other_motor(tmp_path):
    """The fault is then in what the beginning identifies, or after it: never another motor."""
    path = Octocopter(works=weak(3)).write(tmp_path / "octa.tlog")
    for start in (ONSET - 40, ONSET + 5):
        found = fdi.analyze(path, window=(start, 150.0))
        assert {one.component for one in found.findings} <= {"motor_3"}


def test_hover_in_still_air_accuses_nobody(tmp_path):
    @dataclass(frozen=True)
    class Still(Octocopter):
        def pulses(self, t):
            return super().pulses(10.0)

    assert accused(Still(works=HEALTHY), tmp_path) == []
