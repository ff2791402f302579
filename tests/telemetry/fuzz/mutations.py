"""Which input belongs to a number?

The number seeds the choice of a head and of one to four mutations; every choice comes from there,
so that a number and the heads at hand are all that is needed to make an input again.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as mav

from .heads import Head, heads, message, telemetry_records

LARGEST: Final = 1 << 18  # bytes of an input; the extreme ones are that long
_MAGICS: Final = (b"\xfd", b"\xfe", b"\xa3\x95\x80", b"\xa3\x95", b"ULog\x01\x12\x35", b"FMT, ")
_SYNC: Final = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
EXTREMES: Final = (
    b"\0" * 8,
    b"\xff" * 8,
    b"\x7f" + b"\xff" * 7,
    b"\x80" + b"\0" * 7,
    struct.pack("<d", float("nan")),
    struct.pack("<d", float("inf")),
    struct.pack("<ff", float("nan"), float("-inf")),
    struct.pack("<ff", 3.4e38, -3.4e38),
    struct.pack("<q", -1_000_000),
    struct.pack("<Q", 2**63),
    struct.pack(">Q", 2**63),
    struct.pack(">Q", 1_700_000_000_000_000),
)
_NUMBERS: Final = (
    b"1e999",
    b"-1e999",
    b"nan",
    b"inf",
    b"",
    b"0x10",
    b"1_0",
    b"9" * 40,
    b"-",
    b"\xff",
)


@dataclass(frozen=True, slots=True)
class Input:
    """A file to try, and how it came about."""

    number: int
    data: bytes
    story: str


def make_input(number: int) -> Input:
    """Return the input of a number."""
    random = Random(number)
    head = random.choice(heads())
    chunks, story = list(head.chunks), [f"{head.kind} {head.name}"]
    if random.random() < 0.1:
        made = random.choice(_WHOLE)
        data = made(random)
        return Input(number, data, made.__name__.strip("_"))
    for _ in range(random.choice((1, 1, 2, 3, 4))):
        change = random.choice(_OF_CHUNKS + _OF_KIND[head.kind])
        story.append(change.__name__.strip("_"))
        chunks = change(random, head, chunks) or [b"\0"]
    data = b"".join(chunks)[:LARGEST]
    for _ in range(random.choice((0, 0, 1, 1, 2))):
        alter = random.choice(_OF_BYTES)
        story.append(alter.__name__.strip("_"))
        data = alter(random, data)
    return Input(number, data[:LARGEST], ", ".join(story))


def reader_of(number: int) -> str:
    """Return the kind of the head that the input of a number is made of."""
    return Random(number).choice(heads()).kind


# Whole records, messages, lines.


def _nothing(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    return chunks


def _leave_out(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    share = random.choice((0.01, 0.1, 0.5, 0.9))
    return [chunk for chunk in chunks if random.random() > share]


def _swap(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    chunks = list(chunks)
    for _ in range(random.randint(1, 20)):
        i, k = random.randrange(len(chunks)), random.randrange(len(chunks))
        chunks[i], chunks[k] = chunks[k], chunks[i]
    return chunks


def _reverse_run(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    low, high = sorted(random.randrange(len(chunks) + 1) for _ in range(2))
    return chunks[:low] + chunks[low:high][::-1] + chunks[high:]


def _repeat_run(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    low, high = sorted(random.randrange(len(chunks) + 1) for _ in range(2))
    times = random.choice((2, 3, 10))
    return chunks[:high] + chunks[low:high] * times + chunks[high:]


def _repeat_one_often(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    i = random.randrange(len(chunks))
    times = min(random.choice((10, 1000, 5000)), LARGEST // 2 // max(len(chunks[i]), 1))
    return chunks[:i] + [chunks[i]] * times + chunks[i:]


def _splice_other(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    other = random.choice(heads()).chunks
    at, low, high = (
        random.randrange(len(chunks) + 1),
        *sorted(random.choices(range(len(other)), k=2)),
    )
    return chunks[:at] + list(other[low:high]) + chunks[at:]


def _behead(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    return chunks[random.randrange(len(chunks)) :]


# Formats.


def _rewrite_frames(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Change payload, sender, number or length of frames and give them right checksums again."""
    count = random.choice((1, 3, 20, len(chunks)))
    for i in random.sample(range(len(chunks)), min(count, len(chunks))):
        chunks[i] = _rewritten(random, chunks[i])
    return chunks


