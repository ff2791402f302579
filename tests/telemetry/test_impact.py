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
        hover=unknown,
        landed_state=unknown,
        force=np.where(falls, wobble, 9.8) + 150.0 * (np.abs(T - GROUND_S) < 0.05),
        pressed=unknown,
        is_dense=True,
    )


def met(motion: Motion) -> tuple[int, float | None]:
    """The impact of a multicopter that there must be."""
    found = find_impact(motion, 0.0, disarmed=True, is_end=False, has_wings=False)
    assert found is not None
    return found


def test_what_a_spin_holds_is_no_blow_and_what_ends_it_is_one() -> None:
    found = find_impact(spinning(45.0), 0.0, disarmed=True, is_end=False, has_wings=False)
    assert found is not None
    row, speed = found
    assert T[row] == pytest.approx(GROUND_S, abs=0.15)
    assert speed == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize(("sinks", "told"), [(3.0, 3.0), (0.4, None)])
def test_who_spins_sinks_as_the_air_pressure_says_where_the_estimate_falls_on(
    sinks: float, told: float | None
) -> None:
    """15 m/s out of a height of three metres: gravity gives 8."""
    falls = GROUND_S > T
    made = replace(
        spinning(45.0),
        climb=np.where(T > GROUND_S - 2.0, -15.0, 0.0),
        pressed=np.where(falls, sinks * (GROUND_S - T), 0.0),
    )
    row, speed = met(made)
    assert T[row] == pytest.approx(GROUND_S, abs=0.15)
    assert speed == (told if told is None else pytest.approx(told, abs=0.1))


def test_an_estimate_that_falls_out_of_its_bounds_is_held_to_what_gravity_gives() -> None:
    upset = np.interp(T, [GROUND_S - 0.5, GROUND_S], [-1.0, -30.0])
    _, speed = met(replace(spinning(45.0), climb=np.where(GROUND_S > T, upset, -30.0)))
    assert speed is not None
    assert speed < 15.0


def test_who_touches_the_ground_and_spins_on_has_not_met_it_for_good() -> None:
    again = np.where((T > GROUND_S) & (T < GROUND_S + 0.4), 10.0, 45.0)
    assert find_impact(
        replace(spinning(45.0), turns=again), 0.0, disarmed=False, is_end=False, has_wings=False
    ) is None  # fmt: skip


def test_a_tumble_begins_with_the_blow_and_is_no_spin_before_it() -> None:
    """It bounces over the ground for a second and a half: the first blow counts."""
    made = spinning(0.3)
    tumbles = (T >= GROUND_S) & (T < GROUND_S + 1.5)
    force = np.where(T % 0.5 < 0.09, 80.0, 15.0)
    row, speed = met(
        replace(made, turns=np.where(tumbles, 15.0, 0.2), force=np.where(tumbles, force, 9.8))
    )
    assert T[row] == pytest.approx(GROUND_S, abs=0.15)
    assert speed == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize(("by_pressure", "is_met"), [(0.0, False), (8.0, True)])
def test_who_sinks_fast_by_the_estimate_alone_has_hit_nothing(
    by_pressure: float, is_met: bool
) -> None:
    """A bump of 5 g on the ground, while an estimate that vibration upset falls at 8 m/s."""
    falls = GROUND_S > T
    made = replace(
        spinning(0.3),
        climb=np.where(falls, -8.0, 0.0),
        force=np.where(np.abs(T - GROUND_S) < 0.05, 50.0, 9.8),
        pressed=np.where(falls, by_pressure * (GROUND_S - T), 0.0),
    )
    found = find_impact(made, 0.0, disarmed=True, is_end=False, has_wings=False)
    assert (found is not None) == is_met


def test_the_same_force_without_a_spin_is_a_blow_at_once() -> None:
    found = find_impact(spinning(2.0), 0.0, disarmed=True, is_end=False, has_wings=False)
    assert found is not None
    assert T[found[0]] < GROUND_S - 1.0


@pytest.mark.parametrize(("sank", "is_met"), [(0.5, True), (20.0, False)])
def test_who_sinks_on_by_the_air_pressure_has_hit_nothing_yet(sank: float, is_met: bool) -> None:
    """The estimate rests after a blow; the pressure says how far it fell afterwards."""
    after = np.clip(T - GROUND_S, 0.0, 2.0) / 2.0
    pressed = np.maximum(3.0 * (GROUND_S - T), 0.0) - sank * after
    made = replace(spinning(2.0), pressed=pressed, force=9.8 + 60.0 * (np.abs(T - GROUND_S) < 0.05))
    found = find_impact(made, 0.0, disarmed=True, is_end=False, has_wings=True)
    assert (found is not None) == is_met


@pytest.mark.parametrize(("by_pressure", "is_met"), [(0.0, True), (4.0, False)])
def test_an_estimate_that_the_blow_upset_carries_nobody_away(
    by_pressure: float, is_met: bool
) -> None:
    """The estimate climbs at 5 m/s after the blow; the air pressure says whether it does."""
    later = np.maximum(T - GROUND_S, 0.0)
    made = replace(
        spinning(0.3),
        climb=np.where(GROUND_S > T, -5.0, 5.0),
        height=np.maximum(5.0 * (GROUND_S - T), 0.0),
        force=9.8 + 60.0 * (np.abs(T - GROUND_S) < 0.05),
        pressed=np.maximum(5.0 * (GROUND_S - T), 0.0) + by_pressure * later,
    )
    found = find_impact(made, 0.0, disarmed=True, is_end=False, has_wings=False)
    assert (found is not None) == is_met


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

    def ends(motion: Motion) -> tuple[int, float | None] | None:
        return find_impact(motion, 0.0, disarmed=True, is_end=True, has_wings=False)

    found = ends(falls)
    assert found is not None
    assert found[1] == pytest.approx(20.0, abs=2.0)
    assert ends(damaged) is None
