"""A file that changes while it is read gives what was there, and the log says so."""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from fdi.errors import LogError
from fdi.telemetry import content, read

from .build import Flight


@contextmanager
def meanwhile(act: Callable[[], None]) -> Iterator[None]:
    """Do something again and again beside the block, from before it begins."""
    stop, began = threading.Event(), threading.Event()

    def work() -> None:
        while not stop.is_set():
            act()
            began.set()

    thread = threading.Thread(target=work)
    thread.start()
    began.wait(10)
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.fixture(params=["copied", "mapped"])
def flight(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log in a file that is taken the one way or the other."""
    if request.param == "mapped":
        monkeypatch.setattr(content, "COPIED", 1000)
    path = tmp_path / "flight.tlog"
    path.write_bytes(Flight().bytes())
    return path


def test_log_that_grows_while_it_is_read_gives_what_was_there_and_says_so(flight: Path) -> None:
    size = flight.stat().st_size
    more = Flight(start=100.0, boot=120.0).records()[0]
    finding = None
    with flight.open("ab", buffering=0) as file, meanwhile(lambda: file.write(more) and None):
        for _ in range(50):  # on a busy machine the writer may sleep through a whole reading
            log = read(flight)
            finding = next((q for q in log.quality if "while it was read" in q.text), None)
            if finding is not None:
                break
    assert finding is not None
    assert finding.kind == "truncated"
    assert log.bytes >= size
    assert (log.bytes - size) % len(more) == 0
    assert finding.count > 0


def test_log_that_holds_still_has_no_such_finding(flight: Path) -> None:
    assert not [q for q in read(flight).quality if "while it was read" in q.text]


def test_log_that_was_copied_is_whole_whatever_happens_to_the_file(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(Flight().bytes())
    log = read(path)
    expected = log["ATTITUDE"].si("yaw").copy()
    again = read(path)
    os.truncate(path, 10)
    np.testing.assert_array_equal(again["ATTITUDE"].si("yaw"), expected)


def test_log_that_is_cut_short_while_it_is_read_says_so(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(Flight().bytes())
    with content.opened(path) as file:
        data = content.content(file, path)
        os.truncate(path, 1000)
        (finding,) = content.change(file, data)
    assert "cut short" in finding.text


def test_log_that_is_emptied_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(b"x")
    with content.opened(path) as file:
        os.truncate(path, 0)
        with pytest.raises(LogError, match="emptied"):
            content.content(file, path)


def test_bytes_are_those_of_the_file_and_read_only(flight: Path) -> None:
    with content.opened(flight) as file:
        data = content.content(file, flight)
    assert data.tobytes() == flight.read_bytes()
    assert not data.flags.writeable


def test_fifo_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(LogError, match="regular"), content.opened(tmp_path / "fifo"):
        pass
