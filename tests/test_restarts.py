"""An autopilot that starts anew in the air: an end of its own, and what the supply says of it."""

import struct
from pathlib import Path

import numpy as np
import pytest

from fdi import analyze, read
from fdi.diagnosis.recording_end import recording_end
from fdi.report.explained import explained
from fdi.telemetry.clock import last_boot
from fdi.telemetry.supply import supplies
from tests.flights import EXAMPLES, SHARED, joined, records

GAP_S = 2.5
BOOT_MS = 1400
GOES_ON = ("HEARTBEAT", "SYS_STATUS", "POWER_STATUS", "SYSTEM_TIME")


def restarted(name, at, *, goes_on=GOES_ON, until=6.0, last_volts=None, speaks=True, without=""):
    """Return a flight whose autopilot is silent from ``at`` s on, and says little after that."""
    flight = records(EXAMPLES / name)
    zero = flight[0].stamp
    cease, heard = zero + at * 1e6, zero + (at + GAP_S) * 1e6
    kept = []
    for one in flight:
        if one.name == without:
            continue
        if one.system != 1 or one.stamp <= cease:
            is_last = one.name == "POWER_STATUS" and one.stamp > cease - 2.5e6
            kept.append(one.edited(volts(last_volts)) if is_last and last_volts else one)
        elif speaks and heard <= one.stamp <= heard + until * 1e6 and one.name in goes_on:
            boot_ms = round((one.stamp - heard) / 1e3) + BOOT_MS
            kept.append(one.edited(lambda m, ms=boot_ms: anew(m, ms)))
    return joined(kept)


def volts(value):
    return lambda message: setattr(message, "Vcc", round(value * 1000))


def anew(message, boot_ms):
    if message.get_type() == "HEARTBEAT":
        message.base_mode &= ~0x80
    elif hasattr(message, "time_boot_ms"):
        message.time_boot_ms = boot_ms


COPTER = ("copter_motor_failure_crash.tlog", 30.0)
PLANE = ("plane_engine_failure_stall.tlog", 25.0)


@pytest.fixture
def analysed(tmp_path):
    def answer(data, name="restart.tlog"):
        path = Path(tmp_path / name)
        path.write_bytes(data)
        return analyze(path)

    return answer


@pytest.mark.parametrize("flight", [COPTER, PLANE])
def test_a_supply_that_held_leaves_the_computer(flight, analysed):
    found = analysed(restarted(*flight))
    end = found.log.ends[-1]
    assert end.how == "restarted"
    assert end.at == pytest.approx(flight[1], abs=1.0)
    assert [one.component for one in found.findings] == ["autopilot_computer"]
    assert "autopilot_computer" not in {one.component for one in found.ruled_out}
    assert found.verdict.startswith("The autopilot started anew in the air")
    (fact,) = (one.text for one in found.stood_out if one.about == "ending")
    assert "power was there at its last records" in fact


@pytest.mark.parametrize("flight", [COPTER, PLANE])
def test_a_board_whose_voltage_fell_is_the_cause(flight, analysed):
    found = analysed(restarted(*flight, last_volts=3.6))
    assert found.log.ends[-1].how == "restarted"
    assert [one.component for one in found.findings] == ["power"]
    assert "board 3.6 V after 5.0 V" in " ".join(one.text for one in found.stood_out)
    told = explained(found, "facts")
    assert f"rests on the last record before: log {found.log.ends[-1].at:.1f} s" in told
    assert "rests on POWER_STATUS.Vcc: 3.60 V at log " in told


def test_without_a_voltage_of_the_board_nobody_is_accused(analysed):
    found = analysed(restarted(*COPTER, without="POWER_STATUS"))
    assert found.log.ends[-1].how == "restarted"
    assert list(found.findings) == []
    assert "no component explains it" in found.verdict
    assert {"power", "autopilot_computer"}.isdisjoint(one.component for one in found.ruled_out)


def test_nothing_is_said_to_have_stayed_within_health(analysed):
    found = analysed(restarted(*COPTER))
    assert "stayed within" not in found.verdict
    assert found.diagnosis.outlook == "accused"
    assert all(one.component != "power" for one in found.findings)


