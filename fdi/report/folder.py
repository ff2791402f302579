"""How does a folder of ours reach the disk, whole, and without harm to what others put there?

In: a folder's path, and what writes the files. Out: the folder. All files are written into a hidden
folder inside the target and then take their names one by one, so that each appears whole, and the
folder keeps its mode. Which files are ours says `fdi.report.manifest`: those are replaced, or
removed where they are not written again. A file that we did not write, or that was changed since,
is somebody else's: it stops us, and with ``force`` it is left alone, or kept as ``NAME.1`` where we
write a file of its name. A symbolic link is never followed.

A folder without a list is somebody else's, also one that a version of ours wrote before there were
lists: by its names alone it cannot be told what a person made of it.

The trap for a maintainer: a kill may fall between two renames. So the list is the first to change,
to one that holds the old contents and the new ones, and the last.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import stat
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Literal

from fdi.errors import OutputError
from fdi.report import manifest
from fdi.report.files import chosen, contents, names_of
from fdi.report.manifest import checksum_of, manifest_text, read_manifest
from fdi.result import Analysis

Holds = Literal["report", "log", "votes", "estimator", "observer", "headings"]
_TOLD: Final = {
    "report": "a report",
    "log": "a converted log",
    "votes": "what fdi vote writes",
    "estimator": "an estimator's health",
    "observer": "an observer's residuals",
    "headings": "a cross-check of headings",
}
_LEFT: Final = re.compile(r"\.fdi-[0-9a-f]{8}\.tmp")
"""What a run that was killed leaves; such a folder is empty to us."""
_OTHERWISE: Final = "name another folder with --out, or give --force, which keeps it as {}.1"


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
        Write into a folder that is not ours; no file in it that is not ours is lost.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    UsageError
        A format is not known.
    """
    wanted = chosen(formats)
    with fresh_folder(out, holds="report", names=names_of(wanted), force=force) as fresh:
        for name, content in contents(analysis, wanted):
            (fresh / name).write_bytes(content)
    return out


@contextmanager
def fresh_folder(out: Path, *, holds: Holds, names: Collection[str], force: bool) -> Iterator[Path]:
    """Give an empty folder, whose files move into another when the block ends well.

    Parameters
    ----------
    out : Path
        The other folder; it is made where there is none.
    holds : str
        What is written; a folder that holds something else of ours is not replaced unasked.
    names : collection of str
        The files that will be written.
    force : bool
        Write into a folder that is not ours.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    target = check_folder(out, holds=holds, names=names, force=force)
    with _told(out), _made(target), _inside(target) as fresh:
        yield fresh
        _move(fresh, target, holds)


def check_folder(
    out: Path, *, holds: Holds = "report", names: Collection[str] = (), force: bool = False
) -> Path:
    """Return where a folder would be written, if it may be.

    Parameters
    ----------
    out : Path
    holds, names, force
        As of `fresh_folder`.

    Raises
    ------
    OutputError
        There is something else, or ``force`` is not given and the folder is not ours, or not all
        that is in the way.
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
        for name in (*names, manifest.NAME):
            if (target / name).is_dir() and not (target / name).is_symlink():
                raise OutputError(f"holds a folder {name}", where=str(out), hint="move it away")
        if not force:
            _refuse_what_is_not_ours(target, out, holds, names)
    return target


def _refuse_what_is_not_ours(target: Path, out: Path, holds: Holds, names: Collection[str]) -> None:
    known = read_manifest(target)
    if known is None:
        if all(_LEFT.fullmatch(entry.name) for entry in target.iterdir()):
            return
        raise OutputError(
            f"exists, and no list {manifest.NAME} in it says which files are fdi's",
            where=str(out),
            hint="name another folder with --out, or give --force",
        )
    if known.holds != holds:
        raise OutputError(
            f"holds {_TOLD.get(known.holds, 'something else of fdi')}, not {_TOLD[holds]}",
            where=str(out),
            hint="name another folder with --out, or give --force",
        )
    for name in known.files:
        if os.path.lexists(target / name) and not _is_ours(target / name, known.files[name]):
            raise OutputError(
                f"{name} in it was changed since fdi wrote it",
                where=str(out),
                hint=_OTHERWISE.format(name),
            )
    for name in names:
        if name not in known.files and os.path.lexists(target / name):
            raise OutputError(
                f"{name} in it was not written by fdi",
                where=str(out),
                hint=_OTHERWISE.format(name),
            )


def _is_ours(path: Path, checksums: frozenset[str]) -> bool:
    return checksum_of(path) in checksums


def write_file(path: Path, content: bytes) -> None:
    """Write one file, whole or not at all; one that it replaces hands on its mode.

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
            _replace(fresh, path)
        except BaseException:  # an interrupt as well: no half a file stays; it goes on
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
def _made(target: Path) -> Iterator[None]:
    """Make a folder where there is none, and take it back where nothing came into it."""
    is_new = not target.exists()
    try:  # an interrupt may come while `mkdir` returns
        target.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:  # an interrupt as well: no empty folder stays; it goes on
        if is_new:
            with contextlib.suppress(OSError):
                target.rmdir()
        raise


@contextmanager
def _inside(target: Path) -> Iterator[Path]:
    """Give a fresh folder inside the target; what is left of it afterwards goes away."""
    fresh = target / f".fdi-{secrets.token_hex(4)}.tmp"
    try:
        fresh.mkdir(mode=0o700)
        yield fresh
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _move(fresh: Path, target: Path, holds: Holds) -> None:
    """Let the files take their names; room on the disk is taken before the first does."""
    known = read_manifest(target)
    before = {} if known is None else known.files
    ours = {name for name, checksums in before.items() if _is_ours(target / name, checksums)}
    names = sorted(entry.name for entry in fresh.iterdir())
    written = [(name, checksum_of(fresh / name) or "") for name in names]
    either = [*written, *((name, checksum) for name in ours for checksum in before[name])]
    first, last = fresh / f"{manifest.NAME}.first", fresh / manifest.NAME
    first.write_text(manifest_text(holds, sorted(set(either))), "ascii")
    last.write_text(manifest_text(holds, written), "ascii")
    _replace(first, target / manifest.NAME)
    for name in names:
        if name not in ours and os.path.lexists(target / name):
            (target / name).rename(_free(target, name))
        _replace(fresh / name, target / name)
    for name in ours.difference(names):
        (target / name).unlink()
    _replace(last, target / manifest.NAME)


def _free(target: Path, name: str) -> Path:
    """Return the first of ``NAME.1``, ``NAME.2`` ... that nothing has."""
    number = 1
    while os.path.lexists(target / f"{name}.{number}"):
        number += 1
    return target / f"{name}.{number}"


def _replace(fresh: Path, path: Path) -> None:
    """Let a file take a name; it gets the mode of a file that it replaces."""
    with contextlib.suppress(FileNotFoundError):
        mode = os.lstat(path).st_mode
        if stat.S_ISREG(mode):
            fresh.chmod(stat.S_IMODE(mode))
    os.replace(fresh, path)
