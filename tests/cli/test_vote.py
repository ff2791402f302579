"""The command vote: what it prints and writes, and a sentence for everything that cannot be."""

import csv
import json
from pathlib import Path

import pytest
from methods.voting.build import CONDITIONS, UTC_US, S, autopilot

from .conftest import LOG, Ended, Run

LOST = {name: (lambda t: t >= 20.2) for name in CONDITIONS[3:6]}


@pytest.fixture
def write(tmp_path: Path):
    def made(name: str, number: int = 1, **changed: object) -> Path:
        path = tmp_path / name
        path.write_bytes(autopilot(number, **changed))  # type: ignore[arg-type]
        return path

    return made


def is_refused(ended: Ended, code: int, *told: str) -> None:
    assert ended.code == code, ended.err
    assert ended.err.startswith("fdi: ")
    assert ended.err.count("\n") == 1
    assert all(part in ended.err for part in told), ended.err
    assert not ended.out
    assert not list(Path().iterdir())


def test_the_page_tells_votes_flags_reaction_and_the_thesis(run: Run, write) -> None:
    ended = run("vote", write("one.ulg", bad=LOST), "--onset", 15)
    assert ended.code == 0
    assert not ended.err
    assert "Autopilot 1 is voted out for errors that lasted: 1, 2, 3 vote for 2" in ended.out
    assert "condition_global_position_valid" in ended.out
    assert "Reaction, s after the onset at 15 s" in ended.out
    assert ended.out.count("thesis, table 6.1") == 3
    assert "votes are inferred" in ended.out
    assert not list(Path().iterdir())


def test_a_healthy_flight_votes_nobody_out(run: Run, write) -> None:
    ended = run("vote", write("one.ulg"))
    assert ended.code == 0
    assert "Nobody is voted out: every autopilot votes for 1 to the end." in ended.out
    assert "No flag of one autopilot is bad" in ended.out


def test_a_what_if_is_told_beside_the_preset(run: Run, write) -> None:
    words = ("--persistence", 3, "--flags", ",".join(CONDITIONS))
    ended = run("vote", write("one.ulg", bad=LOST), *words)
    assert "what if: persistence 3 s, without failsafe" in ended.out
    lines = ended.out[ended.out.index("Reaction") :].splitlines()
    what_if = next(line.removeprefix("what if") for line in lines if line.startswith("what if"))
    preset = next(line.removeprefix("recorded") for line in lines if line.startswith("recorded"))
    detection = [float(line.split()[2]) for line in (what_if, preset)]
    assert detection[0] - detection[1] == pytest.approx(2.0, abs=0.01)


def test_a_vote_that_changes_before_anything_failed_is_told_as_needless(run: Run, write) -> None:
    """Stamps are 0.5 s old when they come: a silence of 1 s is met between two messages."""
    ended = run("vote", write("two.ulg", 2, silent_from={1: 20.0}), "--silence", 1, "--onset", 19)
    row = next(x for x in ended.out.splitlines() if x.startswith("what if  "))
    assert "earlier" in row
    assert "-" not in row


def test_the_thesis_compares_later(run: Run, write) -> None:
    one = write("one.ulg", bad=LOST, lasts_s=60.0)
    texts = {}
    for name in ("thesis", "recorded"):
        document = json.loads(run("vote", one, "--json", "--preset", name).out)
        assert document["settings"]["preset"] == name
        texts[name] = document["reactions"][0]["votes"][0]["at_s"]
    assert texts["thesis"] > 5 - 1 + 30
    assert texts["recorded"] < 22


