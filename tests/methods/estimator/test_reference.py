"""Flights whose estimator is known: what the notes on estimators say of them is found again."""

import json
from functools import lru_cache

import numpy as np
import pytest
from flights import SHARED

from fdi.methods.estimator import EstimatorHealth, estimator_health
from fdi.methods.estimator.records import cores_of, family_of, flown
from fdi.methods.estimator.tree import Node, first_path, path, unexplained, walk, without_effect
from fdi.methods.estimator.validity import validity_tree
from fdi.telemetry import Log, read

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
VECTORS = SHARED.parent / "methods" / "voter_reference.json"
GPS = "triplex/gps_fail/instance_0.ulg"
TRIPLEX = {
    GPS: ("gps_fail", 0),
    "triplex/comm_fail/instance_0.ulg": ("communication_fail", 0),
    "triplex/comm_fail/instance_1.ulg": ("communication_fail", 1),
}
CUT = "crash/motors_cut_in_air.ulg"
WHIPSAW = "crash/ekf_selector_whipsaw.ulg"
PAIR = "sitl/copter/c62_gps_loss_30s_wind"
RECORD_S = 0.001
FLAGS = {
    "local position invalid": "condition_local_position_valid",
    "local velocity invalid": "condition_local_velocity_valid",
    "global position invalid": "condition_global_position_valid",
    "height invalid": "condition_local_altitude_valid",
    "angular velocity invalid": "condition_angular_velocity_valid",
}


@lru_cache
def log_of(name: str) -> Log:
    return read(SHARED / name)


@lru_cache
def health_of(name: str) -> EstimatorHealth:
    return estimator_health(log_of(name))


@lru_cache
def recorded(test: str, number: int) -> dict:  # type: ignore[type-arg]
    logs = json.loads(VECTORS.read_text())["logs"]
    return next(one for one in logs if (one["test"], one["instance"]) == (test, number))


def whole_tree(name: str) -> Node:
    """Return the validity tree of the whole log, not cut to the flight."""
    log, health = log_of(name), health_of(name)
    family = family_of(log)
    core = flown(log, family, cores_of(log, family))
    return validity_tree(log, health.bits, 0, core, 0.0)


def test_gps_failure_leads_to_the_failsafe_step_by_step() -> None:
    tree = health_of(GPS).trees[0]
    found = [(node.name, node.since, node.resolution) for node in path(tree)]
    expected = [
        ("no GPS measurement", 37.616),
        ("dead reckoning", 38.668),
        ("nothing to hold the position by for 5 s", 42.616),
        ("the estimator gives up its solution (xy_valid)", 42.616),
        ("local position invalid", 42.628),
        ("the commander is in failsafe", 42.628),
    ]
    assert [name for name, _, _ in found] == [name for name, _ in expected]
    for (_, since, step), (_, t) in zip(found, expected, strict=True):
        assert since == pytest.approx(t, abs=max(step, RECORD_S))
    times = {name: since for name, since, _ in found}
    assert times["no GPS measurement"] == pytest.approx(37.616, abs=RECORD_S)
    assert times["dead reckoning"] == pytest.approx(38.668, abs=RECORD_S)
    assert times["local position invalid"] == pytest.approx(42.628, abs=RECORD_S)


def test_the_first_complaint_is_the_failsafe_s_and_no_flicker_of_the_attitude() -> None:
    complaint = health_of(GPS).complaint
    assert complaint is not None
    assert complaint.t == pytest.approx(42.628, abs=RECORD_S)


def test_three_flags_fall_together_with_the_failsafe() -> None:
    tree = health_of(GPS).trees[0]
    fallen = {child.name: child.since for child in tree.children if child.since is not None}
    fallen.pop("attitude invalid")  # falls and rises all the time in these logs
    assert set(fallen) == {
        "local position invalid",
        "local velocity invalid",
        "global position invalid",
    }
    assert list(fallen.values()) == pytest.approx([42.628] * 3, abs=RECORD_S)


@pytest.mark.parametrize("name", TRIPLEX)
def test_commanders_flags_are_those_of_the_record(name: str) -> None:
    own = recorded(*TRIPLEX[name])["own_flags"]
    tree = whole_tree(name)
    nodes = {child.name: child for child in tree.children}
    for title, field in FLAGS.items():
        spans = nodes[title].spans
        assert spans is not None
        falls = [t for t, value in own[field] if value == 0]
        # the record begins before the log's first time, which is 0
        assert [low for low, _ in spans] == pytest.approx([max(t, 0.0) for t in falls], abs=2e-3)
    changes = [t for t, value in own["failsafe"] if value == 1]
    assert [low for low, _ in tree.spans or ()] == pytest.approx(changes, abs=2e-3)


