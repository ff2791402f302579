"""What happened in a log, and which flights does it hold?

Values only: `Event`, `Flight`, and the flight's `FlightState` at any time. Readers make the events
of mode, arming and texts; `flights.py` finds take-off, landing and impact from the data.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.shown import Shown
from fdi.telemetry.catalogue import data_table

Floats = NDArray[np.float64]
Kind = Literal[
    "mode",
    "arm",
    "disarm",
    "failsafe",
    "command",
    "text",
    "takeoff",
    "landing",
    "impact",
    "parameter",
    "reboot",
    "sensor",
    "lift",
]


SETTLING_S: Final = 5.0
"""After take-off, and from rotors to wings, filters and controllers settle, s; read off healthy
simulated flights."""


def over_words(alarm: str) -> str:
    """Return what is said where an alarm of the autopilot no longer stands.

    Examples
    --------
    >>> over_words("radio failsafe: no signal of the remote control")
    'radio failsafe is over'
    """
    return f"{alarm.split(':')[0]} is over"


@dataclass(frozen=True, slots=True)
class Event(Shown):
    """Something that happened at one moment.

    Attributes
    ----------
    t : float
        s of the log's clock.
    kind : Kind
    text : str
        For a person; of untrusted origin, control characters removed. The mode's or parameter's
        name.
    severity : int or None
        MAVLink's, 0 emergency to 7 debug.
    value : float or None
        The parameter's new value, the speed of an impact in m/s.
    by : str
        Who ordered a mode, arming or disarming, gave a command, or set a parameter; "" where the
        log does not say.
    before : float or None
        The parameter's value until then.
    """

    t: float
    kind: Kind
    text: str
    severity: int | None = None
    value: float | None = None
    by: str = ""
    before: float | None = None


@dataclass(frozen=True, slots=True)
class Flight(Shown):
    """One flight, from arming to disarming (or to the end of the data); s of the log's clock.

    Attributes
    ----------
    start, end : float
        Arming and disarming, or the bounds of the data or of the motion where there is no arming.
    takeoff, landing, impact : float or None
        None: not in the log. A flight ends by a landing or an impact, never by both.
    climbed : float or None
        When the climb-out ended: 10 m above the place of take-off.
    approach : float or None
        When the vehicle was last that high above the place of landing.
    impact_speed : float or None
        m/s, descent just before the impact.
    aloft : tuple of (float, float)
        From when to when, each time, it was clear of the fields of the ground.
    stood : (float, float) or None
        From when to when the vehicle stood last before it; None: that is not in the log.
    restart : float or None
        When an autopilot that started anew in the air was heard again.
    flew : bool
        False: armed, and never left the ground.
    """

    start: float
    end: float
    takeoff: float | None = None
    landing: float | None = None
    impact: float | None = None
    climbed: float | None = None
    approach: float | None = None
    impact_speed: float | None = None
    aloft: tuple[tuple[float, float], ...] = ()
    stood: tuple[float, float] | None = None
    restart: float | None = None
    flew: bool = True

    @property
    def airborne(self) -> tuple[float, float]:
        """The part spent in the air, (from, to); empty where it never left the ground."""
        if not self.flew:
            return self.start, self.start
        ends = [x for x in (self.landing, self.impact) if x is not None]
        return self.start if self.takeoff is None else self.takeoff, min([*ends, self.end])


@dataclass(frozen=True, slots=True, eq=False)
class FlightState(Shown):
    """The vehicle's state at times t, (n,) each.

    ``controls_attitude``: the autopilot keeps an attitude that somebody demands;
    ``controls_height``: it keeps a height or a rate of climb as well, with engine or motors.
    ``wing_borne``: it is in the air, and if it could be carried by rotors, wings have carried it
    for a few seconds; ``rotor_borne`` likewise, if it could be carried by wings.
    ``standing``: it stands before one of its flights.
    ``aloft``: it is in the air, and clear of the magnetic fields of the ground.
    """

    t: Floats
    armed: NDArray[np.bool_]
    airborne: NDArray[np.bool_]
    mode: NDArray[Any]
    phase: NDArray[Any]
    controls_attitude: NDArray[np.bool_]
    controls_height: NDArray[np.bool_]
    wing_borne: NDArray[np.bool_]
    rotor_borne: NDArray[np.bool_]
    standing: NDArray[np.bool_]
    aloft: NDArray[np.bool_]

    def part(self, span: slice | NDArray[np.int64]) -> FlightState:
        """Return the state at some of the times."""
        return FlightState(*(getattr(self, f.name)[span] for f in fields(self)))

    def named(self) -> dict[str, NDArray[Any]]:
        """Return the states by the names that conditions of a model give them."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "t"}


