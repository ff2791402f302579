"""The EKF failsafe of copters and EKF3's lanes, on columns made for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import ROOT

from fdi.methods.estimator import estimator_health
from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.cores import Change, Score, Selection
from fdi.methods.estimator.failsafe import checks_node, failsafe_tree
from fdi.methods.estimator.lanes import lane_tree
from fdi.methods.estimator.records import Core
from fdi.methods.estimator.tree import Node, path, walk
from fdi.telemetry import Event, Log, read

from .build import px4_log, status

T = np.arange(0.0, 40.0, 0.1)
GOOD = 0b11111
BAD = (T >= 20.0) & (T < 30.0)


@pytest.fixture
def log(tmp_path: Path) -> Log:
    return px4_log(tmp_path / "a.ulg", {"estimator_status": status(T)})


def core(**ratios: np.ndarray) -> Core:
    names = {"compass": 0.1, "velocity": 0.1, "horizontal position": 0.1, "height": 0.1}
    values = {n: ratios.get(n.replace(" ", "_"), np.full(T.size, v)) for n, v in names.items()}
    return Core(0, "X", T, values, {n: f"X.{n}" for n in names})


def checks(log: Log, flown: Core, bits: np.ndarray | None = None) -> Node:
    solution = np.full(T.size, GOOD) if bits is None else bits
    return checks_node(log, flown, (T, solution.astype(np.int64)), 0.8, "said")


@pytest.mark.parametrize(
    ("ratios", "trips"),
    [
        ({"compass": 0.9}, False),
        ({"velocity": 0.9}, False),
        ({"horizontal_position": 5.0}, False),
        ({"height": 5.0}, False),
        ({"compass": 0.9, "velocity": 0.9}, True),
        ({"compass": 0.9, "horizontal_position": 0.9}, True),
        ({"velocity": 0.9, "horizontal_position": 0.8}, True),
        ({"velocity": 0.9, "horizontal_position": 0.79}, False),
        ({"velocity": 1.6}, True),
    ],
    ids=str,
)
def test_two_of_three_ratios_trip_it_and_velocity_counts_twice(
    log: Log, ratios: dict[str, float], trips: bool
) -> None:
    columns = {name: np.where(BAD, value, 0.1) for name, value in ratios.items()}
    spans = checks(log, core(**columns)).spans
    assert spans is not None
    assert bool(spans) == trips
    if trips:
        assert spans[0] == (pytest.approx(20.9, abs=0.11), pytest.approx(30.9, abs=0.11))


@pytest.mark.parametrize(
    ("bits", "trips"),
    [
        (0b00000111, True),  # neither relative nor absolute position
        (0b00001111, False),  # relative
        (0b00010111, False),  # absolute
        (0b10011111, True),  # constant-position mode
    ],
)
def test_a_copter_without_a_position_trips_it(log: Log, bits: int, trips: bool) -> None:
    spans = checks(log, core(), np.where(BAD, bits, GOOD)).spans
    assert bool(spans) == trips


def test_what_is_shorter_than_a_second_does_not_trip_it(log: Log) -> None:
    brief = np.where((T >= 20.0) & (T < 20.85), 3.0, 0.1)
    assert checks(log, core(velocity=brief)).spans == ()


def test_without_ratios_and_solution_nothing_is_known(log: Log) -> None:
    empty = (np.empty(0), np.empty(0, np.int64))
    assert checks_node(log, Core(0, "X", T, {}, {}), empty, 0.8, "said").spans is None


def test_it_can_be_switched_off(tmp_path: Path) -> None:
    topics = {"estimator_status": status(T)}
    log = px4_log(tmp_path / "a.ulg", topics, parameters={"FS_EKF_THRESH": 0.0})
    tree = failsafe_tree(log, core(velocity=np.full(T.size, 9.0)), (T, np.full(T.size, GOOD)))
    assert tree.spans == ()
    assert tree.because == "switched off: FS_EKF_THRESH is 0"


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("text", "EKF Failsafe Cleared"),
        ("text", "EKF check is over"),  # of an ERR record
        ("disarm", ""),
        (None, ""),
    ],
)
def test_a_failsafe_lasts_until_it_is_cleared_or_the_vehicle_disarmed(
    log: Log, kind: str | None, text: str
) -> None:
    events = [Event(20.0, "failsafe", "EKF check: the estimator's variances are too large")]
    events += [Event(25.0, kind, text)] if kind else []  # type: ignore[arg-type]
    told = replace(log, reported=tuple(events), _cache={})
    tree = failsafe_tree(told, core(), (T, np.full(T.size, GOOD)))
    assert tree.spans == ((20.0, 25.0 if kind else told.span[1]),)


def lanes(log: Log, flown: Core, relative: np.ndarray | None = None) -> list[str]:
    error = np.zeros(T.size) if relative is None else relative
    score = Score(1, T, error, error, error, None)
    selection = Selection("X.PI", T, (T >= 25) * 1, (Change(25.0, 0, 1),), ())
    tree = lane_tree(log, flown, (score,), selection, Bits((), ()), checks(log, flown))
    return [node.name for node in path(tree)][-2:]


def test_a_lane_changes_for_a_score_above_one(log: Log) -> None:
    late = np.where(T >= 24.9, 1.2, 0.1)
    found = lanes(log, core(height=late))
    assert found == ["its score is above 1", "the selector changes the core"]


def test_a_lane_changes_for_a_better_one(log: Log) -> None:
    found = lanes(log, core(), np.where(T >= 24.9, -0.6, 0.0))
    assert found == ["another core is better", "the selector changes the core"]
    assert lanes(log, core(), np.where(T >= 24.9, 0.6, -0.4)) == ["the selector changes the core"]


def test_the_failsafes_check_asks_for_a_lane_one_count_before_it_trips(log: Log) -> None:
    lost = np.where(T >= 24.2, 0b111, GOOD)
    check = checks(log, core(), lost)
    selection = Selection("X.PI", T, (T >= 25) * 1, (Change(25.0, 0, 1),), ())
    tree = lane_tree(log, core(), (), selection, Bits((), ()), check)
    asked = path(tree)[-2]
    assert asked.name == "the EKF check asks for another core"
    assert asked.since == pytest.approx((check.since or 0.0) - 0.1)


def test_both_trees_say_that_a_limit_is_assumed() -> None:
    log = read(ROOT / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog")
    own = {name: value for name, value in log.parameters.items() if name != "FS_EKF_THRESH"}
    trees = estimator_health(replace(log, parameters=own)).trees
    limits = [node.because for tree in trees for node, _, _ in walk(tree) if node.gate == "two"]
    assert limits == ["limit 0.8 (ArduPilot's default)"] * 2


@pytest.mark.parametrize("kind", [np.nan, np.inf, 3.0, 11.0])
def test_a_kind_of_estimator_that_is_none_stops_nothing(kind: float) -> None:
    log = read(ROOT / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog")
    changed = replace(log, parameters={**log.parameters, "AHRS_EKF_TYPE": kind})
    assert estimator_health(changed).family.name == "ArduPilot EKF"
