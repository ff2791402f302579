"""One function over many logs: every log is a row, whatever happens to it."""

import os
import signal

import pytest

from fdi.errors import UsageError
from fdi.fleet import Job, analyze_log, row_of_log, rows
from fdi.result import Analysis

pytestmark = [pytest.mark.flights, pytest.mark.usefixtures("_own_cache_folder")]
LOG = "examples/crash_logs/copter_motor_failure_crash.tlog"


def die_on_two(job):
    if job.path == "2":
        os.kill(os.getpid(), signal.SIGKILL)
    return {"path": job.path, "error": None}


def test_a_log_is_a_row_with_the_findings_of_its_analysis():
    row = analyze_log(Job(LOG))
    assert row["error"] is None
    assert row["accused"] == ["motor_1"]
    assert row["findings"][0]["rank"] == 1
    assert row["airborne_s"] > 10


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ([], (None, None, None, None)),
        ([("landed", 60.0, 0.5, None)], ("landed", 60.0, 0.5, None)),
        ([("impact", 30.0, 9.0, None), ("landed", 60.0, 0.5, None)], ("impact", 30.0, 9.0, None)),
        (
            [("in_air", 30.0, None, None), ("control_lost", 60.0, None, 58.0)],
            ("control_lost", 60.0, None, 58.0),
        ),
        ([("landed", 30.0, 0.4, None), ("landed", 60.0, 0.5, None)], ("landed", 60.0, 0.5, None)),
        ([("landed", 30.0, 0.4, 28.0), ("failsafe", 60.0, 0.5, None)], ("landed", 30.0, 0.4, 28.0)),
    ],
)
def test_a_row_says_how_the_flight_ended_that_ended_worst(monkeypatch, ends, expected):
    document = Analysis.document
    keys = ("flight", "how", "at_s", "speed", "lost_control_s")

    def told(found):
        given = [dict(zip(keys, (number, *end), strict=True)) for number, end in enumerate(ends)]
        return {**document(found), "ends": given}

    monkeypatch.setattr(Analysis, "document", told)
    row = analyze_log(Job(LOG))
    assert tuple(row[key] for key in ("ended", "end_s", "end_speed", "lost_control_s")) == expected


def test_a_defect_of_ours_is_a_row_that_says_where_also_where_its_text_is_cut():
    def tell(found):
        raise KeyError("x" * 1000)

    row = row_of_log(Job(LOG), tell)
    assert row["error_kind"] == "KeyError"
    assert row["error"].startswith("a defect of ours in tell (test_fleet.py, line ")
    assert len(row["error"]) == 500


def test_a_bad_log_is_a_row_with_the_same_keys(tmp_path):
    good, bad = analyze_log(Job(LOG)), analyze_log(Job(str(tmp_path / "none.tlog")))
    assert list(bad) == list(good)
    assert bad["error_kind"] == "LogError"
    assert "no such file" in bad["error"]


def test_a_worker_that_dies_costs_its_own_log_only():
    jobs = [Job(str(i)) for i in range(6)]
    found = dict(rows(jobs, workers=2, work=die_on_two))
    assert sorted(found) == list(range(6))
    assert [i for i in found if found[i]["error"]] == [2]
    assert "died" in found[2]["error"]


def test_a_log_elsewhere_is_fetched(tmp_path):
    pytest.importorskip("fsspec")
    row = analyze_log(Job(f"file://{os.path.abspath(LOG)}"))
    assert row["accused"] == ["motor_1"]
    assert analyze_log(Job(f"file://{tmp_path}/none.tlog"))["error_kind"] == "LogError"


def test_no_workers_is_a_mistake():
    with pytest.raises(UsageError):
        list(rows([], workers=0))
