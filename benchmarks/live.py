"""What do `fdi observe` and `fdi watch` take of a processor while a vehicle flies, and what stays?

    .venv/bin/python benchmarks/live.py [--speed 1] [--minutes 10] [--rate 50] [--command watch]

A recorded flight of ten minutes (``../shared/flights/sitl/long``) whose fastest messages are filled
up to so many a second, linear between records, is played over TCP into the command on a terminal of
its own, as many times faster than in real time as is said. Then Ctrl-C. Printed are CPU seconds per
second of flight, with and without what the start takes, the resident set of a minute after
take-off and of the end, and whether the ``.tlog`` holds every frame that was sent. Returns 1 where
a tenth of a core or a tenth more memory is exceeded, or a frame is lost.

The share of a core is that of real time where --speed is 1; played faster, `fdi watch` takes of
each second of flight what it would take in real time, but the view is drawn less often.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

import fdi

ROOT = Path(__file__).resolve().parents[1]
LOG = ROOT.parent / "shared" / "flights" / "sitl" / "long" / "l02_copter_modes_gusts.tlog"
CORE, GROWTH = 0.1, 1.1
EARLY_S, LATE_S = 120.0, 5.0
"""From after the beginning is learned to the end memory must not grow, s of the flight."""
TICKS = os.sysconf("SC_CLK_TCK")
PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 1e6


def records(path: Path) -> list[tuple[float, bytes]]:
    """Return s from the first, and frame, of all records of a telemetry log."""
    raw, low, found = path.read_bytes(), 0, []
    while low < len(raw):
        head = raw[low + 8 : low + 18]
        size = head[1] + (8 if head[0] == 0xFE else 12 + 13 * (head[2] & 1))
        stamp = int.from_bytes(raw[low : low + 8], "big") / 1e6
        found.append((stamp, raw[low + 8 : low + 8 + size]))
        low += 8 + size
    return [(stamp - found[0][0], frame) for stamp, frame in found]


def filled(path: Path, rate: float, seconds: float) -> list[tuple[float, bytes]]:
    """Return a log's records with its fastest messages filled up to so many a second."""
    whole = [one for one in records(path) if one[0] < seconds]
    number = [frame[5] if frame[0] == 0xFE else int.from_bytes(frame[7:10], "little")
              for _, frame in whole]  # fmt: skip
    count = Counter(own for own in number if own != mav.MAVLINK_MSG_ID_PARAM_VALUE)
    most = count[mav.MAVLINK_MSG_ID_ATTITUDE]
    fastest = {own for own, n in count.items() if 0.9 * most < n < 1.1 * most}
    link = mav.MAVLink(None, 1, 1)
    times = max(round(rate * seconds / most), 1)
    found, before = [], {}
    for (stamp, frame), own in zip(whole, number, strict=True):
        if own not in fastest or (frame[5] if frame[0] == 0xFD else frame[3]) != 1:
            found.append((stamp, frame))
            continue
        now = (stamp, link.decode(bytearray(frame)))
        if own in before:
            found += between(before[own], now, times, link)
        before[own] = now
    found.sort(key=lambda one: one[0])
    return found


def between(first: tuple, last: tuple, times: int, link: mav.MAVLink) -> list[tuple[float, bytes]]:
    """Return so many records from one to the next; angles that turn round stay."""
    (t, a), (end, b) = first, last
    found = []
    for share in np.arange(times) / times:
        values = []
        for name in a.fieldnames:
            low, high = getattr(a, name), getattr(b, name)
            plain = isinstance(low, (int, float))
            turns = name in ("yaw", "hdg", "cog", "heading") and abs(high - low) > 3.2
            value = low if not plain or turns else low + share * (high - low)
            values.append(value if isinstance(low, float) or not plain else round(value))
        message = type(a)(*values)
        link.seq = (link.seq + 1) % 256
        found.append((t + share * (end - t), bytes(message.pack(link))))
    return found


@dataclass
class Player:
    """Plays frames to whoever connects, so many times faster than they came."""

    frames: list[tuple[float, bytes]]
    speed: float
    sent: float = 0.0

    def __post_init__(self) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        self.thread = threading.Thread(target=self.play, daemon=True)
        self.thread.start()

    def play(self) -> None:
        """Play all of it to the first who connects."""
        other, _ = self.server.accept()
        began, row = time.monotonic(), 0
        while row < len(self.frames):
            self.sent = (time.monotonic() - began) * self.speed
            low = row
            while row < len(self.frames) and self.frames[row][0] <= self.sent:
                row += 1
            other.sendall(b"".join(frame for _, frame in self.frames[low:row]))
            time.sleep(0.02)


def used(pid: int) -> tuple[float, float]:
    """Return CPU s and resident MB of a process (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS, int(fields[21]) * PAGE_MB


def drain(terminal: int) -> None:
    """Read what is drawn; a terminal whose process has ended has nothing more."""
    with contextlib.suppress(OSError):
        if select.select([terminal], [], [], 0.2)[0]:
            os.read(terminal, 1 << 16)


def played(command: str, frames: list[tuple[float, bytes]], speed: float, folder: Path) -> bool:
    """Play into a command, print a row, and return whether it kept its bounds."""
    player, kept = Player(frames, speed), folder / f"{command}.tlog"
    own, terminal = pty.openpty()
    run = [sys.executable, "-m", "fdi", command, f"tcp:127.0.0.1:{player.port}", "--record", kept]
    process = subprocess.Popen(run, stdin=terminal, stdout=terminal, stderr=terminal)
    os.close(terminal)
    seen: list[tuple[float, float, float]] = []
    while player.thread.is_alive():
        drain(own)
        if not seen or player.sent > seen[-1][0] + 5:
            seen.append((player.sent, *used(process.pid)))
    size = -1
    while size < (size := kept.stat().st_size):  # what is in the socket still is kept, too
        for _ in range(10):
            drain(own)
    seen.append((player.sent, *used(process.pid)))
    process.send_signal(signal.SIGINT)
    while process.poll() is None:
        drain(own)
    t, cpu, memory = np.array(seen).T
    early, late = memory[t >= min(EARLY_S, t[-1] / 2)], memory[t > t[-1] - LATE_S]
    share = (cpu[-1] - cpu[1]) / (t[-1] - t[1])
    lost = Counter(frame for _, frame in frames)
    lost.subtract(frame for _, frame in records(kept))
    missing = sum(abs(n) for n in lost.values())
    assert fdi.read(kept).messages
    print(f"| {command} | {len(frames)} | {speed:g} | {t[-1]:.0f} | {cpu[-1] / t[-1]:.3f} | "
          f"{share:.3f} | {early[0]:.0f} | {late.max():.0f} | {missing} | {process.returncode} |",
          flush=True)  # fmt: skip
    return bool(share < CORE and late.max() < GROWTH * early[0] and not missing)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--speed", type=float, default=8.0)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--command", choices=("observe", "watch"), action="append")
    given = parser.parse_args()
    if not LOG.exists():
        print("needs ../shared/flights beside the repository")
        return 0
    frames = filled(LOG, given.rate, 60 * given.minutes)
    print("| command | frames | times faster | s | of a core | without the start | MB at 120 s | "
          "MB at the end | frames lost | code |")  # fmt: skip
    print("| --- " * 10 + "|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        kept = [
            played(one, frames, given.speed, Path(folder))
            for one in given.command or ("observe", "watch")
        ]
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
