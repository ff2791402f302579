"""ULogs: what a log means, and which unusual ones are right."""

import time

import numpy as np
import pytest

from fdi.errors import LogError
from fdi.telemetry.formats.ulog.definitions import parsed, resolve
from fdi.telemetry.formats.ulog.times import Stamped, reference

from . import build_ulog as build


def test_topics_become_messages_with_nested_and_repeated_fields(load):
    log = load(build.small())
    motors = log["motors"]
    assert motors.fields == (
        *("timestamp", "motor[0].rpm", "motor[0].state", "motor[1].rpm", "motor[1].state"),
        *("label", "ok"),
    )
    np.testing.assert_array_equal(motors.raw("motor[1].rpm"), 200 + np.arange(50, dtype="f4"))
    assert set(motors.raw("label")) == {"left"}
    np.testing.assert_array_equal(log["wave"].raw("raw[1]"), -np.arange(50, dtype="i2"))
    np.testing.assert_array_equal(log["wave[1]"].raw("raw[2]"), np.full(50, 8, "i2"))


def test_time_is_zero_at_the_header_and_exact_since_boot(load):
    log = load(build.small(start_us=999_000))
    np.testing.assert_allclose(log["wave"].t, 0.001 + np.arange(50) / 10, atol=1e-9)
    assert log.clock.boot(0.0) == pytest.approx(0.999, abs=1e-9)
    assert log.clock.utc(0.0) is None


def test_firmware_vehicle_parameters_and_their_changes_are_found(load):
    log = load(build.small())
    assert (log.format, log.vehicle, log.autopilot) == ("ulog", "hexa", "px4")
    assert log.firmware == "PX4 1.15.2"
    assert dict(log.parameters) == {"GAIN": 0.5, "MAV_TYPE": 13}
    (change,) = log.parameter_changes
    assert (change.name, change.old, change.new) == ("GAIN", 0.5, 0.75)
    assert change.t == pytest.approx(1.4, abs=0.2)


@pytest.mark.parametrize(
    ("number", "board"),
    [("0006000000003736", "V6C \u2026 0006000000003736"), ("00000000", ""), (None, "")],
)
def test_the_board_is_told_with_its_number_alone(load, number, board):
    told = [build.info("ver_hw", "V6C\x1b\u2026")]
    told += [build.info("sys_uuid", number)] if number else []
    made = b"".join(
        [build.header(1), build.flag_bits(), *told, *build.definitions(), *build.records()]
    )
    assert load(made).board == board


def test_texts_modes_arming_and_dropouts_are_told(load):
    log = load(build.small())
    told = [(round(e.t, 3), e.kind, e.text) for e in log.events if e.kind != "parameter"]
    assert told == [
        (0.001, "mode", "MANUAL"),
        (0.9, "text", "[commander] Takeoff detected"),
        (1.001, "arm", ""),
        (3.001, "mode", "AUTO_MISSION"),
        (4.001, "disarm", ""),
    ]
    (gap,) = log.quality
    assert (gap.kind, gap.end - gap.start) == ("gap", pytest.approx(0.25))


def test_units_are_si_by_topic_and_by_the_end_of_the_name(load):
    log = load(build.small())
    assert [log["wave"].unit(name) for name in ("timestamp", "height_m", "raw[0]")] == [
        "s",
        "m",
        "",
    ]


@pytest.mark.parametrize(("release", "pascal"), [(0x010C00FF, 95000.0), (0x010D00FF, 950.0)])
def test_pressure_is_hectopascal_before_release_1_13(load, release, pascal):
    log = load(
        b"".join(
            [
                build.header(),
                build.keyed("I", "uint32_t ver_sw_release", release.to_bytes(4, "little")),
                build.topic("sensor_baro:uint64_t timestamp;float pressure;"),
                build.subscribe(0, "sensor_baro"),
                *(build.data(0, "Qf", 1_000_000 + i, 950.0) for i in range(5)),
            ]
        )
    )
    np.testing.assert_allclose(log["sensor_baro"].si("pressure"), pascal)


def test_value_that_a_flag_declares_invalid_is_unknown(load):
    log = load(
        b"".join(
            [
                build.header(),
                build.topic("battery_status:uint64_t timestamp;float voltage_v;bool connected;"),
                build.subscribe(0, "battery_status"),
                *(build.data(0, "QfB", 1_000_000 + i, 12.0, i % 2) for i in range(4)),
            ]
        )
    )
    battery = log["battery_status"]
    np.testing.assert_array_equal(battery.raw("voltage_v"), np.full(4, 12.0))
    np.testing.assert_array_equal(battery.si("voltage_v"), [np.nan, 12.0, np.nan, 12.0])


