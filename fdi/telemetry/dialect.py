"""What does a MAVLink message consist of?

In: a message number or name. Out: its `MessageDefinition`, from pymavlink's generated dialect
(which is imported at the first question, 50 ms). Only definitions are taken from pymavlink: its
message loop is too slow to read files with, and loses frames (see `formats/tlog/frames.py`).

Payload fields lie in wire order (by element size, extension fields last), packed, little endian.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

# Message numbers have 24 bits; all that are defined lie far below this, the last slot is "unknown".
ID_LIMIT: Final = 65535

_NUMPY: Final = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "uint8_t_mavlink_version": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
    "char": "S",
}


@dataclass(frozen=True, slots=True)
class FieldDefinition:
    """One field of a message: its place in the payload, type and unit.

    ``count`` is 0 for a scalar; a text is one field of type ``S<n>``. ``unit`` is the dialect's;
    ``is_code`` says that it names the values or bits.
    """

    name: str
    offset: int
    dtype: str
    count: int
    unit: str
    is_code: bool = False

    @property
    def is_text(self) -> bool:
        """Whether the field holds characters."""
        return self.dtype.startswith("S")


@dataclass(frozen=True, slots=True)
class MessageDefinition:
    """A message: number, name, payload size in bytes, fields in the order of the definition."""

    id: int
    name: str
    size: int
    fields: tuple[FieldDefinition, ...]
    instance_field: str | None


@dataclass(frozen=True, slots=True, eq=False)
class FrameChecks:
    """What the frame walk needs of every message number, as tables indexed by min(id, ID_LIMIT).

    ``extra`` : (65536,) int16, the CRC_EXTRA byte, -1 where the number is unknown;
    ``size`` : (65536,) int16, the payload's full length with extensions.
    """

    extra: NDArray[np.int16]
    size: NDArray[np.int16]


@cache
def _classes() -> Mapping[int, Any]:
    from pymavlink.dialects.v20 import ardupilotmega

    return MappingProxyType(dict(ardupilotmega.mavlink_map))


@cache
def frame_checks() -> FrameChecks:
    """Return the tables for the frame walk, read-only."""
    extra = np.full(ID_LIMIT + 1, -1, np.int16)
    size = np.zeros(ID_LIMIT + 1, np.int16)
    for number, message in _classes().items():
        if number < ID_LIMIT:
            extra[number] = message.crc_extra
            size[number] = message.unpacker.size
    extra.flags.writeable = size.flags.writeable = False
    return FrameChecks(extra, size)


@cache
def definition(number: int) -> MessageDefinition | None:
    """Return the definition of a message number, None when the dialect has none."""
    message = _classes().get(number)
    if message is None:
        return None
    units = message.fieldunits_by_name
    types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    counts = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    coded = {*message.fieldenums_by_name, *message.fielddisplays_by_name}
    placed: dict[str, FieldDefinition] = {}
    offset = 0
    for name in message.ordered_fieldnames:
        kind, count = _NUMPY[types[name]], counts[name]
        if kind == "S":
            kind, count = f"S{max(count, 1)}", 0
        is_code = name in coded
        placed[name] = FieldDefinition(name, offset, kind, count, units.get(name, ""), is_code)
        offset += np.dtype(kind).itemsize * max(count, 1)
    instance = getattr(message, "instance_field", None)
    return MessageDefinition(
        number,
        message.msgname,
        message.unpacker.size,
        tuple(placed[name] for name in message.fieldnames),
        instance,
    )


@cache
def _numbers() -> Mapping[str, int]:
    return MappingProxyType({c.msgname: number for number, c in _classes().items()})


def is_discrete(message: str, field: str, unit: str) -> bool:
    """Return whether there is nothing between two values of a field: codes, bits, counts, texts.

    Parameters
    ----------
    message, field : str
        As the dialect spells them; what it does not know is not discrete.
    unit : str
        The field's, as the dialect spells it or ought to; whole numbers without any are counts.
    """
    known = definition_by_name(message)
    found = next((f for f in known.fields if f.name == field), None) if known else None
    if found is None:
        return False
    is_count = np.dtype(found.dtype).kind in "iu" and not unit
    return found.is_code or found.is_text or is_count


def definition_by_name(name: str) -> MessageDefinition | None:
    """Return the definition of a message name (upper case), None when the dialect has none."""
    number = _numbers().get(name)
    return None if number is None else definition(number)


def orientation_names() -> tuple[str, ...]:
    """Return the ways in which a sensor may be mounted, ``NONE``, ``YAW_45`` and so on.

    As MAV_SENSOR_ORIENTATION numbers them, which autopilots' parameters do as well.
    """
    from pymavlink.dialects.v20 import ardupilotmega

    entries = ardupilotmega.enums["MAV_SENSOR_ORIENTATION"]
    prefix = "MAV_SENSOR_ROTATION_"
    names = (entries[number].name for number in sorted(entries))
    return tuple(name.removeprefix(prefix) for name in names if name.startswith(prefix))
