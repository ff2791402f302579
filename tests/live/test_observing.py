"""The observer on a link says what it says of the file."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from methods.observer.build import write

from fdi.live.connection import open_link
from fdi.live.hearing import Hearing
from fdi.live.observing import Observing
from fdi.live.recorder import record
from fdi.live.session import Session
from fdi.methods.observer import Observation, observe
from fdi.telemetry import read
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog.frames import find_frames

from .playing import Player, frames_of, pieces

REAL = Path(__file__).parents[3] / "shared" / "flights" / "sitl" / "copter"


@pytest.fixture(scope="module")
def weak(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("weak") / "weak.tlog", weak=(1, 0.7, 45.0, 55.0))


class Kept:
    """Collects what a live observer computes, record by record."""

    def __init__(self) -> None:
        self.parts: list[tuple[np.ndarray, ...]] = []

    def __call__(self, *parts: np.ndarray) -> None:
        self.parts.append(parts)

    def whole(self) -> list[np.ndarray]:
        return [np.concatenate(own, axis=-1) for own in zip(*self.parts, strict=True)]


def over_tcp(path: Path, into: Path, offline: Observation) -> tuple[Observing, Kept]:
    """Play a log over TCP as fast as it goes, the vehicle stated as the file told it."""
    kept, player = Kept(), Player(b"".join(frames_of(path)[0]))
    vehicle = replace(offline.observer.vehicle, name="as told")
    engine = Observing(vehicle, sink=kept)
    session, link = Session(record(into), Hearing(), engine), open_link(player.name)
    since = time.monotonic()
    while time.monotonic() - since < 600 and player.thread.is_alive():
        session.take(link.receive(0.05), time.monotonic())
    while data := link.receive(0.05):
        session.take(data, time.monotonic())
    session.take(b"", time.monotonic(), is_last=True)
    session.recorder.close()
    link.close()
    return engine, kept


def assert_same_as_file(path: Path, into: Path) -> None:
    log = read(path)
    offline = observe(log)
    engine, kept = over_tcp(path, into, offline)
    t, value, doubt = kept.whole()
    file_t = offline.rows.t + float(log.clock.boot_offset[-1])
    assert engine.learned is not None
    same = np.searchsorted(file_t, t - 1e-4)
    assert np.abs(file_t[same] - t).max() < 1e-6
    assert t.size > 0.95 * file_t.size
    assert (np.diff(same) == 1).all()  # no record is left out
    np.testing.assert_allclose(value, offline.residuals[:, same], rtol=0, atol=1e-9)
    np.testing.assert_allclose(doubt, offline.doubt[:, same], rtol=0, atol=1e-9)
    np.testing.assert_allclose(engine.learned.limits.centre, offline.limits.centre, atol=1e-9)
    np.testing.assert_allclose(engine.learned.limits.deviation, offline.limits.deviation, atol=1e-9)
    assert [one.number for one in engine.motors] == [one.number for one in offline.motors]


def test_residuals_over_tcp_are_those_of_the_file(weak: Path, tmp_path: Path) -> None:
    assert_same_as_file(weak, tmp_path / "kept.tlog")


@pytest.mark.parametrize("name", ["c10_motor1_x0.7_20s", "c01_ref_slow_line"])
def test_residuals_of_a_real_log_over_tcp_are_those_of_the_file(name: str, tmp_path: Path) -> None:
    path = REAL / f"{name}.tlog"
    if not path.exists():
        pytest.skip("needs the flights beside the repository")
    assert_same_as_file(path, tmp_path / "kept.tlog")


def test_what_is_kept_is_what_was_sent(weak: Path, tmp_path: Path) -> None:
    """And `observe` says of it what it says of the log that was played."""
    into = tmp_path / "kept.tlog"
    session = Session(record(into), Hearing(), Observing())
    for when, data in pieces(weak):
        session.take(data, session.began[0] + when)
    session.take(b"", session.began[0] + when, is_last=True)
    session.recorder.close()
    assert frames_of(into)[0] == frames_of(weak)[0]
    first, again = observe(read(weak)), observe(read(into))
    np.testing.assert_allclose(again.residuals, first.residuals, rtol=0, atol=1e-9)
    assert [one.residual for one in again.alarms] == [one.residual for one in first.alarms]


def test_the_file_is_whole_after_every_piece(weak: Path, tmp_path: Path) -> None:
    into = tmp_path / "kept.tlog"
    session = Session(record(into), Hearing(), Observing())
    raw = b"".join(frames_of(weak)[0])[:40000]
    for low in range(0, len(raw), 997):
        session.take(raw[low : low + 997], session.began[0] + low / 1e4)
        data = np.fromfile(into, np.uint8)
        assert not data.size or not find_frames(data, frame_checks()).damage
    session.recorder.close()


def test_an_alarm_is_told_within_two_seconds(weak: Path, tmp_path: Path) -> None:
    engine = Observing()
    session = Session(record(tmp_path / "kept.tlog"), Hearing(), engine)
    told: list[tuple[float, str]] = []
    for when, data in pieces(weak, 0.1):
        told += [(when, line) for line in session.take(data, session.began[0] + when)]
    session.recorder.close()
    named = [(when, line) for when, line in told if line.startswith("MOTOR")]
    assert [line[:8] for _, line in named] == ["MOTOR 1 "]
    assert 45.5 <= named[0][0] < 47.0
