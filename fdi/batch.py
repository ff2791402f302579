"""How do the answers about many logs become one table, also when the work is interrupted?

In: logs and a place for the table. Out: a Parquet file with one row a log, in the order of the
logs. Each row is added to a file of JSON lines beside the table (``NAME.rows.jsonl``) as soon as it
is there; when all are, the table takes its name and the lines go away. With ``resume`` the rows of
an older table and of such lines are kept where the log (size and time of change), our code, the
libraries, model and policy (their content) are the same. A row that is damaged is told and made
anew, and so is one whose worker died.

Beside the table may stand, made from the same rows: the page for an operator (``NAME.html``), the
rows as JSON lines (``NAME.ndjson``), and the reports of logs (``NAME.reports/``), which are written
while a log's analysis is at hand. `Beside` says which.

One run at a time works on a table: it holds a lock of the operating system on ``.NAME.lock``,
which ends with the process, however that ends; the file itself means nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Literal

from fdi.decision import load_policy
from fdi.errors import FdiError, OutputError
from fdi.fleet import Job, Reports, Row, rows, with_same_flights
from fdi.model import load_airframe
from fdi.model.load import models_folder
from fdi.report.fleet.flagged import is_flagged
from fdi.report.folder import write_file
from fdi.table import is_table, line_of, plain_line_of, row_of, rows_of, table_of
from fdi.telemetry.search import state

Kind = Literal["html", "ndjson"]
Progress = Callable[[str, float], None]
Tell = Callable[[str], None]

_TRIED_AGAIN: Final = "WorkerDied"
LONGEST_STEM: Final = 60
"""Letters of a log's name in that of its report's folder."""
_ODD: Final = re.compile(r"[^\w.+ -]")
_SEEN: Final = 4096
_OURS: Final[dict[Kind, bytes]] = {
    "html": b'<meta name="generator" content="uav-fdi batch',
    "ndjson": b'{"path": ',
}
"""What stands at the beginning of a file of ours."""
_LIBRARIES: Final = ("numpy", "scipy", "pandas", "sympy", "pymavlink")
"""What the numbers in a row go through; another version may give others."""


@dataclass(frozen=True, slots=True)
class Beside:
    """What is written beside a table.

    Attributes
    ----------
    html, ndjson : bool
        The page for an operator; the rows as JSON lines.
    reports : str or None
        Of ``flagged`` logs (ended badly, or somebody is accused), of ``all``, or of none.
    """

    html: bool = False
    ndjson: bool = False
    reports: Reports | None = None

    def kinds(self) -> tuple[Kind, ...]:
        """Return which files are written."""
        return (*(("html",) if self.html else ()), *(("ndjson",) if self.ndjson else ()))


TABLE_ALONE: Final = Beside()


def beside(out: Path, kind: str) -> Path:
    """Return the place beside a table: its name with another end."""
    name = out.stem if out.suffix == ".parquet" else out.name
    return out.with_name(f"{name}.{kind}")


def batch(
    jobs: Sequence[Job],
    out: Path,
    *,
    also: Beside = TABLE_ALONE,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    tell: Tell | None = None,
) -> list[Row]:
    """Analyse many logs into a Parquet file and return its rows, in the order of the jobs.

    Parameters
    ----------
    jobs : sequence of Job
    out : Path
    also : Beside
        What is written beside the table.
    workers, cluster
        As of `fdi.fleet.rows`.
    resume : bool
        Keep what an earlier run found.
    progress : callable, optional
        Is told the log that is done and the share of all.
    tell : callable, optional
        Is told, in a line each, what of an earlier run is damaged and made anew, and what is kept
        where this one is interrupted.

    Raises
    ------
    OutputError
        The table cannot be written, is not ours, another run is at it, or an earlier one was
        interrupted and is not to be resumed.
    UsageError
        The number of workers is wrong, or there is no cluster at the address.
    """
    with _alone(out):
        _check_place(out, resume=resume)
        for kind in also.kinds():
            _check_file(beside(out, kind), kind)
        jobs = [_with_report(job, out, also.reports) for job in jobs]
        marks = fingerprints(jobs)
        kept = {row["fingerprint"]: row for row in _earlier(out, tell)} if resume else {}
        found_before = {i: _as_now(kept[m], out) for i, m in enumerate(marks) if m in kept}
        done = {i: row for i, row in found_before.items() if not _lacks_report(row, jobs[i])}
        left = [i for i in range(len(jobs)) if i not in done]
        work = closing(rows([jobs[i] for i in left], workers=workers, cluster=cluster))
        try:
            with _lines(out, done.values()) as add, work as found:
                for k, row in found:
                    number = left[k]
                    done[number] = {**_storable(_placed(row, out)), "fingerprint": marks[number]}
                    add(done[number])
                    if progress:
                        progress(Path(row["path"]).name, len(done) / len(jobs))
        except KeyboardInterrupt:
            if tell:
                kept_so_far = f"{len(done)} of {len(jobs)} rows are kept in {_beside(out)}"
                tell(f"{kept_so_far}; the same command with --resume does the others")
            raise
        ordered = with_same_flights([done[i] for i in range(len(jobs))])
        write_file(out, table_of(ordered))
        for kind in also.kinds():
            write_file(beside(out, kind), _content(kind, ordered, out))
        _beside(out).unlink()
    return ordered


def _content(kind: Kind, found: Sequence[Row], out: Path) -> bytes:
    """Return what a file beside the table holds."""
    if kind == "html":
        from fdi.report.fleet.document import fleet_page

        return fleet_page(found, out.name).encode()
    return "".join(map(plain_line_of, found)).encode()


def _with_report(job: Job, out: Path, wanted: Reports | None) -> Job:
    """Return a job with the place of its report: the log's name, and a digest of its path.

    Logs of one name in several folders stay apart, whichever else are given.
    """
    if wanted is None:
        return job
    digest = hashlib.sha256(job.path.encode("utf-8", "surrogateescape")).hexdigest()
    stem = _ODD.sub("_", Path(job.path).stem)[:LONGEST_STEM]
    place = beside(out, "reports") / f"{stem}-{digest[:8]}.fdi"
    return replace(job, report=str(place.absolute()), reports=wanted)


def _placed(row: Row, out: Path) -> Row:
    """Return a row whose report is named from the table on, so that both move together."""
    if row["report"] is None:
        return row
    return {**row, "report": f"{beside(out, 'reports').name}/{Path(row['report']).name}"}


def _storable(value: Any) -> Any:
    r"""Return a row without letters that no file of text holds: ``\udcff`` of a name, spelt out."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, dict):
        return {name: _storable(inner) for name, inner in value.items()}
    return [_storable(inner) for inner in value] if isinstance(value, list) else value