def test_json_holds_finite_numbers_and_what_the_page_tells(run: Run, write) -> None:
    ended = run("vote", write("one.ulg", bad=LOST), "--json", "--onset", 15)
    document = json.loads(ended.out, parse_constant=lambda name: pytest.fail(name))
    assert document["schema_version"] == 1
    assert [one["number"] for one in document["autopilots"]] == [1, 2, 3]
    assert [one["is_inferred"] for one in document["autopilots"]] == [False, True, True]
    (reaction,) = document["reactions"]
    assert (reaction["autopilot"], reaction["replaced_by"], reaction["onset_s"]) == (1, 2, 15.0)
    assert reaction["detection_after_s"] == pytest.approx(reaction["votes"][0]["at_s"] - 15.0)
    assert {row["flag"] for row in document["errors"]} == set(LOST)
    assert document["thesis_table_6_1"]["GPS"] == {"detection_s": 6.0, "replacement_s": 10.0}
    assert ended.err.count("fdi: warning: ") == len(document["notes"])


def test_out_holds_tables_and_figures(run: Run, write) -> None:
    ended = run("vote", write("one.ulg", bad=LOST), "--out", "votes", "--quiet")
    assert (ended.code, ended.out, ended.err) == (0, "", "")
    out = Path("votes")
    assert {path.name for path in out.iterdir()} == {
        *("vote.json", "summary.txt", "votes.csv", "errors.csv", "reaction.csv"),
        *("votes.png", "votes.svg", ".fdi-manifest.json"),
    }
    assert (out / "votes.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "votes.csv").open()))
    assert {row["vote"] for row in rows} == {"1", "2"}
    assert [float(row["t"]) for row in rows] == sorted(float(row["t"]) for row in rows)
    again = run("vote", LOG, "--out", "votes")
    assert again.code == 3
    assert (out / "votes.csv").is_file()


def test_the_same_log_gives_the_same_bytes(run: Run, write) -> None:
    one = write("one.ulg", bad=LOST)
    for name in ("a", "b"):
        run("vote", one, "--out", name, "--quiet")
    for path in Path("a").iterdir():
        assert path.read_bytes() == (Path("b") / path.name).read_bytes(), path.name


def test_a_folder_of_somebody_else_is_left_alone(run: Run, write) -> None:
    Path("mine").mkdir()
    (Path("mine") / "votes.csv").write_text("mine")
    ended = run("vote", write("one.ulg"), "--out", "mine")
    assert ended.code == 5
    assert (Path("mine") / "votes.csv").read_text() == "mine"


def test_logs_of_different_flights_are_2(run: Run, write) -> None:
    logs = write("a.ulg", 1), write("b.ulg", 2, booted_utc_us=UTC_US + 3600 * S)
    is_refused(
        run("vote", *logs), 2, "b.ulg: ", "begins at 2021-09-28T15", "a.ulg at 2021-09-28T14"
    )


def test_logs_without_a_common_clock_are_2(run: Run, write) -> None:
    logs = write("a.ulg", 1, utc=False), write("b.ulg", 2, utc=False)
    is_refused(run("vote", *logs), 2, "b.ulg: cannot be put on the clock of a.ulg")


def test_logs_of_one_autopilot_are_2(run: Run, write) -> None:
    logs = write("a.ulg", 1), write("b.ulg", 1, bad=LOST)
    is_refused(run("vote", *logs), 2, "a.ulg and ", "b.ulg both say that they are of autopilot 1")
    is_refused(run("vote", logs[0], logs[0]), 2, "are the same log")


def test_a_single_log_without_received_flags_is_3(run: Run, write) -> None:
    alone = write("alone.ulg", peers=())
    is_refused(run("vote", alone), 3, "alone.ulg: holds no flags received from other autopilots")


def test_a_log_of_ardupilot_is_3(run: Run) -> None:
    is_refused(run("vote", LOG), 3, LOG.name, "holds none of the 11 flags that are compared")


def test_a_value_that_is_no_flag_blames_nobody_and_is_told(run: Run, write) -> None:
    ended = run("vote", write("odd.ulg", raw={"failsafe": 9}))
    assert ended.code == 0
    assert "own flags are unknown in part (failsafe): unknown ones blame nobody" in ended.out
    assert "Nobody is voted out" in ended.out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "there is no log"),
        (["LOG", "--simulate", "3"], "logs and --simulate are both given"),
        (["LOG", "--runs", "9"], "--runs is of --simulate"),
        (["LOG", "--fail", "dead"], "--fail is of --simulate"),
        (["LOG", "--cycle", "nan"], "cycle is nan s"),
        (["LOG", "--cycle", "0"], "cycle is 0 s"),
        (["LOG", "--silence", "-1"], "silence is -1 s"),
        (["LOG", "--onset", "nan"], "an onset at nan s"),
        (["LOG", "--phase", "1"], "a phase of 1 s"),
        (["LOG", "--flags", "a,b"], "no flag is called 'a'"),
        (["LOG", "--quorum", "0"], "a quorum of 0"),
        (["LOG", "--preset", "best"], "best"),
        (["--simulate", "3", "--delay", "9"], "--delay is of logs"),
        (["--simulate", "1"], "1 autopilots cannot be simulated"),
        (["--simulate", "3,x"], "are no numbers of autopilots"),
        (["--simulate", "3", "--fail", "evil"], "'evil' is no failure"),
        (["--simulate", "3", "--fail", "dead:4"], "there is no autopilot 4 among 3"),
        (["--simulate", "3", "--loss", "nan"], "a loss of nan"),
        (["--simulate", "3", "--runs", "0"], "0 runs"),
        (["--simulate", "3", "--lasts", "nan"], "a run cannot last nan s"),
        (["--simulate", "3", "--mttf", "nan"], "a mean time to failure of nan h"),
        (["--simulate", "3", "--voter", "2"], "a reliability of 2"),
    ],
)
def test_what_cannot_be_carried_out_is_2(run: Run, write, words: list[str], told: str) -> None:
    path = write("one.ulg")
    is_refused(run("vote", *(path if word == "LOG" else word for word in words)), 2, told)


