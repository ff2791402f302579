"""How do the answers about many logs become one table, also when the work is interrupted?

In: logs and a place for the table. Out: a Parquet file with one row a log, in the order of the
logs. Each row is added to a file of JSON lines beside the table (``NAME.rows.jsonl``) as soon as it
is there; when all are, the table takes its name and the lines go away. With ``resume`` the rows of
an older table and of such lines are kept where the log (size and time of change), the version,
model and policy are the same; only a log whose worker died is tried again.

Columns are those of `fdi.fleet.analyze_log`: ``accused``, ``consequences``, ``ruled_out``,
``not_testable`` and ``warnings`` are lists of text, ``findings`` and ``quality`` lists of structs,
``timings_s`` a map, ``fingerprint`` what a row is known by when work is resumed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fdi import __version__
from fdi.errors import OutputError
from fdi.fleet import Job, Row, rows
from fdi.report.folder import write_file
from fdi.telemetry.search import state

if TYPE_CHECKING:
    import pyarrow as pa

Progress = Callable[[str, float], None]

_OURS: Final = {b"tool": b"uav-fdi", b"holds": b"batch"}
_TRIED_AGAIN: Final = "WorkerDied"
_FINDING: Final = {
    "rank": "int64",
    "flight": "int64",
    "component": "string",
    "faults": ["string"],
    "kind": "string",
    "onset_s": "double",
    "onset_boot_s": "double",
    "alarm_s": "double",
    "end_s": "double",
    "confidence": "double",
    "grounds": {"share": "double", "strength": "double", "exclusive": "bool", "part": "bool"},
    "text": "string",
}
_COLUMNS: Final[dict[str, Any]] = {
    "path": "string",
    "format": "string",
    "sha256": "string",
    "bytes": "int64",
    "duration_s": "double",
    "vehicle": "string",
    "autopilot": "string",
    "firmware": "string",
    "flights": "int64",
    "airborne_s": "double",
    "model": "string",
    "policy": "string",
    "verdict": "string",
    "accused": ["string"],
    "findings": [_FINDING],
    "consequences": ["string"],
    "ruled_out": ["string"],
    "not_testable": ["string"],
    "quality": [{"kind": "string", "count": "int64", "text": "string"}],
    "warnings": ["string"],
    "timings_s": "map",
    "seconds": "double",
    "error": "string",
    "error_kind": "string",
    "fingerprint": "string",
}


def batch(
    jobs: Sequence[Job],
    out: Path,
    *,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> list[Row]:
    """Analyse many logs into a Parquet file and return its rows, in the order of the jobs.

    Parameters
    ----------
    jobs : sequence of Job
    out : Path
    workers, cluster
        As of `fdi.fleet.rows`.
    resume : bool
        Keep what an earlier run found.
    progress : callable, optional
        Is told the log that is done and the share of all.

    Raises
    ------
    OutputError
        The table cannot be written, is not ours, or an earlier run was interrupted and is not to
        be resumed.
    UsageError
        The number of workers is wrong, or there is no cluster at the address.
    """
    check_table(out, resume=resume)
    marks = [fingerprint(job) for job in jobs]
    kept = {row["fingerprint"]: row for row in _earlier(out)} if resume else {}
    done = {i: kept[mark] for i, mark in enumerate(marks) if mark in kept}
    left = [i for i in range(len(jobs)) if i not in done]
    with _lines(out, done.values()) as add:
        for k, row in rows([jobs[i] for i in left], workers=workers, cluster=cluster):
            number = left[k]
            done[number] = {**row, "fingerprint": marks[number]}
            add(done[number])
            if progress:
                progress(Path(row["path"]).name, len(done) / len(jobs))
    ordered = [done[i] for i in range(len(jobs))]
    write_file(out, _parquet(ordered))
    _beside(out).unlink()
    return ordered


def check_table(out: Path, *, resume: bool) -> None:
    """Refuse a place that holds something else, or what an interrupted run has found.

    Raises
    ------
    OutputError
        It does.
    """
    if out.is_symlink() or _beside(out).is_symlink():
        raise OutputError("is a symbolic link, which is not followed", where=str(out))
    if out.exists() and (not out.is_file() or _read(out) is None):
        raise OutputError("exists and is no table of fdi batch", where=str(out))
    if _beside(out).exists() and not resume:
        raise OutputError(
            "holds what an interrupted run has found",
            where=str(_beside(out)),
            hint="go on with --resume, or remove the file to begin anew",
        )


def fingerprint(job: Job) -> str:
    """Return what tells that a row is still true: log, version, model and policy, as they are."""
    own = (job.path, job.model, job.policy)
    return json.dumps([__version__, *((name, state(name)) for name in own)])


def _beside(out: Path) -> Path:
    return out.with_name(f"{out.name}.rows.jsonl")


def _line(row: Row) -> str:
    return json.dumps(row, allow_nan=False) + "\n"


@contextmanager
def _lines(out: Path, kept: Iterable[Row]) -> Iterator[Callable[[Row], None]]:
    """Open the file of lines, with those that are kept in it, and hand out what adds one."""
    path = _beside(out)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=str(out)) from error
    write_file(path, "".join(map(_line, kept)).encode())
    with path.open("ab", buffering=0) as file:  # a full disk is told by the line, not at the end

        def add(row: Row) -> None:
            rest = _line(row).encode()
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


def _earlier(out: Path) -> Iterator[Row]:
    """Yield the rows of an older table and of an interrupted run that still say something."""
    found = [*(_read(out) or []), *_interrupted(_beside(out))]
    for row in found:
        is_known = json.loads(row["fingerprint"])[1][1] != ""
        if is_known and row["error_kind"] != _TRIED_AGAIN:
            yield row


def _interrupted(path: Path) -> Iterator[Row]:
    if not path.is_file():
        return
    for line in path.read_text("utf-8", errors="replace").splitlines():
        try:
            row = json.loads(line)
            is_whole = isinstance(row, dict) and row.keys() == _COLUMNS.keys()
        except ValueError:  # the line at which the run was cut
            is_whole = False
        if is_whole:
            yield row


def _parquet(ordered: Sequence[Row]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([(name, _type(what)) for name, what in _COLUMNS.items()])
    ordered = [{**row, "timings_s": list(row["timings_s"].items())} for row in ordered]
    table = pa.Table.from_pylist(ordered, schema=schema.with_metadata(_OURS))
    buffer = BytesIO()
    pq.write_table(table, buffer)
    return buffer.getvalue()


def _type(what: Any) -> pa.DataType:
    """Return the Arrow type of a column: a name, [type of a list's items], {field: type}."""
    import pyarrow as pa

    if isinstance(what, list):
        return pa.list_(_type(what[0]))
    if isinstance(what, dict):
        return pa.struct([(name, _type(inner)) for name, inner in what.items()])
    if what == "map":
        return pa.map_(pa.string(), pa.float64())
    return pa.type_for_alias(what)


def _read(out: Path) -> list[Row] | None:
    """Return the rows of a table of ours, None where it is none."""
    if not out.is_file() or not os.path.getsize(out):
        return None
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(out)
    except (OSError, pa.ArrowInvalid):
        return None
    about = table.schema.metadata or {}
    is_ours = all(about.get(key) == value for key, value in _OURS.items())
    if not is_ours or set(table.column_names) != set(_COLUMNS):
        return None
    return [{**row, "timings_s": dict(row["timings_s"])} for row in table.to_pylist()]
