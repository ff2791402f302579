"""Ctrl-C at any moment, and a sender that means ill: the record stays whole, and nothing grows."""

import os
import signal
import threading
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from methods.observer.build import write
from pymavlink.dialects.v20 import ardupilotmega as mav
from telemetry.build import record as sent

from fdi.errors import OutputError
from fdi.live.connection import PIECE
from fdi.live.hearing import Hearing
from fdi.live.listening import GATHER_S, listen
from fdi.live.observing import Observing
from fdi.live.recorder import record
from fdi.live.session import Session
from fdi.live.watching import Watching
from fdi.live.window import MOST_BYTES
from fdi.telemetry import read

from .playing import frames_of


class Bytes:
    """A link that gives so many bytes at a time, and calls back before some of them."""

    def __init__(self, data: bytes, size: int, at: int = -1, call=lambda: None) -> None:
        self.data, self.size, self.at, self.call, self.low = data, size, at, call, 0

    def receive(self, wait_s: float) -> bytes:
        if self.low // self.size == self.at:
            self.call()
        found = self.data[self.low : self.low + self.size]
        self.low += self.size
        return found

    def close(self) -> None:
        pass


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("flight") / "flight.tlog", 40.0)


@pytest.mark.parametrize("at", [1, 3, 10])
def test_ctrl_c_ends_the_listening_and_the_record_opens(
    at: int, flight: Path, tmp_path: Path
) -> None:
    into, frames = tmp_path / "kept.tlog", frames_of(flight)[0]
    session = Session(record(into), Hearing(), Observing())
    link = Bytes(b"".join(frames), 7919, at, interrupt)
    before = signal.getsignal(signal.SIGINT)
    listen(link, session, lambda lines: None, seconds=20.0)
    assert signal.getsignal(signal.SIGINT) is before
    kept = frames_of(into)[0]
    assert kept == frames[: len(kept)]
    left = sum(map(len, frames[: len(kept) + 1]))
    assert left > min(link.low, len(link.data)) - 1  # all that was received but a cut frame
    assert read(into).messages


def test_ctrl_c_while_a_record_is_written_leaves_it_whole(flight: Path, tmp_path: Path) -> None:
    """A signal that comes in the middle of a write does not cut it."""
    into, frames = tmp_path / "kept.tlog", frames_of(flight)[0]
    session = Session(record(into), Hearing(), Observing())
    whole = session.recorder.write

    class Pressed:
        path, size = into, 1

        def write(self, records: bytes) -> None:
            interrupt()
            whole(records)

        def close(self) -> None:
            session_file.close()

    session_file, session.recorder = session.recorder, Pressed()
    listen(Bytes(b"".join(frames), 7919), session, lambda lines: None, seconds=20.0)
    assert frames_of(into)[0] == frames[: len(frames_of(into)[0])]


def test_ctrl_c_before_anything_was_heard_interrupts_and_leaves_no_file(tmp_path: Path) -> None:
    into = tmp_path / "kept.tlog"
    session = Session(record(into), Hearing(), Observing())
    with pytest.raises(KeyboardInterrupt):
        listen(Bytes(b"", 10, 0, interrupt), session, lambda lines: None)
    assert not into.exists()


def test_so_many_seconds_end_it_and_packets_are_gathered(tmp_path: Path) -> None:
    """A thousand packets a second are some twenty pieces."""
    beat = sent(0.0, mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, 3, 0, 0, 4, 3))[8:]
    pieces = []

    class Busy(Bytes):
        def receive(self, wait_s: float) -> bytes:
            return beat

    session = Session(record(tmp_path / "kept.tlog"), Hearing(), Observing())
    since = time.monotonic()
    listen(Busy(b"", 1), session, pieces.append, seconds=0.5)
    assert 0.5 <= time.monotonic() - since < 60.0
    assert len(pieces) <= 0.5 / GATHER_S + 2


@pytest.mark.parametrize("engine", [Observing, Watching])
def test_a_hostile_sender_makes_no_record_grow_and_no_line_without_end(
    engine, tmp_path: Path
) -> None:
    """Garbage, forged lengths, 10,000 senders, and a real vehicle among them."""
    rng = np.random.default_rng(0)
    message = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, 3, 0, 0, 4, 3)
    real = sent(0.0, message)[8:]
    others = [sent(0.0, message, system=2 + k % 250, component=k // 250)[8:] for k in range(10_000)]
    forged = bytes([0xFD, 255, 0, 0, 0, 1, 1, 30, 0, 0])
    into = tmp_path / "kept.tlog"
    session = Session(record(into), Hearing(), engine())
    lines, now = [], session.began[0]
    tracemalloc.start()
    for k in range(40):
        noise = rng.integers(0, 256, 5000, np.uint8).tobytes()
        data = real + noise + forged * 20 + b"".join(others[250 * k : 250 * k + 250]) + bytes(300)
        now += 0.1
        lines += session.take(data, now)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    session.recorder.close()
    assert sum(frame == real for frame in frames_of(into)[0]) == 40
    assert kept < 2 * MOST_BYTES
    assert len(lines) < 40
    assert read(into, system=1).messages


def test_a_window_of_a_flooded_link_holds_no_more_of_others_than_of_the_vehicle(
    tmp_path: Path,
) -> None:
    message = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, 3, 0, 0, 4, 3)
    real, other = sent(0.0, message)[8:], sent(0.0, message, system=9)[8:]
    engine = Watching()
    session = Session(record(tmp_path / "kept.tlog"), Hearing(), engine)
    for k in range(20):
        session.take(real * 10 + other * (1 if k < 10 else 500), session.began[0] + 0.1 * k)
    session.recorder.close()
    size = sum(len(own) for _, own in engine._first.blocks)
    assert size <= 2 * 200 * (len(real) + 8)


def test_a_full_disk_is_one_error_and_the_record_stays_whole(
    flight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = frames_of(flight)[0]
    recorder = record(tmp_path / "kept.tlog")
    recorder.write(bytes(8) + frames[0])
    size = recorder.size

    class Full:
        def write(self, data: bytes) -> int:
            return file.write(data[: len(data) // 2])

        def fileno(self) -> int:
            return file.fileno()

        def close(self) -> None:
            file.close()

    file, recorder.file = recorder.file, Full()
    with pytest.raises(OutputError, match="the disk is full"):
        recorder.write(bytes(8) + frames[1])
    recorder.close()
    assert recorder.path.stat().st_size == size


def test_in_a_thread_which_hears_no_signal_it_ends_by_the_seconds(tmp_path: Path) -> None:
    session = Session(record(tmp_path / "kept.tlog"), Hearing(), Observing())

    def run() -> None:
        listen(Bytes(b"", PIECE), session, lambda lines: None, seconds=0.2)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join(60.0)
    assert not thread.is_alive()
    assert not (tmp_path / "kept.tlog").exists()
