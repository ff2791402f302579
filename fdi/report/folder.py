"""How does a folder of ours reach the disk, whole or not at all?

In: an analysis and a folder's path. Out: the folder. All files are written into a hidden folder
beside the target, which then takes its name. A folder of ours, which shows by its document, is
replaced; what else a person has put into it stays there. A symbolic link is never followed.

The trap for a maintainer: a swap is two renames, so an interrupt may fall between them; then the
old folder gets its name back.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from fdi.errors import OutputError
from fdi.report.files import NAMES, chosen, contents
from fdi.result import Analysis

DOCUMENT: Final = "analysis.json"
MARKER: Final = ".fdi-report"
"""Tells a folder of ours that holds no ``analysis.json``."""
_OURS: Final = re.compile(rb'"tool"\s*:\s*\{\s*"name"\s*:\s*"uav-fdi"')
_HEAD: Final = 4096  # bytes; our own key stands within the first hundred


def write_report(
    analysis: Analysis, out: Path, formats: Sequence[str] | None = None, force: bool = False
) -> Path:
    """Write the report of an analysis into a folder and return the folder.

    Parameters
    ----------
    analysis : Analysis
    out : Path
    formats : sequence of str, optional
        Of ``html, json, csv, png, svg, txt, parquet``; by default all.
    force : bool
        Write into a folder that is not ours; files of other names in it stay.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    UsageError
        A format is not known.
    """
    wanted = chosen(formats)
    with fresh_folder(out, document=DOCUMENT, own=_of_reports, force=force) as fresh:
        for name, content in contents(analysis, wanted):
            (fresh / name).write_bytes(content)
        if "json" not in wanted:
            (fresh / MARKER).write_bytes(b"uav-fdi\n")
    return out


@contextmanager
def fresh_folder(
    out: Path, *, document: str, own: Callable[[Path], Collection[str]], force: bool
) -> Iterator[Path]:
    """Give an empty folder, which takes the place of another when the block ends well.

    Parameters
    ----------
    out : Path
        The place.
    document : str
        Name of the JSON file by which a folder of this kind shows that it is ours.
    own : callable
        Returns the names of the files in an old folder of ours that we wrote; others stay.
    force : bool
        Take the place of a folder that is not ours.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    target = check_folder(out, document=document, force=force)
    with _told(out):
        target.parent.mkdir(parents=True, exist_ok=True)
        with _beside(target) as fresh:
            yield fresh
            _take_place(fresh, target, own)


def check_folder(out: Path, *, document: str = DOCUMENT, force: bool = False) -> Path:
    """Return where a folder would be written, if it may be.

    Parameters
    ----------
    out : Path
    document : str
        Name of the JSON file by which a folder of this kind shows that it is ours.
    force : bool
        Whether a folder that is not ours may be replaced.

    Raises
    ------
    OutputError
        There is something else, or a folder that is not ours and ``force`` is not given.
    """
    with _told(out):
        if out.is_symlink():
            raise OutputError("is a symbolic link, which is not followed", where=str(out))
        target = out.resolve()
        if not target.exists():
            return target
        if not target.is_dir():
            raise OutputError("exists and is no folder", where=str(out))
        if target == Path.cwd() or target in Path.cwd().parents:
            raise OutputError(
                "holds the working directory", where=str(out), hint="name a folder inside it"
            )
        if not force and any(target.iterdir()) and not is_ours(target, document):
            raise OutputError(
                "exists and holds something else",
                where=str(out),
                hint="name another folder with --out, or give --force",
            )
    return target


def is_ours(folder: Path, document: str = DOCUMENT) -> bool:
    """Return whether a folder was written by us, by its document (a report also by its marker)."""
    if document == DOCUMENT and (folder / MARKER).is_file():
        return True
    path = folder / document
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        return bool(_OURS.search(file.read(_HEAD)))


def write_file(path: Path, content: bytes) -> None:
    """Write one file, whole or not at all.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with _told(path):
        if path.is_symlink():
            raise OutputError("is a symbolic link, which is not followed", where=str(path))
        fresh = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
        try:
            with fresh.open("xb") as file:
                file.write(content)
            os.replace(fresh, path)
        except BaseException:
            with contextlib.suppress(OSError):
                fresh.unlink()
            raise


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turn what the operating system refuses into an error that names the path."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot be written: {reason}", where=str(path)) from error


@contextmanager
def _beside(target: Path) -> Iterator[Path]:
    """Give a fresh folder beside the target; what is left of it afterwards goes away."""
    fresh = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    fresh.mkdir()
    try:
        yield fresh
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _take_place(fresh: Path, target: Path, own: Callable[[Path], Collection[str]]) -> None:
    if not target.exists():
        fresh.rename(target)
        return
    old = target.with_name(f".{target.name}.{secrets.token_hex(4)}.old")
    written = own(target)
    target.rename(old)
    try:
        fresh.rename(target)
    except BaseException:
        old.rename(target)
        raise
    _bring_along(old, target, written)
    shutil.rmtree(old, ignore_errors=True)


def _of_reports(folder: Path) -> Collection[str]:
    return NAMES | {MARKER}


def _bring_along(old: Path, target: Path, written: Collection[str]) -> None:
    """Move what we did not write into the new folder, but for what we write there now."""
    for entry in sorted(old.iterdir()):
        if entry.name not in written and not (target / entry.name).exists():
            entry.rename(target / entry.name)
