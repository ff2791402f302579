"""What a log says about itself stays in proportion to its file, and what is left out is told."""

import struct
import tracemalloc

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.telemetry import read
from fdi.telemetry.formats.bounds import MOST_NAMES, MOST_SENDERS, MOST_TEXTS, MOST_VALUES

from .build import EPOCH, Flight
from .fuzz.heads import composed_binary, composed_text, composed_ulog, message

pytestmark = pytest.mark.flights

MANY = 200_000


def frame(i: int, number: int, payload: bytes, system: int = 1, component: int = 1) -> bytes:
    """Return a MAVLink 2 record of the 61st second on, a thousandth apart."""
    payload = payload.rstrip(b"\0") or b"\0"
    body = struct.pack("<BBBBBBHB", len(payload), 0, 0, i % 256, system, component, number, 0)
    check = mav.x25crc(body + payload + bytes([mav.mavlink_map[number].crc_extra])).crc
    stamp = round(EPOCH * 1e6) + 60_000_000 + 1000 * i
    return struct.pack(">QB", stamp, 0xFD) + body + payload + struct.pack("<H", check)


def tlog_parameters(i: int) -> bytes:
    return frame(i, 22, struct.pack("<fHH16sB", i, 65535, i % 65535, b"P%d" % i, 9))


def tlog_texts(i: int) -> bytes:
    return frame(i, 253, struct.pack("<B50s", 6, b"text number %d" % i))


def tlog_senders(i: int) -> bytes:
    return frame(i, 0, struct.pack("<IBBBBB", 0, 2, 3, 0, 3, 3), *divmod(i % 65536, 256))


def bin_parameters(i: int) -> bytes:
    body = struct.pack("<Q16sf", 5_000_000 + 1000 * i, b"P%d" % i, i)
    return b"\xa3\x95\x16" + body


def bin_texts(i: int) -> bytes:
    return b"\xa3\x95\x15" + struct.pack("<Q64s", 5_000_000 + 1000 * i, b"text number %d" % i)


def log_parameters(i: int) -> bytes:
    return b"PARM, P%d, %d.0\r\n" % (i, i)


def log_texts(i: int) -> bytes:
    return b"MSG, text number %d of many\r\n" % i


def ulg_parameters(i: int) -> bytes:
    key = b"float P%d" % i
    return message(b"P", bytes([len(key)]) + key + struct.pack("<f", i))


def ulg_texts(i: int) -> bytes:
    return message(b"L", b"6" + struct.pack("<Q", 5_000_000 + 1000 * i) + b"text number %d" % i)


HEADS = {
    "tlog": lambda: Flight().records(),
    "bin": lambda: list(composed_binary()),
    "log": lambda: list(composed_text()),
    "ulg": lambda: list(composed_ulog()),
}
# Memory by the size of the file. What every log of such short records needs, whatever they say, is
# five times a record of 20 to 30 bytes: its times, its place, its number.
LOGS = {
    tlog_parameters: 4.5,
    tlog_texts: 4.5,
    tlog_senders: 4.5,
    bin_parameters: 6.0,
    bin_texts: 4.5,
    log_parameters: 6.0,
    log_texts: 4.5,
    ulg_parameters: 4.5,
    ulg_texts: 4.5,
}


@pytest.fixture(params=LOGS, ids=lambda one: one.__name__)
def many(request, tmp_path, monkeypatch):
    """A log of 200,000 of a kind, read with the memory that it took, by the size of its file."""
    monkeypatch.setenv("FDI_FAST", "0")  # numba's own memory hangs on no file
    head = HEADS[request.param.__name__.partition("_")[0]]()
    path = tmp_path / "log"
    path.write_bytes(b"".join(head))
    assert not [q for q in read(path).quality if q.kind == "left_out"]  # warm, and few are kept
    path.write_bytes(b"".join([*head, *map(request.param, range(MANY))]))
    tracemalloc.start()
    try:
        log = read(path)
        assert log.events
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    return request.param, log, peak / path.stat().st_size


def test_memory_for_200_000_of_a_kind_hangs_on_the_size_of_the_file(many):
    made, log, share = many
    assert share < LOGS[made], f"{share:.1f} times the file"
    assert len(log.parameters) <= MOST_NAMES
    assert len(log.sources) <= MOST_SENDERS
    assert sum(event.kind == "text" for event in log.events) <= 2 * MOST_TEXTS
    told = [q for q in log.quality if q.kind == "left_out"]
    assert told
    assert sum(q.count for q in told) > MANY - MOST_VALUES - MOST_NAMES
    if made.__name__.endswith("_texts"):  # how it began, and how it ended
        texts = [event.text for event in log.events if event.kind == "text"]
        assert any(text.startswith("text number 0") for text in texts)
        assert any(text.startswith(f"text number {MANY - 1}") for text in texts)


def test_vehicle_that_sent_least_stays_where_it_is_asked_for(tmp_path):
    path = tmp_path / "log"
    own = Flight(hover=0.0, height=2.0).records()[::10]
    beat = struct.pack("<IBBBBB", 0, 2, 3, 0, 3, 3)
    senders = [divmod(i, 256) for i in range(0x6400, 0x6400 + MOST_SENDERS + 50)]
    others = [frame(i, 0, beat, *sender) for i in range(2 * len(own)) for sender in senders]
    path.write_bytes(b"".join([*own, *others]))
    assert 1 not in {source.system for source in read(path).sources}
    log = read(path, system=1)
    assert log.system_id == 1
    assert "ATTITUDE" in log
    assert len(log.sources) == MOST_SENDERS
    assert np.all(np.diff([source.system for source in log.sources]) >= 0)
