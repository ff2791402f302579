"""What a link has out of the ordinary is a line each, and nothing of it grows without bound."""

import tracemalloc

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from telemetry.build import record as sent

from fdi.live.hearing import MOST_TOLD, Hearing
from fdi.live.window import MOST_BYTES, Window
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog.stream import Piece, whole_frames

ARMED = mav.MAV_MODE_FLAG_SAFETY_ARMED
QUAD, GCS = mav.MAV_TYPE_QUADROTOR, mav.MAV_TYPE_GCS


def beat(system: int = 1, kind: int = QUAD, autopilot: int = 3, mode: int = 0) -> bytes:
    message = mav.MAVLink_heartbeat_message(kind, autopilot, mode, 0, 4, 3)
    return sent(0.0, message, system=system)[8:]


def attitude(boot_s: float, system: int = 1) -> bytes:
    message = mav.MAVLink_attitude_message(round(1000 * boot_s), 0, 0, 0.1, 0, 0, 0.1)
    return sent(0.0, message, system=system)[8:]


def piece(*frames: bytes) -> Piece:
    data = np.frombuffer(b"".join(frames), np.uint8)
    return whole_frames(data, frame_checks(), is_last=True)


@pytest.fixture
def heard() -> Hearing:
    hearing = Hearing()
    hearing.idle(0.0)
    hearing.hear(piece(beat(), *(attitude(20.0 + 0.1 * k) for k in range(10))), 1.0)
    return hearing


def test_the_first_autopilot_is_the_vehicle_and_no_ground_station() -> None:
    hearing = Hearing()
    assert hearing.hear(piece(beat(255, GCS, 8), beat(7)), 0.0) == [
        "heard system 7, a quad with ardupilot"
    ]


def test_a_second_vehicle_is_a_line_once(heard: Hearing) -> None:
    lines = heard.hear(piece(beat(9, mav.MAV_TYPE_FIXED_WING), beat(9), beat()), 1.1)
    assert lines == ["a second vehicle: system 9, a plane; system 1 is listened to"]
    assert heard.hear(piece(beat(9)), 1.2) == []


def test_the_system_that_is_asked_for_is_waited_for() -> None:
    hearing = Hearing(5)
    assert hearing.hear(piece(beat(1)), 0.0) == ["system 1, a quad: it is not the one asked for"]
    assert hearing.hear(piece(beat(5)), 0.1) == ["heard system 5, a quad with ardupilot"]


def test_a_dead_link_and_its_return_are_a_line_each(heard: Hearing) -> None:
    assert heard.idle(3.9) == []
    assert heard.idle(4.1) == ["the link is dead: system 1 has not been heard for 3 s"]
    assert heard.idle(9.0) == []
    lines = heard.hear(piece(attitude(27.0)), 7.0)
    assert "the link is back after 6.0 s" in lines
    assert heard.idle(7.1) == []


def test_silence_from_the_beginning_is_told() -> None:
    hearing = Hearing()
    hearing.idle(0.0)
    assert hearing.idle(3.1) == ["the link is dead: no vehicle was heard for 3 s"]


def test_a_reboot_is_told_once_it_is_certain(heard: Hearing) -> None:
    assert heard.hear(piece(attitude(0.5)), 1.1) == []  # one alone is damage
    lines = heard.hear(piece(attitude(0.6), attitude(0.7)), 1.2)
    assert lines == ["the vehicle started anew: its clock went back from 20.9 to 0.7 s"]
    assert heard.boots == 1


def test_a_time_jump_is_told_and_a_pause_is_none(heard: Hearing) -> None:
    assert heard.hear(piece(attitude(30.9)), 11.0) == []
    lines = heard.hear(piece(attitude(500.0)), 11.1)
    assert lines == ["a time jump: the vehicle's clock went on by 469.1 s while 0.1 s passed here"]


def test_a_hostile_sender_is_bounded_in_lines_and_memory() -> None:
    """Every system with every component, reboots without end."""
    hearing, lines = Hearing(), []
    hearing.idle(0.0)
    hearing.hear(piece(beat()), 0.0)
    tracemalloc.start()
    message = mav.MAVLink_heartbeat_message(QUAD, 3, 0, 0, 4, 3)
    for component in range(0, 256, 16):
        frames = [sent(0.0, message, system=s, component=component)[8:] for s in range(1, 256)]
        lines += hearing.hear(piece(*frames), 1.0)
    for base in (1e4, 0.0) * 2 * MOST_TOLD:
        lines += hearing.hear(piece(*(attitude(base + 0.1 * k) for k in range(4))), 1.0)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 1 << 20
    assert len(lines) <= 5 * MOST_TOLD
    last = [line for line in lines if "further ones are not told" in line]
    assert len(last) == 3, last  # other vehicles, reboots, jumps


def test_a_window_keeps_no_more_than_its_seconds_and_bytes() -> None:
    window = Window("the link", 8.0)
    for k in range(1000):
        window.take(bytes(100), 0.1 * k)
    assert 8.0 <= window.blocks[-1][0] - window.blocks[0][0] <= 8.3
    for _ in range(200):
        window.take(bytes(1 << 16), 100.0)  # a clock that stands still
    assert window.size <= MOST_BYTES + (1 << 16)
