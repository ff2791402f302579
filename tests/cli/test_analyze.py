import json
from pathlib import Path

import pytest

from fdi.report.files import FORMATS, names_of

from .conftest import LOG, Run

OTHER = LOG.with_name("copter_gps_loss_landing.tlog")


def test_it_prints_the_verdict_and_writes_the_folder_here(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model)
    assert ended.code == 0
    assert "Motor 1 (front right) failed first" in ended.out
    folder = Path(f"{LOG.stem}.fdi")
    written = {entry.name for entry in folder.iterdir()}
    assert written == {*names_of(FORMATS), ".fdi-manifest.json"}
    assert not list(LOG.parent.glob("*.fdi"))


def test_the_last_line_tells_how_to_open_the_page(run: Run, model: Path) -> None:
    page = f"{LOG.stem}.fdi/report.html"
    words = ("analyze", LOG, "--model", model, "--format")
    told = " ".join(run(*words, "html").out.split())
    assert told.endswith(f"open {page} in a browser; it needs no network (--open opens it)")
    assert "in a browser" not in run(*words, "txt").out


def test_a_warning_is_told_once_on_a_terminal_and_stands_in_the_summary(run: Run) -> None:
    ended = run("analyze", LOG)
    told = [line for line in ended.err.splitlines() if line.startswith("fdi: warning: ")]
    assert told
    assert "Warnings" not in ended.out
    assert "Warnings" in Path("copter_motor_failure_crash.fdi/summary.txt").read_text("utf-8")


def test_the_verdict_is_the_first_thing_and_warnings_come_behind_it(run: Run) -> None:
    ended = run("analyze", LOG)
    verdict = run("analyze", LOG, "--quiet").out.strip()
    assert " ".join(ended.out.split()).startswith(verdict)
    assert len(ended.out.splitlines()) + len(ended.err.splitlines()) <= 40
    whole = run("analyze", LOG, "--verbose").out
    assert " ".join(whole.split()).startswith(verdict)
    assert "Ruled out: what would have shown did not" in whole


@pytest.mark.parametrize("is_found", [True, False])
def test_open_opens_the_page(
    run: Run, model: Path, monkeypatch: pytest.MonkeyPatch, is_found: bool
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda page: opened.append(page) or is_found)
    ended = run("analyze", LOG, "--model", model, "--format", "html", "--open")
    assert ended.code == 0
    assert opened == [Path(f"{LOG.stem}.fdi/report.html").resolve().as_uri()]
    assert ("no browser was found" in ended.err) != is_found


@pytest.mark.parametrize("words", [("--format", "txt"), ("--json",)])
def test_open_needs_a_page(run: Run, model: Path, words: tuple[str, ...]) -> None:
    ended = run("analyze", LOG, "--model", model, "--open", *words)
    assert ended.code == 2
    assert "--open needs report.html" in ended.err


def test_check_turns_an_accusation_into_1(run: Run, model: Path) -> None:
    words = ("analyze", LOG, "--model", model, "--format", "json", "--check")
    assert run(*words).code == 1
    assert run(*words, "--window", "10:30").code == 0