def test_what_only_falls_silent_is_a_recording_that_stops(analysed):
    found = analysed(restarted(*COPTER, speaks=False))
    assert found.log.ends[-1].how == "in_air"
    assert found.findings == ()


def test_a_restart_on_the_ground_ends_no_flight(analysed):
    found = analysed(restarted("copter_motor_failure_crash.tlog", 3.0))
    assert all(end.how != "restarted" for end in found.log.ends)


def test_who_flies_on_after_it_has_a_second_flight(tmp_path):
    everything = {one.name for one in records(EXAMPLES / PLANE[0])}
    path = tmp_path / "flies_on.tlog"
    path.write_bytes(restarted(*PLANE, goes_on=everything, until=12.0))
    log = read(path)
    first, second = log.flights
    assert first.restart == pytest.approx(second.start, abs=1.0)
    assert second.restart is None
    assert "gave nothing" in recording_end(log)[0].text


def of_a_boot(last, *later):
    return last_boot(np.array([last, *later], np.int64), 0).tolist()


def test_a_few_late_records_with_an_early_clock_are_another_boot():
    assert of_a_boot(60_000, 1_400, 1_900, 2_400) == [1, 2, 3]
    assert of_a_boot(60_000, 60_100, 1_400, 1_900, 2_400) == [2, 3, 4]


@pytest.mark.parametrize(
    "later",
    [
        (1_400, 1_900),  # damage
        (0, 0, 0, 0),  # a clock that stands still
        (2_400, 1_900, 1_400),  # backwards
        (59_500, 59_600, 59_700),  # records that a link delayed
        (),
    ],
)
def test_what_else_comes_late_is_none(later):
    assert of_a_boot(60_000, *later) == []


def test_supplies_tell_a_voltage_before_a_moment_at_it_and_after(tmp_path):
    path = tmp_path / "dip.tlog"
    path.write_bytes(restarted(*COPTER, last_volts=3.6))
    log = read(path)
    battery, board = supplies(log.messages, log.ends[-1].at)
    assert battery.kept
    assert not board.kept
    assert (board.before, board.last, board.after) == pytest.approx((5.0, 3.6, 5.0), abs=0.01)


def dataflash_restarted(data, at, *, boot_us, keep, until=6.0):
    """Return a DataFlash file whose time starts anew after ``at`` s; only its bytes are known."""
    lengths, found, place = {128: (89, "FMT")}, [], 0
    while place + 3 <= len(data):
        kind = data[place + 2]
        assert data[place : place + 2] == b"\xa3\x95"
        size, name = lengths[kind]
        if kind == 128:
            of = data[place + 3]
            lengths[of] = data[place + 4], data[place + 5 : place + 9].rstrip(b"\0").decode()
        us = None if kind == 128 else struct.unpack_from("<Q", data, place + 3)[0]
        found.append((name, us, data[place : place + size]))
        place += size
    cease = min(us for _, us, _ in found if us) + at * 1e6
    heard = cease + GAP_S * 1e6
    parts = []
    for name, us, record in found:
        if us is None or us <= cease:
            parts.append(record)
        elif heard <= us <= heard + until * 1e6 and name in keep:
            later = struct.pack("<Q", int(us - heard) + boot_us)
            parts.append(record[:3] + later + record[11:])
    return b"".join(parts)


BIN = SHARED / "sitl/copter/c01_ref_slow_line.BIN"


@pytest.mark.skipif(not BIN.exists(), reason="needs ../shared")
@pytest.mark.parametrize("keep", [("BAT", "MSG", "PM"), ("BAT", "GPS", "IMU", "ATT", "MSG")])
def test_a_dataflash_file_with_a_restart_in_the_air(keep, tmp_path):
    path = tmp_path / "restart.bin"
    path.write_bytes(dataflash_restarted(BIN.read_bytes(), 50.0, boot_us=2_400_000, keep=keep))
    log = read(path)
    end = log.ends[0]
    assert (end.how, end.at) == ("restarted", pytest.approx(50.0, abs=0.2))
    assert log.flights[0].restart == pytest.approx(52.4, abs=0.2)
    assert [e.kind for e in log.events].count("reboot") == 1
