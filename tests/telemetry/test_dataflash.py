"""DataFlash logs: units, instances, definitions that change, bad files."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from counting import calls
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import FdiError, LogError
from fdi.model.records import integral
from fdi.telemetry import Channel, Request, Sampling
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.formats.commands import MOST, command_events
from fdi.telemetry.formats.dataflash.events import error_words
from fdi.telemetry.formats.dataflash.layouts import CHARACTERS
from fdi.telemetry.formats.dataflash.records import all_records
from fdi.telemetry.signals import TIME

from .spoiling import ANYTHING, SPOILED, assert_readable, spoilings

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")


def fmt(number: int, name: str, form: str, labels: str, length: int | None = None) -> bytes:
    """Return one definition."""
    size = 3 + sum(np.dtype(CHARACTERS[c]).itemsize for c in form)
    texts = name.encode(), form.encode(), labels.encode()
    return struct.pack("<3sBB4s16s64s", b"\xa3\x95\x80", number, length or size, *texts)


def small(count: int = 50) -> bytes:
    """Return a log with units, two instances, texts and parameters."""
    out = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        fmt(10, "UNIT", "QbZ", "TimeUS,Id,Label"),
        fmt(11, "MULT", "Qbd", "TimeUS,Id,Mult"),
        fmt(12, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
        fmt(20, "BARO", "QBfcH", "TimeUS,I,Alt,Temp,Load"),
        fmt(21, "MSG", "QZ", "TimeUS,Message"),
        fmt(22, "PARM", "QNf", "TimeUS,Name,Value"),
    ]

    def add(number: int, form: str, *values: object) -> None:
        out.append(b"\xa3\x95" + bytes([number]) + struct.pack("<" + form, *values))

    add(10, "Qb64s", 1_000_000, ord("m"), b"m")
    add(11, "Qbd", 1_000_000, ord("B"), float(np.float32(0.01)))
    add(12, "QB16s16s", 1_000_000, 20, b"s#mO-", b"F-0?B")
    add(21, "Q64s", 1_000_000, b"ArduCopter V4.6.3 (8264a9b4)")
    add(22, "Q16sf", 1_000_000, b"FRAME_CLASS", 2.0)
    for i in range(count):
        for instance in (0, 1):
            t = 1_000_000 + 100_000 * i
            add(20, "QBfhH", t, instance, i + 0.5, 2500, 300)
    return b"".join(out)


@pytest.mark.parametrize(("code", "word"), [(54, "emergency stop"), (56, "motor interlock")])
def test_a_switch_that_stops_all_motors_is_a_command(load, code, word):
    event = b"\xa3\x95\x3c" + struct.pack("<QB", 2_000_000, code)
    log = load(small() + fmt(60, "EV", "QB", "TimeUS,Id") + event)
    (told,) = (e.text for e in log.events if e.kind == "command")
    assert told.startswith(word)


def test_an_interlock_that_disarming_takes_off_was_switched_by_nobody(load):
    """Copter logs event 56 two milliseconds after every disarming, event 11."""
    events = [(2_000_000, 11), (2_002_000, 56), (5_000_000, 56)]
    written = b"".join(b"\xa3\x95\x3c" + struct.pack("<QB", *one) for one in events)
    log = load(small() + fmt(60, "EV", "QB", "TimeUS,Id") + written)
    assert [e.t for e in log.events if e.kind == "command"] == [pytest.approx(4.0)]


def test_an_error_that_is_over_says_so(load):
    errors = [(2_000_000, 5, 1), (3_000_000, 5, 0), (4_000_000, 16, 2), (5_000_000, 16, 0)]
    written = b"".join(b"\xa3\x95\x3d" + struct.pack("<QBB", *one) for one in errors)
    log = load(small() + fmt(61, "ERR", "QBB", "TimeUS,Subsys,ECode") + written)
    told = [e.text for e in log.events if e.kind in ("failsafe", "text")][-4:]
    assert [text.split(":")[0] for text in told] == [
        "radio failsafe",
        "radio failsafe is over",
        "EKF check",
        "EKF check is over",
    ]


def test_of_a_servo_that_is_moved_all_the_time_the_first_and_last_commands_are_told():
    sent = [(0.02 * i, 183, 9.0, 1000.0 + i % 500) for i in range(10_000)]
    told = [(e.t, e.text) for e in command_events([*sent, (999.0, 209, 2.0, 0.0)])]
    assert len(told) == MOST + 1
    assert told[0] == (0.0, "output 9 is to give 1000 us")
    assert told[-2:] == [
        (pytest.approx(199.98), "output 9 is to give 1499 us"),
        (999.0, "motor 2 is to be tested"),
    ]


@pytest.mark.parametrize(
    ("vehicle", "firmware", "reason", "right"),
    [
        ("quad", "ArduCopter V3.6.0", 4, "the battery failsafe"),
        ("quad", "ArduCopter V4.6.3", 53, "an auxiliary function, as the pilot's switches have"),
        ("rover", "ArduRover V3.2.0", 4, ""),  # there the end of the mission
        ("rover", "ArduRover V3.2.0", 2, "the ground station or a companion"),
        ("rover", "ArduRover V4.5.0", 4, "the battery failsafe"),
        ("sub", "ArduSub V3.5.0", 12, ""),  # there the surface that was reached
        ("sub", "ArduSub V4.1.0", 27, "the surface that was reached"),
        ("plane", "ArduPlane V3.9.0", 9, ""),
    ],
)
def test_a_number_that_meant_something_else_tells_nobody(load, vehicle, firmware, reason, right):
    greeting = struct.pack("<Q64s", 500_000, firmware.encode())
    modes = [(600_000, 0, 1), (700_000, 3, reason)]
    made = fmt(60, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn") + b"\xa3\x95\x15" + greeting
    for t, number, why in modes:
        made += b"\xa3\x95\x3c" + struct.pack("<QBBB", t, number, number, why)
    log = load(fmt(21, "MSG", "QZ", "TimeUS,Message") + made)
    assert (log.vehicle, log.firmware) == (vehicle, firmware)
    assert [e.by for e in log.events if e.kind == "mode"][-1] == right


def test_commands_from_outside_that_act_on_outputs_are_told_once_each(load):
    def sent(t, number, first, second):
        return b"\xa3\x95\x3c" + struct.pack("<QHff", t, number, first, second)

    made = [sent(2_000_000, 183, 4, 1000), sent(2_500_000, 183, 4, 1000)]
    made += [sent(3_000_000, 183, 4, 1500), sent(3_500_000, 176, 1, 4)]
    log = load(small() + fmt(60, "MAVC", "QHff", "TimeUS,Cmd,P1,P2") + b"".join(made))
    told = [(e.text, e.by) for e in log.events if e.kind == "command"]
    assert told == [
        ("output 4 is to give 1000 us", "the ground station or a companion"),
        ("output 4 is to give 1500 us", "the ground station or a companion"),
    ]


def test_values_are_in_si_by_legacy_scale_or_multiplier_not_both(load):
    log = load(small())
    baro = log["BARO"]
    assert log.format == "dataflash"
    assert (baro.unit("Alt"), baro.unit("Temp"), baro.unit("TimeUS")) == ("m", "K", "s")
    np.testing.assert_allclose(baro.si("Temp"), 298.15)
    np.testing.assert_allclose(baro.si("Load"), 3.0, rtol=1e-15)
    np.testing.assert_allclose(baro.t, np.arange(50) / 10, atol=1e-9)
    assert log.clock.boot(0.0) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("form", "pack", "volt", "current"),
    [("Qfff", "Qfff", 15.5, 12.5), ("QhhHHf", "QhhHHf", 1550, 1250)],
    ids=["Copter 3.4 and 3.5: floats", "Copter 3.3: hundredths as integers"],
)
def test_voltage_and_current_of_a_battery_mean_what_their_type_says(
    load, form, pack, volt, current
):
    """No version states a unit: what was an integer of hundredths became volts as a float."""
    is_float = form == "Qfff"
    labels = "TimeUS,Volt,Curr,CurrTot" if is_float else "TimeUS,Thr,Volt,Curr,Vcc,CurrTot"
    out = [small(), fmt(30, "CURR", form, labels)]
    for i in range(50):
        told = (volt, current, 400.0) if is_float else (0, volt, current, 5000, 400.0)
        values = struct.pack("<" + pack, 1_000_000 + 100_000 * i, *told)
        out.append(b"\xa3\x95" + bytes([30]) + values)
    status, battery = (load(b"".join(out))[name] for name in ("SYS_STATUS", "BATTERY_STATUS"))
    np.testing.assert_allclose(status.si("voltage_battery"), 15.5)
    np.testing.assert_allclose(status.si("current_battery"), 12.5)
    np.testing.assert_allclose(battery.si("current_consumed"), 400e-3 * 3600)


def test_instances_vehicle_firmware_and_parameters_are_found(load):
    log = load(small())
    assert len(log["BARO"]) == len(log["BARO[1]"]) == 50
    assert (log.vehicle, log.firmware) == ("hexa", "ArduCopter V4.6.3 (8264a9b4)")
    assert dict(log.parameters) == {"FRAME_CLASS": 2.0}
    assert not log.quality


def test_redefined_type_stands_apart_from_its_offset_on(load):
    more = fmt(20, "BARO", "Qf", "TimeUS,Alt") + b"".join(
        b"\xa3\x95\x14" + struct.pack("<Qf", 7_000_000 + i * 100_000, 9.0) for i in range(20)
    )
    log = load(small() + more)
    assert len(log["BARO"]) == 50
    np.testing.assert_array_equal(log["BARO#2"].si("Alt"), np.full(20, 9.0))
    assert any("defined anew" in q.text for q in log.quality)


def test_label_that_is_no_name_is_told(load):
    spoilt = small().replace(b"TimeUS,I,Alt", b"TimeUS,I,A\x0ct")
    log = load(spoilt)
    assert "A_t" in log["BARO"].fields
    assert [q.text for q in log.quality if "A_t" in q.text]


def test_two_boots_in_one_file_make_time_go_on(load):
    again = small()
    log = load(small() + again)
    assert np.all(np.diff(log["BARO"].t) > 0)
    assert [q.kind for q in log.quality if q.kind == "reboot"] == ["reboot"]


def test_lost_bytes_are_told_with_their_place(load):
    data = small()
    log = load(data[:-300] + b"\x5a" * 7 + data[-300:-2])
    kinds = {q.kind: q.count for q in log.quality}
    assert kinds["lost_bytes"] >= 7
    assert "truncated" in kinds


@pytest.mark.parametrize(
    "data",
    [
        small()[: 89 * 7],
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        b"\xa3\x95\x80" * 3000,
    ],
)
def test_log_without_data_is_refused(load, data):
    with pytest.raises(LogError, match="DataFlash"):
        load(data)


@SPOILED
@given(spoilings(3300))
def test_damage_never_raises_anything_but_our_errors(load, spoiling):
    try:
        log = load(spoiling.of(small(20)))
    except FdiError:
        return
    assert_readable(log)


def test_noise_at_the_end_does_not_stretch_the_log(load):
    log = load(small() + b"\xa3\x95" * 500)
    assert log.duration < 10.0


def test_records_of_noise_have_no_time_of_their_own(load):
    noise = b"".join(b"\xa3\x95\x14" + b"\xc7" * 15 for _ in range(40))
    assert load(small() + noise).duration < 10.0


def all_records_by(data: bytes, way: str, monkeypatch) -> dict[str, object]:
    """Return names, places and gaps of the records, found by numpy ("0") or in machine code."""
    monkeypatch.setenv("FDI_FAST", way)
    found = all_records(np.frombuffer(data, np.uint8))
    return {
        "places": {
            (one.name, one.since): start.tolist()
            for one, start in zip(found.layouts, found.starts, strict=True)
        },
        "lost": found.lost.tolist(),
        "is_cut": found.is_cut,
    }


HEADS = st.sampled_from([b"\xa3\x95", b"\xa3\x95\x14", b"\xa3\x95\x80", b"\xa3"])


@SPOILED
@given(spoilings(4000, st.one_of(ANYTHING, st.lists(HEADS, max_size=40).map(b"".join))))
def test_machine_code_finds_the_same_records(monkeypatch, spoiling):
    pytest.importorskip("numba")
    intact = small(20) + fmt(20, "BARO", "Qf", "TimeUS,Alt") + small(3)[89 * 7 :]
    data = spoiling.of(intact)
    assert all_records_by(data, "1", monkeypatch) == all_records_by(data, "0", monkeypatch)


def test_definition_that_would_give_definitions_another_shape_is_none(monkeypatch):
    low = len(small(5))
    found = all_records_by(
        small(5) + fmt(128, "EV", "QB", "TimeUS,Id") + small(5), "0", monkeypatch
    )
    assert not any(name == "EV" and places for (name, _), places in found["places"].items())
    assert len(found["places"]["FMT", 0]) == 2 * small(0).count(b"\xa3\x95\x80")
    assert found["lost"] == [[low, low + 89]]


def test_headers_alone_cost_no_more_than_a_log(load):
    """Each of 131,000 false headers is looked at a few times, not once for every known version."""
    assert calls(lambda: load(b"\xa3\x95" * 131_072)) < 131_072


def test_definitions_without_end_cost_no_more_than_their_size(load):
    """20,000 versions of one type: none is compared with all others."""
    again = [fmt(20, "BARO", form, "TimeUS,I") for form in ("QH", "QB")]
    few, many = (small() + b"".join(again) * count for count in (5_000, 10_000))
    assert calls(lambda: load(many)) < 3 * calls(lambda: load(few))
    log = load(many)
    assert len(log["BARO"]) == 50
    (lost,) = [record for record in log.quality if record.kind == "lost_bytes"]
    assert lost.count % 89 == 0  # beyond 2,000 a definition is none
    assert 89 * 8_000 < lost.count < 89 * 18_100


def test_two_types_of_one_name_are_on_one_clock(load):
    """Their records stand between each other, also where the vehicle starts anew."""

    def records(boot):
        for i in range(200):
            yield b"\xa3\x95" + bytes([50 + i % 2]) + struct.pack("<Qf", boot + i * 10_000, 1.0)

    log = load(
        small()
        + fmt(50, "ATT", "Qf", "TimeUS,Roll")
        + fmt(51, "ATT", "Qf", "TimeUS,Pitch")
        + b"".join([*records(90_000_000), *records(5_000_000), *records(5_000_000)])
    )
    assert sum(record.kind == "reboot" for record in log.quality) == 2
    times = np.sort(np.concatenate([log["ATT"].t, log["ATT#2"].t]))
    assert times.size == 600
    steps = np.diff(times)
    anew = [199, 399]  # its clock says 5 s: so long ago it started, at least
    np.testing.assert_allclose(steps[anew], 5.0, atol=0.01)
    np.testing.assert_allclose(np.delete(steps, anew), 0.01, atol=0.01)


def test_bytes_of_a_file_in_the_log_stay_as_they_are(load):
    """ArduPilot puts whole files into logs, 64 bytes a record: NULs are part of them."""
    piece = bytes(range(1, 60)) + b"\0\0\xff\0\0"
    records = fmt(40, "FILE", "QNIBZ", "TimeUS,FileName,Offset,Length,Data")
    for i in range(3):
        records += b"\xa3\x95\x28" + struct.pack("<Q16sIB64s", i, b"@SYS/x", 64 * i, 64, piece)
    assert load(small() + records)["FILE"].raw("Data").tolist() == [piece.decode("latin-1")] * 3


def test_length_of_a_type_that_nobody_defines_is_learned(load):
    """Its records are counted, not lost; what they hold nobody knows."""
    alien = b"\xa3\x95\x1c" + bytes(range(20))
    data = small(10)
    at = data.rindex(b"\xa3\x95\x14")  # the last BARO
    log = load(data[:at] + (data[at:] + alien) * 8)
    kinds = {q.kind: q for q in log.quality}
    assert kinds["unknown_message"].count == 8
    assert "type 28, 23 bytes each" in kinds["unknown_message"].text
    assert "lost_bytes" not in kinds
    assert "TYPE28" not in log


def test_two_types_that_nobody_defines_are_told_apart(load):
    one, two = b"\xa3\x95\x1c" + bytes(20), b"\xa3\x95\x1d" + bytes(9)
    data = small(10)
    at = data.rindex(b"\xa3\x95\x14")
    log = load(data[:at] + (data[at:] + one + two) * 8)
    texts = [q.text for q in log.quality if q.kind == "unknown_message"]
    assert "type 28, 23 bytes each" in texts[0]
    assert "type 29, 12 bytes each" in texts[1]


def test_record_with_damaged_time_has_that_of_its_place(load):
    data = bytearray(small())
    last = data.rindex(b"\xa3\x95\x14", 0, len(data) - 500)
    data[last + 7] ^= 0x10  # 268 s
    log = load(bytes(data))
    whole = load(small())
    for key in ("BARO", "BARO[1]"):
        np.testing.assert_allclose(log[key].t, whole[key].t, atol=0.2)
    assert log.duration == whole.duration


def timed(number: int, us: int, form: str = "", *values: object) -> bytes:
    """Return a record of a type whose first field is the time."""
    return b"\xa3\x95" + bytes([number]) + struct.pack("<Q" + form, us, *values)


@pytest.mark.parametrize("leap_s", [5, 268, 590])
def test_one_of_the_last_records_does_not_stretch_the_log(load, leap_s):
    """No checksum guards it; what is written after it says that it was earlier."""
    end = 1_000_000 + 100_000 * 49
    late = timed(21, end + leap_s * 1_000_000, "64s", b"one bit is wrong, or it goes on")
    after = timed(21, end + 1000, "64s", b"after it")
    log = load(small() + late + after)
    assert log.duration == pytest.approx(4.9, abs=0.01)
    assert [q.kind for q in log.quality if "damaged time" in q.text] == ["repaired"]
    assert load(small() + after + late).duration == pytest.approx(4.9 + leap_s)


def test_parameters_in_plenty_at_the_beginning_do_not_tell_the_time_of_the_rest(load):
    many = b"".join(timed(22, 1_000_000 + i, "16sf", b"P%d" % i, i) for i in range(500))
    start, size = len(small(0)), 20
    data = bytearray(small(0) + many + small(450)[start:])
    whole = load(bytes(data))
    for at in range(start + len(many) + 20 * size, len(data), 11 * size):
        data[at + 6] ^= 0x08  # 134 s
    log = load(bytes(data))
    assert log.duration == pytest.approx(whole.duration, abs=0.2)
    for key in ("BARO", "BARO[1]"):
        np.testing.assert_allclose(log[key].t, whole[key].t, atol=0.2)


def test_later_boot_is_as_long_after_the_earlier_one_as_its_clock_tells(load):
    """Its first records are in it, though they come before the first one of the most frequent."""
    first, again = small(), small(30)
    log = load(first + again)
    assert log.clock.boot(log["BARO"].t[49]) == pytest.approx(5.9)
    assert log.clock.boot(log["BARO"].t[51]) == pytest.approx(1.1)
    assert log["MSG"].t[1] == pytest.approx(4.9 + 1.0, abs=0.01)
    assert log["BARO"].t[-1] == pytest.approx(4.9 + 1.0 + 2.9, abs=0.01)


def test_errors_of_the_firmware_are_told_in_words():
    table = data_table("errors_dataflash")
    assert set(table["codes"]) <= set(table["subsystems"])
    told = error_words(6, 1)
    assert told == "battery failsafe: voltage or remaining charge below its limit"
    assert error_words(10, 6) == "flight mode number 6 could not be entered"
    assert error_words(9, 8) == "fence breached: too low"
    assert error_words(16, 77) == "error of EKF check, code 77"


def test_floats_in_metres_are_no_hundredths_whatever_a_development_version_says(load):
    """Copter 3.6-dev; of others, and of integers, what it says holds."""

    def record(number: int, form: str, *values: object) -> bytes:
        return b"\xa3\x95" + bytes([number]) + struct.pack("<" + form, *values)

    out = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        fmt(11, "MULT", "Qbd", "TimeUS,Id,Mult"),
        fmt(12, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
        fmt(20, "POS", "Qff", "TimeUS,RelHomeAlt,Other"),
        record(11, "Qbd", 1, ord("B"), float(np.float32(0.01))),
        record(12, "QB16s16s", 1, 20, b"smm", b"FBB"),
    ]
    out += [record(20, "Qff", 1_000_000 + 100_000 * i, 2.5, 2.5) for i in range(30)]
    log = load(b"".join(out))
    np.testing.assert_allclose(log["POS"].si("RelHomeAlt"), 2.5)
    np.testing.assert_allclose(log["POS"].si("Other"), 0.025)


ATT_OF_COPTER_30, GPS_OF_COPTER_30 = 1, 2


def told_by_gps(spans, silent=()) -> bytes:
    """A log of Copter 3.0: attitude at 10 Hz, and a receiver at 1 Hz, whose clock is the only one.

    ``spans``: s for which anything is recorded; in ``silent`` ones the receiver says nothing.
    """
    out = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        fmt(ATT_OF_COPTER_30, "ATT", "cccccCC", "RollIn,Roll,PitchIn,Pitch,YawIn,Yaw,NavYaw"),
        fmt(
            GPS_OF_COPTER_30,
            "GPS",
            "BIBcLLeeEe",
            "Status,Time,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs",
        ),
    ]
    for low, high in spans:
        for tenth in range(10 * low, 10 * high + 1):
            if tenth % 10 == 0 and not any(a < tenth / 10 < b for a, b in silent):
                fix = (3, 1_000_000 + 100 * tenth, 8, 150, 470_000_000, 80_000_000, 0, 0, 0, 0)
                out.append(b"\xa3\x95\x02" + struct.pack("<BIBhiiiiIi", *fix))
            out.append(b"\xa3\x95\x01" + struct.pack("<hhhhhHH", *[0] * 7))
    return b"".join(out)


def test_a_recorder_that_paused_is_no_receiver_that_fell_silent(load):
    """Where its clock is the only one: what is not written is nobody's."""
    paused = load(told_by_gps([(0, 40), (70, 110)]))
    (gap,) = (q for q in paused.quality if q.kind == "gap")
    assert gap.end - gap.start == pytest.approx(30.0, abs=0.3)
    t = paused["ATT"].t
    assert np.diff(t).max() == pytest.approx(30.0, abs=0.3)
    assert np.quantile(np.diff(t), 0.99) < 0.4


