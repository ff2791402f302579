"""How are the records of a DataFlash log laid out, and in what unit is each field?

In: the bytes. Out: `Layout`s, from the file's own FMT, FMTU, UNIT and MULT records, and from the
carried table of known firmware where the file's are missing.

A definition is believed only when it fits together (name, characters, length): a false header
``A3 95 80`` in damaged bytes would spoil the rest. Type ids move between firmware versions, so a
missing one is taken only from a version whose other definitions agree with the file's.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache, lru_cache
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.bytes.texts import distinct
from fdi.units import Conversion, si

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

FMT: Final = 0x80
FMT_LENGTH: Final = 89
_OWN_FORM: Final = ("FMT", FMT_LENGTH, "BBnNZ")
LENGTHS: Final = range(3, 256)
MOST_LAYOUTS: Final = 2000  # that a file may define; logs have 200. Each costs 5 kB and 0.2 ms
CHARACTERS: Final = {
    **{"a": "<i2", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4"},
    **{"q": "<i8", "Q": "<u8", "f": "<f4", "d": "<f8", "g": "<f2", "c": "<i2", "C": "<u2"},
    **{"n": "S4", "N": "S16", "Z": "S64", "M": "u1", "L": "<i4", "e": "<i4", "E": "<u4"},
}
_WIDTHS: Final = {character: np.dtype(code).itemsize for character, code in CHARACTERS.items()}
_LEGACY: Final = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
_NAME: Final = re.compile(r"[A-Z0-9]{1,4}")
_LABEL: Final = re.compile(r"[^A-Za-z0-9_]")
_PLAIN: Final = re.compile(r"[A-Za-z0-9_,]*")
_ARRAY: Final = 32  # entries of the one array character
_AGREE: Final = 0.8  # share of the file's definitions that a known version must have alike


class Field(NamedTuple):
    """One field of a record (one entry of an array): place in it, header included, and type."""

    name: str
    offset: int
    dtype: str
    character: str
    place: int  # of the format's character

    @property
    def is_text(self) -> bool:
        """Whether the values are `str`."""
        return self.character in "nNZ"


@dataclass(frozen=True, slots=True)
class Layout:
    """What the records of a type look like from byte ``since`` on."""

    number: int
    name: str
    length: int
    fields: tuple[Field, ...]
    since: int = 0
    is_known: bool = False  # from the table, not from the file
    is_scaled: bool = False  # values have the scale of the legacy characters already
    renamed: tuple[str, ...] = ()  # fields whose labels are no names

    def field(self, name: str) -> Field | None:
        """Return a field by name, None where there is none."""
        return next((f for f in self.fields if f.name == name), None)

    @property
    def shape(self) -> tuple[str, int, tuple[Field, ...]]:
        """What tells two layouts apart."""
        return self.name, self.length, self.fields


def layout(number: int, name: str, length: int, form: str, labels: str) -> Layout | None:
    """Return the layout of a definition, None where it does not fit together."""
    if not _NAME.fullmatch(name) or length not in LENGTHS:
        return None
    if any(c not in CHARACTERS for c in form):
        return None
    names = given = labels.split(",")
    if not _PLAIN.fullmatch(labels):
        names = [_LABEL.sub("_", label.strip()) for label in names]
    fields: list[Field] = []
    taken: set[str] = set()
    renamed: list[str] = []
    offset = 3
    for i, character in enumerate(form):
        dtype = CHARACTERS[character]
        label = names[i] if i < len(names) and names[i] else f"field_{i}"
        while label in taken:
            label += "_"
        taken.add(label)
        if i >= len(given) or label != given[i].strip():
            renamed.append(label)
        width = _WIDTHS[character]
        for entry in range(_ARRAY) if character == "a" else (None,):
            full = label if entry is None else f"{label}[{entry}]"
            fields.append(Field(full, offset, dtype, character, i))
            offset += width
    if offset != length:
        return None
    return Layout(number, name, length, tuple(fields), renamed=tuple(renamed))


def defined(data: Bytes, places: Ints) -> tuple[list[Layout], Ints]:
    """Return the layouts that the file defines, and which definitions define nothing.

    Those beyond `MOST_LAYOUTS` count as false ones.

    Parameters
    ----------
    data : (n,) uint8
    places : (m,) int, ascending
        Where headers of definitions stand. One that the file's end cuts defines nothing, but it is
        no false one either.
    """
    places = places[places + FMT_LENGTH <= data.size]
    bodies = gather(data, places + 3, FMT_LENGTH - 3)
    first, which = distinct(bodies)
    each = [definition(bodies[row].tobytes()) for row in first.tolist()]
    is_false = np.array([one is None for one in each], np.bool_)[which]
    latest: dict[int, Layout] = {}
    made: list[Layout] = []
    # a type's first definition holds from the start, another one from its place on
    changes = np.flatnonzero(np.diff(which, prepend=-1))
    for row, end in pairwise([*changes.tolist(), places.size]):
        place, one = int(places[row]), each[which[row]]
        old = None if one is None else latest.get(one.number)
        if one is None or one is old:
            continue
        if old is None or old.shape != one.shape:
            if len(made) == MOST_LAYOUTS:
                is_false[row:end] = True
                continue
            made.append(replace(one, since=0 if old is None else place))
        latest[one.number] = one
    return made, places[is_false]


def definition(body: bytes) -> Layout | None:
    """Return the layout that the body of an FMT record defines, None where it is none."""
    name, form, labels = (
        text.split(b"\0")[0].decode("latin-1").strip()
        for text in (body[2:6], body[6:22], body[22:86])
    )
    made = layout(body[0], name, body[1], form, labels)
    if made is None or body[0] != FMT:
        return made
    # what gives definitions another shape than the one by which it was found is none
    return fmt_layout() if (name, made.length, form) == _OWN_FORM else None


def with_known(own: list[Layout], best_of: Callable[[list[list[Layout]]], int]) -> list[Layout]:
    """Return the layouts with missing ones added from the known firmware that fits best.

    ``best_of`` says which of several sets of layouts explains most of the file; it decides where
    the file defines too little to tell.
    """
    mine = {one.number: one for one in own}
    versions = known_versions()
    if len(mine) > 10:
        best = max(versions, key=lambda v: _alike(mine, versions[v]))
        both = [n for n in mine if n in versions[best]]
        if _alike(mine, versions[best]) < _AGREE * max(len(both), 1):
            return own
    else:
        choices = [[*own, *_missing(mine, known)] for known in versions.values()]
        return choices[best_of(choices)]
    return [*own, *_missing(mine, versions[best])]


def _alike(mine: Mapping[int, Layout], known: Mapping[int, Layout]) -> int:
    return sum(n in known and known[n].shape == one.shape for n, one in mine.items())


def _missing(mine: Mapping[int, Layout], known: Mapping[int, Layout]) -> Iterator[Layout]:
    names = {one.name for one in mine.values()}
    for number, one in known.items():
        if number not in mine and one.name not in names:
            yield one


@cache
def known_versions() -> dict[str, dict[int, Layout]]:
    """Return the layouts by type of each known firmware."""
    known = data_table("known_dataflash")
    versions: dict[str, dict[int, Layout]] = {}
    for version, types in known["versions"].items():
        versions[version] = {}
        for number, row in types.items():
            name, length, form, labels = known["rows"][row][:4]
            one = layout(int(number), name, length, form, labels)
            if one is not None:
                made = Layout(one.number, one.name, one.length, one.fields, 0, True)
                versions[version][one.number] = made
    for types in versions.values():
        types.setdefault(FMT, fmt_layout())
    return versions


def fmt_layout() -> Layout:
    """Return the layout of the definitions themselves, which is the same in every log."""
    name, length, form = _OWN_FORM
    made = layout(FMT, name, length, form, "Type,Length,Name,Format,Columns")
    assert made is not None
    return made


@cache
def known_units() -> dict[tuple[str, str, str], tuple[str, str]]:
    """Return unit and multiplier characters by (message, field, format character)."""
    found: dict[tuple[str, str, str], tuple[str, str]] = {}
    for row in data_table("known_dataflash")["rows"]:
        name, _, form, labels, units, multipliers = row
        for label, *rest in zip(
            labels.split(","), form, units or "", multipliers or "", strict=False
        ):
            found.setdefault((name, label, rest[0]), (rest[1], rest[2]))
    return found


@dataclass(frozen=True, slots=True)
class Units:
    """The file's own UNIT, MULT and FMTU: by character, by character, by type."""

    unit: Mapping[str, str]
    multiplier: Mapping[str, float]
    of_type: Mapping[int, tuple[str, str]]

    def characters(self, one: Layout, field: Field) -> tuple[str, str]:
        """Return unit and multiplier character of a field, "?" where nobody says."""
        stated, i = self.of_type.get(one.number), field.place
        if stated is not None and i < len(stated[0]):
            return stated[0][i], stated[1][i : i + 1] or "-"
        name = numbered(one.name)
        return known_units().get((name, field.name, field.character), ("?", "-"))

    def conversion(self, one: Layout, field: Field) -> Conversion:
        """Return what makes SI of the raw number.

        The multiplier does not concern characters with a scale of their own: there it is wrong
        (1.0 for NTUN.TAsp, whose raw 2200 is 22 m/s). Nor some floats (POS.RelHomeAlt, in metres
        where FMTU says hundredths).
        """
        unit, multiplier = self.characters(one, field)
        scale = _LEGACY.get(field.character)
        is_whole = field.character in "fd" and f"{numbered(one.name)}.{field.name}" in _whole()
        if is_whole or (scale is not None and one.is_scaled):
            scale = 1.0
        elif scale is None:
            scale = self.multiplier.get(multiplier, 1.0) if multiplier not in "-?" else 1.0
        stated = self.unit.get(unit, "UNKNOWN")
        if field.character == "L":  # Copter 3.6 says "us" of longitudes
            stated = "deg"
        return _conversion(one.name, field.name, stated, scale, is_float=field.character in "fd")

    def instance_field(self, one: Layout) -> Field | None:
        """Return the field that numbers instances."""
        marked = (f for f in one.fields if f.dtype == "u1" and self.characters(one, f)[0] == "#")
        return next(marked, None)