def _rewritten(random: Random, record: bytes) -> bytes:
    if len(record) < 16 or record[8] not in (0xFD, 0xFE):
        return record
    is_v2 = record[8] == 0xFD
    start = 18 if is_v2 else 14
    stamp, header = record[:8], bytearray(record[8:start])
    payload = bytearray(record[start : start + record[9]])
    what = random.choice(("payload", "extreme", "number", "sender", "length", "stamp", "sequence"))
    if what == "payload":
        payload = bytearray(random.randbytes(len(payload)))
    elif what == "extreme" and payload:
        at = random.randrange(len(payload))
        value = random.choice(EXTREMES)
        payload[at : at + 8] = value[: max(len(payload) - at, 0)]
    elif what == "number":
        number = random.choice(_KNOWN)
        if is_v2:
            header[7:10] = number.to_bytes(3, "little")
        elif number < 256:
            header[5] = number
    elif what == "sender":
        header[5 if is_v2 else 3] = random.choice((0, 1, 2, 51, 255))
        header[6 if is_v2 else 4] = random.choice((0, 1, 68, 190, 255))
    elif what == "length":
        size = random.choice((0, 1, 2, len(payload) // 2, len(payload) + 1, 255))
        payload = (payload + bytearray(random.randbytes(255)))[: min(size, 255)]
    elif what == "stamp":
        stamp = random.choice(EXTREMES)
    else:
        header[4 if is_v2 else 2] = random.randrange(256)
    header[1] = len(payload)
    is_signed = is_v2 and header[2] & 1
    frame = with_checksum(stamp + bytes(header + payload) + b"\0\0")
    return frame + (random.randbytes(13) if is_signed else b"")


def with_checksum(record: bytes) -> bytes:
    """Return the record of a telemetry log with the checksum that its bytes have."""
    if len(record) < 16 or record[8] not in (0xFD, 0xFE):
        return record
    is_v2 = record[8] == 0xFD
    end = (18 if is_v2 else 14) + record[9]
    number = int.from_bytes(record[15:18], "little") if is_v2 else record[13]
    known = mav.mavlink_map.get(number)
    extra = bytes([known.crc_extra]) if known else b""
    check = mav.x25crc(record[9:end] + extra).crc
    return record[:end] + struct.pack("<H", check) + record[end + 2 :]


_KNOWN: Final = sorted(mav.mavlink_map)


def _change_header(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Change a byte among the first of some chunks: magic, length, type, flags."""
    reach = {"tlog": 18, "bin": 3, "log": 8, "ulg": 6}[head.kind]
    for _ in range(random.choice((1, 2, 10))):
        i = random.randrange(len(chunks))
        chunk = bytearray(chunks[i])
        if chunk:
            at = random.randrange(min(reach, len(chunk)))
            chunk[at] = random.choice((0, 1, 2, 0xFF, 0xFE, chunk[at] ^ 1, random.randrange(256)))
            chunks[i] = bytes(chunk)
    return chunks


def _change_times(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Put an extreme or a shifted time into records, where the format has it."""
    place = {"tlog": 0, "bin": 3, "log": 0, "ulg": 5}[head.kind]
    from_here = random.randrange(len(chunks))
    shift = random.choice((-1, 1)) * random.choice((10**3, 10**6, 10**8, 10**12, 2**32, 2**62))
    order = ">Q" if head.kind == "tlog" else "<Q"
    for i in range(from_here, min(from_here + random.choice((1, 5, 1000)), len(chunks))):
        chunk = chunks[i]
        if head.kind == "log" or len(chunk) < place + 8 or (head.kind == "bin" and chunk[2] == 128):
            continue
        (old,) = struct.unpack_from(order, chunk, place)
        new = struct.pack(order, (old + shift) % 2**64)
        chunks[i] = chunk[:place] + new + chunk[place + 8 :]
    return chunks


def _change_definition(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Change a FMT record: number, length, name, characters, labels."""
    found = [
        i for i, chunk in enumerate(chunks) if chunk[:3] == b"\xa3\x95\x80" and len(chunk) == 89
    ]
    again = []
    for i in random.sample(found, min(len(found), random.choice((1, 2, 5)))):
        record = bytearray(chunks[i])
        what = random.choice(("number", "length", "name", "form", "labels", "fit"))
        if what == "number":
            record[3] = random.choice((0, 128, 255, random.randrange(256)))
        elif what == "length":
            record[4] = random.choice((0, 1, 2, 3, 4, 88, 255, record[4] ^ 1))
        elif what == "name":
            record[5:9] = random.choice(
                (b"\0\0\0\0", b"ATT\0", b"../x", b"A\xffB\0", b"FMT\0", b"GPS\0")
            )
        elif what == "form":
            record[9:25] = bytes(random.choice(b"abBhHiIqQfdgcCeELMnNZ\0?") for _ in range(16))
        elif what == "labels":
            labels = random.choice((b"", b"," * 40, b"TimeUS," * 9, b"I,I,I,I", b"a b/..,\xff,\n"))
            record[25:89] = labels.ljust(64, b"\0")[:64]
        else:  # other characters whose sizes make the length: a valid other layout
            form = [random.choice("bBhHiIqQfdgcCeELMnNZa") for _ in range(random.randrange(17))]
            record[9:25] = "".join(form).encode().ljust(16, b"\0")
            record[4] = min(3 + sum(SIZES[c] for c in form), 255)
        chunks[i] = bytes(record)
        if random.random() < 0.3:
            again.append(bytes(record))
    for record in again:  # redefined later
        chunks.insert(random.randrange(len(chunks)), record)
    return chunks


SIZES: Final = {
    **dict.fromkeys("bBM", 1),
    **dict.fromkeys("hHcCg", 2),
    **dict.fromkeys("iIfeELn", 4),
    **dict.fromkeys("qQd", 8),
    **{"N": 16, "Z": 64, "a": 64},
}


def _change_units(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Put random bytes into short records: UNIT, MULT, FMTU, PARM and their like."""
    for _ in range(random.choice((1, 5))):
        i = random.randrange(len(chunks))
        chunk = chunks[i]
        if len(chunk) > 12 and chunk[:2] == b"\xa3\x95":
            at = random.randrange(11, len(chunk))
            chunks[i] = chunk[:at] + random.choice(EXTREMES)[: len(chunk) - at] + chunk[at + 8 :]
    return chunks


def _change_words(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Put other values into lines."""
    for _ in range(random.choice((1, 3, 10))):
        i = random.randrange(len(chunks))
        words = chunks[i].split(b",")
        k = random.randrange(len(words))
        what = random.choice(("value", "more", "fewer", "raw", "long"))
        if what == "value":
            words[k] = b" " + random.choice(_NUMBERS)
        elif what == "more":
            words[k:k] = [b" 1"] * random.choice((1, 3, 300))
        elif what == "fewer":
            del words[k]
        elif what == "raw":
            words[k] = random.randbytes(random.randrange(12))
        else:
            words[k] = b"9" * 5000
        chunks[i] = b",".join(words)
    return chunks


def _change_endings(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    ending = random.choice((b"\n", b"\r", b"\r\r\n", b"", b"\0\n", b"\xe2\x80\xa8"))
    return [chunk.replace(b"\r\n", b"\n").replace(b"\n", ending) for chunk in chunks]


def _change_format(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Change the text of a ULog's format or subscription."""
    found = [i for i, chunk in enumerate(chunks) if chunk[2:3] in (b"F", b"A")]
    for i in random.sample(found, min(len(found), random.choice((1, 3)))):
        chunk, kind = chunks[i], chunks[i][2:3]
        text = random.choice(_FORMATS)
        if kind == b"A":
            number = random.choice((chunk[4:6], b"\0\0", b"\xff\xff"))
            body = bytes([random.choice((0, 1, 255))]) + number
            body += random.choice((chunk[6:], b"nothing", b"", b"../../x", b"a" * 300))
        else:
            name = chunk[3:].split(b":")[0]
            body = text.replace(b"NAME", name)
            if random.random() < 0.3:
                body = chunk[3:].replace(b";", random.choice((b"", b";;", b" ;", b"[9];")))
        chunks[i] = message(kind, body)
    return chunks


_FORMATS: Final = (
    b"NAME:NAME inside;",
    b"NAME:uint64_t timestamp;NAME[3] inside;",
    b"NAME:uint64_t timestamp;float[1000000000] x;",
    b"NAME:uint64_t timestamp;outer[1000] a;outer[1000] b;",
    b"outer:outer2[99] a;outer2[99] b;uint64_t timestamp;",
    b"NAME:float[0] x;uint64_t timestamp;",
    b"NAME:float[-1] x;uint64_t timestamp;",
    b"NAME:float[x] y;uint64_t timestamp;",
    b"NAME:unknown_t y;uint64_t timestamp;",
    b"NAME:",
    b":",
    b"NAME",
    b"NAME:uint64_t timestamp;uint8_t[60000] _padding0;",
    b"NAME:uint8_t[6] _padding0;uint64_t timestamp;bool a;bool a;",
    b"NAME:float timestamp;float x;",
    b"NAME:int8_t timestamp;",
    b"NAME:char[8] timestamp;uint64_t t;",
    b"NAME:\xff\xfe x;uint64_t timestamp;",
    b"NAME:uint64_t timestamp;" + b"".join(b"float f%d;" % i for i in range(3000)),
)


def _change_body(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Change the body of a ULog's message, or put in one of another kind; the size fits again."""
    for _ in range(random.choice((1, 3, 10))):
        i = random.randrange(len(chunks))
        kind, body = chunks[i][2:3], bytearray(chunks[i][3:])
        if random.random() < 0.3:
            kind = bytes([random.choice(b"BFIMPQARDLCSOZ\0\xff")])
        what = random.choice(("noise", "short", "long", "extreme", "empty"))
        if what == "noise":
            body = bytearray(random.randbytes(len(body)))
        elif what == "short":
            body = body[: random.randrange(len(body) + 1)]
        elif what == "long":
            body += random.randbytes(random.choice((1, 8, 300)))
        elif what == "extreme" and body:
            at = random.randrange(len(body))
            body[at : at + 8] = random.choice(EXTREMES)[: len(body) - at]
        else:
            body = bytearray()
        chunks[i] = message(kind, bytes(body))
    return chunks


def _append_offsets(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Say in the flag bits that data were appended, at any place."""
    total = sum(map(len, chunks))
    places = [
        random.choice((0, 1, 16, 2**63, total - 1, total, total + 1, random.randrange(total)))
        for _ in range(3)
    ]
    flags = bytes(8) + bytes([random.choice((0, 1, 1, 1, 2, 0xFF))]) + bytes(7)
    flags += struct.pack("<3Q", *places) + b"\0" * random.choice((0, 0, 8))
    return [chunks[0], message(b"B", flags), *chunks[1:]]


# Bytes.


def _flip(random: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(random.choice((1, 4, 16, 64))):
        if out:
            out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def _insert(random: Random, data: bytes) -> bytes:
    at = random.randrange(len(data) + 1)
    put = random.choice((random.randbytes(1), random.randbytes(64), random.choice(_MAGICS) * 20))
    return data[:at] + put + data[at:]


def _delete(random: Random, data: bytes) -> bytes:
    at = random.randrange(len(data) + 1)
    return data[:at] + data[at + random.choice((1, 2, 7, 64, 1000)) :]


def _truncate(random: Random, data: bytes) -> bytes:
    return data[: random.randrange(len(data) + 1)]


def _behead_bytes(random: Random, data: bytes) -> bytes:
    return data[random.randrange(len(data) + 1) :]


def _zero(random: Random, data: bytes) -> bytes:
    at, size = random.randrange(len(data) + 1), random.choice((8, 512, 4096))
    return data[:at] + bytes(size) + data[at + size :]


# Whole files.


def _noise(random: Random) -> bytes:
    return random.randbytes(random.choice((0, 1, 8, 16, 100, 5000, 20_000)))


def _noise_of_magics(random: Random) -> bytes:
    """Return noise in which every few bytes a header seems to begin."""
    parts = [
        random.choice(_MAGICS) + random.randbytes(random.randrange(30))
        for _ in range(random.choice((10, 1000)))
    ]
    return b"".join(parts)


def _one_pattern(random: Random) -> bytes:
    """Return a long file of one pattern: resynchronising must not be quadratic."""
    patterns = (
        *_MAGICS,
        b"\xa3\x95\x80\x80",
        b"\0\0\0\0\0\0\0\0\xfe\0",
        b"\0\0\0\0\0\0\0\0\xfd\xff\0\0\0\0\0\0\0\0",
        b"\x01\0D\0",
        b"\0\0D",
        b"FMT, 1, 2, A, , \n",
        b"\n",
        b",",
        _SYNC,
        b"\x00",
    )
    pattern = random.choice(patterns)
    head = b"".join(random.choice(heads()).chunks) if random.random() < 0.5 else b""
    return (head + pattern * (LARGEST // len(pattern)))[: random.choice((5000, LARGEST))]


def _scraps(random: Random) -> bytes:
    """Return a long log put together from scraps of a short one, or with a bit in 300 wrong."""
    head = b"".join(random.choice(heads()).chunks)
    size = random.choice((20_000, LARGEST))
    out = bytearray(head)
    if random.random() < 0.3:
        out = bytearray(head * (size // len(head) + 1))
        for at in range(random.randrange(len(head)), size, 37):
            out[at] ^= 1 << random.randrange(8)
    while len(out) < size:
        at = random.randrange(len(head))
        out += head[at : at + random.choice((5, 20, 200, 1000))]
    return bytes(out[:size])


def _many_kinds(random: Random) -> bytes:
    """Return as many senders and message numbers as there are, one frame each."""
    frames = [r for head in heads() if head.kind == "tlog" for r in head.chunks]
    out = []
    for _ in range(random.choice((300, 2000))):
        record = bytearray(random.choice(frames))
        if record[8] == 0xFD and len(record) > 20:
            record[13], record[14] = random.randrange(256), random.randrange(256)
            out.append(_rewritten(random, bytes(record)))
    return b"".join(out)[:LARGEST]


def _many_definitions(random: Random) -> bytes:
    """Return a binary log that defines its types again and again, with records between."""
    base = [h for h in heads() if h.kind == "bin"]
    chunks = list(random.choice(base).chunks)
    for _ in range(random.choice((20, 200))):
        chunks = _change_definition(random, base[0], chunks)
    return b"".join(chunks)[:LARGEST]


def _lost_in_telemetry(random: Random) -> bytes:
    """Return the records of a telemetry log each with one byte more or less."""
    head = random.choice([h for h in heads() if h.kind == "tlog"])
    out = []
    for record in telemetry_records(b"".join(head.chunks)):
        at = random.randrange(len(record))
        out.append(record[:at] + random.randbytes(random.randrange(3)) + record[at + 1 :])
    return b"".join(out)


Chunks = Callable[[Random, Head, list[bytes]], list[bytes]]
_OF_CHUNKS: Final[tuple[Chunks, ...]] = (
    _nothing,
    _leave_out,
    _swap,
    _reverse_run,
    _repeat_run,
    _repeat_one_often,
    _splice_other,
    _behead,
    _change_header,
    _change_header,
    _change_times,
)
_OF_KIND: Final[dict[str, tuple[Chunks, ...]]] = {
    "tlog": (_rewrite_frames,) * 6,
    "bin": (_change_definition,) * 4 + (_change_units,) * 2,
    "log": (_change_words,) * 5 + (_change_endings,),
    "ulg": (_change_format,) * 3 + (_change_body,) * 3 + (_append_offsets,),
}
_OF_BYTES: Final = (_flip, _flip, _insert, _delete, _truncate, _behead_bytes, _zero)
_WHOLE: Final = (
    _noise,
    _noise_of_magics,
    _one_pattern,
    _scraps,
    _many_kinds,
    _many_definitions,
    _lost_in_telemetry,
)
