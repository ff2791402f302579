"""What carries a vehicle that can change between rotors and wings, and when its wings count."""

import numpy as np
import pytest

from fdi.telemetry import Flight
from fdi.telemetry.events import SETTLING_S, Event, flight_state
from fdi.telemetry.lift import lift_events
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

T = np.arange(0.0, 40.0)
FLIGHTS = (Flight(0, 40, takeoff=1.0),)


def message(name, t, **fields):
    columns = {
        key: Column(lambda v=value: np.asarray(v, float), Conversion(""))
        for key, value in fields.items()
    }
    return {name: Message(name, None, t, t, np.arange(t.size), columns)}


def told(events):
    return [(e.t, e.text) for e in events]


def test_mavlink_says_what_carries_a_vtol():
    state = np.select([T < 10, T < 13, T < 30], [3, 1, 4], 3)
    own = message("EXTENDED_SYS_STATE", T, vtol_state=state)
    found = lift_events(own, (), 0.0, "vtol")
    assert told(found) == [(0, "rotors"), (10, "in transition"), (13, "wings"), (30, "rotors")]
    state = flight_state(T, found, FLIGHTS)
    assert T[state.wing_borne].tolist() == np.arange(13 + SETTLING_S, 30).tolist()
    rotors = [*np.arange(SETTLING_S, 10), *np.arange(30 + SETTLING_S, 40)]
    assert T[state.rotor_borne].tolist() == rotors


def test_a_state_that_is_not_defined_is_none():
    own = message("EXTENDED_SYS_STATE", T, vtol_state=np.zeros(T.size))
    assert told(lift_events(own, (), 0.0, "vtol")) == [(0.0, "unknown")]


def test_a_quadplane_is_carried_as_its_modes_and_the_records_of_its_motors_say():
    modes = (Event(0.0, "mode", "QHOVER"), Event(9.0, "mode", "AUTO"), Event(30.0, "mode", "QLAND"))
    found = lift_events({}, modes, 0.0, "vtol")
    assert told(found) == [(0, "rotors"), (9, "wings"), (30, "rotors")]
    helped = message("QTUN", np.arange(9.0, 14.0, 0.5), ThO=np.ones(10))
    found = lift_events(helped, modes, 0.0, "vtol")
    assert told(found) == [(0, "rotors"), (15.5, "wings"), (30, "rotors")]


@pytest.mark.parametrize("vehicle", ["plane", "quad", "helicopter"])
def test_what_cannot_change_has_no_such_events_and_its_wings_count_in_the_air(vehicle):
    own = message("EXTENDED_SYS_STATE", T, vtol_state=np.zeros(T.size))
    assert lift_events(own, (), 0.0, vehicle) == []
    state = flight_state(T, (), FLIGHTS)
    assert state.wing_borne.tolist() == state.rotor_borne.tolist() == state.airborne.tolist()


def test_nobody_knows_what_carries_a_vtol_whose_log_does_not_tell():
    found = lift_events({}, (), 2.0, "vtol")
    assert told(found) == [(2.0, "unknown")]
    state = flight_state(T, found, FLIGHTS)
    assert not (state.wing_borne | state.rotor_borne).any()
