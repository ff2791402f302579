"""How does a small DataFlash log become a large one?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

GAP_US = 100_000  # between two repetitions
DEFINITIONS = {"FMT", "FMTU", "UNIT", "MULT"}


def repeated(base: bytes, size: int) -> Iterator[bytes]:
    """Yield the pieces of a log of at least that size."""
    places, spans, head = [], [], []
    stamped: dict[int, bool] = {}
    for number, name, start, end in records(base):
        if name in DEFINITIONS:
            head.append(base[start:end])
            if name == "FMT":
                # labels at byte 25; all logs since 2015 have the time in the first field
                stamped[base[start + 3]] = base[start + 25 : start + 31] == b"TimeUS"
            continue
        spans.append((start, end))
        if stamped.get(number):
            places.append((start, end))
    keep = np.zeros(len(base), np.bool_)
    for start, end in spans:
        keep[start:end] = True
    new_place = np.cumsum(keep) - 1
    block = np.frombuffer(base, np.uint8)[keep]
    at = new_place[np.array([start + 3 for start, _ in places])][:, None] + np.arange(8)
    times = block[at].view("<u8").reshape(-1)
    period = int(times.max() - times.min()) + GAP_US
    yield b"".join(head)
    for i in range(-(-size // block.size)):
        part = block.copy()
        part[at] = (times + np.uint64(i * period)).view(np.uint8).reshape(-1, 8)
        yield part.tobytes()


def records(data: bytes) -> Iterator[tuple[int, str, int, int]]:
    """Yield type, name, first byte and end of every record of an intact log."""
    layouts = {0x80: ("FMT", 89)}
    at = 0
    while at + 3 <= len(data) and data[at + 2] in layouts:
        number = data[at + 2]
        name, length = layouts[number]
        if data[at : at + 2] != b"\xa3\x95" or at + length > len(data):
            return
        if number == 0x80:
            layouts[data[at + 3]] = data[at + 5 : at + 9].rstrip(b"\0").decode(), data[at + 4]
        yield number, name, at, at + length
        at += length
