"""How does a table of correspondences say where a MAVLink field comes from?

In: the text of a source in ``data/mavlink_*.json``. Out: a `Source`. Nothing here knows a log.

======================================  ============================================================
text                                    means
======================================  ============================================================
``ATT.Roll``                            a field of the log's own message, in SI
``IMU[1].AccX``, ``esc.esc[0].rpm``     of an instance; of an array
``XKF1[XKF4.PI].VN``                    of the instance that another field names at that moment
``1000*a.x + 500``, ``-CTUN.CRt``       sums; every term has the same unit
``norm(a, b)``, ``roll(q)``             a function of `FUNCTIONS`
``... in cm/s``                         what the numbers are where the log does not state a unit
``... on rotors``                       only for the vehicles of that group of the table
``... if GPS.Status >= 3 and ...``      unknown where this does not hold (values in SI). A condition
                                        on a field that the log does not have is left out
======================================  ============================================================

A key with a range, ``servo{1..8}_raw``, stands for as many fields; ``{n}`` in its sources is the
number and ``{n-1}`` the one before.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import FdiError

Floats = NDArray[np.float64]

_CHANNEL: Final = r"[A-Za-z]\w*(?:\[(?:\d+|[A-Za-z]\w*\.\w+)\])?\.[A-Za-z_][\w.\[\]]*"
_SOURCE: Final = re.compile(r"(.+?)(?: in (\S+(?: \(\w+\))?))?(?: on (\w+))?(?: if (.+))?")
_TERM: Final = re.compile(rf"(?:([\d.]+)\*)?(?:(\w+)\(([^()]*)\)|({_CHANNEL}))|([\d.]+)")
_SPLIT: Final = re.compile(r"\s*([+-])\s*")
_READ: Final = re.compile(r"(\w+?)(?:\[(?:(\d+)|(\w+)\.(\w+))\])?\.(.+)")
_CONDITION: Final = re.compile(rf"({_CHANNEL})\s*(==|!=|>=|<=|>|<)\s*(-?[\d.]+)")
_RANGE: Final = re.compile(r"\{(\d+)\.\.(\d+)\}")
_OPERATORS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    **{"==": operator.eq, "!=": operator.ne, ">=": operator.ge, "<=": operator.le},
    **{">": operator.gt, "<": operator.lt},
}
_UNIT_NORM: Final = 0.1  # a quaternion further from length 1 is none (all zero: not set)
_PRESSURE_MOST: Final = 2e5  # Pa; no air is that dense


@dataclass(frozen=True, slots=True)
class Read:
    """A field of a message: of ``instance``, or of the one that ``chooser`` (a field) names."""

    message: str
    field: str
    instance: int = 0
    chooser: tuple[str, str] | None = None

    @property
    def key(self) -> str:
        """The key of the message in a log."""
        return f"{self.message}[{self.instance}]" if self.instance else self.message


@dataclass(frozen=True, slots=True)
class Term:
    """``factor`` times a function (None: identity) of readings; without readings a number.

    Examples
    --------
    >>> source("2*norm(XKF1.VN, XKF1.VE)").terms[0].function
    'norm'
    """

    factor: float
    function: str | None = None
    reads: tuple[Read, ...] = ()


@dataclass(frozen=True, slots=True)
class Condition:
    """A reading compared with a number."""

    read: Read
    compare: Callable[[Any, Any], Any] = field(repr=False)
    number: float


@dataclass(frozen=True, slots=True)
class Source:
    """A sum of terms; ``unit`` (a dialect's spelling) where the log states none."""

    terms: tuple[Term, ...]
    unit: str | None
    group: str | None
    conditions: tuple[Condition, ...]

    @property
    def reads(self) -> tuple[Read, ...]:
        """All readings of the terms, in order."""
        return tuple(read for term in self.terms for read in term.reads)


@dataclass(frozen=True, slots=True)
class Function:
    """What a source may apply to readings.

    ``kernel`` is over arrays. ``takes``: SI units of the arguments, None: any, one for all.
    ``gives``: SI unit of the value, None: that of the arguments. ``is_of_array``: the argument is
    an array of four, whose elements the kernel gets.
    """

    kernel: Callable[..., Floats]
    takes: tuple[str, ...] | None = None
    gives: str | None = None
    is_of_array: bool = False


def _euler(number: int) -> Callable[..., Floats]:
    """Return the kernel of roll (0), pitch (1) or yaw (2), rad, 3-2-1, of w, x, y, z."""

    def angle(w: Floats, x: Floats, y: Floats, z: Floats) -> Floats:
        if number == 0:
            value = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        elif number == 1:
            value = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
        else:
            value = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        length = np.sqrt(w * w + x * x + y * y + z * z)
        return np.where(np.abs(length - 1) < _UNIT_NORM, value, np.nan)

    return angle


def _origin(north: Floats, east: Floats) -> Floats:
    return np.arctan2(-east, -north)


def wrap(angle: Floats) -> Floats:
    """Return angles folded to -pi..pi, rad."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _heading(angle: Floats) -> Floats:
    return angle % (2 * np.pi)


def _quotient(part: Floats, whole: Floats) -> Floats:
    made: Floats = np.divide(part, whole, out=np.full(part.shape, np.nan), where=whole > 0)
    return made


def _height_wanted(error: Floats, roll: Floats, pitch: Floats) -> Floats:
    """Return demanded minus actual height: what PX4 sends from 1.14 on, and the negative before.

    The same change took the demanded roll and pitch out of the message; they are 0 ever since.
    """
    is_new = not (np.any(roll) or np.any(pitch))
    return error if is_new else -error


def _pressure(told: Floats) -> Floats:
    """Return an air pressure that some versions of PX4 send as Pa in a field of hPa."""
    return np.where(told > _PRESSURE_MOST, told / 100, told)


def _norm(*parts: Floats) -> Floats:
    squares = sum((part * part for part in parts[1:]), parts[0] * parts[0])
    return np.sqrt(squares)


FUNCTIONS: Final[dict[str, Function]] = {
    "norm": Function(_norm),
    "from": Function(_origin, gives="rad"),  # where a vector towards north, east comes from
    "roll": Function(_euler(0), ("",), "rad", is_of_array=True),
    "pitch": Function(_euler(1), ("",), "rad", is_of_array=True),
    "yaw": Function(_euler(2), ("",), "rad", is_of_array=True),
    "force": Function(_quotient, ("m/s", "s"), "m/s^2"),  # an integral over its time
    "rate": Function(_quotient, ("rad", "s"), "rad/s"),
    "wrap": Function(wrap, ("rad",)),  # to -pi..pi
    "heading": Function(_heading, ("rad",)),  # to 0..2 pi
    "height_wanted": Function(_height_wanted, ("m", "rad", "rad"), "m"),  # of PX4
    "pressure": Function(_pressure, ("Pa",), "Pa"),  # likewise
}


def read(text: str) -> Read:
    """Return the reading that a channel's text names."""
    found = _READ.fullmatch(text)
    if found is None:
        raise FdiError(f"{text!r} is no field of a message")
    name, instance, message, other, label = found.groups()
    return Read(name, label, int(instance or 0), (message, other) if message else None)


def source(text: str) -> Source:
    """Return the source that a text describes.

    Raises
    ------
    FdiError
        The text does not follow the rules of this module: the table has a mistake.
    """
    found = _SOURCE.fullmatch(text)
    if found is None:
        raise FdiError(f"{text!r} is no source")
    total, unit, group, conditions = found.groups()
    return Source(
        tuple(_terms(total)),
        unit,
        group,
        tuple(_condition(part) for part in conditions.split(" and ")) if conditions else (),
    )


def _terms(text: str) -> Iterator[Term]:
    parts = _SPLIT.split(text if text.startswith("-") else f"+{text}")
    for sign, part in zip(parts[1::2], parts[2::2], strict=True):
        found = _TERM.fullmatch(part)
        if found is None:
            raise FdiError(f"{part!r} in {text!r} is no term")
        factor, function, arguments, channel, number = found.groups()
        scale = (-1.0 if sign == "-" else 1.0) * float(factor or number or 1)
        if function is not None and function not in FUNCTIONS:
            raise FdiError(f"{text!r}: no function {function}")
        names = [channel] if channel else re.split(r"\s*,\s*", arguments) if arguments else []
        yield Term(scale, function, tuple(map(read, names)))


def _condition(text: str) -> Condition:
    found = _CONDITION.fullmatch(text.strip())
    if found is None:
        raise FdiError(f"{text!r} is no condition")
    return Condition(read(found[1]), _OPERATORS[found[2]], float(found[3]))


def expanded(fields: Mapping[str, list[str]]) -> Iterator[tuple[str, list[str]]]:
    """Yield the fields with every range written out."""
    for name, texts in fields.items():
        found = _RANGE.search(name)
        if found is None:
            yield name, texts
            continue
        for n in range(int(found[1]), int(found[2]) + 1):
            written = [t.replace("{n}", str(n)).replace("{n-1}", str(n - 1)) for t in texts]
            yield name.replace(found[0], str(n)), written
