"""How do the payloads of one MAVLink message become columns?

In: where the payloads lie. Out: a `Column` per field (arrays: one per entry), decoded when asked.

MAVLink 2 cuts trailing zero bytes: a short payload means zeros. MAVLink 1 does not, there a field
beyond the payload was never sent: zero on the wire's side (as pymavlink), unknown in SI. A text
ends at its first NUL; old ArduPilot leaves rests of earlier texts behind it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import mavlink_meaning
from fdi.telemetry.dialect import FieldDefinition, MessageDefinition
from fdi.telemetry.formats.gather import gather
from fdi.telemetry.formats.mavlink_frames import Frames
from fdi.telemetry.message import Column
from fdi.units import si


@dataclass(frozen=True, slots=True, eq=False)
class Payloads:
    """The payloads of one message: ``rows`` are its frames, (m,)."""

    definition: MessageDefinition
    frames: Frames
    rows: NDArray[np.int64]
    _cache: dict[str, NDArray[np.uint8]] = field(default_factory=dict)

    def of(self, rows: NDArray[np.int64]) -> Payloads:
        """Return the payloads of some of the frames."""
        return Payloads(self.definition, self.frames, rows)

    def block(self) -> NDArray[np.uint8]:
        """Return (m, size) bytes: the payloads at full length, what was cut is zero."""
        if "block" not in self._cache:
            self._cache["block"] = self._block()
        return self._cache["block"]

    def _block(self) -> NDArray[np.uint8]:
        size, data = self.definition.size, self.frames.data
        at = self.frames.payload[self.rows]
        length = np.minimum(self.frames.length[self.rows], size)
        inside = at + size <= data.size
        block = np.zeros((at.size, size), np.uint8)
        if inside.any():
            block[inside] = gather(data, at[inside], size)
        for row in np.flatnonzero(~inside):  # the last few frames of the file at most
            block[row, : length[row]] = data[at[row] : at[row] + length[row]]
        for short in np.unique(length[length < size]):
            block[length == short, short:] = 0
        return block

    def values(self, wanted: FieldDefinition) -> NDArray[Any]:
        """Return one field, (m,) or (m, count); texts as `str`."""
        width = np.dtype(wanted.dtype).itemsize * max(wanted.count, 1)
        part = np.ascontiguousarray(self.block()[:, wanted.offset : wanted.offset + width])
        if wanted.is_text:
            return _texts(part)
        values: NDArray[Any] = part.view(wanted.dtype)
        return values if wanted.count else values.reshape(-1)

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


def _texts(characters: NDArray[np.uint8]) -> NDArray[Any]:
    """Return (m,) str from (m, n) bytes, cut at the first NUL; bytes beyond ASCII become U+FFFD."""
    whole = characters.view(f"S{characters.shape[1]}").reshape(-1)
    distinct, place = np.unique(whole, return_inverse=True)
    decoded = [bytes(t).split(b"\0")[0].decode("ascii", "replace") for t in distinct]
    out = np.empty(len(decoded), object)
    out[:] = decoded
    return out[place]


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
                _loader(payloads, wanted, index),
                si(meaning.unit),
                meaning.invalid,
                meaning.blank,
                _absence(payloads, wanted),
                wanted.is_text,
            )
    return made


def _loader(
    payloads: Payloads, wanted: FieldDefinition, index: int | None
) -> Callable[[], NDArray[Any]]:
    def load() -> NDArray[Any]:
        values = payloads.values(wanted)
        return values if index is None else np.ascontiguousarray(values[:, index])

    return load


def _absence(payloads: Payloads, wanted: FieldDefinition) -> Callable[[], NDArray[np.bool_] | None]:
    def absent() -> NDArray[np.bool_] | None:
        return payloads.absent(wanted)

    return absent