def _as_now(row: Row, out: Path) -> Row:
    """Return a row of before; a report that is no longer there is none."""
    told = row["report"]
    return row if told is None or (out.parent / told).is_dir() else {**row, "report": None}


def _lacks_report(row: Row, job: Job) -> bool:
    wanted = job.report is not None and row["error"] is None
    return wanted and row["report"] is None and (job.reports == "all" or is_flagged(row))


def fingerprints(jobs: Sequence[Job]) -> list[str | None]:
    """Return what tells that a row is still true: log, code, libraries, model and policy as now.

    None where nothing tells that: the log or the model is not there, or of no known state.
    """
    models = {name: _model_state(name) for name in {job.model for job in jobs}}
    policies = {name: _policy_state(name) for name in {job.policy for job in jobs}}
    code = code_state()
    return [_mark(code, job, models[job.model], policies[job.policy]) for job in jobs]


def _mark(code: str, job: Job, model: str | None, policy: str | None) -> str | None:
    log = state(job.path)
    if not log or model is None or policy is None:
        return None
    return json.dumps([code, [job.path, log], [job.model, model], [job.policy, policy]])


def _model_state(name: str) -> str | None:
    if name == "auto":
        return ""  # one of those that are part of the code
    try:
        return load_airframe(name).sha256
    except FdiError:  # every row will say so
        return None


def _policy_state(name: str) -> str | None:
    try:
        return load_policy(name).sha256
    except FdiError:
        return None


@lru_cache(maxsize=1)
def code_state() -> str:
    """Return a digest of the package, the shipped models and the libraries' versions."""
    total = hashlib.sha256()
    for folder in (Path(__file__).parent, models_folder()):
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                name, content = str(path.relative_to(folder)).encode(), path.read_bytes()
                total.update(b"%d %d " % (len(name), len(content)) + name + content)
    total.update(json.dumps([[name, version(name)] for name in _LIBRARIES]).encode())
    return total.hexdigest()


