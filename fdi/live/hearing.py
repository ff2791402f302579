"""Who speaks on a link, and is it alive? A line for whatever is out of the ordinary.

In: the frames of every piece. Out: which sender is the vehicle (the first whose heartbeat names an
autopilot, or the one that is asked for), its clock, and lines: it is heard, falls silent and comes
back, starts anew, its clock jumps, another vehicle speaks, its messages are of an unknown sender.

Everything that is kept is bounded: senders beyond `MOST_SENDERS` are counted together, and of a
kind of line so many are told.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from fdi.telemetry.catalogue import mavlink_autopilot, mavlink_vehicle
from fdi.telemetry.formats.bounds import MOST_SENDERS
from fdi.telemetry.formats.tlog.stream import Piece

HEARTBEAT: Final = 0
ATTITUDE: Final = 30
SILENT_S: Final = 3.0
"""Heartbeats come once a second: three are missing."""
STEP_S: Final = 1.0
"""The vehicle's clock against ours and against itself, as in files (``clock.py``)."""
CONFIRMED: Final = 3
"""Records that must agree that the clock went back: a single one is damage."""
MOST_TOLD: Final = 10
_GROUND_STATION: Final = 6
_NO_AUTOPILOT: Final = 8
_ARMED: Final = 128


@dataclass(frozen=True, slots=True)
class Speaker:
    """The vehicle that is listened to; ``vehicle`` and ``autopilot`` as in `Log`."""

    system: int
    component: int
    vehicle: str
    autopilot: str


@dataclass(slots=True)
class Hearing:
    """What has been heard so far.

    Attributes
    ----------
    wanted : int or None
        The system to listen to; None: the first vehicle.
    speaker : Speaker or None
    armed : bool
    boot_s : float
        The vehicle's clock, s since boot; NaN before any.
    boots : int
        How often it has started anew.
    frames : int
    beat : bytes
        The last heartbeat of the vehicle, a frame.
    """

    wanted: int | None = None
    speaker: Speaker | None = None
    armed: bool = False
    boot_s: float = float("nan")
    boots: int = 0
    frames: int = 0
    beat: bytes = b""
    _began: float = field(default=float("nan"))
    _last: float = field(default=float("nan"))
    _clock: float = field(default=float("nan"))
    _back: int = 0
    _is_silent: bool = False
    _senders: set[int] = field(default_factory=set)
    _others: dict[int, str] = field(default_factory=dict)
    _told: dict[str, int] = field(default_factory=dict)

    def hear(self, piece: Piece, now: float) -> list[str]:
        """Return what the frames of a piece that came at ``now``, monotonic s, give to tell."""
        lines: list[str] = []
        self.frames += piece.start.size
        self._count(piece, lines)
        for row in np.flatnonzero(piece.number == HEARTBEAT).tolist():
            self._beat(piece, row, lines)
        own = self.speaker
        if own is None:
            return lines
        mine = (piece.system == own.system) & (piece.component == own.component)
        if mine.any():
            if self._is_silent:
                self._tell(lines, "back", f"the link is back after {now - self._last:.1f} s")
                self._is_silent = False
            for row in np.flatnonzero(mine & (piece.number == ATTITUDE)).tolist():
                boot_s = int.from_bytes(piece.bytes_of(row, 4), "little") / 1000
                self._time(boot_s, now, lines)
            self._last = now
        return lines

    def idle(self, now: float) -> list[str]:
        """Return what is to tell when nothing has come."""
        lines: list[str] = []
        if np.isnan(self._began):
            self._began = self._last = now
        if not self._is_silent and now - self._last > SILENT_S:
            self._is_silent = True
            who = "no vehicle" if self.speaker is None else f"system {self.speaker.system}"
            told = "was heard" if self.speaker is None else "has not been heard"
            self._tell(lines, "silent", f"the link is dead: {who} {told} for {SILENT_S:.0f} s")
        return lines

    @property
    def is_silent(self) -> bool:
        """Whether nothing has been heard of the vehicle for long."""
        return self._is_silent

    def _count(self, piece: Piece, lines: list[str]) -> None:
        if not piece.start.size or len(self._senders) >= MOST_SENDERS:
            return
        self._senders.update(np.unique(piece.system * 256 + piece.component).tolist())
        if len(self._senders) >= MOST_SENDERS:
            text = f"more than {MOST_SENDERS} senders: those beyond are not told apart"
            self._tell(lines, "senders", text)

    def _beat(self, piece: Piece, row: int, lines: list[str]) -> None:
        payload = piece.bytes_of(row, 9)
        kind, autopilot, mode = payload[4:7]
        if kind == _GROUND_STATION or autopilot == _NO_AUTOPILOT:
            return
        system, component = int(piece.system[row]), int(piece.component[row])
        name = mavlink_vehicle(kind)
        if self.speaker is None and self.wanted in (None, system):
            self.speaker = Speaker(system, component, name, mavlink_autopilot(autopilot))
            lines.append(f"heard system {system}, a {name} with {self.speaker.autopilot}")
        own = self.speaker
        if own is not None and (system, component) == (own.system, own.component):
            self.beat = piece.data[piece.start[row] : piece.end[row]].tobytes()
            armed = bool(mode & _ARMED)
            if armed != self.armed:
                self._tell(lines, "arm", "armed" if armed else "disarmed")
            self.armed = armed
        elif system not in self._others and (own is None or system != own.system):
            self._others[system] = name  # a system has 8 bits: there are 256 at most
            kept = f"system {own.system} is listened to" if own else "it is not the one asked for"
            text = f"a second vehicle: system {system}, a {name}; {kept}"
            self._tell(lines, "second", text if own else f"system {system}, a {name}: {kept}")

    def _time(self, boot_s: float, now: float, lines: list[str]) -> None:
        before, passed = self.boot_s, now - self._clock
        if np.isfinite(before) and boot_s < before - STEP_S:
            self._back += 1
            if self._back < CONFIRMED:
                return
            self.boots += 1
            text = (
                f"the vehicle started anew: its clock went back from {before:.1f} to {boot_s:.1f} s"
            )
            self._tell(lines, "reboot", text)
        elif np.isfinite(before) and boot_s - before > max(passed, 0.0) + STEP_S:
            text = f"a time jump: the vehicle's clock went on by {boot_s - before:.1f} s"
            self._tell(lines, "jump", f"{text} while {max(passed, 0.0):.1f} s passed here")
        self._back = 0
        self.boot_s, self._clock = boot_s, now

    def _tell(self, lines: list[str], kind: str, text: str) -> None:
        count = self._told.get(kind, 0)
        if count < MOST_TOLD:
            last = count == MOST_TOLD - 1 and kind != "arm"
            lines.append(f"{text} (further ones are not told)" if last else text)
            self._told[kind] = count + (kind != "arm")