def test_a_receiver_that_falls_silent_while_others_go_on_leaves_no_gap(load):
    silent = load(told_by_gps([(0, 110)], silent=[(40, 70)]))
    assert not [q for q in silent.quality if q.kind == "gap"]
    assert np.diff(silent["ATT"].t).max() < 0.4
    assert np.diff(silent["GPS"].t).max() == pytest.approx(30.0)


def told_by_satellites(pace: float, seconds: int) -> bytes:
    """A log whose clock shows one second where ``pace`` have gone by satellite time."""
    out = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        fmt(20, "GPS", "QBIHBcLLe", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt"),
        fmt(21, "ATT", "Qcc", "TimeUS,DesRoll,Roll"),
    ]
    for tenth in range(10 * seconds):
        at = 5_000_000 + 100_000 * tenth
        out.append(b"\xa3\x95\x15" + struct.pack("<Qhh", at, 0, tenth))
        if tenth % 2 == 0:
            late = 100_000 * (tenth // 2 % 2)  # by up to a tenth of a second
            fix = (
                3,
                200_000_000 + round(100 * pace * tenth),
                2300,
                9,
                90,
                470_000_000,
                80_000_000,
                0,
            )
            out.append(b"\xa3\x95\x14" + struct.pack("<QBIHBhiii", at + late, *fix))
    return b"".join(out)


@pytest.mark.parametrize(
    ("pace", "seconds", "told"),
    [(13 / 12, 60, "7.7 % slow"), (0.9, 60, "11.1 % fast"), (1.0002, 600, ""), (13 / 12, 9, "")],
)
def test_a_clock_that_runs_wrong_is_told_by_satellite_time(load, pace, seconds, told):
    """No crystal, and no receiver whose time comes late, and not the same time always."""
    log = load(told_by_satellites(pace, seconds))
    assert log.clock.pace == pytest.approx(pace if told else 1.0, rel=2e-3)
    said = [q.text for q in log.quality if "satellite time" in q.text]
    assert bool(said) == bool(told)
    assert all(told in text for text in said)
    assert log["ATT"].t[-1] == pytest.approx(seconds, abs=0.3)  # times stay the log's own


def test_a_while_of_records_is_one_by_the_right_clock(load):
    log = load(told_by_satellites(13 / 12, 60))
    over = Request(
        Channel("ATT", "Roll:over"),
        ("Roll",),
        value=lambda known: integral(known[TIME], np.ones(known[TIME].size), 10.0),
        over=True,
    )
    once = replace(
        over, channel=Channel("ATT", "Roll"), value=lambda known: known[TIME], over=False
    )
    found = log.signals([over, once], Sampling(rate_hz=1.0))
    whole, own = (found.columns[one.channel] for one in (over, once))
    assert np.nanmax(whole) == pytest.approx(10.0)
    assert np.isfinite(whole).argmax() == np.searchsorted(own, 10.0 * 12 / 13)
