"""What becomes of one more piece of bytes? The way every engine is fed.

In: bytes of a link and when they came. Out: lines to tell. Whole frames are recorded first of all,
then heard, then kept in the windows of an `Engine`, which computes a block of records a tick.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fdi.live.hearing import Hearing
from fdi.live.recorder import Recorder
from fdi.live.window import Parameters
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog.stream import Piece, whole_frames

TICK_S: Final = 0.5
"""Records are computed so often, of the vehicle's clock or ours: an alarm is that late at most."""

MOST_WAITING: Final = 1 << 20
"""Bytes that are kept till a heartbeat says who the vehicle is: it comes once a second."""


class Engine(Protocol):
    """What computes while records come: the observer, or the bank."""

    def take(self, records: bytes, hearing: Hearing) -> None:
        """Keep records of the vehicle."""

    def tick(self, hearing: Hearing, parameters: Parameters) -> list[str]:
        """Compute what has come since, and return what is to tell."""

    def begin_anew(self, *, why: str) -> None:
        """Forget the flight: the vehicle started anew, or has landed."""


@dataclass(slots=True)
class Session:
    """A link's bytes on their way; ``began``: monotonic s, and us since 1970 at that moment."""

    recorder: Recorder
    hearing: Hearing
    engine: Engine
    parameters: Parameters = field(default_factory=Parameters)
    began: tuple[float, int] = field(
        default_factory=lambda: (time.monotonic(), time.time_ns() // 1000)
    )
    _left: bytes = b""
    _waiting: deque[tuple[Piece, int]] = field(default_factory=deque)
    _ticked: tuple[float, float] = (-np.inf, -np.inf)
    _count: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    _boots: int = 0
    _was_armed: bool = False

    def take(self, data: bytes, now: float, *, is_last: bool = False) -> list[str]:
        """Return what bytes that came at ``now``, monotonic s, give to tell.

        Raises
        ------
        OutputError
            The record of them cannot be written.
        LogError
            The vehicle is none that the engine can serve.
        """
        whole = np.frombuffer(self._left + data, np.uint8)
        piece = whole_frames(whole, frame_checks(), is_last=is_last)
        self._left = whole[piece.done :].tobytes()
        # one clock that nobody sets: this computer's may be put right while we listen
        stamp = self.began[1] + round((now - self.began[0]) * 1e6)
        self.recorder.write(piece.records(stamp))
        lines = self.hearing.hear(piece, now)
        self._keep(piece, stamp)
        lines += self._turns()
        if self.hearing.frames and (is_last or self._is_due(now)):
            lines += self._tick(now)
        return [*lines, *self.hearing.idle(now)]

    def _keep(self, piece: Piece, stamp: int) -> None:
        """Hand records on; till it is known who the vehicle is keep all, within bounds.

        Records of others go along while they are the fewer so far: what carries no time has it from
        where it stands among all of them, as in a file.
        """
        self._waiting.append((piece, stamp))
        if self.hearing.speaker is None:
            while sum(one.data.size for one, _ in self._waiting) > MOST_WAITING:
                self._waiting.popleft()
            return
        while self._waiting:
            piece, stamp = self._waiting.popleft()
            own = piece.system == self.hearing.speaker.system
            self.parameters.take(piece, self.hearing.speaker.system)
            self._count += np.array([own.sum(), own.size - own.sum()])
            heard = piece if self._count[1] <= self._count[0] else piece.of(own)
            self.engine.take(heard.records(stamp), self.hearing)

    def _turns(self) -> list[str]:
        """Let the engine begin anew after a reboot, and where the vehicle was disarmed."""
        hearing, lines = self.hearing, []
        if hearing.boots != self._boots:
            self.engine.begin_anew(why="it started anew")
        elif self._was_armed and not hearing.armed:
            lines = self.engine.tick(hearing, self.parameters)
            self.engine.begin_anew(why="it was disarmed")
        self._boots, self._was_armed = hearing.boots, hearing.armed
        return lines

    def _is_due(self, now: float) -> bool:
        ours, its = self._ticked
        return not (now - ours < TICK_S and self.hearing.boot_s - its < TICK_S)

    def _tick(self, now: float) -> list[str]:
        self._ticked = (now, self.hearing.boot_s)
        if self.hearing.speaker is None:
            return []
        return self.engine.tick(self.hearing, self.parameters)
