"""A log is written with other values, and every other byte is as it was."""

from itertools import count

import numpy as np
import pytest

from fdi.errors import UsageError
from fdi.telemetry import read
from fdi.telemetry.formats.change import as_stored
from fdi.telemetry.writing import Change, rewritten

from . import build, build_ulog
from .test_dataflash import small as small_dataflash

TEXT = b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\r\n"
TEXT += b"FMT, 10, 15, BARO, Qf, TimeUS,Alt\r\nBARO, 1000000, 1.5\r\n"
SIGNATURE = 13  # bytes
LOGS = {  # bytes, a message that others of its kind stand beside, one of its fields
    "tlog": (build.Flight().bytes(), "VFR_HUD", "alt"),
    "tlog, MAVLink 1": (build.Flight(version=1).bytes(), "VFR_HUD", "alt"),
    "dataflash": (small_dataflash(), "BARO[1]", "Load"),
    "ulog": (build_ulog.small(), "wave[1]", "raw[1]"),
}


@pytest.fixture
def load(tmp_path):
    """Return a function that reads bytes as a log, each from a file of its own."""
    numbers = count()

    def reader(data):
        path = tmp_path / f"{next(numbers)}.log"
        path.write_bytes(data)
        return read(path)

    return reader


@pytest.fixture(params=LOGS)
def case(request, load):
    data, key, field = LOGS[request.param]
    return load(data), key, field


def changed_at(log, key, field, row, value, lost=()):
    """Return the bytes of the log with one value, and without some records."""
    size = log[key].stamp.size
    where = np.arange(size) == row
    gone = np.isin(np.arange(size), lost)
    return rewritten(log, {key: Change({field: (np.full(size, value), where)}, gone)})


def differing(log, other):
    """Return the fields of the log's own messages of which any raw value differs."""
    own = {key: message for key, message in log.messages.items() if message.made_from is None}
    return {
        (key, name)
        for key, message in own.items()
        for name in message.fields
        if not np.array_equal(message.raw(name), other[key].raw(name))
    }


def test_without_changes_every_byte_stays(case):
    log, key, _ = case
    data = log.data.tobytes()
    assert rewritten(log, {}) == data
    assert rewritten(log, {key: Change({})}) == data


def test_one_value_is_written_and_no_other(case, load):
    log, key, field = case
    made = changed_at(log, key, field, 7, 42.0)
    other = load(made)
    before, after = log[key].raw(field), other[key].raw(field)
    assert np.flatnonzero(after != before).tolist() == [7]
    assert after[7] == 42.0
    assert differing(log, other) == {(key, field)}
    assert other.quality == log.quality


def test_records_that_are_left_out_are_gone_and_no_others(case, load):
    log, key, field = case
    other = load(changed_at(log, key, field, 7, 42.0, lost=(3, 4, 11)))
    kept = np.delete(np.arange(log[key].stamp.size), (3, 4, 11))
    stays = kept != 7
    expected = log[key].raw(field)[kept]
    np.testing.assert_array_equal(other[key].raw(field)[stays], expected[stays])
    np.testing.assert_array_equal(other[key].stamp, log[key].stamp[kept])
    assert {name for name, _ in differing(log, other)} == {key}
    assert not [one for one in other.quality if one.kind in ("lost_bytes", "bad_checksum")]


def test_what_is_left_out_of_a_tlog_is_not_lost_on_the_link(load):
    log = load(LOGS["tlog"][0])
    other = load(changed_at(log, "VFR_HUD", "alt", 0, 0.0, lost=range(2, 40)))
    assert not [one for one in other.quality if "did not arrive" in one.text]
    assert not [one for one in other.quality if one.kind == "bad_checksum"]


def test_a_signature_of_other_bytes_goes(load):
    flight = build.Flight()
    huds = [
        message
        for tick in range(80)
        for message in flight.messages(tick / 5, tick)
        if message.get_type() == "VFR_HUD"
    ]
    beat = build.record(0.0, flight.messages(0.0, 0)[0])
    sent = [
        build.record(i / 5, message, sequence=i + 1, signed=i >= 40)
        for i, message in enumerate(huds)
    ]
    log = load(beat + b"".join(sent))
    made = changed_at(log, "VFR_HUD", "alt", 60, 42.0)
    assert len(made) == log.data.size - SIGNATURE
    after = load(made)["VFR_HUD"].raw("alt")
    assert np.flatnonzero(after != log["VFR_HUD"].raw("alt")).tolist() == [60]


def test_an_appended_part_is_found_where_it_moved_to(load):
    whole = build_ulog.small()
    more = b"".join(build_ulog.records(10, 7_000_000))
    cut = whole[:-5]  # the part before ends within a message: only the place tells of the next
    flags = build_ulog.flag_bits(1, [len(cut)])
    at = len(build_ulog.header())
    log = load(cut[:at] + flags + cut[at + len(flags) :] + more)
    other = load(changed_at(log, "wave", "height_m", 7, 42.0, lost=(3, 4)))
    assert other["wave"].stamp.size == log["wave"].stamp.size - 2
    assert differing(log, other) <= {("wave", name) for name in log["wave"].fields}


def test_a_text_log_is_not_written(load):
    log = load(TEXT)
    assert log.format == "dataflash_text"
    with pytest.raises(UsageError, match="cannot be rewritten"):
        rewritten(log, {})


def test_stored_numbers_are_rounded():
    assert as_stored(np.array([-1.6, 1.4, 1.6]), np.dtype("i1")).tolist() == [-2, 1, 2]
    assert as_stored(np.array([-1.6, 1.5]), np.dtype("<f4")).tolist() == [np.float32(-1.6), 1.5]


@pytest.mark.parametrize("kind", ["i1", "u1", "<i2", "<u4", "<i8", "<u8"])
def test_stored_numbers_are_held_at_the_ends_of_their_type(kind):
    limits = np.iinfo(kind)
    low, high = as_stored(np.array([-1e30, 1e30]), np.dtype(kind)).tolist()
    assert low == limits.min
    assert high == limits.max if limits.bits < 64 else limits.max - 2048 < high <= limits.max