def test_simulated_voters_are_a_page_json_and_tables(run: Run) -> None:
    words = ("vote", "--simulate", "3,5", "--runs", "20", "--lasts", "15")
    page = run(*words).out
    assert "Runs that end with a failing autopilot in charge" in page
    assert "assumed: units fail independently" in page
    document = json.loads(run(*words, "--json").out)
    by_name = {(row["name"], row["autopilots"]): row for row in document["scenarios"]}
    assert by_name["2 stuck", 3]["wrong"][0] == 1
    assert by_name["2 stuck", 5]["wrong"][0] == 0
    of_three = next(x for x in document["reliability"]["structures"] if x["name"] == "2 of 3")
    assert of_three["reliability"] == pytest.approx([0.974556, 0.306432], abs=5e-7)
    assert run(*words, "--out", "simulated", "--quiet").out == ""
    assert {path.name for path in Path("simulated").iterdir()} == {
        *("simulation.json", "summary.txt", "simulation.csv", "reliability.csv"),
        ".fdi-manifest.json",
    }


def test_one_scenario_is_simulated_as_asked_for(run: Run) -> None:
    words = ("--fail", "faulty", "--fail", "mute:3", "--loss", "0.1", "--seed", "4", "--runs", "20")
    document = json.loads(run("vote", "--simulate", "5", *words, "--json").out)
    (row,) = document["scenarios"]
    assert row["failures"] == [{"kind": "faulty", "autopilot": 1}, {"kind": "mute", "autopilot": 3}]
    assert (row["loss"], row["seed"], row["runs"]) == (0.1, 4, 20)
    assert row["name"] == "faulty 1, mute 3, 10 % of messages lost"


def test_reliability_is_told_in_hours_where_they_are_known(run: Run) -> None:
    page = run("vote", "--simulate", "3", "--runs", "5", "--mttf", "1000", "--flight", "100").out
    assert "R after 100 h" in page
    assert "0.974556" in page
    assert "833.333" in page
