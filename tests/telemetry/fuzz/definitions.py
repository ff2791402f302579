"""Which input, wrong in what it says about itself, belongs to a number?

The records stay whole and their checksums right. What is changed are definitions and metadata:
names, labels, formats, units and multipliers of DataFlash, formats, subscriptions, informations and
parameters of ULog, parameters, texts and identities of MAVLink. So the whole analysis is reached,
with names that nobody wrote and values that no vehicle has.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from random import Random
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as mav

from ..build import record
from .heads import Head, heads, message, telemetry_records
from .mutations import EXTREMES, Input

_WORDS: Final = (
    b"",
    b"\0",
    b" ",
    b"TimeUS",
    b"I",
    b"a.b",
    b"x[0]",
    b"[1]",
    b"#2",
    b"-1",
    b"7/x",
    b"nan",
    b"../../x",
    b"[red]",
    b"{{x}}",
    b"<b>",
    b"=1+1",
    b"\x1b[2J",
    b"\xff\xfe",
    "\u202egnp".encode(),
    b"a b",
    b"timestamp",
    b"armed",
    b"mode",
    b"t",
    b"9" * 16,
    b"A" * 64,
)
_VALUES: Final = (0.0, -1.0, 1.0, 2.0, 7.0, 1e-30, 1e9, 3.4e38, -3.4e38, float("nan"), float("inf"))
_NAMES: Final = (  # that say what the vehicle is and how it is built
    *("FRAME_CLASS", "FRAME_TYPE", "FRAME", "Q_ENABLE", "MOT_PWM_MIN", "MOT_PWM_MAX", "RC3_MIN"),
    *(
        "RC3_MAX",
        "MOT_SPIN_MIN",
        "MOT_SPIN_ARM",
        "SERVO1_FUNCTION",
        "SERVO3_FUNCTION",
        "BATT_MONITOR",
    ),
    *(
        "BATT_LOW_VOLT",
        "BATT_CAPACITY",
        "SYSID_THISMAV",
        "MAV_TYPE",
        "SYS_AUTOSTART",
        "LIM_PITCH_MAX",
    ),
    *(
        "TRIM_ARSPD_CM",
        "ARSPD_FBW_MIN",
        "ANGLE_MAX",
        "COMPASS_DEC",
        "MAV_SYS_ID",
        "FS_BATT_VOLTAGE",
    ),
)


def make_input(number: int) -> Input:
    """Return the input of a number."""
    random = Random(-1 - number)
    head = random.choice(heads())
    chunks, story = list(head.chunks), [f"{head.kind} {head.name}"]
    for _ in range(random.choice((1, 1, 2, 4))):
        change = random.choice(_OF_KIND[head.kind])
        story.append(change.__name__.strip("_"))
        chunks = change(random, head, chunks)
    return Input(number, b"".join(chunks), ", ".join(story))


def _text(random: Random, size: int) -> bytes:
    """Return a hostile word, or two of them, padded or cut to a size."""
    word = random.choice(_WORDS)
    if random.random() < 0.3:
        word += random.choice((b",", b".", b"")) + random.choice(_WORDS)
    return word.ljust(size, b"\0")[:size]


def _flipped(random: Random, data: bytes) -> bytes:
    """Return the bytes with one to three bits the other way round."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 3)) if out else 0):
        out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def _spoilt(random: Random, data: bytes) -> bytes:
    """Return the bytes with a few bits, a word or a number of another kind in them."""
    what = random.random()
    if what < 0.6 or not data:
        return _flipped(random, data)
    at = random.randrange(len(data))
    put = random.choice(EXTREMES) if what < 0.8 else random.choice(_WORDS).rstrip(b"\0")
    return (data[:at] + put + data[at + len(put) :])[: len(data)]


def _some(random: Random, places: list[int]) -> list[int]:
    return random.sample(places, min(len(places), random.choice((1, 1, 3))))


# DataFlash, binary and text.


