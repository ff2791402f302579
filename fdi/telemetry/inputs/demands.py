"""Does the vehicle follow the attitude that the log says is demanded?

In: demanded and estimated roll and pitch while the autopilot controls the attitude. Out: whether
the demand is somebody's. One that the controller does not read (a set point of a module that does
not fly) moves, and the vehicle does not: by it a sound controller fails from the beginning on.

The trap: a controller that fails later does not follow either, so only the first half of the time
in motion is asked, and both axes, of which a surface that is stuck leaves one. Rotors roll and
pitch a vehicle by the same means: there one axis is enough, if it is missed by more than it moves.

Wings that miss both axes and stay in the air for minutes are flown by somebody else, whether the
demand moves or not: an autopilot is on board that only records.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from fdi.telemetry.events import Event, flight_state
from fdi.telemetry.inputs.steering import steered_by_others
from fdi.telemetry.inputs.values import LEAST, TURNS, Judged, first_half, judged, turning
from fdi.telemetry.message import Floats, Message

_AXES: Final = ("roll", "pitch")
_DEMAND: Final = "NAV_CONTROLLER_OUTPUT"
TOLD: Final = float(np.radians(2.0))
"""rad: a demand that moves less tells nothing of who follows; twice an estimate's error."""
STRAYS: Final = 2.0
"""Times of the attitude's own motion, that it misses a demand which somebody follows at worst: no
motion at all misses by as much as the demand moves. Of 100 logs those that follow miss by 0 to 1.7
times, those that do not by 4 to 45 times. On rotors twice as much about one axis is enough: of
382 logs (all in sight) those of one vehicle, which another controller flies, miss about the worse
axis by up to 14 times, where both are told, all others by up to 1.6."""

FLOWN_AWAY: Final = float(np.radians(10.0))
"""rad: wings that miss both axes by so much in the median are steered by somebody else. Chosen: of
134 logs of wings those that follow miss the nearer axis by 5 degrees at most, four of planes that a
pilot flies by another receiver by 14 to 25; with 5 or 13 none is judged otherwise."""
FLOWN_S: Final = 60.0
"""No aeroplane that its autopilot has lost about both axes flies on for so long."""


def judge_demands(
    messages: Mapping[str, Message], reported: Sequence[Event], *, wings: bool
) -> Iterator[Judged]:
    """Yield what is to be said of the demanded attitude.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    reported : sequence of Event
        Arming and modes.
    wings : bool
        Whether wings may carry the vehicle; else rotors alone do.
    """
    demand, attitude = messages.get(_DEMAND), messages.get("ATTITUDE")
    if demand is None or attitude is None:
        return
    fields = tuple(f"nav_{axis}" for axis in _AXES)
    if not all(f in demand for f in fields) or not all(axis in attitude for axis in _AXES):
        return
    name = "demanded attitude"
    state = flight_state(demand.t, reported, ())
    controlled = state.controls_attitude & ~(turning(messages, demand.t) < TURNS)
    if any(e.kind in ("arm", "disarm") for e in reported):
        controlled &= state.armed
    wanted = np.array([demand.si(field) for field in fields])
    known = controlled & np.isfinite(wanted).all(axis=0)
    known &= (demand.t >= attitude.t[0]) & (demand.t <= attitude.t[-1])
    half = first_half(known)
    if half.sum() < LEAST:
        yield judged(name, demand, fields, None, "too few records while the attitude is controlled")
        return
    seen = [
        _misses(demand.t[half], wanted[axis, half], attitude, name)
        for axis, name in enumerate(_AXES)
    ]
    if wings and np.ptp(demand.t[half]) >= FLOWN_S and min(miss for miss, _ in seen) > FLOWN_AWAY:
        told = _in_words([miss for miss, _ in seen])
        yield from steered_by_others(messages, f"they are missed in {told}: somebody else steers")
        return
    is_told = [(miss, most) if most is not None else None for miss, most in seen]
    if any(miss is None for miss in is_told):
        yield judged(name, demand, fields, None, "it is the same for most of the time")
        return
    misses = [miss for miss in is_told if miss is not None]
    is_lost = not wings and any(miss > STRAYS * move for miss, move in misses)
    if is_lost or all(miss > move for miss, move in misses):
        told = _in_words([miss for miss, _ in misses])
        yield judged(name, demand, fields, False, f"nothing follows it: it is missed in {told}")
        return
    yield judged(name, demand, fields, True, "the vehicle follows it")


def _in_words(misses: Sequence[float]) -> str:
    """Return by how much each axis is missed."""
    parts = (
        f"{a} by {np.degrees(miss):.0f} degrees" for a, miss in zip(_AXES, misses, strict=True)
    )
    return " and ".join(parts)


def _misses(t: Floats, wanted: Floats, attitude: Message, axis: str) -> tuple[float, float | None]:
    """Return by how much a demand is missed in the median, and what says that nobody follows.

    The latter is None where the demand does not move.
    """
    own = np.interp(t, attitude.t, attitude.si(axis))
    moves, turns = (_spread(values) for values in (wanted, own))
    most = None if moves < TOLD else max(STRAYS * turns, moves / STRAYS)
    return float(np.nanmedian(np.abs(own - wanted))), most


def _spread(values: Floats) -> float:
    return float(np.nanmedian(np.abs(values - np.nanmedian(values))))
