"""How does a small ULog become a large one?"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

GAP_US = 100_000  # between two repetitions


def repeated(base: bytes, size: int) -> Iterator[bytes]:
    """Yield the pieces of a log of at least that size; the definitions and subscriptions once."""
    head, body, places = [base[:16]], [], []
    first: dict[bytes, bool] = {}  # by topic: its time stands first, as in all logs of PX4
    number_of: dict[bytes, bytes] = {}
    length = 0
    for kind, message in messages(base):
        if kind == b"F":
            name, _, fields = message[3:].partition(b":")
            first[name] = fields.startswith(b"uint64_t timestamp;")
        elif kind == b"A":
            number_of[message[4:6]] = message[6:]
        if kind in b"FAIMPQ":
            head.append(message)
        if kind != b"D":
            continue
        if first.get(number_of.get(message[3:5], b"")):
            places.append(length + 5)
        body.append(message)
        length += len(message)
    block = np.frombuffer(b"".join(body), np.uint8)
    at = np.array(places)[:, None] + np.arange(8)
    times = block[at].view("<u8").reshape(-1)
    period = int(times.max() - times.min()) + GAP_US
    yield b"".join(head)
    for i in range(-(-size // block.size)):
        part = block.copy()
        part[at] = (times + np.uint64(i * period)).view(np.uint8).reshape(-1, 8)
        yield part.tobytes()


def messages(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield type and bytes of every message of an intact ULog."""
    at = 16
    while at + 3 <= len(data):
        (size,) = struct.unpack_from("<H", data, at)
        if at + 3 + size > len(data):
            return
        yield data[at + 2 : at + 3], data[at : at + 3 + size]
        at += 3 + size