def test_padding_at_the_end_may_be_left_out(load):
    def log_of(padding: bytes) -> bytes:
        return b"".join(
            [
                build.header(),
                build.topic("one:uint64_t timestamp;uint8_t x;uint8_t[7] _padding0;"),
                build.subscribe(0, "one"),
                *(build.data(0, f"QB{len(padding)}s", i, i, padding) for i in range(9)),
            ]
        )

    for padding in (b"", bytes(7)):
        log = load(log_of(padding))
        np.testing.assert_array_equal(log["one"].raw("x"), np.arange(9))
        assert log["one"].fields == ("timestamp", "x")


@pytest.mark.parametrize("fast", ["0", "1"])
def test_topic_of_padding_alone_has_no_fields(fast, load, monkeypatch):
    monkeypatch.setenv("FDI_FAST", fast)
    log = load(
        b"".join(
            [
                *(build.header(), *build.definitions(), *build.records()),
                *(build.topic("none:uint8_t[4] _padding0;"), build.subscribe(3, "none")),
                *(build.data(3, "4s", bytes(4)) for _ in range(3)),
            ]
        )
    )
    assert log["none"].fields == ()
    assert all(log["wave"].raw(name).size == 50 for name in log["wave"].fields)
    assert all(log["motors"].raw(name).size == 50 for name in log["motors"].fields)


def test_format_may_be_defined_after_its_subscription(load):
    parts = build.definitions()
    log = load(b"".join([build.header(), *reversed(parts), *build.records()]))
    assert len(log["motors"]) == 50


def test_topic_subscribed_again_under_its_id_keeps_what_came_before(load):
    again = build.subscribe(0, "wave")
    log = load(build.small() + again + b"".join(build.records(20, 9_000_000)))
    assert len(log["wave"]) == 70


def test_id_taken_over_by_another_topic_ends_the_first_one(load):
    late = [build.subscribe(0, "wave", 3), *build.records(20, 9_000_000)]
    log = load(build.small() + b"".join(late))
    assert (len(log["wave"]), len(log["wave[3]"])) == (50, 20)


def test_appended_parts_begin_with_a_fresh_message(load):
    whole = build.small()
    more = b"".join(build.records(10, 7_000_000))
    cut = whole[:-5]
    flags = build.flag_bits(1, [len(cut)])
    at = len(build.header())
    log = load(cut[:at] + flags + cut[at + len(flags) :] + more)
    assert len(log["wave"]) == 60
    assert [q.kind for q in log.quality if q.kind != "gap"] == ["truncated"]


def test_what_was_published_before_the_log_began_stands_at_its_beginning(load):
    records = build.records()
    records[0] = build.data(0, "Qf3h", 10, 0.0, 0, 0, 7)
    log = load(b"".join([build.header(), *build.definitions(), *records]))
    assert log["wave"].t[0] == 0.0
    assert not log.quality


def test_stamp_that_its_place_contradicts_gives_way(load):
    records = build.records()
    records[6 * 3 + 1] = build.data(0, "Qf3h", 2**40, 0.0, 6, -6, 7)
    log = load(b"".join([build.header(), *build.definitions(), *records]))
    np.testing.assert_allclose(log["wave"].t, np.arange(50) / 10, atol=0.02)
    (told,) = log.quality
    assert (told.kind, told.count) == ("repaired", 1)


def test_logged_strings_may_have_a_tag(load):
    log = load(build.small() + build.logged(3_000_000, "tagged", 3, tag=2))
    event = next(e for e in log.events if e.text == "tagged")
    assert (event.t, event.severity) == (pytest.approx(2.0), 3)


def test_appended_crash_dump_is_told(load):
    dump = build.keyed("M", "char[5] hardfault_plain", b"fault", b"\0")
    more = build.keyed("M", "char[3] hardfault_plain", b" pc", b"\1")
    log = load(build.small() + dump + more)
    assert any(e.kind == "failsafe" and e.text.endswith("crashed: fault pc") for e in log.events)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (build.header()[:12], "less than its header"),
        (build.header(), "without data"),
        (build.header() + b"".join(build.definitions()), "without data"),
        (build.header() + build.flag_bits(4) + b"".join(build.records()), "newer reader"),
        (b"ULogEnc" + bytes(40), "encrypted"),
    ],
)
def test_log_without_data_or_of_the_future_is_refused(load, data, words):
    with pytest.raises(LogError, match=words):
        load(data)


@pytest.mark.parametrize(
    "text",
    [
        "a:b x;",  # missing
        "a:a x;",  # itself
        "a:uint8_t[2000000000] x;",
        "a:c[2000000000] x;",
        "a:uint8_t[0] x;",
        "a:",
        "a:float",
    ],
)
def test_format_that_no_message_could_hold_is_none(text):
    made, *circle = (parsed(ord("F"), line, 0) for line in (text.encode(), b"c:d y;", b"d:c y;"))
    others = {one.name: one for one in circle}
    assert made is None or resolve("a", {"a": made, **others}) is None


def test_text_longer_than_its_key_says_is_no_damage(load):
    """Tools that copy logs leave the first part's length in the keys of the others."""
    part = build.keyed("M", "char[81] boot_console_output", b"NuttShell", b"\1")
    log = load(b"".join([build.header(), part, *build.definitions(), *build.records()]))
    assert not log.quality


