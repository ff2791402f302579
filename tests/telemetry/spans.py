"""Which bytes of a file belong to records that a reader believes, by format of the file?

The readers' own finders, without the columns: what the damage experiments count.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.dataflash.records import all_records
from fdi.telemetry.formats.tlog.frames import find_frames
from fdi.telemetry.formats.ulog.reader import _header
from fdi.telemetry.formats.ulog.records import find_records
from fdi.telemetry.formats.ulog.walk import words

Spans = NDArray[np.int64]


def _tlog(data: NDArray[np.uint8]) -> Spans:
    frames = find_frames(data, frame_checks())
    is_v2 = frames.version == 2
    is_signed = is_v2 & (data[frames.start + 10] & 1 == 1)
    size = np.where(is_v2, 20, 16) + frames.length + 13 * is_signed
    return np.stack((frames.start, frames.start + size), axis=1)


def _bin(data: NDArray[np.uint8]) -> Spans:
    return all_records(data).spans()


def _ulg(data: NDArray[np.uint8]) -> Spans:
    _, parts = _header(Path("log.ulg"), data)
    records = find_records(data, parts)
    found = [rows.at - 5 for rows in records.rows]
    low = np.sort(np.concatenate([*found, [other.start for other in records.others]]))
    low = low.astype(np.int64)
    spans = np.stack((low, low + 3 + words(data, "<u2")[low]), axis=1)
    return np.append([[0, 16]], spans, axis=0)


SPANS: Final[dict[str, Callable[[NDArray[np.uint8]], Spans]]] = {
    "tlog": _tlog,
    "bin": _bin,
    "ulg": _ulg,
}


def spans(data: bytes, kind: str) -> list[tuple[int, int]]:
    """Return first byte and end of every believed record, ascending."""
    found = SPANS[kind](np.frombuffer(data, np.uint8))
    return [(low, high) for low, high in found.tolist()]
