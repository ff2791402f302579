"""A blow is what ends a fall: also one that a spin's own force hides."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.telemetry.impact import find_impact
from fdi.telemetry.motion import Motion

T = np.arange(0.0, 12.0, 0.1)
GROUND_S = 8.0
"""When a spinning vehicle meets the ground, which it sinks to at 3 m/s."""


def spinning(turns: float, ends: bool = True) -> Motion:
    """A multicopter with a rotor less: 90 m/s^2 and more are felt by its spin, for seconds."""
    falls = GROUND_S > T
    rate = np.where(falls | (not ends), turns, 0.2)
    wobble = 60.0 + 60.0 * np.abs(np.sin(7.0 * T))
    unknown = np.full(T.size, np.nan)
    return Motion(
        T,
        height=np.maximum(3.0 * (GROUND_S - T), 0.0),
        climb=np.where(falls, -3.0, 0.0),
        speed=np.where(falls, 2.0, 0.1),
        airspeed=unknown,
        turns=rate,
        upright=np.full(T.size, 0.9),
        throttle=np.where(falls, 0.3, 0.0),
        landed_state=unknown,
        force=np.where(falls, wobble, 9.8) + 150.0 * (np.abs(T - GROUND_S) < 0.05),
        pressed=unknown,
        is_dense=True,
    )


def test_what_a_spin_holds_is_no_blow_and_what_ends_it_is_one() -> None:
    found = find_impact(spinning(45.0), 0.0, disarmed=True, is_end=False, has_wings=False)
    assert found is not None
    row, speed = found
    assert T[row] == pytest.approx(GROUND_S, abs=0.7)
    assert speed == pytest.approx(3.0, abs=0.1)


def test_the_same_force_without_a_spin_is_a_blow_at_once() -> None:
    found = find_impact(spinning(2.0), 0.0, disarmed=True, is_end=False, has_wings=False)
    assert found is not None
    assert T[found[0]] < GROUND_S - 1.0


def test_a_spin_that_goes_on_has_met_nothing() -> None:
    made = spinning(45.0, ends=False)
    assert find_impact(made, 0.0, disarmed=True, is_end=False, has_wings=False) is None


def test_one_damaged_height_is_no_fall() -> None:
    """Without an accelerometer the height alone tells; none falls at ten kilometres a second."""
    unknown = np.full(T.size, np.nan)
    made = spinning(0.1)
    rests = replace(made, force=unknown, climb=0.0 * T, height=0.0 * T, throttle=0.0 * T)
    falls = replace(rests, height=np.interp(T, [0.0, 5.0, 6.0], [20.0, 20.0, 0.0]))
    damaged = replace(rests, height=np.where(np.abs(T - 6.0) < 0.05, -9918.0, 0.0))

    def met(motion: Motion) -> tuple[int, float] | None:
        return find_impact(motion, 0.0, disarmed=True, is_end=True, has_wings=False)

    found = met(falls)
    assert found is not None
    assert found[1] == pytest.approx(20.0, abs=2.0)
    assert met(damaged) is None
