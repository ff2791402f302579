"""The last seconds of a vehicle, as a log.

In: frames as they come. Out: a `Log` by the reader of files, on demand. What lies further back than
so many seconds of the vehicle's clock, or beyond so many bytes, goes; the beginning of a flight,
from which methods learn, stays where that is asked for. Of parameters the first value of each stays
too, as a file's count as first downloaded, and the last heartbeat says what it is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.live.hearing import Hearing
from fdi.telemetry import Log
from fdi.telemetry.formats.bounds import MOST_NAMES
from fdi.telemetry.formats.tlog import read_tlog
from fdi.telemetry.formats.tlog.stream import Piece
from fdi.telemetry.meaning import MOTORS, ROTORS, with_motors, with_outputs

PARAM_VALUE: Final = 22
MOST_BYTES: Final = 1 << 23
"""Of a window; at 50 Hz of everything 300 s are about 6 MB."""
_NAME: Final = slice(8, 24)  # of PARAM_VALUE


@dataclass(slots=True)
class Parameters:
    """The first value of every parameter that came, as frames by name."""

    frames: dict[bytes, bytes] = field(default_factory=dict)

    def take(self, piece: Piece, system: int) -> None:
        """Keep the parameters that a system sends in a piece."""
        is_one = (piece.number == PARAM_VALUE) & (piece.system == system)
        for row in np.flatnonzero(is_one).tolist():
            name = piece.bytes_of(row, 25)[_NAME]
            if name not in self.frames and len(self.frames) < MOST_NAMES:
                frame = piece.data[piece.start[row] : piece.end[row]].tobytes()
                self.frames[name] = frame


@dataclass(slots=True)
class Window:
    """Records of the last ``keep_s`` seconds of the vehicle's clock, and of a ``beginning``."""

    name: str
    keep_s: float
    blocks: deque[tuple[float, bytes]] = field(default_factory=deque)
    beginning: tuple[tuple[float, bytes], ...] = ()
    size: int = 0

    def take(self, records: bytes, boot_s: float) -> None:
        """Add records that came up to a time of the vehicle's clock, and let old ones go."""
        if not records:
            return
        # so much before what is new, however long that is; what came before any time, too
        until = self.blocks[-1][0] if self.blocks else boot_s
        self.size += len(records)
        while self.blocks and (self.size > MOST_BYTES or self.blocks[0][0] < until - self.keep_s):
            self.size -= len(self.blocks.popleft()[1])
        if np.isnan(until):
            self.blocks = deque((boot_s, own) for _, own in self.blocks)
        self.blocks.append((boot_s, records))

    def clear(self) -> None:
        """Forget all records."""
        self.blocks.clear()
        self.beginning, self.size = (), 0

    def between(self, start: float, end: float) -> tuple[tuple[float, bytes], ...]:
        """Return what came from one time of the vehicle's clock to another, s since boot."""
        return tuple(block for block in self.blocks if start <= block[0] <= end)

    def log(self, hearing: Hearing, parameters: Parameters | None = None) -> Log | None:
        """Return the window as a log; None if empty.

        With the parameters where they are given; without them a heartbeat says whose it is, even if
        the window is too short to hold one.
        """
        assert hearing.speaker is not None
        if not self.blocks:
            return None
        earlier = [block for block in self.beginning if block[0] < self.blocks[0][0]]
        blocks = [*earlier, *self.blocks]
        stamp = blocks[0][1][:8]
        known = (hearing.beat,) if parameters is None else parameters.frames.values()
        first = [stamp + frame for frame in known]
        data = np.frombuffer(b"".join([*first, *(own for _, own in blocks)]), np.uint8)
        try:
            return read_tlog(Path(self.name), data, system=hearing.speaker.system)
        except LogError:  # what there is holds no message: nothing is known yet
            return None


def as_of(log: Log, vehicle: str, parameters: Mapping[str, float], frame: str) -> Log:
    """Return a window's log with what is known of its vehicle already."""
    own = {key: one for key, one in log.messages.items() if key not in (MOTORS, *ROTORS)}
    own = with_outputs(own, parameters, log.autopilot, vehicle)
    own = with_motors(own, parameters, log.autopilot, vehicle)
    known = replace(log, vehicle=vehicle, parameters=parameters, frame=frame, messages=own)
    return known.believing()


def since_boot(log: Log) -> float:
    """Return what turns the log's clock into s since boot, at its end; NaN where unknown."""
    return float(log.clock.boot_offset[-1])
