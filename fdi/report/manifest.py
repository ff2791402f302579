"""Which files of a folder did we write, and are they still as we wrote them?

In: a folder. Out: its list, ``.fdi-manifest.json``, which names each file that we wrote with the
SHA-256 of its content::

    {"schema_version": 1, "tool": {"name": "uav-fdi", "version": ...},
     "holds": "report" | "log" | "votes" | "estimator" | "observer",
     "files": [{"name": ..., "sha256": ...}, ...]}

A name stands there twice while a folder is being written anew: the old content is ours, and so is
the new one. A list may come from a stranger: a name in it is a plain file name, a link is not
followed, and what it says counts only for a file whose content has that very checksum.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import Final

from fdi import __version__
from fdi.report.json_text import json_text

NAME: Final = ".fdi-manifest.json"
_TOOL: Final = "uav-fdi"
_SCHEMA: Final = 1
_MOST: Final = 1 << 24  # bytes; a list of 100,000 files, ten times what any log has messages
_PLAIN: Final = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a folder holds of ours.

    Attributes
    ----------
    holds : str
        The kind of folder: ``report``, ``log`` or ``votes``.
    files : mapping of str to frozenset of str
        Names, with the checksums of the contents that are ours.
    """

    holds: str
    files: Mapping[str, frozenset[str]]


def read_manifest(folder: Path) -> Manifest | None:
    """Return the list of a folder, None where there is none or it is not one of ours.

    Raises
    ------
    OSError
        There is one that cannot be read.
    """
    file = _opened(folder / NAME)
    if file is None:
        return None
    with file:
        text = file.read(_MOST)
    try:
        tree = json.loads(text)
        if tree["schema_version"] != _SCHEMA or tree["tool"]["name"] != _TOOL:
            return None
        entries = [(str(entry["name"]), str(entry["sha256"])) for entry in tree["files"]]
        holds = str(tree["holds"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if not all(_PLAIN.fullmatch(name) for name, _ in entries):
        return None
    files: dict[str, frozenset[str]] = {}
    for name, checksum in entries:
        files[name] = files.get(name, frozenset()) | {checksum}
    return Manifest(holds, files)


def manifest_text(holds: str, entries: Iterable[tuple[str, str]]) -> str:
    """Return a list as text, from names with the checksums of their contents."""
    return json_text(
        {
            "schema_version": _SCHEMA,
            "tool": {"name": _TOOL, "version": __version__},
            "holds": holds,
            "files": [{"name": name, "sha256": checksum} for name, checksum in entries],
        }
    )


def checksum_of(path: Path) -> str | None:
    """Return the SHA-256 of a file, None where there is none or it is no plain file.

    Raises
    ------
    OSError
        It cannot be read.
    """
    file = _opened(path)
    if file is None:
        return None
    with file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _opened(path: Path) -> BufferedReader | None:
    """Open a plain file; a link, a folder, a pipe is None, and so is nothing."""
    try:
        if not stat.S_ISREG(os.lstat(path).st_mode):
            return None
    except FileNotFoundError:
        return None
    return path.open("rb")
