"""Which scripts and styles does the page hold, and which may a browser run?

Out: the text of uPlot and of our own files, and the policy that allows these by their hashes and
nothing else: no request, no evaluation of text, no other script, whatever a log may contain.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any, Final

PLOTTING: Final = "uplot/uPlot.iife.min.js"
SCRIPTS: Final = (
    "values.js",
    "clock.js",
    "frames.js",
    "plot.js",
    "grid.js",
    "track.js",
    "events.js",
    "picker.js",
    "address.js",
    "main.js",
)
"""Ours, in the order in which they need each other."""
STYLES: Final = ("uplot/uPlot.min.css", "report.css")
_LINE_ENDS: Final = str.maketrans({"\u2028": "\\u2028", "\u2029": "\\u2029"})


@cache
def script(name: str = "") -> str:
    """Return the text of a script by name, by default ours of an analysis' page as one."""
    if name:
        return _text(name)
    return "".join(f"\n// {part}\n{_text(part)}" for part in SCRIPTS)


@cache
def style(parts: Sequence[str] = STYLES) -> str:
    """Return the text of style sheets as one, by default those of an analysis' page."""
    return "\n".join(_text(part) for part in parts)


def _text(name: str) -> str:
    return (files("fdi.report.page") / "assets" / name).read_text("utf-8")


def hash_of(text: str) -> str:
    """Return the hash of an element's text as a policy names it."""
    return "sha256-" + base64.b64encode(sha256(text.encode()).digest()).decode()


def policy() -> str:
    """Return the page's Content-Security-Policy; its drawings hold pictures of their own."""
    return policy_of((script(PLOTTING), script()), style()) + "; img-src data:"


def policy_of(scripts: Sequence[str], sheet: str) -> str:
    """Return the policy of a page that holds these scripts and this style sheet alone."""
    allowed = " ".join(f"'{hash_of(text)}'" for text in scripts)
    return (
        f"default-src 'none'; script-src {allowed}; style-src '{hash_of(sheet)}'; "
        "base-uri 'none'; form-action 'none'"
    )


def json_for_page(document: Mapping[str, Any]) -> str:
    r"""Return a document as JSON that may stand in a script element.

    No letter in it ends the element or begins a comment.

    Examples
    --------
    >>> json_for_page({"name": "</script><!--"})
    '{"name":"\\u003c/script>\\u003c!--"}'
    """
    text = json.dumps(document, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").translate(_LINE_ENDS)
