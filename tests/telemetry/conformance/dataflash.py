"""Do the columns of a DataFlash log hold what DFReader reads?

Raw values are compared before DFReader applies the scale of the legacy characters. In SI the rule
is: a legacy character has its own scale, every other one the multiplier that the file states,
which DFReader leaves out.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Final

from pymavlink import DFReader

from fdi.telemetry import Log, Message, read
from fdi.telemetry.formats.dataflash.layouts import numbered, si_unit, true_unit
from fdi.units import Conversion

from .comparison import Comparison

LEGACY: Final = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
TEXT: Final = "nNZ"
ENTRIES: Final = 32  # of the one array character


@dataclass(frozen=True, slots=True)
class _Units:
    """The file's UNIT, MULT and FMTU: by character, by character, by message."""

    unit: Mapping[str, str]
    multiplier: Mapping[str, float]
    of_message: Mapping[str, tuple[str, str]]

    def conversion(
        self, name: str, label: str, index: int, character: str
    ) -> tuple[Conversion | None, str]:
        """Return what the file says that a field is in SI, and which reason applies."""
        units, multipliers = self.of_message.get(name, ("", ""))
        if index >= len(units) or units[index] not in self.unit:
            return None, ""
        scale, reason = LEGACY.get(character, 1.0), ""
        stated = multipliers[index : index + 1]
        if character not in LEGACY and stated and stated not in "-?":
            scale = self.multiplier.get(stated, 1.0)
            reason = "multiplier" if scale != 1 else ""
        said = self.unit[units[index]]
        true = true_unit(numbered(name), label, said, is_float=character in "fd")
        reason = reason if true == said else "corrected"
        unit = si_unit(true)
        return Conversion(unit.unit, scale * unit.scale, unit.offset), reason


def compare_dataflash(path: Path) -> Comparison:
    """Return what the comparison of a binary log found."""
    found = Comparison(path.name, "dataflash")
    reader = DFReader.DFReader_binary(str(path))
    rows: dict[str, list[Any]] = defaultdict(list)
    of_message: dict[str, tuple[str, str]] = {}
    while (record := reader.recv_msg()) is not None:
        found.records += 1
        rows[record.get_type()].append(record)
        if record.get_type() == "FMTU" and record.FmtType in reader.formats:
            name = reader.formats[record.FmtType].name
            of_message[name] = record.UnitIds, record.MultIds
    units = _Units(reader.unit_lookup, reader.mult_lookup, of_message)
    log = read(path)
    for name, records in sorted(rows.items()):
        for ours, theirs in _parts(log, name, records, found):
            _compare_message(ours, theirs, units, found)
    return found


def _parts(
    log: Log, name: str, records: Sequence[Any], found: Comparison
) -> Iterator[tuple[Message, Sequence[Any]]]:
    """Yield our message of each instance with the records that belong to it."""
    ours = [m for m in log.messages.values() if m.name == name and m.made_from is None]
    total = sum(m.stamp.size for m in ours)
    if not found.demand(total == len(records), f"{name}: {total} for {len(records)} records"):
        return
    if len(ours) == 1:
        yield ours[0], records
        return
    field = _instance_field(ours)
    if found.demand(field is not None, f"{name}: split, but by no field"):
        for message in ours:
            wanted = message.instance or 0
            yield message, [r for r in records if getattr(r, field) == wanted]


def _instance_field(parts: Sequence[Message]) -> str | None:
    """Return the field that has the instance's number in every record of every part."""
    for field in parts[0].fields:
        if all(
            not p.columns[field].is_text and bool((p.raw(field) == (p.instance or 0)).all())
            for p in parts
        ):
            return field
    return None


def _compare_message(
    ours: Message, theirs: Sequence[Any], units: _Units, found: Comparison
) -> None:
    names = iter(ours.fields)
    for index, character in enumerate(theirs[0].fmt.format):
        values = [record._elements[index] for record in theirs]
        columns: list[Sequence[Any]] = [values]
        if character == "a":
            columns = list(zip(*values, strict=True))
        elif character in TEXT:
            is_binary = ours.name == "FILE" and character == "Z"
            columns = [[value.decode("latin-1") if is_binary else _text(value) for value in values]]
        label = theirs[0].fmt.columns[index] if index < len(theirs[0].fmt.columns) else ""
        stated, reason = units.conversion(ours.name, label, index, character)
        for name, column in zip(islice(names, len(columns)), columns, strict=True):
            found.compare_raw(ours, name, column)
            if character in TEXT:
                continue
            if stated is None:
                found.explained["unstated"] += len(column)
            elif character == "L" and stated.unit != "rad":
                found.compare_si(ours, name, _DEGREES, "corrected")
            else:
                found.compare_si(ours, name, stated, reason)


_DEGREES: Final = Conversion("rad", 1e-7 * si_unit("deg").scale)


def _text(value: bytes) -> str:
    cut = value.split(b"\0")[0]
    try:
        return cut.decode("utf-8")
    except UnicodeDecodeError:
        return cut.decode("latin-1")
