"""The loop: from the first byte to Ctrl-C.

Ctrl-C ends the listening and not the process: the record is closed, and what is asked for is told
of it. Till something was heard Ctrl-C interrupts as anywhere else.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

from fdi.live.connection import PIECE, Link
from fdi.live.session import Session

WAIT_S: Final = 0.1
"""Ctrl-C is heard within that."""
GATHER_S: Final = 0.05
"""What comes within it is one piece: a millisecond a packet would be a tenth of a core."""


class Stop:
    """Whether Ctrl-C was pressed."""

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Hear it."""
        self.pressed = True


@contextmanager
def stopping() -> Iterator[Stop]:
    """Give what Ctrl-C sets instead of interrupting; in a thread, which hears none, nothing."""
    stop = Stop()
    try:
        before = signal.signal(signal.SIGINT, stop)
    except ValueError:
        yield stop
        return
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def listen(
    link: Link,
    session: Session,
    tell: Callable[[list[str]], None],
    *,
    seconds: float | None = None,
) -> None:
    """Feed a session from a link till Ctrl-C, or for so many seconds.

    Parameters
    ----------
    link : Link
    session : Session
    tell : callable
        Is given the lines of every piece, often none.
    seconds : float, optional

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C before any message was heard.
    """
    end = float("inf") if seconds is None else time.monotonic() + seconds
    with stopping() as stop:
        try:
            while not stop.pressed and time.monotonic() < end:
                tell(session.take(_gathered(link, stop), time.monotonic()))
            tell(session.take(b"", time.monotonic(), is_last=True))
        finally:
            session.recorder.close()
    if stop.pressed and not session.hearing.frames:
        raise KeyboardInterrupt


def _gathered(link: Link, stop: Stop) -> bytes:
    """Return what comes within `GATHER_S` of the first bytes, nothing after `WAIT_S` without."""
    found = [link.receive(WAIT_S)]
    size, until = len(found[0]), time.monotonic() + GATHER_S
    while found[-1] and size < PIECE and not stop.pressed:
        if (left := until - time.monotonic()) <= 0:
            break
        time.sleep(left)  # to be woken by every packet is what costs
        found.append(link.receive(0.0))
        size += len(found[-1])
    return b"".join(found)