@lru_cache(maxsize=1)
def _whole() -> frozenset[str]:
    return frozenset(data_table("units_dataflash")["whole"])


@lru_cache(maxsize=4096)
def _conversion(
    message: str, field: str, stated: str, scale: float, *, is_float: bool
) -> Conversion:
    unit = true_unit(numbered(message), field, stated, is_float=is_float)
    name, factor, offset = si_unit(unit)
    return Conversion(name, scale * factor, offset)


def numbered(name: str) -> str:
    """Return the name of a message without the instance in it: IMU of IMU2."""
    key: str = data_table("mavlink_dataflash")["instances"].get(name, name)
    return key.partition("[")[0]


def true_unit(name: str, field: str, stated: str, *, is_float: bool = False) -> str:
    """Return the unit of a field where what FMTU states of it is wrong, or nothing."""
    tables = data_table("units_dataflash")
    found = dict(tables["wrong"])
    if stated in ("", "UNKNOWN"):
        found.update(tables["silent"])
        found.update(tables["silent_floats"] if is_float else {})
    matching = (u for pattern, u in found.items() if fnmatchcase(f"{name}.{field}", pattern))
    unit: str = next(matching, stated)
    return unit


def si_unit(unit: str) -> Conversion:
    """Return the conversion to SI of a unit as UNIT spells it."""
    row = data_table("units_dataflash")["si"].get(unit)
    if row is not None:
        return Conversion(*row)
    return Conversion("us") if unit == "us" else si(unit)  # a pulse width, not a time
