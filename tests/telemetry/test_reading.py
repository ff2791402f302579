"""Files that are no log are refused in one line; damage is told and the rest returned."""

import hashlib
import os

import numpy as np
import pytest
from flights import EXAMPLES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fdi.errors import FdiError, LogError, UsageError
from fdi.telemetry import read

from .build import Flight, mav, record

INTACT = Flight(hover=2.0, height=6.0)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n", "DataFlash text log without"),
        (b"hello\n" * 1000, "no known format"),
        (b"\xa3\x95\x80" + bytes(200), "DataFlash"),
        (b"\xa3\x95\x80\x02\x37ATT " + b"f".ljust(80), "sdlog2"),
        (b"ULog\x01\x12\x35\x01" + bytes(100), "ULog"),
        (b"\x1f\x8b\x08" + bytes(100), "gzip"),
        (b"PK\x03\x04" + bytes(100), "zip"),
        (bytes(range(256)) * 400, "no known format"),
        (b"\xfe" * 100_000, "no known format"),
        (b"\xfd" * 100_000, "no known format"),
    ],
)
def test_file_that_is_no_log_is_refused_by_name(load, content, says):
    with pytest.raises(LogError, match=says) as caught:
        load(content)
    assert "\n" not in str(caught.value)


def test_noise_is_refused(load):
    noise = np.random.default_rng(1).integers(0, 256, 1 << 20, np.uint8).tobytes()
    with pytest.raises(LogError, match="no known format"):
        load(noise)


def test_who_gives_no_log_is_told_which_files_are_logs_and_who_gives_a_folder_what_to_do(
    load, tmp_path
):
    with pytest.raises(LogError, match=r"PX4's \.ulg, ArduPilot's \.bin.*ground station's \.tlog"):
        load(b"hello\n")
    with pytest.raises(LogError, match="fdi batch analyses all"):
        read(tmp_path)


def test_missing_file_directory_and_fifo_are_refused(tmp_path):
    fifo = tmp_path / "pipe.tlog"
    os.mkfifo(fifo)
    for path, says in ((tmp_path / "no", "no such"), (tmp_path, "directory"), (fifo, "regular")):
        with pytest.raises(LogError, match=says):
            read(path)


