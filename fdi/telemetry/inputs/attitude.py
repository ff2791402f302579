"""Does the estimated attitude fit what the accelerometer feels?

In: estimated roll and pitch and the specific force while the vehicle is armed. Out: whether the
attitude is its own. Averaged over ten seconds a vehicle hardly accelerates: what it feels is then
its weight, upwards. An estimator that does not converge (a gyroscope that is stuck, a board that is
mounted otherwise than it is told) shows a vehicle that leans by 60 degrees for minutes and neither
falls nor leaves, and everything that is told by the attitude is untrue with it.

The trap: an accelerometer that reads too much or too little must not cost the attitude its belief.
So the force has to be missed in its size upwards and in its direction, which a wrong scale leaves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.inputs.values import Judged, accelerometers, first_half, judged, while_armed
from fdi.telemetry.message import Floats, Message
from fdi.units import G0

WINDOW_S: Final = 10.0
"""Over which it is averaged."""
GAINS: Final = 3.0
"""m/s^2 upwards or downwards throughout such a window: 30 m/s, which no vehicle here gains."""
LEANS: Final = float(np.cos(np.radians(35.0)))
"""Of the force that is felt, the part upwards: who accelerates from 0 to 30 m/s in a window has
0.96, and 0.82 takes 7 m/s^2 of an accelerometer's error."""
FEW: Final = 3
"""Windows; fewer tell nothing."""
MOST: Final = 0.5
"""Of the windows."""
_ANGLES: Final = ("roll", "pitch")


def judge_attitude(messages: Mapping[str, Message], armed: Floats) -> Iterator[Judged]:
    """Yield what is to be said of the estimated attitude.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    armed : (k, 2) float
        From when to when, s.
    """
    attitude = messages.get("ATTITUDE")
    felt = accelerometers(messages)
    if attitude is None or not felt or not all(angle in attitude for angle in _ANGLES):
        return
    window, up, size = _averaged(attitude, felt[0], armed)
    name = "estimated attitude"
    if window.size < FEW:
        yield judged(name, attitude, attitude.fields, None, "the vehicle is armed too shortly")
        return
    with np.errstate(invalid="ignore", divide="ignore"):
        off = (np.abs(up - G0) > GAINS) & (up / size < LEANS)
    half = first_half(np.ones(window.size, np.bool_))
    if off[half].mean() > MOST:
        told = np.degrees(np.arccos(np.clip(np.median(up[off] / size[off]), -1.0, 1.0)))
        why = f"the accelerometer feels the ground {told:.0f} degrees away from where it has it"
        yield judged(name, attitude, attitude.fields, False, why)
        return
    yield judged(name, attitude, attitude.fields, True, "the accelerometer feels the same down")


def _averaged(attitude: Message, felt: Message, armed: Floats) -> tuple[Floats, Floats, Floats]:
    """Return windows of an armed vehicle, the force upwards and its size in each, m/s^2."""
    t = felt.t
    force = np.array([felt.si(axis) for axis in ("xacc", "yacc", "zacc")])
    on = np.isfinite(force).all(axis=0)
    on &= (t >= attitude.t[0]) & (t <= attitude.t[-1]) if len(attitude) else False
    on &= while_armed(t, armed)
    t, force = t[on], force[:, on]
    down = _down(attitude, t)
    known = np.isfinite(down).all(axis=0)
    t, force, down = t[known], force[:, known], down[:, known]
    window = np.floor(t / WINDOW_S)
    first = np.flatnonzero(np.diff(window, prepend=-np.inf))
    if not first.size:
        return first.astype(np.float64), first.astype(np.float64), first.astype(np.float64)
    count = np.diff(first, append=t.size)
    up = -np.add.reduceat((force * down).sum(axis=0), first) / count
    mean = np.array([np.add.reduceat(axis, first) / count for axis in force])
    return window[first], up, np.linalg.norm(mean, axis=0)


def _down(attitude: Message, t: Floats) -> Floats:
    """Return where the attitude has the ground, in the body's axes, (3, n)."""
    roll, pitch = (attitude.si(angle) for angle in _ANGLES)
    told = (-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch))
    return np.array([np.interp(t, attitude.t, axis) for axis in told])