def _definitions(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Spoil name, characters or labels of definitions; number and length stay."""
    places = [i for i, c in enumerate(chunks) if c[:3] == b"\xa3\x95\x80" and len(c) == 89]
    for i in _some(random, places):
        low, high = random.choice(((5, 9), (9, 25), (25, 89), (25, 89), (25, 89)))
        part = chunks[i][low:high]
        used = part.rstrip(b"\0")
        if random.random() < 0.7:
            part = _flipped(random, used) + part[len(used) :]
        elif high == 89 and used:
            labels = used.split(b",")
            labels[random.randrange(len(labels))] = _text(random, 12).rstrip(b"\0")
            part = b",".join(labels).ljust(64, b"\0")[:64]
        else:
            part = _text(random, high - low)
        chunks[i] = chunks[i][:low] + part + chunks[i][high:]
    return chunks


def _metadata(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Spoil the bodies of UNIT, MULT, FMTU, PARM, MSG and MODE."""
    told = {c[3] for c in chunks if c[:3] == b"\xa3\x95\x80" and c[5:9].rstrip(b"\0") in _TELLING}
    places = [i for i, c in enumerate(chunks) if c[:2] == b"\xa3\x95" and c[2] in told]
    for i in _some(random, places):
        chunks[i] = chunks[i][:11] + _spoilt(random, chunks[i][11:])
    return chunks


_TELLING: Final = (b"UNIT", b"MULT", b"FMTU", b"PARM", b"MSG", b"MODE", b"EV", b"ERR")


def _words(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Spoil words of definitions, parameters, texts and modes."""
    places = [i for i, c in enumerate(chunks) if c[:4] in (b"FMT,", b"PARM", b"MSG,", b"MODE")]
    for i in _some(random, places):
        words = chunks[i].split(b",")
        k = random.randrange(len(words))
        words[k] = _spoilt(random, words[k]) if random.random() < 0.6 else random.choice(_WORDS)
        chunks[i] = b",".join(words)
    return chunks


def _stated(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Put in parameters that say what the vehicle is, with values that none has."""
    name, value = random.choice(_NAMES), random.choice(_VALUES)
    if head.kind == "log":
        made = b"PARM, %s, %g\r\n" % (name.encode(), value)
    elif head.kind == "ulg":
        key = f"float {name}".encode()
        made = message(b"P", bytes([len(key)]) + key + struct.pack("<f", value))
    else:
        form = _form_of(b"PARM", chunks)
        if form is None:
            return chunks
        number, length = form
        body = struct.pack("<Q16sf", 1_000_000, name.encode(), value)
        made = (b"\xa3\x95" + bytes([number]) + body).ljust(length, b"\0")[:length]
    at = random.randrange(len(chunks) // 2, len(chunks))
    return [*chunks[:at], made, *chunks[at:]]


def _form_of(name: bytes, chunks: list[bytes]) -> tuple[int, int] | None:
    for c in chunks:
        if c[:3] == b"\xa3\x95\x80" and c[5:9].rstrip(b"\0") == name:
            return c[3], c[4]
    return None


# ULog.


def _told(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Spoil formats, subscriptions, informations, parameters and texts; their sizes fit."""
    places = [i for i, c in enumerate(chunks) if c[2:3] in _HEADS]
    for i in _some(random, places):
        kind, body = chunks[i][2:3], chunks[i][3:]
        if kind == b"F" and random.random() < 0.5:
            fields = body.split(b";")
            fields[random.randrange(len(fields))] = random.choice(
                (b"float " + _text(random, 8).rstrip(b"\0"), _text(random, 8), b"float[3] x.y")
            )
            body = b";".join(fields)
        else:
            body = _spoilt(random, body)
        chunks[i] = message(kind, body)
    return chunks


_HEADS: Final = (b"F", b"I", b"M", b"P", b"Q", b"A", b"L", b"C")


# MAVLink.


@cache
def _sender(head: Head) -> tuple[bytes, int, int]:
    """Return stamp, system and component of a record in the middle of a head."""
    records = list(telemetry_records(b"".join(head.chunks)))
    one = records[len(records) // 2]
    at = 13 if one[8] == 0xFD else 11
    return one[:8], one[at], one[at + 1]


def _sayings(random: Random, head: Head, chunks: list[bytes]) -> list[bytes]:
    """Put in parameters, texts and identities that no vehicle sends."""
    stamp, system, component = _sender(head)
    for _ in range(random.choice((1, 5, 40))):
        at = random.randrange(len(chunks))
        near = chunks[at][:8] if len(chunks[at]) >= 8 else stamp
        stamp_us = struct.unpack(">Q", near)[0]
        name = random.choice(_NAMES).encode() if random.random() < 0.5 else _text(random, 16)
        value = random.choice(_VALUES)
        what = random.choice(("parameter", "parameter", "text", "heartbeat", "version"))
        if what == "parameter":
            made = mav.MAVLink_param_value_message(name, value, 9, 1000, random.randrange(1000))
        elif what == "text":
            made = mav.MAVLink_statustext_message(random.randrange(256), _text(random, 50))
        elif what == "heartbeat":
            made = mav.MAVLink_heartbeat_message(
                *(random.randrange(256) for _ in range(3)), 0, 3, 3
            )
            made.custom_mode = random.choice((0, 3, 99, 2**32 - 1))
        else:
            made = mav.MAVLink_autopilot_version_message(
                2**63, *(random.randrange(2**32) for _ in range(4)), *([[255] * 8] * 3), 0, 0, 2**63
            )
        chunks.insert(
            at, record(stamp_us / 1e6, made, system=system, component=component, epoch=0.0)
        )
    return chunks


Change = Callable[[Random, Head, list[bytes]], list[bytes]]
_OF_KIND: Final[dict[str, tuple[Change, ...]]] = {
    "tlog": (_sayings,),
    "bin": (_definitions, _definitions, _definitions, _metadata, _stated),
    "log": (_words, _words, _stated),
    "ulg": (_told, _told, _stated),
}
