"""How does a log read that was cut, sent twice or recorded at another time, in three formats?

In: the bytes of an intact log. Out: its records with their times, and the bytes of others. A time
is the recorder's stamp in a tlog; the first field (``TimeUS``, ``TimeMS``) of a DataFlash record;
the field ``timestamp`` of a ULog topic. What carries none (definitions, parameters) has None and
stays where it is.
"""

import struct
from collections.abc import Iterable
from typing import NamedTuple

SIZES = {  # of the plain types of a ULog
    **dict.fromkeys(("int8_t", "uint8_t", "bool", "char"), 1),
    **dict.fromkeys(("int16_t", "uint16_t"), 2),
    **dict.fromkeys(("int32_t", "uint32_t", "float"), 4),
    **dict.fromkeys(("int64_t", "uint64_t", "double"), 8),
}
TIMES = ("timestamp", "timestamp_sample")
CLOCKS = {"TimeUS": ("<Q", 1e6), "TimeMS": ("<I", 1e3)}


class Piece(NamedTuple):
    """A record: its message, s since the first record with a time, and where such times stand.

    ``clocks``: byte, format and ticks per second of every time that counts from the boot.
    """

    name: str
    t: float | None
    data: bytes
    clocks: tuple[tuple[int, str, float], ...] = ()

    def later(self, seconds: float) -> bytes:
        """Return its bytes with all times since boot later."""
        data = bytearray(self.data)
        for at, form, ticks in self.clocks:
            (value,) = struct.unpack_from(form, data, at)
            struct.pack_into(form, data, at, value + round(seconds * ticks))
        return bytes(data)


def pieces(data: bytes) -> list[Piece]:
    """Return the records of a log; joined they are its bytes."""
    split = ulog if data[:4] == b"ULog" else dataflash if data[:2] == b"\xa3\x95" else telemetry
    return split(data)


def joined(some: Iterable[Piece]) -> bytes:
    return b"".join(piece.data for piece in some)


def telemetry(data: bytes) -> list[Piece]:
    """Return the records of a tlog: the recorder's stamp and a MAVLink frame."""
    found, at, first = [], 0, None
    while at < len(data):
        head = data[at + 8 : at + 15]
        is_second = head[0] == 0xFD
        assert is_second or head[0] == 0xFE, f"not intact at byte {at}"
        size = head[1] + ((25 if head[2] & 1 else 12) if is_second else 8)
        (stamp,) = struct.unpack_from(">Q", data, at)
        first = stamp if first is None else first
        sender = data[at + 13] if is_second else data[at + 11]
        number = int.from_bytes(data[at + 15 : at + 18], "little") if is_second else data[at + 13]
        clocks = ((0, ">Q", 1e6),)
        end = at + 8 + size
        found.append(Piece(f"{sender}/{number}", (stamp - first) / 1e6, data[at:end], clocks))
        at = end
    return found


def dataflash(data: bytes) -> list[Piece]:
    """Return the records of a binary DataFlash log."""
    layouts: dict[int, tuple[str, int, str]] = {0x80: ("FMT", 89, "")}
    found, at, first = [], 0, None
    while at < len(data):
        layout = layouts.get(data[at + 2]) if data[at : at + 2] == b"\xa3\x95" else None
        if layout is None or at + layout[1] > len(data):  # cut, or between records
            end = data.find(b"\xa3\x95", at + 1)
            found.append(Piece("", None, data[at : end if end > 0 else len(data)]))
            at += len(found[-1].data)
            continue
        name, size, label = layout
        record = data[at : at + size]
        at += size
        if record[2] == 0x80:
            own, columns = (
                record[k : k + n].split(b"\0")[0].decode() for k, n in ((5, 4), (25, 64))
            )
            layouts[record[3]] = own, record[4], columns.split(",")[0]
        if label not in CLOCKS:
            found.append(Piece(name, None, record))
            continue
        form, ticks = CLOCKS[label]
        stamp = struct.unpack_from(form, record, 3)[0] / ticks
        first = stamp if first is None else first
        found.append(Piece(name, stamp - first, record, ((3, form, ticks),)))
    return found


def ulog(data: bytes) -> list[Piece]:
    """Return header and messages of a ULog without appended parts."""
    (start,) = struct.unpack_from("<Q", data, 8)
    formats: dict[str, list[tuple[str, int, str]]] = {}
    topics: dict[int, str] = {}
    found, at = [Piece("", None, data[:16], ((8, "<Q", 1e6),))], 16
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<HB", data, at)
        record = data[at : at + 3 + size]
        body = record[3:]
        at += 3 + size
        if kind == ord("F"):
            name, _, fields = body.decode().partition(":")
            formats[name] = [member(text) for text in fields.split(";") if text]
        elif kind == ord("A"):
            topics[int.from_bytes(body[1:3], "little")] = body[3:].decode()
        elif kind in b"LC":
            place = 4 if kind == ord("L") else 6
            found.append(Piece("", None, record, ((place, "<Q", 1e6),)))
            continue
        if kind != ord("D"):
            found.append(Piece("", None, record))
            continue
        name = topics[int.from_bytes(body[:2], "little")]
        clocks = tuple((5 + k, "<Q", 1e6) for k in places(name, formats, *TIMES))
        (stamp,) = struct.unpack_from("<Q", record, clocks[0][0])
        found.append(Piece(name, (stamp - start) / 1e6, record, clocks))
    return found


def member(text: str) -> tuple[str, int, str]:
    """Return type, number and name of a declared field."""
    kind, _, name = text.partition(" ")
    kind, _, count = kind.partition("[")
    return kind, int(count.rstrip("]") or 1), name


def places(name: str, formats: dict[str, list[tuple[str, int, str]]], *wanted: str) -> list[int]:
    """Return where the wanted fields of a topic begin."""
    at, found = 0, []
    for kind, count, own in formats[name]:
        if own in wanted:
            found.append(at)
        at += count * size_of(kind, formats)
    return found


def size_of(kind: str, formats: dict[str, list[tuple[str, int, str]]]) -> int:
    if kind in SIZES:
        return SIZES[kind]
    return sum(count * size_of(inner, formats) for inner, count, _ in formats[kind])


def until(end: float, data: bytes) -> bytes:
    """Return the log without what was recorded from a time on, s."""
    return joined(piece for piece in pieces(data) if piece.t is None or piece.t < end)


def later(seconds: float, data: bytes) -> bytes:
    """Return the log as if the recorder's clock had been ahead; of a tlog, its UTC."""
    return b"".join(piece.later(seconds) for piece in pieces(data))


def twice(data: bytes) -> bytes:
    """Return the log with every record that carries a time twice in a row."""
    return b"".join(piece.data * (1 if piece.t is None else 2) for piece in pieces(data))


def with_garbage(data: bytes) -> bytes:
    """Return the log with bytes behind it that belong to nothing.

    A record that was cut at the end is left out: they would complete it.
    """
    last = pieces(data)[-1]
    whole = data if last.name else data[: -len(last.data)]
    return whole + bytes(range(7, 256, 3)) * 40