def _beside(out: Path) -> Path:
    return out.with_name(f"{out.name}.rows.jsonl")


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Hold the lock of a table; the file that carries it goes away with the one that holds it."""
    path = out.with_name(f".{out.name}.lock")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        handle = _locked(path)
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=str(out)) from error
    if handle is None:
        raise OutputError(
            "another fdi batch is writing it", where=str(out), hint="wait, or name another file"
        )
    try:
        yield
    finally:
        if sys.platform != "win32":  # while it is locked, or it might be another's
            path.unlink(missing_ok=True)
        os.close(handle)


def _locked(path: Path) -> int | None:
    """Return the handle of a file that is locked by us alone, None where it is by somebody else."""
    while True:  # once more for each run that ended between the two steps
        handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600)
        try:
            _lock(handle)
            if sys.platform == "win32" or _is_at(path, handle):
                return handle
        except (BlockingIOError, PermissionError):
            os.close(handle)
            return None
        except BaseException:  # an interrupt as well: what stays open keeps the lock
            os.close(handle)
            raise
        os.close(handle)


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_at(path: Path, handle: int) -> bool:
    """Return whether a file is still the one of that name: who held it removes it at the end."""
    try:
        return os.path.samestat(os.fstat(handle), os.lstat(path))
    except FileNotFoundError:
        return False


def _check_place(out: Path, *, resume: bool) -> None:
    """Refuse a place that holds something else, or what an interrupted run has found."""
    lines = _beside(out)
    for path in (out, lines):
        if path.is_symlink():
            raise OutputError("is a symbolic link, which is not followed", where=str(path))
        if path.exists() and not path.is_file():
            raise OutputError("exists and is no file", where=str(path))
    if out.exists() and not is_table(out):
        raise OutputError(
            "exists and is no table of fdi batch, or one whose end is damaged",
            where=str(out),
            hint="move it away, or name another file",
        )
    if lines.exists() and not resume:
        raise OutputError(
            "holds what an interrupted run has found",
            where=str(lines),
            hint="go on with --resume, or remove the file to begin anew",
        )


def _check_file(path: Path, kind: Kind) -> None:
    """Refuse a file in the way that is not one of ours, before the work is done.

    Raises
    ------
    OutputError
        There is something else.
    """
    if path.is_symlink():
        raise OutputError("is a symbolic link, which is not followed", where=str(path))
    if not path.exists():
        return
    if not path.is_file():
        raise OutputError("exists and is no file", where=str(path))
    try:
        with path.open("rb") as file:
            first = file.read(_SEEN)
    except OSError as error:
        raise OutputError(f"cannot be read: {error.strerror}", where=str(path)) from error
    if first and _OURS[kind] not in first:
        raise OutputError(
            f"exists, and fdi batch did not write it; the {kind} of the table has this name",
            where=str(path),
            hint="move it away, or name another table",
        )


@contextmanager
def _lines(out: Path, kept: Iterable[Row]) -> Iterator[Callable[[Row], None]]:
    """Open the file of lines, with those that are kept in it, and hand out what adds one."""
    path = _beside(out)
    write_file(path, "".join(map(line_of, kept)).encode())
    with path.open("ab", buffering=0) as file:  # a full disk is told by the line, not at the end

        def add(row: Row) -> None:
            rest = line_of(row).encode()
            try:
                while rest:
                    rest = rest[file.write(rest) :]
            except OSError as error:
                raise OutputError(
                    f"cannot be written: {error.strerror}",
                    where=str(path),
                    hint="what is in it is kept: make room and go on with --resume",
                ) from error

        yield add


def _earlier(out: Path, tell: Tell | None) -> Iterator[Row]:
    """Yield the rows of an older table and of an interrupted run, and tell of what is damaged."""
    tell = tell or (lambda _: None)
    if out.exists():
        found = rows_of(out)
        if found is None:
            tell(f"{out} is damaged or of another version; all its logs are analysed again")
        yield from filter(_is_an_answer, found or ())
    if _beside(out).exists():
        lines = _beside(out).read_text("utf-8", errors="replace").splitlines()
        read = [row_of(line) for line in lines]
        damaged = read.count(None)
        if damaged:
            tell(
                f"{_beside(out)}: {damaged} of {len(lines)} rows cut, damaged or of another "
                "version; their logs are analysed again"
            )
        yield from (row for row in read if row is not None and _is_an_answer(row))


def _is_an_answer(row: Row) -> bool:
    return row["fingerprint"] is not None and row["error_kind"] != _TRIED_AGAIN
