"""Machine code and numpy find the same messages, whatever happened to the bytes."""

import random

import numpy as np
import pytest

from fdi.telemetry.formats.ulog.columns import Places, Store
from fdi.telemetry.formats.ulog.records import find_records
from fdi.telemetry.formats.ulog.walk import Walk

from . import build_ulog as build

pytest.importorskip("numba")


def walked(data: bytes, fast: str, monkeypatch) -> tuple[object, ...]:
    monkeypatch.setenv("FDI_FAST", fast)
    walk = Walk.over(np.frombuffer(data, np.uint8))
    assert (walk.kernel is not None) == (fast == "1")
    walk.part(16, len(data))
    found = [
        (at, number, stamp if walk.stamp_at[number] else 0)
        for at, number, stamp in zip(*(x.tolist() for x in walk.found.messages), strict=True)
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


def test_room_for_messages_grows(monkeypatch):
    """More messages than there is room for at first."""
    monkeypatch.setattr("fdi.telemetry.formats.ulog.walk._BYTES", 1000)
    data = build.small(1000)
    found = walked(data, "1", monkeypatch)[0]
    assert len(found) == 3100
    assert found == walked(data, "0", monkeypatch)[0]


@pytest.mark.parametrize("seed", range(12))
def test_machine_code_decodes_what_numpy_decodes(seed, monkeypatch, load):
    data = damaged(seed)

    def columns(fast: str) -> dict[tuple[str, str], object]:
        monkeypatch.setenv("FDI_FAST", fast)
        log = load(data)
        own = [message for message in log.messages.values() if message.made_from is None]
        found = {(m.key, name): m.raw(name) for m in own for name in m.fields}
        return {
            key: values.tolist() if values.dtype == object else (values.dtype, values.tobytes())
            for key, values in found.items()
        }

    assert columns("1") == columns("0")


@pytest.mark.parametrize("fast", ["0", "1"])
def test_records_are_copied_part_by_part_of_the_file(fast, monkeypatch):
    monkeypatch.setenv("FDI_FAST", fast)
    data = np.frombuffer(build.small(20_000), np.uint8)  # of several parts of the machine code
    topics = [Places(one.layout, one.at) for one in find_records(data, [(16, data.size)]).rows]
    store = Store(data, topics)
    for number, (layout, at) in enumerate(topics):
        for field in layout.fields:
            width = np.dtype(field.dtype).itemsize
            rows = data[at[:, None] + field.offset + np.arange(width)]
            if not field.is_text:
                assert rows.tobytes() == store.load(number, field).tobytes()
    assert set(store.kept) == set(range(len(topics)))


def test_topic_too_large_to_be_kept_is_read_field_by_field(monkeypatch, load):
    data = build.small(500)
    whole = load(data)
    monkeypatch.setattr("fdi.telemetry.formats.ulog.columns._KEPT_BYTES", 1000)
    parts = load(data)
    for key in ("wave", "motors"):
        for name in whole[key].fields:
            assert whole[key].raw(name).tolist() == parts[key].raw(name).tolist()


def test_columns_used_last_are_kept_up_to_a_size(monkeypatch, load):
    data = build.small(500)
    monkeypatch.setattr("fdi.telemetry.formats.ulog.columns._KEPT_BYTES", 25_000)
    monkeypatch.setenv("FDI_FAST", "0")
    log = load(data)
    for _ in range(2):
        for message in log.messages.values():
            for name in message.fields:
                assert message.columns[name].load().size == message.stamp.size


def test_what_nobody_asks_for_is_not_decoded(monkeypatch):
    monkeypatch.setenv("FDI_FAST", "1")
    data = np.frombuffer(build.small(500), np.uint8)
    rows = find_records(data, [(16, data.size)]).rows
    store = Store(data, [Places(one.layout, one.at) for one in rows])
    number = {one.layout.topic: i for i, one in enumerate(rows)}
    status = rows[number["vehicle_status"]].layout.fields[1]
    store.load(number["vehicle_status"], status)
    assert set(store.kept) == {number["vehicle_status"]}
    for name in ("motors", "wave"):
        store.load(number[name], rows[number[name]].layout.fields[0])
    assert len(store.kept) == len(rows)
