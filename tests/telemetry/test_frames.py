"""The compiled walk finds what numpy finds, whatever the bytes."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import LogError
from fdi.telemetry import Log
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog import read_tlog
from fdi.telemetry.formats.tlog.frames import Frames, find_frames

from .build import Flight, mav, record

ARRAYS = ("start", "payload", "length", "version", "number", "sequence", "system", "component")


def found(data: bytes, fast: bool) -> Frames:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FDI_FAST", "1" if fast else "0")
        return find_frames(np.frombuffer(data, np.uint8), frame_checks())


def assert_same(one: Frames, other: Frames) -> None:
    for name in (*ARRAYS, "stamp_us"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs, err_msg=name)
    assert one.damage == other.damage


def tunnel(t: float, inside: bytes) -> bytes:
    payload = list(inside[:128].ljust(128, b"\0"))
    return record(t, mav.MAVLink_tunnel_message(1, 1, 0, min(len(inside), 128), payload))


def unknown(data: bytes) -> bytes:
    """Return a MAVLink 2 record with a message number that nobody knows."""
    return data[:15] + b"\x39\x30\x00" + data[18:]


def parts() -> list[bytes]:
    """Return records of every kind: both versions, signed, unknown, tunnelled, without payload."""
    attitude = mav.MAVLink_attitude_message(1000, 0.5, 0.1, 0.2, 0.3, 0.4, 0.5)
    made = Flight(hover=1.0, height=3.0).records(until=2.0)
    made += Flight(hover=1.0, height=3.0, version=1).records(until=2.0)
    made += [record(i / 10, attitude, signed=True, sequence=i) for i in range(3)]
    made += [unknown(made[0]), tunnel(1.0, made[1] + made[2]), tunnel(1.1, b"".join(made[:3]))]
    return made


PARTS = parts()


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    data = bytearray(b"".join(draw(st.lists(st.sampled_from(PARTS), max_size=25))))
    for _ in range(draw(st.integers(0, 6))):
        at = draw(st.integers(0, len(data)))
        kind = draw(st.sampled_from(["flip", "delete", "noise", "magic", "copy"]))
        if kind == "flip" and at < len(data):
            data[at] ^= draw(st.integers(1, 255))
        elif kind == "delete":
            del data[at : at + draw(st.integers(1, 60))]
        elif kind == "noise":
            data[at:at] = draw(st.binary(max_size=40))
        elif kind == "magic":
            data[at:at] = draw(st.sampled_from([b"\xfd", b"\xfe"])) * draw(st.integers(1, 80))
        elif kind == "copy":
            data[at:at] = data[at // 2 : at // 2 + draw(st.integers(1, 200))]
    return bytes(data)


@given(data=damaged())
@settings(max_examples=400)
def test_compiled_walk_finds_the_same_frames_and_damage(data):
    pytest.importorskip("numba")
    assert_same(found(data, fast=True), found(data, fast=False))


@given(data=damaged())
def test_every_byte_is_in_one_frame_or_told_as_damage(data):
    frames = found(data, fast=False)
    stop = frames.payload + frames.length + 2
    stop += 13 * ((frames.version == 2) & (frames.data[frames.start + 10] & 1 == 1))
    spans = [*zip(frames.start.tolist(), stop.tolist(), strict=True)]
    spans += [(d.offset, d.offset + d.size) for d in frames.damage]
    edges = sorted(spans)
    assert [start for start, _ in edges] == [0, *(stop for _, stop in edges[:-1])][: len(edges)]
    assert (edges[-1][1] if edges else 0) == len(data)


def test_frame_wins_over_the_frames_that_it_carries():
    inside = b"".join(PARTS[:3])
    data = PARTS[0] + tunnel(1.0, inside) + PARTS[1]
    for fast in (False, True):
        frames = found(data, fast)
        assert frames.number.tolist() == [0, 385, 2]
        assert not frames.damage


def assert_same_log(one: Log, other: Log) -> None:
    assert (one.events, one.flights, one.quality) == (other.events, other.flights, other.quality)
    assert (one.parameters, one.sources) == (other.parameters, other.sources)
    assert list(one.messages) == list(other.messages)
    for key, ours in one.messages.items():
        theirs = other[key]
        for name in ("t", "stamp", "kept"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=key)
        for field in ours.fields:
            assert ours.raw(field).dtype == theirs.raw(field).dtype
            np.testing.assert_array_equal(ours.raw(field), theirs.raw(field), err_msg=field)
            np.testing.assert_array_equal(ours.si(field), theirs.si(field), err_msg=field)


@given(data=damaged())
def test_log_is_the_same_with_and_without_machine_code(data):
    pytest.importorskip("numba")
    made = []
    for fast in ("0", "1"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("FDI_FAST", fast)
            try:
                made.append(read_tlog(Path("log.tlog"), np.frombuffer(data, np.uint8)))
            except LogError as error:
                made.append(str(error))
    assert type(made[0]) is type(made[1])
    if isinstance(made[0], str):
        assert made[0] == made[1]
    else:
        assert_same_log(*made)
