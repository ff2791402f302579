"""What a vehicle was doing at any moment, from its events and flights."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry import Flight
from fdi.telemetry.events import Event, flight_state

WHOLE = Flight(10, 100, takeoff=20, landing=90, climbed=30, approach=80)
CRASH = Flight(10, 100, takeoff=20, impact=60, climbed=30)


def phases(flights, *times):
    return flight_state(times, (), flights).phase.tolist()


def test_a_flight_goes_through_its_phases():
    found = phases([WHOLE], 0, 15, 20, 29, 30, 80, 81, 90, 91, 200)
    assert found == [
        *("ground", "ground", "takeoff", "takeoff", "flight"),
        *("flight", "landing", "landing", "ground", "ground"),
    ]


def test_after_an_impact_nothing_is_flight_until_the_next_one():
    later = Flight(200, 300, takeoff=210, landing=290)
    assert phases([CRASH, later], 59, 60, 99, 150, 205, 215) == [
        *("flight", "impact", "impact", "impact", "ground", "flight"),
    ]


def test_what_never_left_the_ground_is_never_in_the_air():
    state = flight_state(np.arange(20.0), (), [Flight(2, 18, flew=False)])
    assert not state.airborne.any()
    assert state.armed.tolist() == [2 <= t <= 18 for t in range(20)]


def test_without_flights_nothing_is_in_the_air():
    state = flight_state([0.0, 1.0], (), ())
    assert state.phase.tolist() == ["ground", "ground"]
    assert not state.armed.any()


@pytest.mark.parametrize(("first", "before"), [("arm", False), ("disarm", True)])
def test_before_the_first_change_the_opposite_held(first, before):
    """A log that begins with disarming began armed."""
    state = flight_state([0.0, 5.0, 9.0], [Event(5.0, first, "")], ())
    assert state.armed.tolist() == [before, not before, not before]


def test_first_mode_holds_before_it_as_well():
    events = [Event(5.0, "mode", "AUTO"), Event(8.0, "mode", "RTL")]
    assert flight_state([0, 5, 7.9, 8, 99], events, ()).mode.tolist() == [
        *("AUTO", "AUTO", "AUTO", "RTL", "RTL"),
    ]


marks = st.lists(st.floats(0, 1000), min_size=6, max_size=6, unique=True).map(sorted)


@given(marks, st.lists(st.floats(-10, 1010), min_size=1, max_size=30), st.booleans())
def test_phases_come_in_order_and_air_is_what_lies_between_take_off_and_landing(
    marks, times, crashes
):
    start, takeoff, climbed, approach, landing, end = marks
    ending = {"impact": landing} if crashes else {"landing": landing, "approach": approach}
    flight = Flight(start, end, takeoff=takeoff, climbed=climbed, **ending)
    times = sorted(times)
    state = flight_state(times, (), [flight])
    rank = {"ground": 0, "takeoff": 1, "flight": 2, "landing": 3, "impact": 4}
    inside = [rank[p] for p, t in zip(state.phase, times, strict=True) if takeoff <= t < landing]
    assert inside == sorted(inside)
    for t, up in zip(times, state.airborne, strict=True):
        if t != landing:
            assert up == (takeoff <= t < landing)


@given(marks, st.permutations(range(12)))
def test_order_of_the_moments_asked_for_does_not_matter(marks, order):
    start, takeoff, climbed, approach, landing, end = marks
    flights = [Flight(start, end, takeoff=takeoff, landing=landing, climbed=climbed)]
    events = [Event(start, "arm", ""), Event(approach, "mode", "LAND"), Event(end, "disarm", "")]
    times = np.linspace(start - 1, end + 1, 12)
    one, other = flight_state(times, events, flights), flight_state(times[order], events, flights)
    for name in ("armed", "airborne", "mode", "phase"):
        assert getattr(one, name)[order].tolist() == getattr(other, name).tolist()


@pytest.mark.parametrize(
    ("mode", "attitude", "height"),
    [
        ("AUTO", True, True),  # ArduPilot
        ("AUTO_MISSION", True, True),  # PX4
        ("ALTCTL", True, True),
        ("FBWA", True, False),
        ("STABILIZED", True, False),
        ("MANUAL", False, False),
        ("QHOVER", False, False),  # motors hold it, not surfaces
        ("", False, False),
    ],
)
def test_modes_say_what_is_controlled_on_both_autopilots(mode, attitude, height):
    state = flight_state([1.0], [Event(0.0, "mode", mode)], ())
    assert state.controls_attitude.tolist() == [attitude]
    assert state.controls_height.tolist() == [height]