def flight_state(t: ArrayLike, events: Sequence[Event], flights: Sequence[Flight]) -> FlightState:
    """Return arming, mode and phase at arbitrary times.

    Parameters
    ----------
    t : (n,) float, s

    Notes
    -----
    What is known first also holds before it. Without any arming in the log a flight counts as
    armed.
    """
    at = np.atleast_1d(np.asarray(t, np.float64))
    modes = [(e.t, e.text) for e in events if e.kind == "mode"]
    arms = [(e.t, e.kind == "arm") for e in events if e.kind in ("arm", "disarm")]
    times, names = zip(*modes, strict=True) if modes else ((0.0,), ("",))
    told = _latest(times, at)
    mode = np.array(names, object)[told]
    armed = np.zeros(at.size, np.bool_)
    if arms:
        times, values = zip(*arms, strict=True)
        before_first = not values[0]  # a log that begins with disarming began armed
        armed = np.where(at < times[0], before_first, np.array(values)[_latest(times, at)])
    phase = np.full(at.size, "ground", object)
    if flights:
        phase, in_flight = _phases(at, flights)
        armed = armed if arms else in_flight
    airborne = (phase == "takeoff") | (phase == "flight") | (phase == "landing")
    controls = data_table("modes_controls")
    height = np.isin(names, controls["height"])[told]
    attitude = height | np.isin(names, controls["attitude"])[told]
    air = np.asarray(airborne, np.bool_)
    lift = [(e.t, e.text) for e in events if e.kind == "lift"]
    wings, rotors = (air & _carried(at, lift, by) for by in ("wings", "rotors"))
    standing = _within(at, (flight.stood for flight in flights))
    aloft = air & _within(at, (span for flight in flights for span in flight.aloft))
    return FlightState(
        at, armed, air, mode, phase, attitude, height, wings, rotors, standing, aloft
    )


def _within(at: Floats, spans: Iterable[tuple[float, float] | None]) -> NDArray[np.bool_]:
    found = np.zeros(at.size, np.bool_)
    for low, high in filter(None, spans):
        found |= (at >= low) & (at <= high)
    return found


def _carried(at: Floats, lift: Sequence[tuple[float, str]], by: str) -> NDArray[np.bool_]:
    """Return where that has carried a vehicle for a while; everywhere if it never changes."""
    if not lift:
        return np.ones(at.size, np.bool_)
    times, texts = zip(*lift, strict=True)
    last = _latest(times, at)
    carried = np.array(texts)[last] == by
    return np.asarray(carried & (at >= np.array(times)[last] + SETTLING_S))


def _latest(times: Sequence[float], at: Floats) -> NDArray[np.int64]:
    return np.maximum(np.searchsorted(times, at, side="right") - 1, 0)


def _phases(at: Floats, flights: Sequence[Flight]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Return the phase at each time, and whether it lies in a flight; flights do not overlap."""
    spans = [flight.airborne for flight in flights]
    table = [
        (
            flight.start,
            flight.end,
            *span,
            span[0] if flight.climbed is None else flight.climbed,
            span[1] if flight.approach is None else flight.approach,
            np.inf if flight.impact is None else flight.impact,
            flight.flew,
        )
        for flight, span in zip(flights, spans, strict=True)
    ]
    columns = np.array(table, np.float64).T
    which = np.searchsorted(columns[0], at, side="right") - 1
    start, end, low, high, climbed, approach, impact, flew = columns[:, np.maximum(which, 0)]
    is_up = (which >= 0) & (flew > 0) & (at >= low) & (at <= high)
    phase = np.full(at.size, "ground", object)
    phase[is_up] = "flight"
    phase[is_up & (at < climbed)] = "takeoff"
    phase[is_up & (at > approach)] = "landing"
    # nothing after an impact is evidence any more, until the next flight begins
    phase[(which >= 0) & (at >= impact)] = "impact"
    return phase, (at >= start) & (at <= end)
