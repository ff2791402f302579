"""Machine code and numpy find the same messages, whatever happened to the bytes."""

import random

import numpy as np
import pytest

from fdi.telemetry.formats.ulog_walk import Walk

from . import build_ulog as build

pytest.importorskip("numba")


def walked(data: bytes, fast: str, monkeypatch) -> tuple[object, ...]:
    monkeypatch.setenv("FDI_FAST", fast)
    walk = Walk.over(np.frombuffer(data, np.uint8))
    assert (walk.room is not None) == (fast == "1")
    walk.part(16, len(data))
    found = [
        (at, number, stamp if walk.stamp_at[number] else 0)
        for run in walk.found
        for at, number, stamp in zip(*(column.tolist() for column in run), strict=True)
    ]
    return found, walk.others, walk.lost, walk.unknown, walk.cut, walk.sizes


def damaged(seed: int) -> bytes:
    choice = random.Random(seed)
    data = bytearray(build.small(300))
    for _ in range(seed % 12):
        at = choice.randrange(16, len(data))
        what = choice.randrange(4)
        if what == 0:
            data[at] ^= 1 << choice.randrange(8)
        elif what == 1:
            del data[at : at + choice.randrange(1, 60)]
        elif what == 2:
            data[at:at] = choice.randbytes(choice.randrange(1, 60))
        else:
            data[at : at + 40] = bytes(40)
    return bytes(data)


@pytest.mark.parametrize("seed", range(40))
def test_machine_code_finds_what_numpy_finds(seed, monkeypatch):
    data = damaged(seed)
    assert walked(data, "1", monkeypatch) == walked(data, "0", monkeypatch)


def test_messages_end_with_the_room_of_the_machine_code(monkeypatch):
    """More messages than it finds at once."""
    data = build.small(30_000)
    found = walked(data, "1", monkeypatch)[0]
    assert len(found) == 93_000
    assert found == walked(data, "0", monkeypatch)[0]
