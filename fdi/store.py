"""What was computed before, and is it still whole?

In: a kind, a key and a plain tree of JSON values. Out: the same tree in a later process, or
nothing. One file per entry in the user's cache folder: a first line with format, key and checksum,
then the tree. A file appears whole or not at all, the least recently used ones beyond 200 go, and a
folder that cannot be written means that nothing is kept. There is no pickle: what is read back is
data, and whoever asked for it checks every index and name, since any program of the user writes
there.

The trap for a maintainer: the key must hold everything that the tree depends on. ``digest`` adds
the version and the state of our own source files (``SOURCES``): a changed checkout never sees old
answers.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import stat
import sys
import tempfile
import time
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

FORMAT: Final = "fdi-cache 1"
MAX_FILES: Final = 200
MAX_BYTES: Final = 50_000_000
"""Of one entry; a bank of 20,000 generators, the most there are, takes a fifth of it."""
SOURCES: Final = (
    "*.py",
    "decision/*.py",
    "model/*.py",
    "residuals/*.py",
    "structure/*.py",
    "telemetry/channel.py",
    "telemetry/dialect.py",
)
"""Our files that a kept answer may depend on."""
ABANDONED_S: Final = 3600.0
"""A temporary file of this age belongs to a process that died."""


def cache_folder() -> Path | None:
    """Return the user's folder for kept answers, or None where there is no home.

    ``FDI_CACHE_DIR`` names it; otherwise it is the platform's place for caches.
    """
    own = os.environ.get("FDI_CACHE_DIR")
    if own:
        return Path(own)
    xdg = os.environ.get("XDG_CACHE_HOME")
    if xdg and os.path.isabs(xdg):
        return Path(xdg) / "fdi"
    local = os.environ.get("LOCALAPPDATA")
    if sys.platform == "win32" and local:
        return Path(local) / "fdi" / "Cache"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "fdi"


def digest(*parts: str | bytes) -> str:
    """Return a key over the parts, our version and the state of our source files."""
    total = hashlib.sha256(_code().encode())
    for part in parts:
        content = part.encode() if isinstance(part, str) else part
        total.update(len(content).to_bytes(8, "big") + content)
    return total.hexdigest()


@lru_cache(maxsize=1)
def _code() -> str:
    from fdi import __version__

    lines = [FORMAT, __version__]
    for path in sorted(p for pattern in SOURCES for p in Path(__file__).parent.glob(pattern)):
        state = path.stat()
        lines.append(f"{path} {state.st_size} {state.st_mtime_ns}")
    return "\n".join(lines)


def fetch(kind: str, key: str) -> Any | None:
    """Return the tree that was kept under a key; None where there is none or it is damaged."""
    body = fetch_text(kind, key)
    try:
        return None if body is None else json.loads(body)
    except (ValueError, RecursionError):
        return None


def fetch_text(kind: str, key: str) -> bytes | None:
    """Return the JSON text of the tree that was kept under a key, whole; None as for `fetch`."""
    folder = cache_folder()
    if folder is None:
        return None
    path = folder / f"{kind}-{key}.json"
    try:
        state = path.stat()
        if not stat.S_ISREG(state.st_mode) or state.st_size > MAX_BYTES:
            return None
        head, _, body = path.read_bytes().partition(b"\n")
        if head != _head(kind, key, body):
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # used just now: others are dropped before it
    except OSError:
        return None
    return body


def keep(kind: str, key: str, tree: Any) -> None:
    """Keep a tree of JSON values under a key, if the folder allows it."""
    folder = cache_folder()
    if folder is None:
        return
    try:
        body = json.dumps(tree, separators=(",", ":")).encode()
        if len(body) > MAX_BYTES // 2:
            return
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _write(folder / f"{kind}-{key}.json", _head(kind, key, body) + b"\n" + body)
        _drop_oldest(folder)
    except (OSError, RecursionError):
        return


def _head(kind: str, key: str, body: bytes) -> bytes:
    return f"{FORMAT} {kind} {key} {hashlib.sha256(body).hexdigest()}".encode()


def _write(path: Path, content: bytes) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(name, path)
    except BaseException:  # an interrupt as well: no half a file stays; it goes on
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def _drop_oldest(folder: Path) -> None:
    kept: list[tuple[float, str]] = []
    for entry in os.scandir(folder):
        with contextlib.suppress(OSError):
            used = entry.stat(follow_symlinks=False).st_mtime
            if entry.name.startswith(".") and entry.name.endswith(".tmp"):
                if time.time() - used > ABANDONED_S:
                    os.unlink(entry.path)
            elif entry.name.endswith(".json"):
                kept.append((used, entry.path))
    for _, path in sorted(kept)[:-MAX_FILES]:
        with contextlib.suppress(OSError):
            os.unlink(path)
