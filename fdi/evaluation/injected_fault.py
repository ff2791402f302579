"""What does a channel read with a known fault?

In: healthy values of a channel and a fault, written ``CHANNEL:KIND[=SIZE]@START[:END]``. Out: the
values with the fault between START and END (s of the log's clock, to the log's end without END).

======== ============================================= ====================================
kind     the channel reads                             SIZE
======== ============================================= ====================================
bias     SIZE more                                     in the channel's SI unit
drift    SIZE times the time since START more          in that unit per second
freeze   what it read last before START                none
noise    normally distributed numbers more             one sigma, in the unit; the same numbers
                                                       every time for a channel
scale    SIZE times as much                            a factor
dropout  nothing: the records are not there            the share of records lost; 1 if not given
======== ============================================= ====================================

Angles that go round (`ROUND`) are wrapped as their log does, from -pi or from 0, `LONGITUDES`
always from -pi.
"""

from __future__ import annotations

import math
import re
import zlib
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.model.evaluate import wrap

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Kind = Literal["bias", "drift", "freeze", "noise", "scale", "dropout"]

KINDS: Final[tuple[str, ...]] = get_args(Kind)
ROUND: Final = frozenset({"yaw", "cog", "hdg", "heading", "GCrs", "Yaw"})
LONGITUDES: Final = frozenset({"lon", "Lng"})
"""Names of fields that are angles over a full circle."""
_SPEC: Final = re.compile(r"(?P<target>.+):(?P<kind>[a-z]+)(?:=(?P<size>[^@]+))?@(?P<span>.+)")
_HINT: Final = "write CHANNEL:KIND=SIZE@START:END, e.g. GPS_RAW_INT.alt:bias=15@60:90"


@dataclass(frozen=True, slots=True)
class InjectedFault:
    """A fault at ``target`` (a channel or component), from ``start`` to ``end``, s."""

    target: str
    kind: Kind
    size: float
    start: float
    end: float

    def holds(self, t: Floats) -> Mask:
        """Return when it is there, ends included."""
        holds: Mask = (t >= self.start) & (t <= self.end)
        return holds


def parse_fault(text: str) -> InjectedFault:
    """Return the fault that a text describes.

    Raises
    ------
    UsageError
        It describes none.

    Examples
    --------
    >>> parse_fault("GPS_RAW_INT.alt:bias=15@60:90")
    InjectedFault(target='GPS_RAW_INT.alt', kind='bias', size=15.0, start=60.0, end=90.0)
    """
    found = _SPEC.fullmatch(text.strip())
    if found is None:
        raise UsageError(f"{text[:80]!r} describes no fault", hint=_HINT)
    kind, stated = found["kind"], found["size"]
    if kind not in KINDS:
        raise UsageError(f"{text!r}: no kind {kind!r}", hint=f"there are {', '.join(KINDS)}")
    start, _, end = found["span"].partition(":")
    try:
        span = float(start), float(end or "inf")
        size = 1.0 if stated is None else float(stated)
    except ValueError:
        raise UsageError(f"{text!r}: that is no number", hint=_HINT) from None
    if not (math.isfinite(span[0]) and span[0] < span[1]):
        raise UsageError(f"{text!r}: does not end after it begins", hint=_HINT)
    if (stated is None) != (kind == "freeze") and not (kind == "dropout" and stated is None):
        raise UsageError(f"{text!r}: {_size_needed(kind)}", hint=_HINT)
    in_range = {"noise": size >= 0, "dropout": 0 < size <= 1}.get(kind, True)
    if not (math.isfinite(size) and in_range):
        raise UsageError(f"{text!r}: a {kind} cannot have the size {size:g}")
    return InjectedFault(found["target"], kind, size, *span)  # type: ignore[arg-type]


def _size_needed(kind: str) -> str:
    return "a freeze has no size" if kind == "freeze" else f"a {kind} needs a size"


def faulty(fault: InjectedFault, t: Floats, values: Floats, *, channel: str) -> Floats:
    """Return the values (n,), in SI, as the channel reads them with the fault; not of a dropout.

    Parameters
    ----------
    t : (n,) float, s
    values : (n,) float
        NaN stays NaN.
    channel : str
        Its name; the noise depends on it, so that two channels do not have the same.
    """
    holds = fault.holds(t)
    made = values.copy()
    if fault.kind == "bias":
        made[holds] += fault.size
    elif fault.kind == "drift":
        made[holds] += fault.size * (t[holds] - fault.start)
    elif fault.kind == "scale":
        made[holds] *= fault.size
    elif fault.kind == "noise":
        moments, which = np.unique(t, return_inverse=True)
        draw = np.random.default_rng(zlib.crc32(channel.encode()))
        made[holds] += fault.size * draw.standard_normal(moments.size)[which][holds]
    elif fault.kind == "freeze":
        before = np.flatnonzero((t < fault.start) & np.isfinite(values))
        if not before.size:
            raise UsageError(f"{channel} reads nothing before {fault.start:g} s that could freeze")
        last = before[np.argmax(t[before])]
        made[holds & np.isfinite(values)] = values[last]
    field = channel.rpartition(".")[2]
    if field in LONGITUDES:
        made[holds] = wrap(made[holds])
    elif field in ROUND:
        made[holds] = _wrapped(made[holds], values)
    return made


def _wrapped(made: Floats, like: Floats) -> Floats:
    low = -math.pi if np.nanmin(like, initial=0.0) < 0 else 0.0
    out: Floats = (made - low) % (2 * math.pi) + low
    return out


def lost_records(fault: InjectedFault, t: Floats, *, message: str) -> Mask:
    """Return which records a dropout loses, (n,)."""
    draw = np.random.default_rng(zlib.crc32(message.encode())).random(t.size)
    lost: Mask = fault.holds(t) & (draw < fault.size)
    return lost
