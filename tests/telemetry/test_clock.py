"""One clock: whatever happens to stamps and boot time, t stays and what was repaired is told."""

import struct

import numpy as np
import pytest

from .build import EPOCH, Flight, mav, record
from .fuzz.clocks import places_of
from .fuzz.mutations import with_checksum

BASE = Flight()


def kinds(log) -> list[str]:
    return [q.kind for q in log.quality]


def assert_same_times(one, other, atol=1e-6):
    for key in one.messages:
        np.testing.assert_allclose(one[key].t, other[key].t, atol=atol, err_msg=key)


def test_times_ascend_and_begin_at_the_first_record(load):
    log = load(BASE.bytes())
    for message in log.messages.values():
        assert (np.diff(message.t) > 0).all()
    assert log["HEARTBEAT"].stamp[0] == 0.0
    assert log["ATTITUDE"].t[1] - log["ATTITUDE"].t[0] == pytest.approx(0.2, abs=1e-9)
    assert log.quality == ()


@pytest.mark.parametrize("change", [{"boot": 4000.0}, {"epoch": EPOCH - 3.2e7}])
def test_other_boot_offset_or_epoch_changes_no_time(load, change):
    """No absolute time enters anything."""
    one, other = load(BASE.bytes()), load(BASE.but(**change).bytes())
    assert_same_times(one, other)
    assert [(round(e.t, 6), e.kind) for e in one.events] == [
        (round(e.t, 6), e.kind) for e in other.events
    ]


def test_boot_time_and_utc_are_known(load):
    log = load(BASE.bytes())
    assert log.clock.boot(0.0) == pytest.approx(20.0, abs=0.02)
    assert log.clock.utc_source == "vehicle"
    assert log.clock.utc(10.0).startswith("2023-11-14T22:13:30")


def test_wrapped_boot_time_goes_on(load):
    one, other = load(BASE.bytes()), load(BASE.but(boot=2**32 / 1e6 - 10.0).bytes())
    assert_same_times(one, other)


def test_wrong_stamps_are_interpolated_and_told(load):
    records = BASE.records()
    for row in (0, 50, 51, 120):
        records[row] = b"\xff" + records[row][1:]
    log = load(b"".join(records))
    assert_same_times(load(BASE.bytes()), log, atol=0.02)
    assert "repaired" in kinds(log)


@pytest.mark.parametrize("step", [-3600.0, -5.0, 7.0, 86400.0])
def test_jump_of_the_recorders_clock_is_taken_out(load, step):
    records = BASE.records()
    half = len(records) // 2
    moved = [
        struct.pack(">Q", int.from_bytes(r[:8], "big") + round(step * 1e6)) + r[8:]
        for r in records[half:]
    ]
    log = load(b"".join(records[:half] + moved))
    assert_same_times(load(BASE.bytes()), log, atol=0.02)
    assert "clock_jump" in kinds(log)


def test_reboot_is_told_and_time_goes_on(load):
    second = BASE.but(boot=2.0, start=BASE.duration + 30.0)
    log = load(b"".join(BASE.records() + second.records()))
    assert kinds(log).count("reboot") == 1
    assert any(e.kind == "reboot" for e in log.events)
    t = log["ATTITUDE"].t
    assert (np.diff(t) > 0).all()
    assert t[-1] == pytest.approx(2 * BASE.duration + 30, abs=0.5)
    assert log.clock.boot(t[-1]) == pytest.approx(2.0 + BASE.duration, abs=0.1)
    assert len(log.flights) == 2


def test_every_record_belongs_to_the_boot_whose_time_it_tells(load):
    """The recorder's clock steps back at the new start, and records come in bunches."""
    one = BASE.but(rate=1.0, boot=100.0)
    log = load(one.bytes() + one.but(boot=2.0).bytes())
    ticks = np.arange(np.floor(one.duration) + 1)
    told = log["GPS_RAW_INT"].si("time_usec")
    np.testing.assert_allclose(told, [*(100 + ticks), *(2 + ticks)], atol=1e-3)