@pytest.mark.parametrize("name", TRIPLEX)
def test_attitude_flag_changes_as_often_as_in_the_record(name: str) -> None:
    nodes = {child.name: child for child in whole_tree(name).children}
    spans = nodes["attitude invalid"].spans or ()
    changes = recorded(*TRIPLEX[name])["own_attitude_flag_changes"]
    assert spans[0][0] == 0.0  # it begins invalid: the first change is a rise
    assert len(spans) == 1 + changes // 2


def test_selected_core_changes_as_in_the_notes() -> None:
    (change,) = health_of(GPS).selection.changes
    assert (change.before, change.after) == (0, 3)
    assert change.t == pytest.approx(47.620, abs=RECORD_S)
    for name in TRIPLEX:
        if name != GPS:
            assert health_of(name).selection.changes == ()


def test_combined_ratio_is_reproduced_where_a_record_of_the_ratios_is_near() -> None:
    scores = [score for name in TRIPLEX for score in health_of(name).scores]
    exact = sum((score.reproduced or 0.0) * score.t.size for score in scores)
    total = sum(score.t.size for score in scores)
    assert total == 1104
    assert exact / total > 0.85  # five records a second; the selector compares at every update
    for score in scores:
        known = np.isfinite(score.combined) & np.isfinite(score.by_rule)
        assert np.quantile(np.abs(score.combined - score.by_rule)[known], 0.85) <= 1e-2


def test_innovations_carry_the_logged_ratios_which_are_squares_over_the_gate() -> None:
    health = health_of(GPS)
    status = log_of(GPS)["estimator_status"]
    found = {one.channel: one for one in health.innovations}
    one = found["estimator_innovations.gps_hpos[0]"]
    assert one.variance is not None
    assert one.ratio is not None
    fused = (one.t > 6.0) & (one.t < 47.0)
    # element 0 holds the larger of both axes, so that one axis gives no more than it
    with np.errstate(divide="ignore", invalid="ignore"):
        by_gate = one.value**2 / (5.0**2 * one.variance)
    known = fused & np.isfinite(by_gate)
    assert np.all(by_gate[known] <= one.ratio[known] * (1 + 1e-5) + 1e-9)
    latest = np.searchsorted(status.t, one.t[known], side="right") - 1
    root = status.si("pos_test_ratio")[latest]
    near = np.abs(np.sqrt(one.ratio[known]) - root) < 0.02
    assert near.mean() > 0.9


def test_sources_that_are_no_longer_fused_stand_still() -> None:
    still = [one for one in health_of(GPS).findings if "stands still" in one.text]
    assert {one.text.partition(" is ")[0] for one in still} == {"velocity", "horizontal position"}
    assert all(37.616 <= one.t <= 38.1 for one in still)
    falls = [one for one in health_of(GPS).findings if "GPS is no longer used" in one.text]
    assert [one.t for one in falls] == pytest.approx([47.62], abs=RECORD_S)


def test_solution_bits_of_the_flight() -> None:
    bits = health_of(GPS).bits
    solution = {b.name for b in bits.of("solution") if b.core == 0 and _is_set(b.spans, 30.0)}
    assert solution == {
        "attitude",
        "velocity_horiz",
        "velocity_vert",
        "pos_horiz_rel",
        "pos_horiz_abs",
        "pos_vert_abs",
        "pred_pos_horiz_rel",
        "pred_pos_horiz_abs",
    }  # 0x33f
    later = {b.name for b in bits.of("solution") if b.core == 0 and _is_set(b.spans, 48.0)}
    assert later == {"attitude", "velocity_vert", "pos_vert_abs", "const_pos_mode"}  # 0xa5


def _is_set(spans: tuple[tuple[float, float], ...], t: float) -> bool:
    return any(low <= t < high for low, high in spans)


def test_roll_over_comes_before_the_complaint_where_the_motors_were_cut() -> None:
    health = health_of(CUT)
    assert health.upset is not None
    assert health.complaint is not None
    assert health.complaint.t - health.upset.t == pytest.approx(3.2, abs=0.05)
    (said,) = [one for one in health.findings if one.kind == "consequence"]
    assert "3.2 s before the estimator first complains" in said.text
    assert all(one.is_late for one in health.findings if one.kind == "rejected")


def test_a_mask_of_1_15_agrees_with_the_topic_that_names_the_bits() -> None:
    log = log_of(CUT)
    flags, status = log["estimator_status_flags"], log["estimator_status"]
    latest = np.searchsorted(flags.t, status.t, side="right") - 1
    named = flags.si("fs_bad_acc_vertical")[np.maximum(latest, 0)] > 0
    mask = status.si("filter_fault_flags").astype(int)
    assert set(mask) == {0, 1 << 10}  # where masks.json has bad_acc_vertical from 1.15 on
    assert np.mean((mask > 0) == named) > 0.99  # but for the records at its beginning and end


