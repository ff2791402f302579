"""A recorded log played into a socket, and into a session without one."""

import contextlib
import itertools
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fdi.live.connection import PIECE
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog.frames import find_frames


def frames_of(path: Path) -> tuple[list[bytes], np.ndarray]:
    """Return the frames of a tlog without their stamps, and the stamps, s from the first."""
    data = np.fromfile(path, np.uint8)
    found = find_frames(data, frame_checks())
    assert not found.damage
    ends = np.append(found.start[1:], data.size).tolist()
    raw = data.tobytes()
    frames = [raw[low + 8 : high] for low, high in zip(found.start.tolist(), ends, strict=True)]
    return frames, (found.stamp_us - found.stamp_us[0]) / 1e6


def pieces(path: Path, seconds: float = 0.5) -> Iterator[tuple[float, bytes]]:
    """Yield a log in pieces of so many seconds: when, and the bytes."""
    frames, stamps = frames_of(path)
    edges = np.arange(0.0, stamps.max() + seconds, seconds)
    rows = [0, *np.searchsorted(stamps, edges[1:]).tolist(), len(frames)]
    for k, when in enumerate(edges[1:].tolist()):
        yield when, b"".join(frames[rows[k] : rows[k + 1]])


def moments(path: Path, seconds: float) -> Iterator[tuple[float, bytes]]:
    """Yield the first so many seconds of a log as it came: when, and the frames of that moment."""
    frames, stamps = frames_of(path)
    frames, stamps = frames[: np.searchsorted(stamps, seconds)], stamps[stamps < seconds]
    edges = [0, *(np.flatnonzero(np.diff(stamps)) + 1).tolist(), len(frames)]
    for low, high in itertools.pairwise(edges):
        yield float(stamps[low]), b"".join(frames[low:high])


class Player:
    """Serves bytes to the first who connects, in sends of so many bytes, then closes."""

    def __init__(self, data: bytes, size: int = PIECE // 8) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp:127.0.0.1:{self.server.getsockname()[1]}"
        self.thread = threading.Thread(target=self._play, args=(data, size), daemon=True)
        self.thread.start()

    def _play(self, data: bytes, size: int) -> None:
        other, _ = self.server.accept()
        self.server.close()
        with other, contextlib.suppress(OSError):  # whoever listened may have gone
            for low in range(0, len(data), size):
                other.sendall(data[low : low + size])
