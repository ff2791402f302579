"""What does an ArduPilot DataFlash log in text form (`.log`) hold?

In: the bytes of the file. Out: a `Log`, as of the binary form: only its records come from lines.
After some free lines (board, version) come the definitions, then the records:

    FMT, <type>, <length>, <name>, <format>, <label>,<label>,...
    <name>, <value>, <value>, ...

Copter 3 sent that over the serial line, later tools write it. Separators are ``, `` or ``,``, lines
may end with CR; texts contain commas. Values have the scale of the format's characters already
(degrees, metres), not that of FMTU, and modes are names. The definition of FMT may lack its last
label. Lines are found by `text_lines`, records and columns by `text_columns`.

A last line without its end is left out: its last number may be cut, and nothing shows that.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.telemetry.formats.bounds import SINGLE
from fdi.telemetry.formats.dataflash.layouts import (
    CHARACTERS,
    FMT,
    MOST_LAYOUTS,
    Bytes,
    Field,
    Layout,
    fmt_layout,
    layout,
    with_known,
)
from fdi.telemetry.formats.dataflash.log import Finding, make_log
from fdi.telemetry.formats.dataflash.reader import definition_findings
from fdi.telemetry.formats.dataflash.text_columns import find_records
from fdi.telemetry.formats.dataflash.text_lines import BLANKS, whole_lines
from fdi.telemetry.formats.wording import clean_text
from fdi.telemetry.log import Log

_SNIFF: Final = 1 << 16  # bytes in which the first definition stands
_HEADING: Final = 4096  # bytes of free lines before it, at most
_DEFINITION: Final = re.compile(
    rb"FMT[ \t]*,[ \t]*([0-9]{1,3})[ \t]*,[ \t]*[0-9]{1,3}[ \t]*,[ \t]*([A-Z0-9]{1,4})[ \t\0]*,"
    rb"[ \t]*([A-Za-z]{0,16})[ \t\0]*,([^\r\n]*)"
)
_NAME: Final = re.compile(rb"[ \t]*([A-Z0-9]{1,4})[ \t]*,")
_INDENT: Final = 4  # blanks before a definition
_HEADER_SIZE: Final = 3  # of a binary record
_ENOUGH: Final = 10  # definitions, from which the firmware is known
_OFTEN: Final = 3  # lines that make a type
_MANY: Final = 5  # names that are told


def is_dataflash_text(data: Bytes) -> bool:
    """Return whether the bytes begin with lines of which one defines a record."""
    return next(_definitions(data[:_SNIFF]), None) is not None


def read_dataflash_text(path: Path, data: Bytes, *, system: int | None = None) -> Log:
    """Return the log; ``system`` is without meaning here, the file is of one vehicle.

    Raises
    ------
    LogError
        There is no record in it.
    """
    own = list(_definitions(data))
    layouts, not_followed = _layouts([one for _, one in own])
    found = find_records(data, layouts)
    if all(table.layout.number == FMT for table in found.tables):
        raise LogError("is a DataFlash text log without a record of data", where=path.name)
    first = min(own[0][0], int(min(table.start[0] for table in found.tables)))
    heading = found.strange[:, 1] <= min(first, _HEADING)
    strange = found.strange[~heading]
    findings = [
        *_strange_lines(strange),
        *_cut(data),
        *_bad_records(found.bad),
        *_unknown(data, strange, found.bad),
        *_not_followed(not_followed),
        *definition_findings(found.tables),
    ]
    free = [clean_text(_decoded(data, *line)) for line in found.strange[heading].tolist()]
    return make_log(
        path, "dataflash_text", data, found.tables, findings, heading=[x for x in free if _tells(x)]
    )


def _tells(line: str) -> bool:
    """Return whether a line before the records says more than which log of the board it is."""
    return bool(line) and not line.isdecimal()


def _decoded(data: Bytes, low: int, high: int) -> str:
    return data[low:high].tobytes().strip(BLANKS).decode("latin-1")


def _definitions(data: Bytes) -> Iterator[tuple[int, Layout]]:
    """Yield where the file defines which layout, as a binary log would define it."""
    whole = np.ascontiguousarray(data).data
    for found in _DEFINITION.finditer(whole):
        at = found.start()
        before = bytes(whole[max(at - _INDENT, 0) : at]).rstrip(b" \t")
        if before[-1:] not in ((b"", b"\n", b"\r") if at < _INDENT else (b"\n", b"\r")):
            continue  # in the middle of a line
        number, name, form = int(found[1]), found[2].decode(), found[3].decode()
        size = _HEADER_SIZE + sum(np.dtype(CHARACTERS[c]).itemsize for c in form if c in CHARACTERS)
        labels = found[4].strip(BLANKS).decode("latin-1")
        made = layout(number, name, size, form, labels) if number <= 0xFF else None
        if made is not None and made.fields:
            yield at, fmt_layout() if name == "FMT" else replace(made, since=at)


def _layouts(own: list[Layout]) -> tuple[dict[str, list[Layout]], int]:
    """Return the layouts by name, and how many definitions are beyond `MOST_LAYOUTS`.

    The first layout of a name holds from the start of the file.
    """
    versions: dict[str, list[Layout]] = {"FMT": [_in_words(fmt_layout())]}
    followed: list[Layout] = []
    not_followed = 0
    for one in own:
        known = versions.get(one.name, [])
        if known and (one.name == "FMT" or _in_words(one).fields == known[-1].fields):
            continue
        if len(followed) == MOST_LAYOUTS:
            not_followed += 1
            continue
        followed.append(one)
        versions[one.name] = [*known, _in_words(one if known else replace(one, since=0))]
    if len(versions) > _ENOUGH:
        once = [replace(one, since=0) for one in followed]
        for one in with_known(once, lambda choices: 0):
            if one.fields:
                versions.setdefault(one.name, [_in_words(one)])
    return versions, not_followed


def _in_words(one: Layout) -> Layout:
    """Return a layout as a text log has it: a word per field, decimals in double precision."""
    fields: dict[int, Field] = {}
    for field in one.fields:
        character = field.character
        if character == "a":  # no way is known in which an array is written
            name = field.name.partition("[")[0]
            fields.setdefault(field.place, field._replace(name=name, character="Z", dtype="S64"))
        else:
            is_float = character in "fdgcCeEL"
            fields[field.place] = field._replace(dtype="<f8" if is_float else field.dtype)
    return replace(one, fields=tuple(fields.values()), is_scaled=True)


def _strange_lines(strange: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> Iterator[Finding]:
    """Yield what lies between the records, with offsets and byte counts."""
    if not strange.size:
        return
    # line ends between: neighbours are told together
    breaks = np.flatnonzero(strange[1:, 0] - strange[:-1, 1] > 2) + 1
    places = np.split(strange, breaks)
    sizes = [int((place[:, 1] - place[:, 0]).sum()) for place in places]
    if len(places) > SINGLE:
        first, last = int(strange[0, 0]), int(places[-1][0, 0])
        text = f"lines that are no record: {len(strange)} lines in {len(places)} places, "
        text += f"{sum(sizes)} bytes in all, first at byte {first}, last at byte {last}"
        yield Finding("lost_bytes", first, last, sum(sizes), text)
        return
    for place, size in zip(places, sizes, strict=True):
        low = int(place[0, 0])
        lines = "1 line" if len(place) == 1 else f"{len(place)} lines"
        text = f"lines that are no record: {lines}, {size} bytes at byte {low}"
        yield Finding("lost_bytes", low, low, size, text)


def _cut(data: Bytes) -> Iterator[Finding]:
    """Yield what stands behind the last line end."""
    low = whole_lines(data)
    rest = data[low:].tobytes().strip(BLANKS)
    if rest:
        size = data.size - low
        text = f"the file ends in the middle of a line: {size} bytes at byte {low}"
        yield Finding("truncated", low, low, size, text)


def _bad_records(bad: dict[str, int]) -> Iterator[Finding]:
    if bad:
        count = sum(bad.values())
        text = f"{count} lines have not the values that their type has, each a number of its kind; "
        text += f"they are left out: {_counted(bad)}"
        yield Finding("invalid_values", None, None, count, text)


def _not_followed(count: int) -> Iterator[Finding]:
    if count:
        text = f"{count} definitions that change a type are not followed: no log has {MOST_LAYOUTS}"
        yield Finding("invalid_values", None, None, count, text)


def _unknown(
    data: Bytes, strange: np.ndarray[tuple[int, int], np.dtype[np.int64]], bad: dict[str, int]
) -> Iterator[Finding]:
    """Yield which types the lines that are no record seem to have."""
    heads = (data[low : min(low + 8, high)].tobytes() for low, high in strange.tolist())
    named = (_NAME.match(head) for head in heads)
    count = Counter(found[1].decode() for found in named if found)
    often = {name: n for name, n in count.items() if n >= _OFTEN and name not in bad}
    if often:
        total = sum(often.values())
        text = f"{total} lines are of types that neither the file nor known firmware defines: "
        yield Finding("unknown_message", None, None, total, text + _counted(often))


def _counted(count: dict[str, int]) -> str:
    most = sorted(count.items(), key=lambda item: (-item[1], item[0]))
    told = ", ".join(f"{n} {name}" for name, n in most[:_MANY])
    return told + (" and others" if len(most) > _MANY else "")
