"""How does Ctrl-C end the command line with one line and 130, whatever runs when it is pressed?

An exception that Python raises wherever it happens to be is not enough. In an import a library may
turn it into another, or stay half loaded; a destructor prints it and goes on; after the answer it
is a traceback. So a handler of our own looks where it is called, and is called again every 0.1 s
from the first Ctrl-C on:

- within an import it waits for the import's end;
- while the interrupt unwinds the stack it does nothing: what cleans up is not disturbed, neither by
  a second Ctrl-C;
- once the answer is given it ends the process at once;
- else it raises ``KeyboardInterrupt``, again where one was swallowed.

What it cannot help: until it listens, Python itself prints a traceback. Of the CPU that passes till
then some 60 % are the interpreter's own start, 30 % ``re`` in the script that pip writes before it
calls us, and 10 % ours (measured on a busy machine: 24, 12 and 4 of 40 ms).

The trap for a maintainer: this is loaded before anything else, so it imports next to nothing.
"""

from __future__ import annotations

import _thread
import os
import sys
import time

TYPE_CHECKING = False  # what `typing` has, without the 8 ms that it takes to load
if TYPE_CHECKING:
    import signal
    from types import FrameType
    from typing import Any
else:
    import _signal as signal  # `signal` itself would load `enum` first

INTERRUPTED = 130
LINE = "fdi: interrupted\n"
AGAIN_S = 0.1
LONGEST_IMPORT_S = 10.0
"""After so long an import is no longer waited for; the slowest of ours takes 2 s on a slow disk."""
_IMPORT = "<frozen importlib"


class Interrupts:
    """Hears Ctrl-C for a process, from `listen` on.

    Attributes
    ----------
    seen : bool
        Whether it was pressed.
    """

    def __init__(self) -> None:
        self.seen = False
        self._is_over = False
        self._since = 0.0
        self._before: Any = None

    def listen(self, *, to_the_end: bool) -> None:
        """Take over Ctrl-C, unless whoever started us switched it off, or we are in a thread.

        ``to_the_end`` of the process: when Python has taken down its handlers, and with them ours,
        it frees what the libraries hold for some 50 ms, in which Ctrl-C does nothing.
        """
        before = signal.getsignal(signal.SIGINT)
        if before == signal.SIG_IGN:
            return
        try:
            signal.signal(signal.SIGINT, self._hear)
        except ValueError:  # not the main thread, to which alone signals are told
            return
        self._before = before
        if to_the_end:
            import atexit

            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)

    def is_over(self) -> None:
        """Say that the answer was given: an interrupt has nothing to stop, and ends us at once."""
        self._is_over = True

    def say(self) -> None:
        """Write the one line; from here on nothing is heard any more."""
        self._is_over = True
        if self._before is not None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            sys.stderr.write(LINE)
            sys.stderr.flush()
        except (AttributeError, OSError, ValueError):  # nobody listens: nor at the very end
            sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - it stays

    def hand_back(self) -> None:
        """Give Ctrl-C back to who had it before, where the process goes on without us."""
        self._is_over = True
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self._is_over:
            if not self.seen:
                os.write(2, LINE.encode())
                os._exit(INTERRUPTED)
            return
        if not self.seen:
            self.seen = True
            self._since = time.monotonic()
            sys.unraisablehook = _say_nothing
            _thread.start_new_thread(self._call_again, (_thread.get_ident(),))
        if _is_unwinding():
            return
        if _is_importing(frame) and time.monotonic() - self._since < LONGEST_IMPORT_S:
            return
        raise KeyboardInterrupt

    def _call_again(self, main: int) -> None:
        while True:
            time.sleep(AGAIN_S)
            if self._is_over:
                return
            if sys.platform == "win32":
                _thread.interrupt_main()
            else:  # a signal also wakes a thread that waits
                signal.pthread_kill(main, signal.SIGINT)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT):
            return True
        frame = frame.f_back
    return False


def _is_unwinding() -> bool:
    """Return whether the main thread is in a block that handles an interrupt on its way up."""
    error = sys.exception()
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__context__
    return False


def _say_nothing(told: object) -> None:
    """Take the place of what prints the exceptions of destructors."""
