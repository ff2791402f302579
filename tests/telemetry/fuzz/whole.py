"""How does the whole analysis of an input end, by the exit code of the command line?

Whatever a log says, it was read (0) or it is to blame (3): never the command line (2), the model
(4) or a defect of ours (70).
"""

from __future__ import annotations

import os
import signal
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, Final

from fdi.analysis import analyze
from fdi.cli import main
from fdi.errors import LogError

START_S: Final = 30.0  # CPU: tests of channels that were never together are derived anew
SECONDS_PER_MB: Final = 10.0
REPORTED: Final = 25  # of every such number a report is written
_ALLOWED: Final = (0, 3)


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
        with open(os.devnull, "w") as nobody, redirect_stdout(nobody), redirect_stderr(nobody):
            code = main(words)
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
        from .worker import described

        what, text = described(error)
    return {"number": number, "what": f"{code}: {what}", "text": text, "bytes": len(data)}
