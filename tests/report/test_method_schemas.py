"""What ``fdi estimator --json`` and ``fdi vote --json`` print keeps its schema, for any log."""

import json
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from flights import EXAMPLES, SHARED
from methods.estimator.build import RATIOS, px4_log, status
from methods.voting.build import CONDITIONS, autopilot

from fdi.methods.estimator import estimator_health
from fdi.methods.voting import PRESETS, Scenario, Settings, vote
from fdi.methods.voting.scenarios import parse_failures, run_one, run_standard
from fdi.report.estimator_document import estimator_document
from fdi.report.json_text import json_text
from fdi.report.reliability_text import Units
from fdi.report.simulation_text import simulation_document
from fdi.report.vote_document import vote_document
from fdi.telemetry import read

HEALTHY = EXAMPLES.parent / "healthy_logs"
OWN = [*sorted(EXAMPLES.glob("*.tlog")), *sorted(HEALTHY.glob("*.tlog"))]
OTHERS = (
    "triplex/gps_fail/instance_0.ulg",
    "crash/ekf_selector_whipsaw.ulg",
    "crash/motors_cut_in_air.ulg",
    "crash/motor2_lost.bin",
    "healthy/no_battery_monitor.ulg",
    "paper/afrika.tlog",
    "sitl/copter/c62_gps_loss_30s_wind.BIN",
)
TRIPLEX = (
    ("triplex/gps_fail/instance_0.ulg",),
    ("triplex/comm_fail/instance_0.ulg", "triplex/comm_fail/instance_1.ulg"),
)
T = np.arange(0.0, 40.0, 0.2)
LOST = {name: (lambda t: t >= 20.2) for name in CONDITIONS[3:6]}
Document = dict[str, Any]
Damage = Callable[[Document], Any]
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")


def check(document: Document, name: str) -> None:
    schema = json.loads(files("fdi.report").joinpath(f"{name}.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(json.loads(json_text(document)))


def estimator(path: Path) -> Document:
    log = read(path)
    return estimator_document(log, estimator_health(log))


def simulated(settings: Settings = PRESETS["recorded"]) -> Document:
    failures = parse_failures(["dead"])
    scenario = Scenario(3, failures, outside=True, loss=0.2)
    rows = run_one((3, 4), scenario, settings, runs=5, seed=0)
    return simulation_document(rows, settings, Units((3, 4), 1000.0, 1.0, 0.9))


@pytest.fixture
def voted(tmp_path: Path) -> Document:
    path = tmp_path / "one.ulg"
    path.write_bytes(autopilot(1, bad=LOST))
    return vote_document(vote([read(path)], onset=15.0))


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.stem)
def test_an_estimators_document_keeps_its_schema(path: Path) -> None:
    check(estimator(path), "estimator")


@needs_shared
@pytest.mark.parametrize("name", OTHERS)
def test_that_of_any_format_does(name: str) -> None:
    check(estimator(SHARED / name), "estimator")


def test_that_of_a_log_that_tells_nothing_does(tmp_path: Path) -> None:
    unknown = {name: np.full(T.size, np.nan) for name in RATIOS}
    px4_log(tmp_path / "unknown.ulg", {"estimator_status": status(T, **unknown)}, release=None)
    check(estimator(tmp_path / "unknown.ulg"), "estimator")
    px4_log(tmp_path / "one_record.ulg", {"estimator_status": status(T[:1])})
    check(estimator(tmp_path / "one_record.ulg"), "estimator")


def test_a_votes_document_keeps_its_schema(voted: Document) -> None:
    assert voted["reactions"]
    check(voted, "vote")


def test_that_of_a_what_if_does(tmp_path: Path) -> None:
    path = tmp_path / "one.ulg"
    path.write_bytes(autopilot(1, bad=LOST))
    settings = Settings("thesis", ("failsafe",), transport=0.1, quorum=2, age_from="received")
    found, usual = vote([read(path)], settings), vote([read(path)], "thesis")
    document = vote_document(found, usual)
    assert document["reactions_of_the_preset"]
    check(document, "vote")


@needs_shared
@pytest.mark.parametrize("names", TRIPLEX, ids=("gps", "communication"))
def test_that_of_the_published_logs_does(names: tuple[str, ...]) -> None:
    check(vote_document(vote([read(SHARED / name) for name in names])), "vote")


def test_simulations_documents_keep_the_schema_of_votes() -> None:
    settings = PRESETS["recorded"]
    check(simulated(), "vote")
    rows = run_standard((2, 3), settings, runs=5, seed=0)
    check(simulation_document(rows, settings, Units((2, 3))), "vote")


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(extra=1),
        lambda d: d.pop("notes"),
        lambda d: d["ratios"][0].update(quantity="odd"),
        lambda d: d["ratios"][0].update(largest="2"),
        lambda d: d["ratios"][0]["rises_s"].append([1.0]),
        lambda d: d["trees"][0]["tree"]["children"][0].pop("gate"),
        lambda d: d["trees"][0]["tree"]["children"][0].update(extra=1),
        lambda d: d["findings"].append({"kind": "odd"}),
    ],
)
def test_the_schema_of_the_estimator_is_strict(damage: Damage) -> None:
    document = estimator(EXAMPLES / "copter_motor_failure_crash.tlog")
    damage(document)
    with pytest.raises(jsonschema.ValidationError):
        check(document, "estimator")


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(extra=1),
        lambda d: d.pop("errors"),
        lambda d: d["settings"].update(preset="odd"),
        lambda d: d["autopilots"][0]["votes"].append([1.0]),
        lambda d: d["autopilots"][0]["errors"].update(one=[[1.0, 0]]),
        lambda d: d["reactions"][0].update(cause="odd"),
        lambda d: d["reactions"][0].pop("takeover_s"),
    ],
)
def test_the_schema_of_votes_is_strict(voted: Document, damage: Damage) -> None:
    damage(voted)
    with pytest.raises(jsonschema.ValidationError):
        check(voted, "vote")


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(verdict="a simulation has none"),
        lambda d: d["scenarios"][0].update(loss=1.2),
        lambda d: d["scenarios"][0].update(wrong=[0.5]),
        lambda d: d["reliability"]["structures"][0].pop("needed"),
    ],
)
def test_the_schema_of_simulations_is_strict(damage: Damage) -> None:
    document = simulated()
    damage(document)
    with pytest.raises(jsonschema.ValidationError):
        check(document, "vote")
