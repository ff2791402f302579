"""How are many logs analysed? One function over logs, here or on a cluster.

`analyze_log` turns one job into one row of plain values and never raises: a log that cannot be
read, or a defect of ours, is a row that says so. It also writes the log's report where one is asked
for, since the analysis is at hand there and nowhere else. `rows` maps it over jobs in worker
processes, or hands the same function to a `dask.distributed` cluster; the rows come back in any
order, each with the number of its job. A worker that dies (killed for its memory, aborted) costs
its own log only.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, Literal

from fdi.errors import FdiError, LogError, OutputError, UsageError, own_file
from fdi.report.fleet.flagged import ENDS, is_flagged
from fdi.telemetry.ends import BAD
from fdi.telemetry.together.track import NOWHERE, Track, first_of_flights, track_of

if TYPE_CHECKING:
    from fdi.result import Analysis

Reports = Literal["flagged", "all"]
Row = dict[str, Any]
Work = Callable[["Job"], Row]

AHEAD: Final = 4
"""Jobs handed out per worker before the first is done: keeps them busy, and memory bounded."""
_THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Job:
    """One log and how to analyse it.

    Attributes
    ----------
    path : str
        May be a URL that fsspec opens.
    model, policy : str
    report : str or None
        The folder of its report, none without.
    reports : str
        ``flagged``: write it where a flight ended badly or somebody is accused; ``all``: always.
    """

    path: str
    model: str = "auto"
    policy: str = "default"
    report: str | None = None
    reports: Reports = "flagged"


def analyze_log(job: Job) -> Row:
    """Return one row about one log: facts, findings, quality, timings, or what went wrong.

    Every row has the same keys. ``error`` is None, or one line; ``error_kind`` is then the name of
    the exception.
    """
    return row_of_log(job, lambda found: _reported(job, found, told(found)))


def _reported(job: Job, found: Analysis, row: Row) -> Row:
    """Return a row after its report is written, if one is asked for."""
    if job.report is None or not (job.reports == "all" or is_flagged(row)):
        return row
    try:
        found.report(job.report)
    except OutputError as error:  # the answer about the log is not lost for that
        return {**row, "report_error": str(error)}
    return {**row, "report": job.report}


def row_of_log(job: Job, tell: Callable[[Analysis], Row]) -> Row:
    """Return one row about one log as `analyze_log` does, with what ``tell`` says of it."""
    start = time.perf_counter()
    row = _empty(job)
    try:
        from fdi.analysis import analyze

        with _local(job.path) as path:
            found = analyze(path, model=job.model, policy=job.policy)
        row.update(tell(found))
    except FdiError as error:
        row.update(error=str(error), error_kind=type(error).__name__)
    except Exception as error:  # noqa: BLE001 - a bad log is a row, never a stop
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"  # first: a text may be cut
        text = own_file(error) or f"a defect of ours in {last.name} ({place}): {error!r}"
        row.update(error=text[:500], error_kind=type(error).__name__)
    row["seconds"] = round(time.perf_counter() - start, 3)
    return row


def lost(job: Job, why: str) -> Row:
    """Return the row of a log whose worker died."""
    return {**_empty(job), "error": why, "error_kind": "WorkerDied"}


def failed(job: Job, error: Exception) -> Row:
    """Return the row of a log that could not be analysed."""
    return {**_empty(job), "error": str(error), "error_kind": type(error).__name__}


def _empty(job: Job) -> Row:
    return {
        "path": job.path,
        "format": None,
        "sha256": None,
        "bytes": None,
        "duration_s": None,
        "start_utc": None,
        "vehicle": None,
        "autopilot": None,
        "firmware": None,
        "system_id": None,
        "hardware": None,
        "hardware_kind": None,
        "flights": None,
        "airborne_s": None,
        "ended": None,
        "end_s": None,
        "end_speed": None,
        "lost_control_s": None,
        "model": None,
        "policy": job.policy,
        "verdict": None,
        "outlook": None,
        "advice": None,
        "accused": [],
        "stood_out": [],
        "safety_net": [],
        "findings": [],
        "consequences": [],
        "ruled_out": [],
        "not_testable": [],
        "names": [],
        "quality": [],
        "warnings": [],
        "trends": [],
        "curves": [],
        "track": {name: [] for name in NOWHERE._fields},
        "same_flight_as": None,
        "report": None,
        "report_error": None,
        "timings_s": {},
        "seconds": None,
        "error": None,
        "error_kind": None,
    }


def told(found: Analysis) -> Row:
    """Return what an analysis says about its log."""
    from fdi.report.advice_text import first_steps
    from fdi.report.fleet.sparks import curves_of
    from fdi.report.words import clean
    from fdi.telemetry.identity import identity_of
    from fdi.trends import trends_of

    log, tree = found.log, found.document()
    identity = identity_of(log)
    spans = [flight.airborne for flight in log.flights]
    return {
        "format": log.format,
        "sha256": log.sha256,
        "bytes": log.bytes,
        "duration_s": tree["log"]["duration_s"],
        "start_utc": tree["log"]["start_utc"],
        "vehicle": log.vehicle,
        "autopilot": log.autopilot,
        "firmware": log.firmware,
        "system_id": log.system_id,
        "hardware": clean(identity.hardware),
        "hardware_kind": identity.kind,
        "flights": len(log.flights),
        "airborne_s": round(sum(high - low for low, high in spans), 3),
        **_worst(tree.get("ends", [])),
        "model": found.airframe.name,
        "policy": found.policy.name,
        "verdict": found.verdict,
        "outlook": found.diagnosis.outlook,
        "advice": next(iter(first_steps(found)), None),
        "accused": list(dict.fromkeys(finding.component for finding in found.findings)),
        "stood_out": [fact.text for fact in found.stood_out],
        "safety_net": [
            f"{gap['parameter']}: {gap['means']}"
            for gap in tree["safety_net"]
            if gap["word"] != "note"
        ],
        "findings": [_finding(item) for item in tree["findings"]],
        **{
            part: list(dict.fromkeys(item["component"] for item in tree[part]))
            for part in ("consequences", "ruled_out", "not_testable")
        },
        "quality": [
            {"kind": item["kind"], "count": item["count"], "text": item["text"]}
            for item in tree["quality"]
        ],
        "names": _names(found),
        "warnings": tree["warnings"],
        "trends": [asdict(trend) for trend in trends_of(found)],
        "curves": curves_of(log),
        "track": {name: list(values) for name, values in track_of(log)._asdict().items()},
        "timings_s": tree["timings_s"],
    }


def with_same_flights(found: Sequence[Row]) -> list[Row]:
    """Return rows that say which earlier log is of the same flight of the same vehicle."""
    tracks = [
        ((row["vehicle"], row["autopilot"], row["system_id"]), Track(*row["track"].values()))
        for row in found
    ]
    first = first_of_flights(tracks)
    return [
        {**row, "same_flight_as": None if first[i] == i else found[first[i]]["path"]}
        for i, row in enumerate(found)
    ]


def _names(found: Analysis) -> list[Row]:
    """Return what a person calls every component that a row names."""
    from fdi.model.naming import component_words

    told = found.diagnosis
    parts = (told.findings, told.consequences, told.ruled_out, told.not_testable)
    keys = {one.component for part in parts for one in part}
    keys.update(name for one in told.findings for name in one.inseparable_from)
    known = found.system.components
    return [{"component": key, "name": component_words(key, known)} for key in sorted(keys)]


def _worst(ends: Sequence[Row]) -> Row:
    """Return how the flight ended that ended worst; of those alike, the last."""
    if not ends:
        return {}
    end = min(ends, key=_rank)
    return {
        "ended": end["how"],
        "end_s": end["at_s"],
        "end_speed": end["speed"],
        "lost_control_s": end["lost_control_s"],
    }


def _rank(end: Row) -> tuple[bool, int, int]:
    is_bad = end["how"] in BAD or end["lost_control_s"] is not None
    return not is_bad, ENDS.index(end["how"]), -end["flight"]


def _finding(item: Row) -> Row:
    over = item["end"]
    return {
        "rank": item["rank"],
        "flight": item["flight"],
        "component": item["component"],
        "faults": item["faults"],
        "kind": item["kind"],
        "onset_s": item["onset"]["log_s"],
        "onset_boot_s": item["onset"]["boot_s"],
        "alarm_s": item["alarm"]["log_s"],
        "end_s": None if over is None else over["log_s"],
        "confidence": item["confidence"],
        "because": [
            {"feature": one["feature"], "weight": one["weight"]} for one in item["because"]
        ],
        "rivals": item["rivals"],
        "text": item["evidence"]["text"],
    }


@contextmanager
def _local(path: str) -> Iterator[str]:
    """Give the local file of a path; what lies elsewhere is fetched, and removed afterwards."""
    if "://" not in path:
        yield path
        return
    try:
        import fsspec
    except ImportError:
        raise UsageError(
            "needs fsspec to be fetched", where=path, hint="pip install 'uav-fdi[fleet]'"
        ) from None
    with TemporaryDirectory(prefix="fdi-") as folder:
        local = str(Path(folder) / "log")
        try:
            with fsspec.open(path, "rb") as source, open(local, "wb") as copy:
                shutil.copyfileobj(source, copy)
        except (OSError, ValueError, ImportError) as error:
            raise LogError(f"cannot be fetched: {error}", where=path) from error
        yield local


def rows(
    jobs: Sequence[Job],
    *,
    workers: int = 1,
    cluster: str | None = None,
    work: Work = analyze_log,
) -> Generator[tuple[int, Row], None, None]:
    """Yield the number of each job with its row, in the order in which they get done.

    Parameters
    ----------
    jobs : sequence of Job
    workers : int
        Local processes; with 1 the work is done in this one.
    cluster : str, optional
        Address of a ``dask.distributed`` scheduler; its workers must see the same paths.
    work : callable
        What is done with a job; picklable.

    Raises
    ------
    UsageError
        The number of workers is wrong, or there is no cluster at the address.
    """
    if workers < 1:
        raise UsageError(f"{workers} workers cannot work", hint="give 1 or more")
    if cluster is not None:
        yield from _on_cluster(jobs, cluster, work)
    elif workers == 1:
        for number, job in enumerate(jobs):
            yield number, work(job)
    else:
        yield from _in_processes(jobs, workers, work)


def _in_processes(jobs: Sequence[Job], workers: int, work: Work) -> Iterator[tuple[int, Row]]:
    """Yield rows from a pool; the jobs that were under way when a worker died are tried alone."""
    waiting = sorted(enumerate(jobs), key=lambda item: _size(item[1]))  # the longest goes first
    suspects: list[tuple[int, Job]] = []
    while waiting:
        under_way: dict[Future[Row], tuple[int, Job]] = {}
        with _pool(min(workers, len(waiting))) as pool:
            try:
                while waiting or under_way:
                    while waiting and len(under_way) < AHEAD * workers:
                        item = waiting.pop()
                        under_way[_submitted(pool, work, item[1])] = item
                    done, _ = wait(under_way, return_when=FIRST_COMPLETED)
                    for future in done:
                        row = future.result()
                        yield under_way.pop(future)[0], row
            except BrokenProcessPool:
                suspects += under_way.values()
    for number, job in sorted(suspects):
        with _pool(1) as pool:
            try:
                yield number, _submitted(pool, work, job).result()
            except BrokenProcessPool:
                yield number, lost(job, "the process that read it died (out of memory?)")


def _size(job: Job) -> int:
    try:
        return os.path.getsize(job.path)
    except (OSError, ValueError):  # whoever reads it tells
        return 0


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool whose processes compute with one thread each, and end with an interrupt."""
    before = {name: os.environ.get(name) for name in _THREADS}
    others = set(active_children())
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read when a process loads its libraries
    try:
        with ProcessPoolExecutor(
            workers, get_context("spawn"), initializer=_prepare_worker
        ) as pool:
            try:
                yield pool
            except BaseException:  # an interrupt as well: what has begun need not end; it goes on
                pool.shutdown(wait=False, cancel_futures=True)
                for process in set(active_children()) - others:
                    process.terminate()
                raise
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _submitted(pool: ProcessPoolExecutor, work: Work, job: Job) -> Future[Row]:
    """Hand out a job; a process that is started for it never hears Ctrl-C.

    A terminal sends that to every process; it is for the one that gave the work. What is blocked
    here is blocked in the new process from its first instruction on, also while it imports.
    """
    if sys.platform == "win32":
        return pool.submit(work, job)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return pool.submit(work, job)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare_worker() -> None:
    """Let a process end with the one that gave the work, also where that is killed.

    The pipe to the parent is closed by the system when it ends, however it does.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where nothing can be blocked
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _on_cluster(jobs: Sequence[Job], address: str, work: Work) -> Iterator[tuple[int, Row]]:
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise UsageError(
            "--cluster needs dask.distributed", hint="pip install 'uav-fdi[fleet]'"
        ) from None
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise UsageError(f"no cluster answers: {error}", where=address) from error
    with client:
        futures = {client.submit(work, job, pure=False): i for i, job in enumerate(jobs)}
        for future in as_completed(list(futures)):
            number = futures[future]
            failure = future.exception()
            row = future.result() if failure is None else lost(jobs[number], f"lost: {failure!r}")
            yield number, row
