"""Do the outputs in a log drive the motors?

In: what the motors are given as shares of their range, and how fast the vehicle turns. Out: whether
that may be what moves it. A controller in flight moves every output all the time: outputs that
stand still while the vehicle turns are not its own (another process writes those, a companion or a
controller of the user's). And a vector of outputs does not come back exactly, time after time, in
the midst of others far from it: that is a second publisher in the same topic, and its records are
left out. Surfaces are not asked: a VTOL that hovers holds them still.

Outputs that move at first and stand still later are another matter: the processor that writes them
may have stopped, so only the first half of the time in motion is asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.inputs.values import (
    LEAST,
    TURNS,
    Judged,
    Mask,
    first_half,
    judged,
    turning,
    while_armed,
)
from fdi.telemetry.message import Floats, Message

_MOTORS: Final = "MOTORS"
_NAME: Final = "outputs to the motors"
STOPPED: Final = 0.1
"""Share of the range: less lifts nothing."""
HELD_S: Final = 0.4
"""s: a controller in flight moves an output within tenths of a second (models/shared/motors.yaml,
``pulse_held``)."""
MOST: Final = 0.5
"""Of the time in motion, that outputs stand still or lie outside their range. Of 75 recorded logs
the vector of the motors' outputs stands in 0 to 13 % of it, or in 97 % and more."""
OUTSIDE: Final = 0.1
"""Beyond either end of a range, as a share of it, before the range is not the outputs' own."""
RETURNS: Final = 10
"""Times that a vector comes back exactly in the midst of others."""
APART: Final = 3.0
"""Times of the usual step between records, that a second publisher's lie off their neighbours: a
calm hover, which comes back to a vector by its resolution, does so from the next one."""


def judge_outputs(messages: Mapping[str, Message], armed: Floats) -> Iterator[Judged]:
    """Yield what is to be said of the outputs to the motors.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    armed : (k, 2) float
        From when to when, s.
    """
    message = messages.get(_MOTORS)
    if message is None or len(message) < LEAST or not message.fields:
        return
    shares = np.array([_as_sent(message, field) for field in message.fields])
    yield _judge(message, shares, _in_motion(messages, message.t, shares, armed))


def _as_sent(message: Message, field: str) -> Floats:
    """Return an output as a share of its range, (n,), an output of 0 too."""
    told = message.columns[field].conversion
    raw = np.asarray(message.raw(field)[message.kept], np.float64)
    return told.scale * raw + told.offset


def _in_motion(messages: Mapping[str, Message], t: Floats, shares: Floats, armed: Floats) -> Mask:
    """Return when the vehicle is armed, under power and turns (or nobody knows), (n,) bool.

    Rotors that idle carry nothing: who turns the vehicle then is a person.
    """
    on = while_armed(t, armed)
    on &= ~_idle(shares, on)
    rate = turning(messages, t)
    on &= ~(rate < TURNS)
    with np.errstate(invalid="ignore"):
        on &= shares.mean(axis=0) > STOPPED
    return on


def _idle(shares: Floats, on: Mask) -> Mask:
    """Return when all outputs are the lowest of those while armed, of outputs that rise, (n,)."""
    if not on.any():
        return on
    lowest, highest = shares[:, on].min(axis=1), shares[:, on].max(axis=1)
    rises: Mask = highest - lowest > STOPPED
    idle: Mask = (shares[rises] <= lowest[rises, None]).all(axis=0) & rises.any()
    return idle


def _judge(message: Message, shares: Floats, moving: Mask) -> Judged:
    name, fields = _NAME, message.fields
    if moving.sum() < LEAST:
        return judged(name, message, fields, None, "the vehicle is not seen to turn under power")
    second = _second_publisher(shares, moving)
    own = ~second
    half = first_half(moving & own)
    held = np.zeros(moving.size, np.bool_)
    held[own] = _held(message.t[own], shares[:, own])
    share = float(held[half].mean())
    if share > MOST:
        why = f"they do not change in {100 * share:.0f} % of the time in which the vehicle turns"
        return judged(name, message, fields, False, f"{why}: they do not drive it")
    with np.errstate(invalid="ignore"):
        outside = (shares < -OUTSIDE) | (shares > 1 + OUTSIDE)
    share = float(outside[:, moving & own].any(axis=0).mean())
    if share > MOST:
        why = f"in {100 * share:.0f} % of the time under power one is outside the range"
        return judged(name, message, fields, False, f"{why} that the parameters give")
    if second.any():
        why = f"{100 * second[moving].mean():.0f} % of the records come from another source"
        return judged(name, message, fields, True, f"{why} and are left out", second)
    return judged(name, message, fields, True, "they move while the vehicle turns")


def _held(t: Floats, shares: Floats) -> Mask:
    """Return the records, (n,) bool, of stretches in which no output changes for `HELD_S`."""
    same = np.append(False, (np.diff(shares, axis=1) == 0).all(axis=0))
    first = np.flatnonzero(~same)
    last = np.append(first[1:], t.size) - 1
    is_long = t[last] - t[first] >= HELD_S
    return np.repeat(is_long, last - first + 1)


def _second_publisher(shares: Floats, moving: Mask) -> Mask:
    """Return the records, (n,) bool, of one vector that keeps coming back among others far off."""
    found = np.zeros(moving.size, np.bool_)
    rows, count = np.unique(shares[:, moving].T, axis=0, return_counts=True)
    often = rows[np.argmax(count)][:, None]
    ends = (often == shares.min(axis=1, keepdims=True)) | (
        often == shares.max(axis=1, keepdims=True)
    )
    if ends.all():
        return found  # where a controller's limits take it again and again
    same = (shares == often).all(axis=0)
    starts = np.flatnonzero(same[1:] & ~same[:-1] & moving[1:]) + 1
    if starts.size < RETURNS:
        return found
    others = shares[:, moving & ~same]
    if others.shape[1] < LEAST:
        return found
    usual = float(np.median(np.abs(np.diff(others, axis=1)).max(axis=0)))
    jump = np.abs(shares[:, starts] - shares[:, starts - 1]).max(axis=0)
    return same if np.median(jump) > APART * usual else found