def test_long_pause_between_recordings_is_shortened(load):
    second = BASE.but(boot=2.0, start=5 * 86400.0)
    log = load(b"".join(BASE.records() + second.records()))
    assert log.duration < 300
    assert "clock_jump" in kinds(log)


def test_slow_link_does_not_shift_one_message_against_another(load):
    """VFR_HUD carries no time: it gets the delay of the messages around it."""
    records = []
    for i, r in enumerate(BASE.records()):
        late = 0.5 + 0.3 * np.sin(i / 200)
        records.append(struct.pack(">Q", int.from_bytes(r[:8], "big") + round(late * 1e6)) + r[8:])
    log = load(b"".join(records))
    gap = log["VFR_HUD"].t - log["ATTITUDE"].t[: len(log["VFR_HUD"])]
    assert np.ptp(gap) < 0.01


def test_repeated_gps_fix_is_left_out_until_it_is_old(load):
    def fix(t: float, at: float) -> bytes:
        gps = mav.MAVLink_gps_raw_int_message(round(at * 1e6), 3, 1, 2, 3, 100, 100, 0, 0, 9)
        return record(t, gps, sequence=round(7 * t / 0.2))

    parts = BASE.records(until=20.0)
    times = [0.2 * k for k in range(100)]
    extra = [fix(t, 20.0 + min(np.floor(t), 10.0)) for t in times]
    kept = [p for p in parts if p[15] != 24]
    mixed = sorted(kept + extra, key=lambda p: p[:8])
    gps = load(b"".join(mixed))["GPS_RAW_INT"]
    early = gps.t[gps.t < 10.5]
    assert np.allclose(np.diff(early), 1.0, atol=0.01)
    assert np.sum(gps.t > 11.5) > 35


def test_a_fix_that_the_link_held_up_is_as_old_as_it_says(load):
    def fix(at: float) -> bytes:
        gps = mav.MAVLink_gps_raw_int_message(round(1e6 * (20 + at)), 3, 1, 2, 3, 100, 100, 0, 0, 9)
        return record(6.5 if 5 < at < 6.5 else at, gps, sequence=round(5 * at))

    kept = [p for p in BASE.records(until=20.0) if p[15] != 24]
    mixed = sorted(kept + [fix(0.2 * k) for k in range(100)], key=lambda p: p[:8])
    gps = load(b"".join(mixed))["GPS_RAW_INT"]
    assert gps.t.size == 100
    assert np.allclose(np.diff(gps.t), 0.2, atol=0.02)


@pytest.mark.parametrize("messages", [(30,), None])
def test_message_that_always_says_one_time_does_not_tell_it(load, messages):
    """ATTITUDE comes most often; who has no clock fills in 0."""
    records = Flight().records()
    whole = load(b"".join(records))
    told = [p for p in places_of("tlog", tuple(records)) if p.clock != "recorder"]
    for place in told:
        if messages is None or place.clock in {f"vehicle {one}" for one in messages}:
            records[place.chunk] = with_checksum(place.written(records[place.chunk], 0))
    log = load(b"".join(records))
    assert log.duration == pytest.approx(whole.duration, abs=0.2)
    assert log["ATTITUDE"].t.size == whole["ATTITUDE"].t.size
    np.testing.assert_allclose(log["ATTITUDE"].t, whole["ATTITUDE"].t, atol=0.2)


def test_log_without_any_boot_time_uses_the_stamps(load):
    hud = mav.MAVLink_vfr_hud_message(1, 2, 3, 4, 5, 6)
    log = load(b"".join(record(k / 4, hud) for k in range(20)))
    np.testing.assert_allclose(log["VFR_HUD"].t, np.arange(20) / 4, atol=1e-6)
    assert log.clock.boot(0.0) is None
    assert log.clock.utc_source == "recorder"