@pytest.mark.parametrize("name", sorted(TRIPLEX))
def test_an_attitude_flag_of_1_12_without_a_cause_is_told_as_unexplained(name: str) -> None:
    (top, *_) = health_of(name).trees
    attitude = next(child for child in top.children if child.name == "attitude invalid")
    assert attitude.spans
    assert unexplained(attitude) == attitude.spans  # neither stale nor a quaternion that is none
    assert without_effect(top, attitude)  # and no failsafe came of it


def test_selector_whipsaw_of_a_fixed_wing() -> None:
    health = health_of(WHIPSAW)
    assert log_of(WHIPSAW).vehicle == "plane"
    assert len(health.selection.changes) == 15
    (said,) = [one for one in health.findings if one.kind == "whipsaw"]
    assert said.t == pytest.approx(190.894, abs=0.01)
    assert said.end == pytest.approx(284.229, abs=0.01)
    reasons = [change.reason for change in health.selection.changes if change.before == 1]
    assert set(reasons) == {"filter fault"}
    tree = next(tree for tree in health.trees if tree.name == "estimator 1 is unhealthy")
    names = [node.name for node in path(tree)]
    assert names == ["bad_acc_clipping", "filter fault", "estimator 1 is unhealthy"]


def test_tlog_and_bin_of_one_flight_give_the_same_trees() -> None:
    told = []
    for ending in (".tlog", ".BIN"):
        log, health = log_of(PAIR + ending), health_of(PAIR + ending)
        boot = log.clock.boot(0.0)
        assert boot is not None
        told.append(
            [
                (
                    [(n.name, n.gate, depth) for n, depth, _ in walk(tree)],
                    [(n.name, (n.since or 0.0) + boot) for n in path(tree)],
                )
                for tree in health.trees
            ]
        )
    for (shape, steps), (other, again) in zip(*told, strict=True):
        assert shape == other
        assert [name for name, _ in steps] == [name for name, _ in again]
        # the telemetry has two records a second
        assert [t for _, t in steps] == pytest.approx([t for _, t in again], abs=0.6)
    (names,) = [[name for name, _ in steps] for _, steps in told[0][:1]]
    assert names == [
        "no GPS measurement",
        "no horizontal position",
        "EKF check failed for 1 s",
        "EKF failsafe",
    ]


def test_tlog_and_bin_of_one_flight_have_ratios_of_one_scale() -> None:
    tlog, dataflash = (
        {r.quantity: r.peak for r in health_of(PAIR + e).ratios} for e in (".tlog", ".BIN")
    )
    assert tlog.keys() == dataflash.keys()
    for quantity, peak in tlog.items():
        assert dataflash[quantity] == pytest.approx(peak, abs=0.05), quantity


def test_ardupilots_score_is_the_log_s_within_its_rounding() -> None:
    for score in health_of(PAIR + ".BIN").scores:
        known = np.isfinite(score.combined) & np.isfinite(score.by_rule)
        assert np.abs(score.combined - score.by_rule)[known].max() < 0.02


def test_a_slow_drift_of_gps_is_told_as_one() -> None:
    found = health_of("sitl/long/l21_copter_gps_drift_0.2ms.tlog").findings
    assert any(f.kind == "drift" and f.text.startswith("horizontal position") for f in found)


@pytest.mark.parametrize(
    "name",
    [
        "triplex/comm_fail/instance_1.ulg",
        "propeller_cut/good_prop_hover_1.bin",
        "sitl/copter/c01_ref_slow_line.BIN",
        "sitl/copter/c03_ref_square_wind.tlog",
        "sitl/plane/p01_rect_calm.BIN",
        "sitl/long/l04_hexa_strong_gusts.tlog",
        "healthy/no_battery_monitor.ulg",
    ],
)
def test_nothing_is_lost_in_healthy_flights(name: str) -> None:
    health = health_of(name)
    kinds = {one.kind for one in health.findings}
    assert not kinds & {"not fused", "whipsaw", "rejected", "consequence", "before symptom"}
    tops = [
        tree
        for tree in health.trees
        if tree.name in ("EKF failsafe", "the commander is in failsafe")
    ]
    assert all(tree.since is None for tree in tops)


@pytest.mark.parametrize(
    ("name", "family", "cores"),
    [
        ("real/dronekit_171.bin", "ArduPilot EKF1", 1),
        ("others/btp_13.BIN", "ArduPilot EKF2", 2),
        ("others/belito_04.BIN", "ArduPilot EKF3", 2),
        ("healthy/mission_1hz.tlog", "ArduPilot EKF", 1),
        (GPS, "PX4 EKF2", 6),
        ("real/pyulog_sample.ulg", "PX4 LPE", 1),
    ],
)
def test_every_estimator_is_recognised(name: str, family: str, cores: int) -> None:
    health = health_of(name)
    assert (health.family.name, len(health.cores)) == (family, cores)
    for tree in health.trees:
        for node in first_path(tree):
            assert node.since is not None