def test_utc_comes_from_the_receiver_or_the_time_of_the_start(load):
    boot_us = 1_700_000_000_000_000
    start = build.keyed("I", "uint64_t boot_time_utc_us", boot_us.to_bytes(8, "little"))
    gps = [
        build.topic("vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;"),
        build.subscribe(20, "vehicle_gps_position"),
        *(
            build.data(20, "QQ", 1_000_000 + i, boot_us + 3_000_000 + i if i else 0)
            for i in range(5)
        ),
    ]
    log = load(b"".join([build.header(), start, *build.definitions(), *build.records()]))
    assert log.clock.utc(0.0) == "2023-11-14T22:13:21.000Z"
    log = load(b"".join([build.header(), start, *build.definitions(), *gps, *build.records()]))
    assert log.clock.utc(0.0) == "2023-11-14T22:13:23.000Z"


def test_records_of_before_the_log_and_of_one_time_are_counted_apart(load):
    early = [build.data(0, "Qf3h", 10 + i, 0.0, 0, 0, 7) for i in range(4)]
    again = [build.data(0, "Qf3h", 5_900_000, 0.0, 0, 0, 7) for _ in range(3)]
    log = load(b"".join([build.header(), *build.definitions(), *early, *build.records(), *again]))
    counts = {q.text.split("(")[1]: q.count for q in log.quality if q.kind == "duplicate"}
    assert counts == {"wave 3)": 3, "wave 4)": 4}  # a record at 0.0 s and three at 4.9 s
    assert len(log["wave"]) == 50


def test_log_that_defines_no_topic_is_refused_with_their_names(load):
    formats = [part for part in build.definitions() if part[2:3] != b"F"]
    with pytest.raises(LogError, match="does not define: motors, vehicle_status, wave"):
        load(b"".join([build.header(), *formats, *build.records()]))


def test_topics_with_absurdly_many_fields_are_told_and_not_listed(load):
    wide = [
        part
        for i in range(3)
        for part in (
            build.topic(f"wide_{i}:uint64_t timestamp;uint8_t[40000] x;"),
            build.subscribe(30 + i, f"wide_{i}"),
        )
    ]
    rows = [build.data(30 + i % 3, "Q40000s", 2_000_000 + i, b"") for i in range(6)]
    parts = [p for row in rows for p in (row, *build.records(1, 3_000_000))]
    log = load(b"".join([build.header(), *build.definitions(), *wide, *build.records(), *parts]))
    assert [key for key in log.messages if key.startswith("wide")] == ["wide_0", "wide_1"]
    told = [q for q in log.quality if q.kind == "unknown_message"]
    assert len(told) == 2
    assert all("wide_2" in q.text for q in told)


def test_fields_of_one_name_are_told_apart(load):
    parts = [build.topic("a:uint64_t timestamp;uint8_t x;uint8_t x;"), build.subscribe(40, "a")]
    rows = [build.data(40, "QBB", 2_000_000 + i, 1, 2) for i in range(3)]
    log = load(b"".join([build.header(), *build.definitions(), *parts, *rows]))
    assert log["a"].fields == ("timestamp", "x", "x_2")
    assert log["a"].raw("x_2").tolist() == [2, 2, 2]


def test_id_taken_over_by_an_undefined_topic_is_not_read_as_the_first_one(load):
    late = [build.subscribe(0, "nothing"), *build.records(20, 9_000_000)]
    log = load(build.small() + b"".join(late))
    assert (len(log["wave"]), len(log["wave[1]"])) == (50, 70)
    told = [q for q in log.quality if q.kind == "unknown_message"]
    assert sum(q.count for q in told) == 20
    assert all("nothing" in q.text for q in told)


def test_topics_without_end_cost_no_more_than_their_size(load):
    """Topics of one record each: none is counted together with all others each time."""

    def spent(count: int) -> float:
        many = range(1000, 1000 + count)
        data = build.small() + b"".join(
            build.topic(f"t{i}:uint64_t timestamp;float x;")
            + build.subscribe(i, f"t{i}")
            + build.data(i, "Qf", 1_000_000 + i, 1.0)
            for i in many
        )
        since = time.process_time()
        log = load(data)
        assert sum(float(log[f"t{i}"].raw("x")[0]) for i in many) == count
        return time.process_time() - since

    few, many = (min(spent(count) for _ in range(3)) for count in (500, 3000))
    assert many < 15 * few  # six times as much, and room for a busy machine; else 36 times


def test_records_that_were_written_twice_give_the_time_like_others():
    """Half of their steps are none, and none is backwards."""
    at, stamp = np.arange(20), np.repeat(np.arange(10, dtype=np.uint64) * 100_000, 2)
    known = reference([Stamped("a", at, stamp)], 0)
    np.testing.assert_allclose(known.expected(at), stamp / 1e6)
    still = Stamped("b", np.arange(40), np.full(40, 7, np.uint64))
    assert reference([still], 0).at.size == 0
