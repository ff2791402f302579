"""Many logs become one table: whatever happens to a log, to a worker or to the run."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

import jsonschema
import pyarrow.parquet as pq
import pytest

import fdi.batch
from fdi.batch import batch, code_state, fingerprints
from fdi.cli import main
from fdi.errors import LogError, OutputError, UsageError
from fdi.fleet import Job, lost, with_same_flights
from fdi.table import COLUMNS, plain_line_of
from fdi.telemetry import read
from fdi.telemetry.search import find_logs
from fdi.telemetry.together.track import track_of

pytestmark = pytest.mark.flights

FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]
EXAMPLES = Path("examples/crash_logs").absolute()
ROOT = Path(__file__).parents[1]
TIMED = ("seconds", "timings_s")  # what differs from run to run


def untimed(found):
    return [{k: v for k, v in row.items() if k not in TIMED} for row in found]


@pytest.fixture
def logs(tmp_path):
    """Two logs that take a while, one that is none, one that is missing."""
    folder = tmp_path / "logs"
    (folder / "inner").mkdir(parents=True)
    shutil.copy(EXAMPLES / "copter_motor_failure_crash.tlog", folder / "a.tlog")
    shutil.copy(EXAMPLES / "plane_engine_failure_stall.tlog", folder / "inner" / "without_suffix")
    (folder / "b.bin").write_bytes(b"no log at all")
    (folder / "notes.txt").write_text("no log, and not called like one")
    (folder / ".hidden.tlog").write_bytes(b"")
    return folder


def test_every_log_is_a_row_and_the_table_reads_like_the_rows(logs, tmp_path):
    jobs = [Job(path) for path in (*find_logs([str(logs)]), str(tmp_path / "none.ulg"))]
    out = tmp_path / "fleet.parquet"
    found = batch(jobs, out, workers=2)
    assert [row["accused"] for row in found] == [["motor_1"], [], ["engine"], []]
    assert [row["error_kind"] for row in found] == [None, "LogError", None, "LogError"]
    told = pq.read_table(out).to_pylist()
    assert [{**row, "timings_s": dict(row["timings_s"])} for row in told] == found
    assert [entry.name for entry in tmp_path.iterdir() if "fleet" in entry.name] == [out.name]


def test_a_cluster_gives_the_same_rows(logs, tmp_path):
    distributed = pytest.importorskip("distributed")
    jobs = [Job(path) for path in find_logs([str(logs)])]
    here = batch(jobs, tmp_path / "here.parquet")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        there = batch(jobs, tmp_path / "there.parquet", cluster=cluster.scheduler_address)
    assert untimed(there) == untimed(here)
    assert untimed(pq.read_table(tmp_path / "there.parquet").to_pylist()) == untimed(
        pq.read_table(tmp_path / "here.parquet").to_pylist()
    )


def fake_rows(jobs, **_):
    """Instead of analyses, which take long: each is one row without content."""
    for number, job in enumerate(jobs):
        yield number, {**lost(job, ""), "error": None, "error_kind": None}


@pytest.fixture
def analysed(monkeypatch):
    """Paths that were analysed, in order."""
    seen = []

    def rows(jobs, **options):
        for number, row in fake_rows(jobs, **options):
            seen.append(Path(row["path"]).name)
            yield number, row

    monkeypatch.setattr(fdi.batch, "rows", rows)
    return seen


@pytest.fixture
def four(tmp_path):
    paths = [tmp_path / f"{name}.tlog" for name in "abcd"]
    for path in paths:
        path.write_bytes(b"content")
    return [Job(str(path)) for path in paths]


def stopped_after(count):
    def rows(jobs, **options):
        for number, row in fake_rows(jobs, **options):
            if number == count:
                raise KeyboardInterrupt
            yield number, row

    return rows


def test_an_interrupted_run_goes_on_where_it_was(four, analysed, tmp_path, monkeypatch):
    out = tmp_path / "t.parquet"
    with monkeypatch.context() as patch:
        patch.setattr(fdi.batch, "rows", stopped_after(2))
        with pytest.raises(KeyboardInterrupt):
            batch(four, out)
    assert not out.exists()
    lines = tmp_path / "t.parquet.rows.jsonl"
    lines.write_text(lines.read_text() + '{"path": "c.tl')  # the line that was being written
    with pytest.raises(OutputError, match="--resume"):
        batch(four, out)
    found = batch(four, out, resume=True)
    assert analysed == ["c.tlog", "d.tlog"]
    assert [row["path"] for row in found] == [job.path for job in four]
    assert not lines.exists()


def test_only_what_changed_is_analysed_again(four, analysed, tmp_path, monkeypatch):
    out = tmp_path / "t.parquet"
    batch(four, out)
    analysed.clear()
    Path(four[1].path).write_bytes(b"other content")
    os.utime(four[2].path, (1, 1))
    batch(four[::-1], out, resume=True)
    assert analysed == ["c.tlog", "b.tlog"]
    monkeypatch.setattr(fdi.batch, "code_state", lambda: "another")
    batch(four, out, resume=True)
    assert analysed[2:] == ["a.tlog", "b.tlog", "c.tlog", "d.tlog"]


def test_another_policy_is_another_row(four):
    job = four[0]
    same, other, again = fingerprints([job, Job(job.path, policy="paper"), Job(job.path)])
    assert other != same == again


def test_another_content_of_the_model_is_another_row(four, analysed, tmp_path, monkeypatch):
    """Also in a file that the model includes, and with the times of the files as they were."""
    model, part = tmp_path / "mine.yaml", tmp_path / "part.yaml"
    part.write_text("format: 1\nname: part\ncomponents: {gps: {group: sensor}}\n")
    model.write_text("format: 1\nname: mine\ndescription: One\ninclude: [part.yaml]\n")
    before = part.stat()
    job = Job(four[0].path, model=str(model))
    batch([job], tmp_path / "t.parquet")
    batch([job], tmp_path / "t.parquet", resume=True)
    assert analysed == ["a.tlog"]
    part.write_text(part.read_text().replace("gps", "gsp"))
    os.utime(part, ns=(before.st_atime_ns, before.st_mtime_ns))
    batch([job], tmp_path / "t.parquet", resume=True)
    assert analysed == ["a.tlog", "a.tlog"]


@pytest.mark.parametrize("place", ["package/telemetry/reader.py", "models/plane.yaml"])
def test_the_state_of_the_code_is_its_content(tmp_path, monkeypatch, place):
    for name in ("package/telemetry/reader.py", "models/plane.yaml", "package/batch.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("content")
    monkeypatch.setattr(fdi.batch, "__file__", str(tmp_path / "package/batch.py"))
    monkeypatch.setattr(fdi.batch, "models_folder", lambda: tmp_path / "models")
    before = code_state.__wrapped__()
    os.utime(tmp_path / place, (1, 1))
    assert code_state.__wrapped__() == before
    (tmp_path / place).write_text("another")
    assert code_state.__wrapped__() != before


def test_a_log_without_a_known_state_is_analysed_again(four, analysed, tmp_path):
    missing = Job(str(tmp_path / "missing.tlog"))
    batch([missing], tmp_path / "t.parquet")
    batch([missing], tmp_path / "t.parquet", resume=True)
    assert analysed == ["missing.tlog"] * 2


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace("b.tlog", "x.tlog"),
        lambda text: text.replace('"accused": []', '"accused": ["motor_1"]', 1),
        lambda text: text[: text.index("\n") - 3] + text[text.index("\n") :],
        lambda text: "[]\n" + text.partition("\n")[2],
        lambda text: "{}\n" + text.partition("\n")[2],
        lambda text: text[:-20],
        lambda text: "[" * 100_000 + "\n" + text.partition("\n")[2],
    ],
)
def test_a_damaged_row_is_told_and_made_anew(four, analysed, tmp_path, monkeypatch, damage):
    out, lines, told = tmp_path / "t.parquet", tmp_path / "t.parquet.rows.jsonl", []
    with monkeypatch.context() as patch:
        patch.setattr(fdi.batch, "rows", stopped_after(2))
        with pytest.raises(KeyboardInterrupt):
            batch(four, out)
    text = lines.read_text()
    assert damage(text) != text
    lines.write_text(damage(text))
    found = batch(four, out, resume=True, tell=told.append)
    assert len(analysed) == 3
    assert [row["path"] for row in found] == [job.path for job in four]
    assert not any(row["accused"] for row in found)
    assert len(told) == 1
    assert "1 of 2 rows cut, damaged" in told[0]


def test_a_damaged_table_is_told_and_made_anew(four, analysed, tmp_path):
    out, told = tmp_path / "t.parquet", []
    batch(four, out)
    content = bytearray(out.read_bytes())
    content[content.index(b"a.tlog")] ^= 1
    out.write_bytes(content)
    analysed.clear()
    found = batch(four, out, resume=True, tell=told.append)
    assert len(analysed) == 4
    assert [row["path"] for row in found] == [job.path for job in four]
    assert len(told) == 1
    assert "is damaged" in told[0]


def test_no_flipped_byte_of_a_table_is_believed(four, analysed, tmp_path, monkeypatch):
    """A byte is either without meaning, or the rows are made anew, or the file is no table."""
    out = tmp_path / "t.parquet"
    monkeypatch.setattr(fdi.batch, "code_state", lambda: "as it is")
    expected = batch(four, out)
    whole = out.read_bytes()
    for at in range(0, len(whole), len(whole) // 40):
        out.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        with suppress(OutputError):
            assert batch(four, out, resume=True) == expected


def test_a_second_run_on_a_table_is_refused_while_the_first_works(four, tmp_path, monkeypatch):
    out = tmp_path / "t.parquet"
    refused = []

    def rows(jobs, **options):
        with pytest.raises(OutputError, match="another fdi batch is writing it") as caught:
            batch(four, out, resume=True)
        refused.append(caught.value.exit_code)
        yield from fake_rows(jobs, **options)

    monkeypatch.setattr(fdi.batch, "rows", rows)
    batch(four, out)
    assert refused == [5]
    assert not list(tmp_path.glob(".*"))


def pids_below(pid):
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in found]


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no /proc here")
def test_a_killed_run_leaves_no_workers_and_no_lock(tmp_path):
    logs = []
    for number in range(12):  # some minutes of work
        logs.append(str(tmp_path / f"{number}.tlog"))
        shutil.copy(EXAMPLES / "copter_motor_failure_crash.tlog", logs[-1])
    out, bad = tmp_path / "t.parquet", tmp_path / "a.bin"
    bad.write_bytes(b"done at once")
    lines = tmp_path / "t.parquet.rows.jsonl"
    words = ["batch", *logs, str(bad), "--out", str(out), "--workers", "2"]
    with subprocess.Popen(FDI + words, stderr=subprocess.DEVNULL) as process:
        limit = time.monotonic() + 600
        while not (lines.exists() and lines.stat().st_size) and time.monotonic() < limit:
            time.sleep(0.01)
        workers = pids_below(process.pid)
        assert len(workers) >= 2
        process.kill()
    limit = time.monotonic() + 100
    while any(map(is_alive, workers)) and time.monotonic() < limit:
        time.sleep(0.05)
    assert not [pid for pid in workers if is_alive(pid)]
    assert (tmp_path / ".t.parquet.lock").exists()
    again = ["batch", str(bad), "--out", str(out), "--workers", "1"]
    ended = subprocess.run([*FDI, *again, "--resume"], capture_output=True, text=True, timeout=600)
    assert ended.returncode == 3, ended.stderr  # none of its logs has an analysis
    assert not list(tmp_path.glob(".*"))


def test_the_summary_names_the_flights_that_need_a_look(four, tmp_path, monkeypatch, capsys):
    changes = [
        {
            "accused": ["gps"],
            "findings": [{"component": "gps", "confidence": 0.871}],
            "names": [{"component": "gps", "name": "GPS receiver"}],
        },
        {"ended": "in_air", "end_s": 60.0},
        {"ended": "impact", "end_s": 68.84, "end_speed": 12.93, "lost_control_s": 66.0},
        {"error": "cannot be read", "error_kind": "LogError"},
    ]

    def rows(jobs, **options):
        for number, row in fake_rows(jobs, **options):
            yield number, {**row, **changes[number]}

    monkeypatch.setattr(fdi.batch, "rows", rows)
    assert main(["batch", *(job.path for job in four), "--out", str(tmp_path / "t.parquet")]) == 0
    first, *looks = capsys.readouterr().out.splitlines()
    assert first.endswith("t.parquet: 1 with an accusation, 1 ended badly, 1 without an analysis")
    assert [line.partition(": ")[0].strip() for line in looks] == ["c.tlog", "a.tlog", "d.tlog"]
    assert [line.partition(": ")[2] for line in looks] == [
        "lost control, 66.0 s, hit the ground at 12.9 m/s, 68.8 s",
        "accused: GPS receiver (87 %)",
        "no analysis: cannot be read",
    ]


def ending(monkeypatch, changes):
    def rows(jobs, **options):
        for number, row in fake_rows(jobs, **options):
            yield number, {**row, **changes[number % len(changes)]}

    monkeypatch.setattr(fdi.batch, "rows", rows)


QUIET, ACCUSED = {}, {"accused": ["gps"]}
FAILED = {"error": "cannot be read", "error_kind": "LogError"}


@pytest.mark.parametrize(
    ("changes", "plain", "checked"),
    [
        ([QUIET], 0, 0),
        ([QUIET, ACCUSED], 0, 1),
        ([QUIET, FAILED], 0, 3),
        ([ACCUSED, FAILED], 0, 1),
        ([FAILED], 3, 3),
    ],
)
def test_the_exit_code_says_what_a_script_asks(
    four, tmp_path, monkeypatch, capsys, changes, plain, checked
):
    ending(monkeypatch, changes)
    words = ["batch", *(job.path for job in four), "--out"]
    assert main([*words, str(tmp_path / "a.parquet")]) == plain
    assert (tmp_path / "a.parquet").exists()
    capsys.readouterr()
    assert main([*words, str(tmp_path / "b.parquet"), "--check"]) == checked
    assert ("could not be analysed" in capsys.readouterr().err) == (checked == 3)


def test_files_of_other_kinds_are_counted(logs, tmp_path, monkeypatch, capsys):
    ending(monkeypatch, [QUIET])
    (logs / "inner" / "more.TXT").write_text("no log either")
    assert main(["batch", str(logs), "--out", str(tmp_path / "t.parquet")]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said == ["fdi: 2 files are no logs and were passed over: 2 .txt"]


def test_logs_are_named_from_where_the_user_pointed(logs, tmp_path, monkeypatch, capsys):
    ending(monkeypatch, [ACCUSED])
    monkeypatch.chdir(tmp_path)
    other = tmp_path / "far" / "a.tlog"
    other.parent.mkdir()
    shutil.copy(logs / "a.tlog", other)
    assert main(["batch", "logs", str(other), "--out", "t.parquet"]) == 0
    _, *looks = capsys.readouterr().out.splitlines()
    named = [line.partition(": ")[0].strip() for line in looks]
    assert named == ["logs/a.tlog", "b.bin", "inner/without_suffix", str(other)]


def test_a_row_keeps_its_schema_and_the_schema_names_every_column(tmp_path):
    schema = json.loads(files("fdi.report").joinpath("batch.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    assert list(schema["properties"]) == schema["required"] == list(COLUMNS)
    jobs = [Job(str(EXAMPLES / "copter_motor_failure_crash.tlog")), Job(str(tmp_path / "no.bin"))]
    for row in batch(jobs, tmp_path / "t.parquet"):
        validator.validate(json.loads(plain_line_of(row)))
    assert {"component": "motor_1", "name": "Motor 1 (front right)"} in batch(
        jobs, tmp_path / "t.parquet", resume=True
    )[0]["names"]


def test_two_recorders_of_one_flight_are_told_as_one(tmp_path):
    folder = ROOT.parent / "shared" / "flights" / "sitl" / "copter"
    names = ("c10_motor1_x0.7_20s", "c01_ref_slow_line")
    paths = [str(folder / f"{name}.{end}") for end in ("BIN", "tlog") for name in names]
    if not all(map(os.path.exists, paths)):
        pytest.skip("no ../shared")
    tracks = [track_of(read(path)) for path in paths]
    rows = [
        {**lost(Job(path), ""), "track": track._asdict()}
        for path, track in zip(paths, tracks, strict=True)
    ]
    told = [row["same_flight_as"] for row in with_same_flights(rows)]
    assert told == [None, None, *paths[:2]]  # not of each other, though both began alike


def test_a_log_whose_worker_died_is_tried_again(four, analysed, tmp_path, monkeypatch):
    out = tmp_path / "t.parquet"
    with monkeypatch.context() as patch:
        patch.setattr(
            fdi.batch, "rows", lambda jobs, **_: ((i, lost(j, "x")) for i, j in enumerate(jobs[:4]))
        )
        batch(four, out)
    batch(four, out, resume=True)
    assert len(analysed) == 4


def test_what_is_not_ours_is_not_replaced(four, tmp_path):
    out = tmp_path / "mine.parquet"
    out.write_bytes(b"precious")
    with pytest.raises(OutputError, match="no table of fdi batch"):
        batch(four, out)
    assert out.read_bytes() == b"precious"
    (tmp_path / "link.parquet").symlink_to(out)
    with pytest.raises(OutputError, match="link"):
        batch(four, tmp_path / "link.parquet")


def test_an_interrupt_ends_with_130_and_leaves_the_rows(tmp_path):
    """Sent to the one process that gives the work; those that do it end with it."""
    out, lines = tmp_path / "t.parquet", tmp_path / "t.parquet.rows.jsonl"
    bad = tmp_path / "a.bin"
    bad.write_bytes(b"done at once")
    slow = [str(path) for path in EXAMPLES.glob("*.tlog")]
    words = ["batch", str(bad), *slow, "--out", str(out), "--workers", "2"]
    environment = {**os.environ, "FDI_CACHE_DIR": str(tmp_path / "cache")}
    with subprocess.Popen(
        FDI + words,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # a background job's is off
    ) as process:
        limit = time.monotonic() + 600
        while not (lines.exists() and lines.stat().st_size) and time.monotonic() < limit:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=600)
    assert process.returncode == 130, err
    kept, interrupted = (line for line in err.splitlines() if line)
    assert interrupted == "fdi: interrupted"
    told = (
        rf": \d of {1 + len(slow)} rows are kept in .*rows\.jsonl; the same command with --resume"
    )
    assert re.search(told, kept)
    assert not out.exists()
    assert json.loads(lines.read_text().splitlines()[0])["path"] in words


def test_folders_globs_and_urls_name_the_same_logs_once(logs):
    names = ["a.tlog", "b.bin", "inner/without_suffix"]
    expected = tuple(str(logs / name) for name in names)
    assert find_logs([str(logs)]) == expected
    assert find_logs([str(logs / "*"), str(logs)])[:2] == expected[:2]
    assert set(find_logs([f"{logs}/**"])) >= set(expected)
    pytest.importorskip("fsspec")
    urls = find_logs([f"file://{logs}"])
    assert urls == tuple(f"file://{path}" for path in expected[:2])
    assert find_logs([f"file://{logs}/*.tlog"]) == urls[:1]


def test_a_folder_without_logs_is_told(tmp_path):
    with pytest.raises(LogError, match="holds no log"):
        find_logs([str(tmp_path)])
    with pytest.raises(LogError, match="holds no log"):
        find_logs([str(tmp_path / "*.tlog")])


def test_paths_none_of_which_exists_are_told_and_one_of_several_is_a_row(logs, tmp_path):
    missing = str(tmp_path / "nowhere")
    with pytest.raises(LogError, match="does not exist"):
        find_logs([missing])
    assert missing in find_logs([missing, str(logs)])


def test_a_url_of_an_unknown_kind_is_refused():
    pytest.importorskip("fsspec")
    with pytest.raises(UsageError):
        find_logs(["nowhere://logs/"])


def wanted(**kinds):
    return fdi.batch.Beside(**kinds)


def test_page_lines_and_report_stand_beside_the_table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = str(EXAMPLES / "copter_motor_failure_crash.tlog")
    words = ["batch", log, "--out", "fleet.parquet", "--workers", "1"]
    assert main([*words, "--html", "--ndjson", "--reports", "flagged"]) == 0
    (told,) = pq.read_table("fleet.parquet").to_pylist()
    assert told["report"].startswith("fleet.reports/copter_motor_failure_crash-")
    assert Path(told["report"], "report.html").is_file()
    page = Path("fleet.html").read_text("utf-8")
    assert f'href="{told["report"]}/report.html"' in page
    (line,) = map(json.loads, Path("fleet.ndjson").read_text("utf-8").splitlines())
    assert {**line, "timings_s": list(line["timings_s"].items())} == told
    assert {one["part"] for one in told["trends"]} >= {"motor_1", "compass_1"}
    assert [curve["name"] for curve in told["curves"]] == ["height", "speed"]


@pytest.fixture
def reported(monkeypatch):
    """Logs of which a report was written, in order: every second one is flagged."""
    seen = []

    def rows(jobs, **options):
        for number, row in fake_rows(jobs, **options):
            job = jobs[number]
            row["accused"] = ["gps"] if Path(job.path).stem in "ac" else []
            if job.report and (job.reports == "all" or row["accused"]):
                Path(job.report).mkdir(parents=True)
                row["report"] = job.report
                seen.append(Path(job.path).name)
            yield number, row

    monkeypatch.setattr(fdi.batch, "rows", rows)
    return seen


def test_a_report_that_is_there_is_kept_and_one_that_lacks_is_written(four, reported, tmp_path):
    out = tmp_path / "t.parquet"
    batch(four, out, also=wanted())
    assert reported == []
    found = batch(four, out, resume=True, also=wanted(reports="flagged"))
    assert reported == ["a.tlog", "c.tlog"]
    assert [row["report"] is not None for row in found] == [True, False, True, False]
    batch(four, out, resume=True, also=wanted(reports="flagged"))
    assert len(reported) == 2
    shutil.rmtree(tmp_path / found[2]["report"])
    batch(four, out, resume=True, also=wanted(reports="flagged"))
    assert reported[2:] == ["c.tlog"]
    batch(four, out, resume=True, also=wanted(reports="all"))
    assert reported[3:] == ["b.tlog", "d.tlog"]


@pytest.mark.parametrize("kind", ["html", "ndjson"])
@pytest.mark.usefixtures("analysed")
def test_a_file_in_the_way_that_is_not_ours_is_refused_and_one_of_ours_replaced(
    four, tmp_path, kind
):
    out, also = tmp_path / "t.parquet", wanted(**{kind: True})
    other = tmp_path / f"t.{kind}"
    other.write_text("mine")
    with pytest.raises(OutputError, match="did not write it"):
        batch(four, out, also=also)
    assert other.read_text() == "mine"
    assert not out.exists()
    other.unlink()
    batch(four, out, also=also)
    first = other.read_text()
    batch(four, out, also=also)
    assert other.read_text() == first != ""


@pytest.mark.usefixtures("analysed")
def test_without_asking_nothing_stands_beside_the_table(four, tmp_path):
    batch(four, tmp_path / "t.parquet")
    assert {one.name for one in tmp_path.iterdir() if one.name.startswith("t.")} == {"t.parquet"}


def test_a_page_made_by_resuming_analyses_nothing_again(four, analysed, tmp_path):
    batch(four, tmp_path / "t.parquet")
    analysed.clear()
    batch(four, tmp_path / "t.parquet", resume=True, also=wanted(html=True))
    assert analysed == []
    assert (tmp_path / "t.html").exists()


def test_logs_of_one_name_have_reports_of_their_own(tmp_path, monkeypatch):
    asked = []

    def rows(jobs, **_):
        asked.extend(jobs)
        yield from fake_rows(jobs)

    monkeypatch.setattr(fdi.batch, "rows", rows)
    jobs = [Job(f"/logs/{folder}/a<b>&c\udcff.bin") for folder in "xyz"]
    batch(jobs, tmp_path / "t.parquet", also=wanted(reports="all"))
    places = [Path(job.report) for job in asked]
    assert len(set(places)) == 3
    assert {place.parent for place in places} == {tmp_path / "t.reports"}
    assert all(re.fullmatch(r"a_b__c_-[0-9a-f]{8}\.fdi", place.name) for place in places)
    assert pq.read_table(tmp_path / "t.parquet")["path"][0].as_py() == "/logs/x/a<b>&c\\udcff.bin"


def test_a_report_that_cannot_be_written_is_told_and_costs_no_row(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("t.reports").write_text("in the way")
    log = str(EXAMPLES / "copter_motor_failure_crash.tlog")
    code = main(["batch", log, "--out", "t.parquet", "--reports", "flagged", "--workers", "1"])
    assert code == 5
    assert "the report is not written" in capsys.readouterr().err
    (row,) = pq.read_table("t.parquet").to_pylist()
    assert row["accused"] == ["motor_1"]
    assert row["report"] is None
