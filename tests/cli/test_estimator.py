"""``fdi estimator``: what it prints and writes, and a sentence for everything that lacks."""

import json
from pathlib import Path

import numpy as np
import pytest
from methods.estimator.build import RATIOS, px4_log, status

from .conftest import LOG, Run

T = np.arange(0.0, 40.0, 0.2)
FILES = {
    ".fdi-manifest.json",
    "estimator.json",
    "estimator.txt",
    "ratios.png",
    "ratios.svg",
    "trees.png",
    "trees.svg",
}


@pytest.fixture
def ulog(tmp_path: Path) -> Path:
    path = tmp_path / "one_core.ulg"
    fault = np.where((T > 20) & (T < 22), 4.0, 0.0)
    unused = np.full(T.size, np.nan)
    columns = status(T, filter_fault_flags=fault, tas_test_ratio=unused)
    px4_log(path, {"estimator_status": columns}, release=None)
    return path


def test_it_prints_a_page(run: Run) -> None:
    ended = run("estimator", LOG)
    assert ended.code == 0
    assert ended.err == ""
    assert "Test ratios of the core that flew" in ended.out
    assert "Tree: EKF failsafe" in ended.out


def test_json_is_a_document_and_nothing_else(run: Run) -> None:
    ended = run("estimator", LOG, "--json")
    assert ended.code == 0
    document = json.loads(ended.out)
    assert document["schema_version"] == 1
    assert {one["quantity"] for one in document["ratios"]} >= {"velocity", "compass"}
    assert next(tree["tree"]["name"] for tree in document["trees"]) == "EKF failsafe"


def test_json_is_the_same_every_time(run: Run) -> None:
    assert run("estimator", LOG, "--json").out == run("estimator", LOG, "--json").out


def test_a_folder_holds_text_json_and_figures_the_same_every_time(run: Run) -> None:
    assert run("estimator", LOG, "--out", "a").code == 0
    assert run("estimator", LOG, "--out", "b").code == 0
    assert {path.name for path in Path("a").iterdir()} == FILES
    for name in FILES:
        assert Path("a", name).read_bytes() == Path("b", name).read_bytes(), name
    svg = Path("a", "trees.svg").read_text()
    assert svg.startswith("<?xml")


def test_a_folder_of_somebody_else_is_5(run: Run) -> None:
    Path("mine").mkdir()
    Path("mine", "notes.txt").write_text("x")
    ended = run("estimator", LOG, "--out", "mine")
    assert ended.code == 5
    assert ended.err.count("\n") == 1
    assert run("estimator", LOG, "--out", "mine", "--force").code == 0
    assert Path("mine", "notes.txt").read_text() == "x"


def test_a_log_without_a_message_of_an_estimator_is_3(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "none.ulg"
    px4_log(path, {"wave": (T, {"x": T})})
    ended = run("estimator", path)
    assert ended.code == 3
    assert ended.out == ""
    assert ended.err.startswith("fdi: none.ulg: holds no message of an estimator's health")
    assert ended.err.count("\n") == 1


def test_a_missing_log_is_3(run: Run) -> None:
    ended = run("estimator", "nowhere.bin")
    assert ended.code == 3
    assert ended.err.count("\n") == 1


def test_a_flight_that_is_not_there_is_2(run: Run) -> None:
    ended = run("estimator", LOG, "--flight", 9)
    assert ended.code == 2
    assert "has no flight 9 (it has 1)" in ended.err


def test_a_system_that_is_not_there_is_told(run: Run) -> None:
    ended = run("estimator", LOG, "--system", 99)
    assert ended.code in (2, 3)
    assert ended.err.count("\n") == 1


def test_one_core_unknown_firmware_and_unused_entries_are_told(run: Run, ulog: Path) -> None:
    ended = run("estimator", ulog)
    assert ended.code == 0
    said = " ".join(ended.out.split())
    assert "one core only is in this log: there is no other to compare it with" in said
    assert (
        "estimator_status.filter_fault_flags: the log does not say which firmware wrote it: "
        "bits by number"
    ) in said
    assert "filter fault bit 2 of the estimator" in said
    assert "not used, or not in this log: the ratio of airspeed" in said
    assert "innovations are not in this log" in said


def test_no_ratio_at_all_is_no_praise(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "unknown.ulg"
    unknown = {name: np.full(T.size, np.nan) for name in RATIOS}
    px4_log(path, {"estimator_status": status(T, **unknown)})
    ended = run("estimator", path, "--out", "a")
    assert ended.code == 0
    assert "the log has no test ratios: little could be looked at" in ended.out
    assert "no source lost" not in ended.out


def test_without_an_own_level_nobody_says_that_no_rise_was_seen(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "short.ulg"
    px4_log(path, {"estimator_status": status(T[:3])})
    said = " ".join(run("estimator", path).out.split())
    assert "no source lost, no rejection, no whipsaw" in said
    assert "so that no rise can show: fewer than 4 records in the first 20 s" in said


def test_a_log_without_a_flight_is_told_of_as_a_log(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "ground.ulg"
    flags = {"condition_local_position_valid": np.zeros(T.size)}
    topics = {"estimator_status": status(T), "vehicle_status_flags": (T, flags)}
    px4_log(path, topics)
    said = " ".join(run("estimator", path).out.split())
    assert "local position invalid (held at the beginning already)" in said
    assert "take-off already" not in said
    assert "in the flight" not in said


def test_a_tree_with_nodes_that_are_not_known_is_no_praise(run: Run) -> None:
    log = LOG.parents[1] / "healthy_logs" / "copter_gusts.tlog"
    said = " ".join(run("estimator", log).out.split())
    assert "nothing in it became true in the flight, as far as this log tells" in said


def test_bits_are_told_of_the_flight_and_of_no_other_time(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "later.ulg"
    fault = np.where((T > 10) & (T < 12) | (T > 35), 4.0, 0.0)
    px4_log(path, {"estimator_status": status(T, filter_fault_flags=fault)})
    monkeypatch.setattr(
        "fdi.methods.estimator.health._when", lambda log, flight: (None, (5.0, 30.0), (4.0, 31.0))
    )
    out = run("estimator", path).out
    row = next(line for line in out.splitlines() if line.startswith("fault "))
    assert row.split()[-3:] == ["10.2", "to", "12.0"]
