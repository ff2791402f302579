"""How does the whole analysis of an input end, by the exit code of the command line?

Whatever a log says, it was read (0) or it is to blame (3): never the command line (2), the model
(4) or a defect of ours (70). Where its clocks alone are wrong (`check_clock`), so do the methods
on their own, and none may cost more than `TIMES` what the undamaged log costs, and `MEMORY`.
"""

from __future__ import annotations

import os
import resource
import signal
import time
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any, Final

from fdi.analysis import analyze
from fdi.cli import main
from fdi.errors import LogError

from .clocks import base_of
from .heads import Head
from .worker import TooSlowError, described, forget_peak, tell_cost, used_memory

START_S: Final = 30.0  # CPU: tests of channels that were never together are derived anew
SECONDS_PER_MB: Final = 10.0
REPORTED: Final = 25  # of every such number a report is written
_ALLOWED: Final = (0, 3)
TIMES: Final = 20.0
LEAST_S: Final = 0.25
"""CPU of the undamaged log: less is not told from what else the process does."""
MEMORY: Final = 1_000_000_000
MORE: Final = ("info", "check", "convert", "observe", "heading", "estimator")


def check(data: bytes, number: int, folder: Path) -> dict[str, Any] | None:
    """Return what is wrong with how the analysis of an input ends, None where nothing is."""
    path = folder / "log"
    path.write_bytes(data)
    words = ["analyze", str(path), "--quiet", "--no-progress"]
    if number % REPORTED:
        words += ["--json"]
    else:
        words += ["--out", str(folder / "out"), "--force", "--format", "html,json,csv,txt"]
    signal.setitimer(signal.ITIMER_PROF, START_S + SECONDS_PER_MB * len(data) / 1e6)
    try:
        code = _silent(words)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    if code in _ALLOWED:
        return None
    what, text = f"exit code {code}", ""
    try:
        analyze(path).document()
    except LogError:
        pass
    except Exception as error:  # noqa: BLE001  whatever it is, it is a defect
        what, text = described(error)
    return {"number": number, "what": f"{code}: {what}", "text": text, "bytes": len(data)}


def check_clock(data: bytes, number: int, folder: Path) -> dict[str, Any] | None:
    """Return what is wrong with how a flight with damaged clocks is dealt with, None for nothing.

    By `analyze`, and by one of the other commands in turn.
    """
    path, base = folder / "log", base_of(number)
    path.write_bytes(data)
    for command in ("analyze", MORE[number % len(MORE)]):
        undamaged = _undamaged_s(command, base, folder)
        allowed = TIMES * undamaged
        forget_peak()
        limit = used_memory() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
        signal.setitimer(signal.ITIMER_PROF, allowed)
        began = time.process_time()
        try:
            code = _silent(_words(command, path, folder))
            what = "" if code in _ALLOWED else f"exit code {code}"
        except TooSlowError:
            what = "too slow"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY,) * 2)
        spent = time.process_time() - began
        tell_cost(command, spent, undamaged)
        if what:
            text = f"{spent:.1f} s of CPU, {allowed:.1f} allowed, of {Path(base.name).name}"
            return {
                "number": number,
                "what": f"{command}: {what}",
                "text": text,
                "bytes": len(data),
            }
    return None


@cache
def _undamaged_s(command: str, base: Head, folder: Path) -> float:
    """Return what the undamaged log costs, s of CPU, once all is loaded and compiled."""
    path = folder / "undamaged"
    path.write_bytes(b"".join(base.chunks))
    spent = []
    for _ in range(2):
        began = time.process_time()
        _silent(_words(command, path, folder))
        spent.append(time.process_time() - began)
    return max(min(spent), LEAST_S)


def _words(command: str, path: Path, folder: Path) -> list[str]:
    out = ["--out", str(folder / "out"), "--force"]
    more = {"analyze": ["--quiet", "--no-progress", "--json"], "convert": out}
    return [command, str(path), *more.get(command, [])]


def _silent(words: list[str]) -> int:
    """Return the exit code of the command line."""
    with open(os.devnull, "w") as nobody, redirect_stdout(nobody), redirect_stderr(nobody):
        return int(main(words))