def test_json_is_all_that_standard_output_holds(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--json")
    document = json.loads(ended.out)
    assert document["findings"][0]["component"] == "motor_1"
    assert not list(Path().iterdir())
    again = run("analyze", LOG, "--model", model, "--json", "--out", "o", "--format", "json")
    assert json.loads(again.out) == json.loads(Path("o/analysis.json").read_text())


def test_quiet_prints_the_verdict_alone(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--quiet", "--format", "txt")
    assert ended.out.count("\n") == 1
    assert not ended.err


def test_verbose_tells_the_timings_on_standard_error(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--verbose", "--format", "txt")
    assert "read took" in ended.err
    assert "took" not in ended.out


def test_window_and_rate_reach_the_grid(run: Run, model: Path) -> None:
    said = run("analyze", LOG, "--model", model, "--window", "10:20", "--format", "txt")
    assert "only 10 to 20 s of the log" in said.out
    words = ("analyze", LOG, "--model", model, "--json", "--window", "10:20", "--rate", "2")
    document = json.loads(run(*words).out)
    assert document["fault_grid"]["t"] == [10 + k / 2 for k in range(21)]


def test_budget_reaches_the_thresholds(run: Run, model: Path) -> None:
    def policy(*words: str) -> dict[str, float]:
        found = json.loads(run("analyze", LOG, "--model", model, "--json", *words).out)
        return dict(found["policy"])

    assert policy()["budget_per_hour"] == 10.0
    rare, often = (policy("--budget", per_hour) for per_hour in ("0.1", "10"))
    assert (rare["budget_per_hour"], often["budget_per_hour"]) == (0.1, 10.0)
    assert rare["threshold_scale"] > often["threshold_scale"]
    assert policy("--policy", "paper")["budget_per_hour"] is None


def test_a_pipe_gets_neither_colour_nor_progress(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--format", "txt")
    assert "\x1b" not in ended.out + ended.err
    assert "\r" not in ended.err


def test_a_foreign_folder_needs_force(run: Run, model: Path) -> None:
    Path("o").mkdir()
    Path("o/mine").write_text("")
    words = ("analyze", LOG, "--model", model, "--format", "txt", "--out", "o")
    refused = run(*words)
    assert refused.code == 5
    assert "--force" in refused.err
    assert run(*words, "--force").code == 0
    assert Path("o/mine").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "Missing argument"),
        ([LOG, "--window", "5"], "not two ascending"),
        ([LOG, "--window", "9:5"], "not two ascending"),
        ([LOG, "--window", "nan:5"], "not two ascending"),
        ([LOG, "--budget", "nan"], "per hour from 0.01 to 100"),
        ([LOG, "--budget", "0"], "per hour from 0.01 to 100"),
        ([LOG, "--budget", "few"], "per hour from 0.01 to 100"),
        ([LOG, "--budget", "1", "--policy", "paper"], "paper has no budget"),
        ([LOG, "--rate", "fast"], "'auto'"),
        ([LOG, "--rate", "0"], "'auto'"),
        ([LOG, "--format", "docx"], "unknown format"),
        ([LOG, "--metods", "all"], "No such option"),
        ([LOG, "--methods", "tea_leaves"], "no method 'tea_leaves'"),
        ([LOG, "--quiet", "--verbose"], "exclude"),
        ([LOG, "--json", "--format", "txt"], "--out"),
        ([LOG, LOG], "the same file twice"),
        ([LOG, OTHER], "another flight"),
        ([LOG, "--system", "77"], "77"),
    ],
)
def test_a_wrong_command_line_is_2_in_one_line(run: Run, words: list[object], says: str) -> None:
    ended = run("analyze", *words)
    assert ended.code == 2
    assert not ended.out
    assert ended.err.count("\n") == 1
    assert ended.err.startswith("fdi: ")
    assert says in ended.err


def test_explain_tells_what_a_test_did_and_writes_nothing(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--explain", "works_hardest")
    assert ended.code == 0
    assert "| works_hardest | motor_1 |" in ended.out
    assert "holds: motor_1" in ended.out
    assert "effort = u_1" in ended.out
    assert "alarm from " in ended.out
    assert not list(Path().iterdir())
    every = run("analyze", LOG, "--model", model, "--explain", "all")
    component = run("analyze", LOG, "--model", model, "--explain", "motor_1")
    assert set(ended.out.splitlines()[:3]) <= set(every.out.splitlines())
    assert set(ended.out.splitlines()) <= set(component.out.splitlines())


def test_explain_of_many_tests_says_how_to_learn_more_and_keeps_warnings(run: Run) -> None:
    ended = run("analyze", LOG, "--explain", "all")
    assert ended.out.endswith("more is told: its equations, thresholds and alarms.\n")
    assert "fdi: warning: " in ended.err
    assert "fdi: warning: " not in run("analyze", LOG, "--explain", "all", "--quiet").err


def test_explain_facts_tells_where_nothing_stood_out(run: Run) -> None:
    ended = run("analyze", LOG, "--explain", "facts")
    first, *net = ended.out.splitlines()
    assert (ended.code, first) == (0, "Nothing stood out in this log.")
    assert net
    assert all(line.startswith(("safety net, ", "  rests on ")) for line in net)
    assert not list(Path().iterdir())


def test_explaining_a_test_that_there_is_none_of_names_some(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--explain", "nothing_like_it")
    assert (ended.code, ended.out) == (2, "")
    assert "there is no test 'nothing_like_it'" in ended.err
    assert "give an id such as r1" in ended.err


def test_explain_and_json_exclude_each_other(run: Run, model: Path) -> None:
    ended = run("analyze", LOG, "--model", model, "--explain", "all", "--json")
    assert ended.code == 2
    assert "exclude each other" in ended.err