def test_cut_file_gives_the_rest_and_says_so(load):
    data = INTACT.bytes()
    log = load(data[: len(data) * 3 // 5 + 3])
    assert len(log["ATTITUDE"]) > 10
    assert [q.kind for q in log.quality] == ["truncated"]


def test_headless_file_is_read(load):
    data = INTACT.bytes()
    log = load(data[len(data) // 3 :])
    assert len(log["ATTITUDE"]) > 10
    assert {q.kind for q in log.quality} == {"lost_bytes"}


def test_appended_garbage_changes_no_value(load):
    whole = load(INTACT.bytes())
    more = load(INTACT.bytes() + bytes((7 * i) % 251 for i in range(5000)))
    assert whole.events == more.events
    assert whole.flights == more.flights
    for key in whole.messages:
        for field in whole[key].fields:
            np.testing.assert_array_equal(whole[key].raw(field), more[key].raw(field))
        np.testing.assert_array_equal(whole[key].t, more[key].t)
    assert sum(q.count for q in more.quality if q.kind == "lost_bytes") == 5000


def test_versions_signatures_and_truncated_payloads_give_the_same_values(load):
    attitude = mav.MAVLink_attitude_message(1000, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    parts = [
        record(i / 10, attitude, version=v, signed=s)
        for i, (v, s) in enumerate([(1, False), (2, False), (2, True), (1, False)])
    ]
    log = load(b"".join(parts))
    assert log["ATTITUDE"].raw("roll").tolist() == [0.5] * 4
    assert log["ATTITUDE"].raw("yawspeed").tolist() == [0.0] * 4
    assert not [q for q in log.quality if q.kind != "duplicate"]


def test_extension_field_of_mavlink_1_is_unknown(load):
    imu = mav.MAVLink_raw_imu_message(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 2500)
    log = load(record(0, imu, version=1, base_size=26) + record(1, imu, version=2))
    assert log["RAW_IMU"].raw("temperature").tolist() == [0, 2500]
    assert np.isnan(log["RAW_IMU"].si("temperature")[0])
    assert log["RAW_IMU"].si("temperature")[1] == pytest.approx(298.15)


def test_unknown_message_is_skipped_by_length_and_counted(load):
    parts = INTACT.records()
    stranger = bytearray(parts[10])
    stranger[15:18] = b"\xfe\xfe\x0f"
    log = load(b"".join([*parts[:10], bytes(stranger), *parts[10:]]))
    found = [q for q in log.quality if q.kind == "unknown_message"]
    assert [q.count for q in found] == [1]
    own = [m for m in log.messages.values() if m.made_from is None]
    assert sum(len(m.stamp) for m in own) == len(parts)


def test_record_with_wrong_checksum_is_left_out_and_named(load):
    parts = INTACT.records()
    row = next(i for i, p in enumerate(parts) if p[15] == 30)
    spoiled = bytearray(parts[row])
    spoiled[22] ^= 1
    log = load(b"".join([*parts[:row], bytes(spoiled), *parts[row + 1 :]]))
    assert [(q.kind, q.channel) for q in log.quality if q.kind != "gap"] == [
        ("bad_checksum", "ATTITUDE")
    ]


def test_second_vehicle_does_not_disturb_the_first(load):
    first, second = INTACT.records(), INTACT.but(system=7, boot=500.0, height=9.0).records()
    mixed = [p for pair in zip(first, second, strict=False) for p in pair] + first[len(second) :]
    alone, both = load(b"".join(first)), load(b"".join(mixed), system=1)
    assert both.events == alone.events
    for key in alone.messages:
        np.testing.assert_array_equal(alone[key].t, both[key].t)
    assert load(b"".join(mixed), system=7).system_id == 7
    assert [s.system for s in both.sources] == [1, 7]
    assert [s.system for s in both.other_vehicles] == [7]
    assert not alone.other_vehicles
    with pytest.raises(UsageError, match="no system 9") as caught:
        load(b"".join(mixed), system=9)
    assert "1, 7" in str(caught.value)


def test_frames_that_came_twice_count_once(load):
    records = INTACT.records()
    late = [(int.from_bytes(r[:8], "big") + 80_000).to_bytes(8, "big") + r[8:] for r in records]
    twice = sorted([*records, *late], key=lambda r: r[:8])
    once, both = load(b"".join(records)), load(b"".join(twice))
    assert once.events == both.events
    for key in once.messages:
        np.testing.assert_allclose(once[key].t, both[key].t, atol=1e-6)
    assert [(q.kind, q.count) for q in both.quality] == [("duplicate", len(records))]


def test_records_of_one_moment_are_all_kept(load):
    names = [b"A", b"B", b"C"]
    parts = [record(1, mav.MAVLink_param_value_message(n, 1.0, 9, 3, 0)) for n in names]
    assert len(load(b"".join(parts))["PARAM_VALUE"]) == 3


def test_texts_stay_in_the_order_in_which_they_were_sent(load):
    """The link's delay grows while they arrive: taken off, it would turn them round."""
    texts = [f"text {i}".encode() for i in range(9)]
    parts = [
        record(t / 10, mav.MAVLink_attitude_message(100 * t, 0, 0, 0, 0, 0, 0)) for t in range(100)
    ]
    late = mav.MAVLink_attitude_message(9_950, 0, 0, 0, 0, 0, 0)
    parts += [
        record(9.99 + i / 1e4, mav.MAVLink_statustext_message(6, text))
        for i, text in enumerate(texts)
    ]
    parts += [record(9.995, late)]
    parts += [record(10.5, mav.MAVLink_attitude_message(10_400, 0, 0, 0, 0, 0, 0))]
    log = load(b"".join(parts))
    assert [e.text for e in log.events if e.kind == "text"] == [t.decode() for t in texts]
    assert (np.diff(log["STATUSTEXT"].t) > 0).all()


def test_ground_station_is_counted_and_left_out(load):
    beat = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
    manual = mav.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0)
    ground = [record(0, m, system=255, component=190) for m in [beat, manual] * 500]
    log = load(b"".join(ground) + INTACT.bytes())
    assert log.system_id == 1
    assert "MANUAL_CONTROL" not in log
    assert next(s for s in log.sources if s.system == 255).frames == 1000


def test_radio_and_other_components_add_what_the_autopilot_does_not_send(load):
    radio = mav.MAVLink_radio_status_message(100, 90, 50, 20, 21, 0, 0)
    beat = mav.MAVLink_heartbeat_message(26, 8, 0, 3, 4, 3)
    mount = mav.MAVLink_mount_status_message(1, 1, 100, 200, 300)
    extra = [
        record(1, radio, system=51, component=68),
        record(1, beat, component=154),
        record(1, mount, component=154),
    ]
    log = load(b"".join([*INTACT.records(), *extra]))
    assert log["RADIO_STATUS"].si("rssi").tolist() == [100.0]
    assert len(log["MOUNT_STATUS"]) == 1
    assert [e.text for e in log.events if e.kind == "mode"] == ["LOITER", "AUTO"]


def test_instances_are_messages_of_their_own(load):
    def battery(number: int, volt: int) -> mav.MAVLink_message:
        cells = [volt, *([65535] * 9)]
        return mav.MAVLink_battery_status_message(number, 0, 1, 32767, cells, -1, 10, 1, 50)

    parts = [record(i / 2 + n / 10, battery(n, 12000 + n)) for i in range(4) for n in (0, 1)]
    log = load(b"".join(parts))
    assert set(log.messages) == {"BATTERY_STATUS", "BATTERY_STATUS[1]"}
    t, value, unit = log.channel("BATTERY_STATUS[1].voltages[0]")
    assert (value.tolist(), unit, len(t)) == ([12.001] * 4, "V", 4)
    names = {str(c) for c in log.channels}
    assert "BATTERY_STATUS.voltages[0]" in names
    assert "BATTERY_STATUS.voltages[1]" not in names
    assert "BATTERY_STATUS.temperature" not in names


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data())
def test_no_damage_raises_anything_but_our_errors(load, data):
    """Cuts, flips, deletions and insertions anywhere, stamps and lengths included."""
    spoiled = bytearray(INTACT.bytes())
    for _ in range(data.draw(st.integers(1, 12))):
        at = data.draw(st.integers(0, max(len(spoiled) - 1, 0)))
        kind = data.draw(st.sampled_from(["flip", "cut", "delete", "insert", "stamp", "repeat"]))
        if kind == "flip" and spoiled:
            spoiled[at] ^= data.draw(st.integers(1, 255))
        elif kind == "cut":
            del spoiled[at + 200 :]
        elif kind == "delete":
            del spoiled[at : at + data.draw(st.integers(1, 100))]
        elif kind == "insert":
            spoiled[at:at] = data.draw(st.binary(max_size=80))
        elif kind == "stamp":
            place = spoiled.find(b"\xfd", at)
            if place >= 8:
                spoiled[place - 8 : place] = data.draw(st.binary(min_size=8, max_size=8))
        else:
            spoiled += spoiled[at : at + 3000]
    try:
        log = load(bytes(spoiled))
    except FdiError:
        return
    for message in log.messages.values():
        assert (np.diff(message.t) > 0).all()
        for field in message.fields:
            assert message.si(field).shape == message.t.shape
    log.state(np.linspace(-1, log.duration + 1, 50))
    assert repr(log)


def test_checksum_of_a_log_is_that_of_its_file(load):
    data = INTACT.bytes()
    assert load(data).sha256 == hashlib.sha256(data).hexdigest()


def test_a_log_counts_its_flights_as_a_person_does() -> None:
    log = read(EXAMPLES / "copter_motor_failure_crash.tlog")
    assert len(log.flights) == 1
    assert ", 1 flight, " in repr(log)
