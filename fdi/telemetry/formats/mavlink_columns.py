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
from fdi.telemetry.dialect import FieldDefinition, MessageDefinition
from fdi.telemetry.formats.gather import gather
from fdi.telemetry.formats.mavlink_frames import Frames, payload_offsets
from fdi.telemetry.formats.repeated import kinds_of_rows
from fdi.telemetry.message import Column
from fdi.units import si

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

KEPT: Final = 256 << 20
"""Bytes: of a larger file the payloads do not stay in memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Payloads:
    """The payloads of one message of one sender, (m,) each.

    ``rows``: which frames of the file.
    """

    definition: MessageDefinition
    frames: Frames
    rows: Ints
    _cache: dict[str, Any] = field(default_factory=dict)

    def of(self, chosen: NDArray[np.bool_]) -> Payloads:
        """Return the payloads of some of the frames, by a mask (m,)."""
        block = {"block": self._cache["block"][chosen]} if "block" in self._cache else {}
        return Payloads(self.definition, self.frames, self.rows[chosen], block)

    def block(self) -> Bytes:
        """Return (m, size) bytes: the payloads at full length, what was cut is zero."""
        if "block" in self._cache:
            kept: Bytes = self._cache["block"]
            return kept
        block = self._gathered(0, self.definition.size)
        if self.frames.data.size <= KEPT:
            self._cache["block"] = block
        return block

    def _gathered(self, low: int, high: int) -> Bytes:
        """Return the bytes from low to high of every payload, (m, high - low)."""
        start, version = self.frames.start[self.rows], self.frames.version[self.rows]
        block = gather(self.frames.data, payload_offsets(start, version) + low, high - low)
        length = self.frames.length[self.rows]
        for short in np.flatnonzero(np.bincount(length, minlength=high)[:high]).tolist():
            block[length == short, max(short - low, 0) :] = 0
        return block

    def bytes_of(self, offset: int, width: int) -> Bytes:
        """Return some bytes of every payload, (m, width), perhaps not contiguous."""
        if "block" in self._cache or self.frames.data.size <= KEPT:
            return self.block()[:, offset : offset + width]
        return self._gathered(offset, offset + width)

    def values(self, wanted: FieldDefinition, index: int | None = None) -> NDArray[Any]:
        """Return one field, (m,), of an array field one entry; texts as `str`."""
        if wanted.is_text:
            return self._texts(wanted)
        kind = np.dtype(wanted.dtype)
        part = self.bytes_of(wanted.offset + kind.itemsize * (index or 0), kind.itemsize)
        # as items of the field's type, not as bytes: numpy copies these ten times as fast
        items: NDArray[Any] = part.view(kind)[:, 0]
        return np.ascontiguousarray(items)

    def _texts(self, wanted: FieldDefinition) -> NDArray[Any]:
        distinct, kind = self.texts(wanted.name)
        out = np.empty(len(distinct), object)
        out[:] = distinct
        return out[kind]

    def texts(self, name: str) -> tuple[list[str], Ints]:
        """Return the different texts of a field, and which of them every record has, (m,).

        They are cut at the first NUL; bytes beyond ASCII become U+FFFD.
        """
        if name not in self._cache:
            wanted = next(f for f in self.definition.fields if f.name == name)
            rows = self.bytes_of(wanted.offset, np.dtype(wanted.dtype).itemsize)
            first, kind = kinds_of_rows(rows)
            whole = [bytes(row).split(b"\0")[0].decode("ascii", "replace") for row in rows[first]]
            self._cache[name] = whole, kind
        found: tuple[list[str], Ints] = self._cache[name]
        return found

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


def columns(payloads: Payloads, *, autopilot: str, vehicle: str) -> dict[str, Column]:
    """Return a column for every field of the message, in the order of its definition."""
    made: dict[str, Column] = {}
    for wanted in payloads.definition.fields:
        meaning = mavlink_meaning(
            payloads.definition.name,
            wanted.name,
            wanted.unit,
            autopilot=autopilot,
            vehicle=vehicle,
        )
        for index in range(wanted.count) if wanted.count else (None,):
            name = wanted.name if index is None else f"{wanted.name}[{index}]"
            made[name] = Column(
                partial(payloads.values, wanted, index),
                si(meaning.unit),
                meaning.invalid,
                meaning.blank,
                partial(payloads.absent, wanted),
                wanted.is_text,
            )
    return made
