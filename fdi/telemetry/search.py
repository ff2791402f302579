"""Which logs are meant by these paths?

In: files, folders, globs, and URLs of these. Out: the path or URL of each log, once, in the order
of the paths and by name within one. A file that is named is taken as it is; in a folder those count
that are called like a log or begin like one. Files and folders whose name begins with a dot are
passed over, and links to folders are not followed.

The trap for a maintainer: in a folder behind a URL only the name counts; to look into every file
would be to fetch it.
"""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from fdi.errors import LogError, UsageError
from fdi.telemetry.formats import FORMATS

SUFFIXES: Final = (".tlog", ".bin", ".ulg", ".log", ".px4log", ".ulge")
"""What logs are called, in small letters; those that cannot be read yet too, so that it is told."""
_SNIFF: Final = 1 << 16  # bytes of a file of another name that are looked at
_MAGIC: Final = "*?["


class Found(NamedTuple):
    """The logs that paths name, and how many other files folders hold by the end of their name."""

    logs: tuple[str, ...]
    passed_over: Mapping[str, int]


def find_logs(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the logs that the paths name; raises as `search_logs`."""
    return search_logs(paths).logs


def search_logs(paths: Sequence[str]) -> Found:
    """Return the logs that the paths name, and what else lies in their folders.

    Raises
    ------
    LogError
        A folder or glob holds none.
    UsageError
        A URL needs a library that is not installed, or is none.
    """
    found: dict[str, None] = {}
    others: dict[str, None] = {}
    for path in paths:
        seen = dict(_elsewhere(path) if "://" in path else _here(path))
        own = [each for each, is_log in seen.items() if is_log]
        if not own:
            raise LogError("holds no log", where=path, hint=f"one ends in {', '.join(SUFFIXES)}")
        found.update(dict.fromkeys(own))
        others.update((each, None) for each, is_log in seen.items() if not is_log)
    if not any("://" in path or os.path.exists(path) for path in found):
        raise LogError("does not exist", where=paths[0])
    ends = Counter(os.path.splitext(path)[1].lower() for path in others if path not in found)
    return Found(tuple(found), dict(sorted(ends.items(), key=lambda item: (-item[1], item[0]))))


def _here(path: str) -> Iterator[tuple[str, bool]]:
    """Yield each file with whether it is taken for a log."""
    if os.path.isdir(path):
        yield from _in_folder(path)
    elif any(c in path for c in _MAGIC) and not os.path.exists(path):
        for each in sorted(glob.glob(path, recursive=True)):
            if os.path.isdir(each):
                yield from _in_folder(each)
            else:
                yield each, True
    else:
        yield path, True


def _in_folder(folder: str) -> Iterator[tuple[str, bool]]:
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            path = os.path.join(place, name)
            if not name.startswith(".") and os.path.isfile(path):
                yield path, is_like_a_log(path)


def is_like_a_log(path: str) -> bool:
    """Return whether a file is called like a log, or begins like one."""
    if path.lower().endswith(SUFFIXES):
        return True
    try:
        with open(path, "rb") as file:
            head = np.frombuffer(file.read(_SNIFF), np.uint8)
    except OSError:  # of a name that says nothing, and closed to us: nothing says that it is a log
        return False
    return head.size > 0 and any(form.is_it(head) for form in FORMATS.values())


def _elsewhere(url: str) -> Iterator[tuple[str, bool]]:
    system, path = _opened(url)
    try:
        if any(c in path for c in _MAGIC):
            found = sorted(n for n in system.glob(path) if not os.path.basename(n).startswith("."))
            names = [(name, True) for name in found]
        elif system.isdir(path):
            found = sorted(n for n in system.find(path) if "/." not in n.removeprefix(path))
            names = [(name, name.lower().endswith(SUFFIXES)) for name in found]
        else:
            names = None
    except OSError as error:
        raise LogError(f"cannot be looked into: {error}", where=url) from error
    if names is None:
        yield url, True
    else:
        yield from ((system.unstrip_protocol(name), is_log) for name, is_log in names)


def state(path: str) -> str:
    """Return size and time of change of a file, by which it shows that it is the same.

    "" where nothing tells.
    """
    try:
        if "://" not in path:
            status = os.stat(path)
            return f"{status.st_size}:{status.st_mtime_ns}"
        system, inner = _opened(path)
        about = system.info(inner)
    except (OSError, UsageError):
        return ""
    when = (about.get(k) for k in ("mtime", "LastModified", "last_modified", "updated", "ETag"))
    changed = next((str(value) for value in when if value is not None), None)
    return "" if changed is None else f"{about.get('size')}:{changed}"


def _opened(url: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise UsageError(
            "needs fsspec to be looked into", where=url, hint="pip install 'uav-fdi[fleet]'"
        ) from None
    try:
        system, path = url_to_fs(url)
    except (ValueError, ImportError) as error:
        raise UsageError(f"cannot be opened: {error}", where=url) from error
    return system, str(path)
