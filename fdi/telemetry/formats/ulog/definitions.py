"""What do the messages of a ULog say that hold no data?

In: type and body of one message. Out: a `Format`, a `Subscription`, a `Key` with its value, a
`Logged` text; and of a format the `Layout`, with nested formats resolved and flattened to single
values.

=========  =========================================================================
type       body (PX4 user guide, "ULog File Format")
=========  =========================================================================
B          compat[8], incompat[8], uint64 appended_offsets[3]
F          ``name:type field;type[n] field;...``
I, P       key length u8, key ``type name``, value
M          is_continued u8, then as I
Q          bit mask u8 (1 system, 2 current setup), then as P
A          multi id u8, message id u16, format name
R          message id u16: unsubscribed
L          level (ASCII 0 to 7), uint64 stamp us, text
C          level, tag u16, stamp, text
S          sync: 8 fixed bytes
O          dropout: duration u16 ms
=========  =========================================================================

Nested names are flattened as ``esc[0].esc_rpm``. Sizes are computed before anything is listed: a
format that no message could hold is none, whatever its array sizes say.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

TYPES: Final = {
    **{"int8_t": "i1", "int16_t": "<i2", "int32_t": "<i4", "int64_t": "<i8"},
    **{"uint8_t": "u1", "uint16_t": "<u2", "uint32_t": "<u4", "uint64_t": "<u8"},
    **{"float": "<f4", "double": "<f8", "bool": "u1", "char": "S1"},
}
_NUMBERS: Final = {
    **{"int8_t": "<b", "int16_t": "<h", "int32_t": "<i", "int64_t": "<q", "bool": "<B"},
    **{"uint8_t": "<B", "uint16_t": "<H", "uint32_t": "<I", "uint64_t": "<Q"},
    **{"float": "<f", "double": "<d"},
}
_SIZES: Final = {name: np.dtype(dtype).itemsize for name, dtype in TYPES.items()}
LARGEST: Final = 0xFFFF - 2  # bytes of fields that one message can hold
_ANY: Final = 1 << 16
SIZES: Final = {  # of the bodies of the known types, data aside
    **{ord("B"): range(40, _ANY), ord("F"): range(3, _ANY), ord("A"): range(4, _ANY)},
    **{ord("I"): range(2, _ANY), ord("M"): range(3, _ANY), ord("P"): range(2, _ANY)},
    **{ord("Q"): range(3, _ANY), ord("L"): range(9, _ANY), ord("C"): range(11, _ANY)},
    **{ord("R"): range(2, 3), ord("S"): range(8, 9), ord("O"): range(2, 3)},
}
_SYNC: Final = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_FLAGS: Final = (bytes(8), b"\1" + bytes(7))  # incompatible flags that are known
_KEY_AT: Final = {"I": 0, "M": 1, "P": 0, "Q": 1}
_TEXT_AT: Final = {"L": 9, "C": 11}
_SEVERITIES: Final = range(8)
_NO_TEXT: Final = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f\x7f]")
_PADDING: Final = "_padding"
_DEEPEST: Final = 16  # formats within formats
_WORD: Final = r"[A-Za-z0-9_\-/]+"
_FIELD: Final = re.compile(rf"({_WORD})(?:\[([0-9]{{1,10}})\])? +({_WORD})", re.ASCII)
_KEY: Final = re.compile(r"(\w+)(?:\[([0-9]{1,10})\])? +([\x21-\x7e]+(?: [\x21-\x7e]+)*)", re.ASCII)
_TOPIC: Final = re.compile(_WORD, re.ASCII)


class Member(NamedTuple):
    """One declared field: its type, how many of it (0: no array), its name."""

    kind: str
    length: int
    name: str


@dataclass(frozen=True, slots=True)
class Format:
    """A format as it is written: nested formats are names still."""

    name: str
    members: tuple[Member, ...]


class Field(NamedTuple):
    """One value of a record: where in the body behind the message id, and its type.

    ``plain`` is the name without indices, by which units are known: ``esc.esc_rpm``.
    """

    name: str
    plain: str
    offset: int
    dtype: str

    @property
    def is_text(self) -> bool:
        """Whether the values are `str`."""
        return self.dtype.startswith("S")


@dataclass(frozen=True, slots=True)
class Layout:
    """What the records of a topic look like.

    ``size`` and ``full``: bytes of the fields without and with the padding at the end, which may
    be left out of a message.
    """

    topic: str
    fields: tuple[Field, ...]
    size: int
    full: int

    def field(self, name: str) -> Field | None:
        """Return a field by name, None where there is none."""
        return next((f for f in self.fields if f.name == name), None)

    @property
    def stamp(self) -> Field | None:
        """Return the field that says when a record was made, None where there is none."""
        found = self.field("timestamp")
        return found if found is not None and found.dtype == "<u8" else None


class Subscription(NamedTuple):
    """From byte ``since`` on, messages with this id are records of an instance of a topic."""

    since: int
    number: int
    instance: int
    topic: str


class Key(NamedTuple):
    """A key with its value as bytes, from an I, M, P or Q message; ``length`` of an array.

    ``before``: the byte before it: of an M message 1 where it goes on with the one before, of a Q
    message whose default it tells.
    """

    kind: str
    length: int | None
    name: str
    raw: bytes
    before: int = 0

    @property
    def is_continued(self) -> bool:
        """Whether an M message goes on with the one before."""
        return self.before == 1

    def value(self) -> float | str | None:
        """Return a text or number, None where it is neither."""
        if self.kind == "char":
            return self.raw.decode("utf-8", "replace")
        if self.length is not None:
            return None
        number: float = struct.unpack(_NUMBERS[self.kind], self.raw)[0]
        return number


class Logged(NamedTuple):
    """A text of the autopilot: severity (0 emergency to 7 debug), us since boot."""

    severity: int
    stamp: int
    text: str


Content = Format | Subscription | Key | Logged | bytes


def parsed(kind: int, body: bytes, at: int) -> Content | None:
    """Return what a message at a byte says, None where the body cannot be one of its type."""
    letter = chr(kind)
    if len(body) not in SIZES.get(kind, ()):
        return None
    if letter in _KEY_AT:
        return _key(body[: _KEY_AT[letter]], body[_KEY_AT[letter] :])
    if letter in _TEXT_AT:
        return _logged(body, _TEXT_AT[letter])
    if letter == "F":
        return _format(body)
    if letter == "A":
        return _subscription(body, at)
    if (letter == "S" and body != _SYNC) or (letter == "B" and body[8:16] not in _FLAGS):
        return None
    return body


def _format(body: bytes) -> Format | None:
    name, colon, text = body.decode("latin-1").partition(":")
    members = []
    for part in text.split(";"):
        found = _FIELD.fullmatch(part.strip()) if part else None
        if found is not None:
            kind, count, field = found.groups()
            members.append(Member(kind, int(count or 0), field))
        if part and (found is None or (found[2] and not members[-1].length)):
            return None
    is_format = colon and members and _TOPIC.fullmatch(name)
    return Format(name, tuple(members)) if is_format else None


def _subscription(body: bytes, since: int) -> Subscription | None:
    instance, number = struct.unpack_from("<BH", body)
    topic = body[3:].decode("latin-1")
    return Subscription(since, number, instance, topic) if _TOPIC.fullmatch(topic) else None


def _key(before: bytes, body: bytes) -> Key | None:
    end = 1 + body[0]
    found = _KEY.fullmatch(body[1:end].decode("latin-1"))
    size = 0 if found is None else _SIZES.get(found[1], 0)
    if found is None or not size:
        return None
    count = None if found[2] is None else int(found[2])
    # texts that are continued keep the first part's length when a tool has copied the log
    if len(body) - end != size * (1 if count is None else count) and (size > 1 or count is None):
        return None
    return Key(found[1], count, found[3], body[end:], before[0] if before else 0)


def _logged(body: bytes, start: int) -> Logged | None:
    severity = body[0] - ord("0")
    if severity not in _SEVERITIES or _NO_TEXT.search(body, start):
        return None
    stamp = int.from_bytes(body[start - 8 : start], "little")
    return Logged(severity, stamp, body[start:].decode("utf-8", "replace"))


def extent(name: str, formats: Mapping[str, Format]) -> tuple[int, int] | None:
    """Return the bytes of a format without and with the padding at its end.

    None where a part of it is missing or circular, or where no message could hold it.
    """
    sizes: dict[str, int] = {}
    full = _size(name, formats, sizes, _DEEPEST)
    if not full:
        return None
    tail = 0
    for member in reversed(formats[name].members):
        if not member.name.startswith(_PADDING):
            break
        tail += _extent(member, sizes)
    return full - tail, full


def resolve(name: str, formats: Mapping[str, Format]) -> Layout | None:
    """Return the layout of a format, None where it has no `extent`."""
    found = extent(name, formats)
    if found is None:
        return None
    fields: list[Field] = []
    _flatten(formats[name], formats, Field("", "", 0, ""), fields)
    if len({one.name for one in fields}) < len(fields):
        fields = _told_apart(fields)
    return Layout(name, tuple(fields), *found)


def _told_apart(fields: Sequence[Field]) -> list[Field]:
    made: dict[str, Field] = {}
    seen: dict[str, int] = {}
    for one in fields:
        label = one.name
        while label in made:
            seen[one.name] = seen.get(one.name, 1) + 1
            label = f"{one.name}_{seen[one.name]}"
        made[label] = one._replace(name=label)
    return list(made.values())


def _size(name: str, formats: Mapping[str, Format], sizes: dict[str, int], deep: int) -> int:
    """Return the bytes of a format, 0 where it cannot be; ``sizes`` remembers."""
    if name in sizes:
        return sizes[name]
    known = formats.get(name)
    sizes[name] = 0  # what asks for itself finds this
    total = 0
    for member in known.members if known is not None and deep else ():
        if member.kind not in TYPES:
            _size(member.kind, formats, sizes, deep - 1)
        size = _extent(member, sizes)
        total += size
        if not size or total > LARGEST:
            return 0
    sizes[name] = total
    return total


def _extent(member: Member, sizes: Mapping[str, int]) -> int:
    return (_SIZES.get(member.kind) or sizes.get(member.kind, 0)) * max(member.length, 1)


def _flatten(
    known: Format, formats: Mapping[str, Format], inside: Field, fields: list[Field]
) -> int:
    """Add the single values of a possible format; ``inside``: the beginning of names, offset.

    Returns the offset behind it.
    """
    prefix, plain, offset, _ = inside
    for kind, count, name in known.members:
        full, bare, times = prefix + name, plain + name, max(count, 1)
        if name.startswith(_PADDING) and kind in TYPES:
            offset += _SIZES[kind] * times
        elif kind == "char":
            fields.append(Field(full, bare, offset, f"S{times}"))
            offset += times
        else:
            for i in range(times):
                label = f"{full}[{i}]" if count else full
                if kind in TYPES:
                    fields.append(Field(label, bare, offset, TYPES[kind]))
                    offset += _SIZES[kind]
                else:
                    here = Field(f"{label}.", f"{bare}.", offset, "")
                    offset = _flatten(formats[kind], formats, here, fields)
    return offset
