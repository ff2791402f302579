"""What do the definitions of a ULog say: formats, subscriptions, keys with their values?

In: the body of one message. Out: a `Format`, a `Layout` (the format with nested ones resolved and
flattened to single values), a `Subscription`, a `Key`.

=========  =========================================================================
type       body (PX4 user guide, "ULog File Format")
=========  =========================================================================
B          compat[8], incompat[8], uint64 appended_offsets[3]
F          ``name:type field;type[n] field;...``
I, P       key length u8, key ``type name``, value
M          is_continued u8, then as I
Q          bit mask u8 (1 system, 2 current setup), then as P
A          multi id u8, message id u16, format name
=========  =========================================================================

Nested names are flattened as ``esc[0].esc_rpm``. Sizes are computed before anything is listed: a
format that no message could hold is none, whatever its array sizes say.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

TYPES: Final = {
    **{"int8_t": "i1", "int16_t": "<i2", "int32_t": "<i4", "int64_t": "<i8"},
    **{"uint8_t": "u1", "uint16_t": "<u2", "uint32_t": "<u4", "uint64_t": "<u8"},
    **{"float": "<f4", "double": "<f8", "bool": "u1", "char": "S1"},
}
LARGEST: Final = 0xFFFF - 2  # bytes of fields that one message can hold
_DEEPEST: Final = 16  # formats within formats
_WORD: Final = r"[A-Za-z0-9_\-/]+"
_FORMAT: Final = re.compile(rf"({_WORD}):(.*)", re.ASCII | re.DOTALL)
_FIELD: Final = re.compile(rf"({_WORD})(?:\[([0-9]{{1,10}})\])? +({_WORD})", re.ASCII)
_KEY: Final = re.compile(rf"({_WORD})(?:\[([0-9]{{1,10}})\])? +([\x21-\x7e]+(?: [\x21-\x7e]+)*)")
_TOPIC: Final = re.compile(_WORD, re.ASCII)


@dataclass(frozen=True, slots=True)
class Member:
    """One declared field: its type, how many of it (0: no array), its name."""

    kind: str
    count: int
    name: str


@dataclass(frozen=True, slots=True)
class Format:
    """A format as it is written: nested formats are names still."""

    name: str
    members: tuple[Member, ...]


@dataclass(frozen=True, slots=True)
class Field:
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


@dataclass(frozen=True, slots=True)
class Subscription:
    """From byte ``since`` on, messages with this id are records of an instance of a topic."""

    since: int
    number: int
    instance: int
    topic: str


@dataclass(frozen=True, slots=True)
class Key:
    """A key with its value as bytes, from an I, M, P or Q message; ``count`` of an array."""

    kind: str
    count: int | None
    name: str
    raw: bytes

    @property
    def is_whole(self) -> bool:
        """Whether the value has the size that the key states."""
        dtype = TYPES.get(self.kind)
        count = 1 if self.count is None else self.count
        return dtype is not None and len(self.raw) == np.dtype(dtype).itemsize * count

    def value(self) -> float | str | None:
        """Return a text or number, None where it is neither."""
        if self.kind == "char":
            return self.raw.decode("utf-8", "replace")
        if self.count is not None or not self.is_whole:
            return None
        number: float = np.frombuffer(self.raw, TYPES[self.kind])[0].item()
        return number


def parse_format(body: bytes) -> Format | None:
    """Return the format that an F message defines, None where the text is none."""
    try:
        found = _FORMAT.fullmatch(body.decode("ascii"))
    except UnicodeDecodeError:
        return None
    if found is None:
        return None
    members = []
    for text in filter(None, found[2].split(";")):
        field = _FIELD.fullmatch(text.strip())
        if field is None or (field[2] and not int(field[2])):
            return None
        members.append(Member(field[1], int(field[2] or 0), field[3]))
    return Format(found[1], tuple(members)) if members else None


def parse_subscription(body: bytes, since: int) -> Subscription | None:
    """Return the subscription of an A message, None where it names no topic."""
    if len(body) < 4:
        return None
    instance, number = struct.unpack_from("<BH", body)
    topic = body[3:].decode("latin-1")
    return Subscription(since, number, instance, topic) if _TOPIC.fullmatch(topic) else None


def parse_key(body: bytes) -> Key | None:
    """Return key and value from the key's length on, None where there is no key."""
    if not body or len(body) < 1 + body[0]:
        return None
    end = 1 + body[0]
    found = _KEY.fullmatch(body[1:end].decode("latin-1"))
    if found is None:
        return None
    return Key(found[1], None if found[2] is None else int(found[2]), found[3], body[end:])


def resolve(name: str, formats: Mapping[str, Format]) -> Layout | None:
    """Return the layout of a format, None where a part of it is missing, circular or too large."""
    sizes: dict[str, int] = {}
    full = _size(name, formats, sizes, _DEEPEST)
    if not full:
        return None
    tail = 0
    for member in reversed(formats[name].members):
        if not member.name.startswith("_padding"):
            break
        tail += _extent(member, sizes)
    fields: list[Field] = []
    taken: set[str] = set()
    for field in _flat(name, formats, sizes, ("", "", 0)):
        label = field.name
        while label in taken:
            label += "_"
        taken.add(label)
        fields.append(Field(label, field.plain, field.offset, field.dtype))
    return Layout(name, tuple(fields), full - tail, full)


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
    dtype = TYPES.get(member.kind)
    one = np.dtype(dtype).itemsize if dtype else sizes.get(member.kind, 0)
    return one * max(member.count, 1)


def _flat(
    name: str,
    formats: Mapping[str, Format],
    sizes: Mapping[str, int],
    place: tuple[str, str, int],
) -> Iterator[Field]:
    """Yield the single values of a possible format; place: names so far, offset."""
    prefix, plain, offset = place
    for member in formats[name].members:
        size = _extent(member, sizes)
        dtype = TYPES.get(member.kind)
        full, bare = prefix + member.name, plain + member.name
        if member.name.startswith("_padding"):
            pass
        elif member.kind == "char":
            yield Field(full, bare, offset, f"S{size}")
        else:
            step = size // max(member.count, 1)
            for i in range(max(member.count, 1)):
                label = f"{full}[{i}]" if member.count else full
                at = offset + i * step
                if dtype:
                    yield Field(label, bare, at, dtype)
                else:
                    yield from _flat(member.kind, formats, sizes, (f"{label}.", f"{bare}.", at))
        offset += size
