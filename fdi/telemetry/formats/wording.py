"""How does what a vehicle says read: its texts, its parameters' names, how its firmware greets?"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
PARAMETER_NAME: Final = re.compile(r"[A-Za-z0-9_]{1,16}")
_FIRMWARE: Final = re.compile(r"\b(Ardu\w+|APM:\w+|Blimp|PX4)\s+(V?\d[\w.\-]*(?: \(\w+\))?)")


def clean_text(text: str) -> str:
    """Return a text without control characters (a log's text may reach a terminal)."""
    return _CONTROL.sub(" ", text).strip()


def greeting(texts: Iterable[str]) -> str | None:
    """Return the firmware's name and version by the first text that tells them."""
    found = next(filter(None, map(_FIRMWARE.search, dict.fromkeys(texts))), None)
    return f"{found[1]} {found[2]}" if found else None
