"""Writes a binary DataFlash log as text, as the ground stations do, from what DFReader reads."""

import math
from collections.abc import Iterator
from pathlib import Path

from pymavlink import DFReader

SCALES = {"c": 2, "C": 2, "e": 2, "E": 2, "L": 7}  # decimals of the legacy characters


def text_lines(path: Path, *, separator: str = ", ", ending: str = "\r\n") -> Iterator[bytes]:
    """Yield the lines: definitions as they come, values with the scale of their character."""
    yield f"1{ending}{ending}Free RAM: 1331{ending}".encode()
    reader = DFReader.DFReader_binary(str(path))
    while (record := reader.recv_msg()) is not None:
        name = record.get_type()
        values = [
            _word(value, character)
            for value, character in zip(record._elements, record.fmt.format, strict=True)
        ]
        yield (separator.join([name, *values]) + ending).encode("latin-1")


def _word(value: object, character: str) -> str:
    if character in SCALES:
        return f"{value / 10 ** SCALES[character]:.{SCALES[character]}f}"
    if isinstance(value, bytes):
        return value.split(b"\0")[0].decode("latin-1")
    if isinstance(value, float) and not math.isnan(value):
        return repr(value)
    return str(value)
