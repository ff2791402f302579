"""How do the payloads of one MAVLink message become columns?

In: where the payloads lie. Out: a `Column` per field (arrays: one per entry), decoded when asked.

MAVLink 2 cuts trailing zero bytes: a short payload means zeros. MAVLink 1 does not, there a field
beyond the payload was never sent: zero on the wire's side (as pymavlink), unknown in SI. A text
ends at its first NUL; old ArduPilot leaves rests of earlier texts behind it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import mavlink_meaning
from fdi.telemetry.dialect import FieldDefinition, MessageDefinition, is_discrete
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.bytes.repeated import kinds_of_rows
from fdi.telemetry.formats.tlog.frames import Frames, payload_offsets
from fdi.telemetry.message import Column
from fdi.units import si

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

KEPT: Final = 256 << 20
"""Bytes: of a larger file the payloads do not stay in memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Payloads:
    """The payloads of one message of one sender, (m,) each.

    ``rows``: which frames of the file. The first field that is asked for brings the payloads, (m,
    size) bytes at full length, of which the fields are views: to find them in the file is what
    takes the time.
    """

    definition: MessageDefinition
    frames: Frames
    rows: Ints
    _kept: list[Bytes] = field(default_factory=list)

    def of(self, chosen: NDArray[np.bool_] | Ints) -> Payloads:
        """Return the payloads of some of the frames, by a mask (m,) or rows, ascending."""
        kept = [block[chosen] for block in self._kept]
        return Payloads(self.definition, self.frames, self.rows[chosen], kept)

    def _part(self, at: int, kind: np.dtype[Any]) -> NDArray[Any]:
        """Return an item of every payload, (m,): what was cut is zero."""
        end = at + kind.itemsize
        if not self._kept and self.frames.data.size > KEPT:
            return self._gathered(at, end).view(kind)[:, 0]
        if not self._kept:
            self._kept.append(self._gathered(0, self.definition.size))
        part: NDArray[Any] = self._kept[0][:, at:end].view(kind)[:, 0]
        return part

    def _gathered(self, low: int, high: int) -> Bytes:
        """Return the bytes from low to high of every payload, (m, high - low)."""
        start, version = self.frames.start[self.rows], self.frames.version[self.rows]
        block = gather(self.frames.data, payload_offsets(start, version) + low, high - low)
        length = self.frames.length[self.rows]
        for short in np.flatnonzero(np.bincount(length, minlength=high)[:high]).tolist():
            block[length == short, max(short - low, 0) :] = 0
        return block

    def values(self, wanted: FieldDefinition, index: int | None = None) -> NDArray[Any]:
        """Return one field, (m,), of an array field one entry; texts as `str`."""
        kind = np.dtype(wanted.dtype)
        if not wanted.is_text:
            return self._part(wanted.offset + kind.itemsize * (index or 0), kind)
        distinct, which = self.texts(wanted.name)
        out = np.empty(len(distinct), object)
        out[:] = distinct
        return out[which]

    def texts(self, name: str) -> tuple[list[str], Ints]:
        """Return the different texts of a field, and which of them every record has, (m,).

        They are cut at the first NUL; bytes beyond ASCII become U+FFFD.
        """
        wanted = next(f for f in self.definition.fields if f.name == name)
        rows = np.ascontiguousarray(self._part(wanted.offset, np.dtype(wanted.dtype)))
        rows = rows.view(np.uint8).reshape(rows.size, -1)
        first, which = kinds_of_rows(rows)
        whole = [bytes(row).split(b"\0")[0].decode("ascii", "replace") for row in rows[first]]
        return whole, which

    def field(self, name: str) -> NDArray[Any]:
        """Return one field by name."""
        return self.values(next(f for f in self.definition.fields if f.name == name))

    def has(self, name: str) -> bool:
        """Return whether the message has a field of that name."""
        return any(f.name == name for f in self.definition.fields)

    def absent(self, wanted: FieldDefinition) -> NDArray[np.bool_] | None:
        """Return in which records the field was not sent; None where in all of them it was."""
        short = self.frames.length[self.rows] <= wanted.offset
        short &= self.frames.version[self.rows] == 1
        return short if short.any() else None


def columns(
    payloads: Payloads, *, autopilot: str, vehicle: str, recorded: str | None
) -> dict[str, Column]:
    """Return a column for every field of the message, in the order of its definition."""
    made: dict[str, Column] = {}
    for wanted in payloads.definition.fields:
        meaning = mavlink_meaning(
            payloads.definition.name,
            wanted.name,
            wanted.unit,
            autopilot=autopilot,
            vehicle=vehicle,
            recorded=recorded,
        )
        discrete = is_discrete(payloads.definition.name, wanted.name, meaning.unit)
        for index in range(wanted.count) if wanted.count else (None,):
            name = wanted.name if index is None else f"{wanted.name}[{index}]"
            made[name] = Column(
                partial(payloads.values, wanted, index),
                si(meaning.unit),
                meaning.invalid,
                meaning.blank,
                partial(payloads.absent, wanted),
                wanted.is_text,
                meaning.range,
                discrete,
            )
    return made
