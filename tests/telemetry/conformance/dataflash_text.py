"""Do the columns of a DataFlash text log hold what DFReader_text reads?

Values have the scale of the legacy characters already, in both. DFReader_text cuts a text at its
first ", ", and cannot make a clock of a log without weeks: it is asked for the records alone.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pymavlink import DFReader

from fdi.telemetry import Message, read

from .comparison import Comparison

TEXT: Final = "nNZ"
MODE: Final = "M"


class _Reader(DFReader.DFReader_text):  # type: ignore[misc]
    def init_clock(self) -> None:
        """Do without times."""


def compare_dataflash_text(path: Path) -> Comparison:
    """Return what the comparison of a text log found."""
    found = Comparison(path.name, "dataflash_text")
    reader = _Reader(str(path))
    rows: dict[str, list[Any]] = defaultdict(list)
    while (record := reader.recv_msg()) is not None:
        found.records += 1
        rows[record.get_type()].append(record)
    log = read(path)
    own = {message.name for message in log.messages.values() if message.made_from is None}
    found.demand(own == set(rows), f"messages: {sorted(own ^ set(rows))}")
    for name in sorted(own & set(rows)):
        parts = [m for m in log.messages.values() if m.name == name and m.made_from is None]
        if found.demand(len(parts) == 1, f"{name}: is split"):
            _compare_message(parts[0], rows[name], found)
    return found


def _compare_message(ours: Message, theirs: Sequence[Any], found: Comparison) -> None:
    form = theirs[0].fmt.format
    for index, (name, character) in enumerate(zip(ours.fields, form, strict=True)):
        words = [record._elements[index] for record in theirs]
        if character in TEXT or ours.columns[name].is_text:
            whole = [_whole(record, index) for record in theirs]
            found.explained["cut_text"] += sum(a != b for a, b in zip(words, whole, strict=True))
            found.compare_raw(ours, name, whole)
        elif character == MODE:
            found.compare_raw(ours, name, [int(word) for word in words])
        else:
            label = theirs[0].fmt.columns[index]
            found.compare_raw(ours, name, [getattr(record, label) for record in theirs])


def _whole(record: Any, index: int) -> str:
    """Return a text with what follows behind commas, which belongs to the last field."""
    is_last = index == len(record.fmt.format) - 1
    words = record._elements[index:] if is_last else [record._elements[index]]
    return ", ".join(words).strip()
