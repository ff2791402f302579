"""The fault grid: both rules of marking by hand tables."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.decision import load_policy
from fdi.diagnosis import runs
from fdi.diagnosis.marking import MARKINGS, fault_grid

from .build import POLICY, alarms_of, bank_of, model, row

# A column is one moment: three tests of one fault (1 triggered, 0 quiet, -1 unknown), then what
# each rule says. In the first table every trigger is an alarm.
BY_STATE = np.array(
    [
        [0, 1, 1, 1, 1, 1, -1, 0, -1],
        [0, 0, 1, 1, 0, -1, -1, -1, 1],
        [0, 0, 0, 1, -1, -1, -1, -1, 1],
    ]
)
ALL_RESIDUALS = [0, 0, 0, 1, 0, 0, -1, 0, 0]
MAJORITY = [0, 0, 1, 1, 1, 1, -1, 0, 1]


@pytest.mark.parametrize(
    ("rule", "expected"), [("all_residuals", ALL_RESIDUALS), ("majority", MAJORITY)]
)
def test_marks_are_those_of_the_table(rule, expected):
    state = BY_STATE.astype(np.int8)
    assert MARKINGS[rule](state, state == 1).tolist() == expected


def test_majority_counts_alarms_where_the_published_rule_counts_triggers():
    state = np.array([[1, 1], [1, 1]], dtype=np.int8)
    alarm = np.array([[0, 1], [0, 0]], dtype=bool)
    assert MARKINGS["majority"](state, alarm).tolist() == [0, 1]
    assert MARKINGS["all_residuals"](state, alarm).tolist() == [1, 1]


def test_unknown_sample_inside_an_alarm_marks_nothing():
    state, alarm = np.array([[1, -1, 1]], dtype=np.int8), np.ones((1, 3), dtype=bool)
    assert MARKINGS["majority"](state, alarm).tolist() == [1, -1, 1]


def test_an_alarm_that_is_unknown_is_none_beside_a_test_that_is_quiet():
    state, alarm = np.array([[-1], [0]], dtype=np.int8), np.array([[True], [False]])
    assert MARKINGS["majority"](state, alarm).tolist() == [0]


SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "compass": ["y"]}


@pytest.mark.parametrize("policy", [POLICY, load_policy("paper")])
def test_fault_in_no_test_is_unknown_and_never_marked(policy):
    bank = bank_of(model(SHOWN))
    every = {place: [(0, 100)] for place in range(len(bank.generators))}
    grid = fault_grid(alarms_of(bank, every, policy=policy))
    marks = dict(zip(grid.faults, grid.marks, strict=True))
    assert (marks["COMPASS.y"] == -1).all()
    assert (marks["GPS.x"] == 1).all()


def test_grid_has_a_row_for_every_fault_with_its_component():
    bank = bank_of(model(SHOWN))
    grid = fault_grid(alarms_of(bank, {}))
    assert grid.faults == ("GPS.x", "BARO.x", "RADAR.x", "COMPASS.y")
    assert grid.components == tuple(SHOWN)
    assert not grid.marks.flags.writeable


@pytest.mark.parametrize(("rule", "both"), [("majority", True), ("all_residuals", False)])
def test_rule_of_the_policy_decides(rule, both):
    """One of two tests of each alarms: half, not all."""
    bank = bank_of(model(SHOWN))
    alarms = alarms_of(
        bank, {row(bank, "GPS.x", "BARO.x"): [(10, 20)]}, policy=replace(POLICY, marking=rule)
    )
    grid = fault_grid(alarms)
    for place in (0, 1):
        assert grid.intervals(place, 1) == ([[10.0, 20.0]] if both else [])
    assert grid.intervals(2, 1) == []


def test_frame_shows_unknown_as_nan():
    bank = bank_of(model(SHOWN))
    pair = row(bank, "GPS.x", "BARO.x")
    other = row(bank, "GPS.x", "RADAR.x")
    frame = fault_grid(
        alarms_of(bank, {pair: [(10, 20)]}, unknown={pair: [(50, 60)], other: [(55, 60)]})
    ).frame()
    assert frame.index.name == "t"
    assert frame.loc[[9.75, 10.0, 54.75], "GPS.x"].tolist() == [0.0, 1.0, 0.0]
    assert np.isnan(frame.loc[55.0, "GPS.x"])


@pytest.mark.parametrize(
    ("mask", "expected"),
    [
        ([0, 0, 0, 0], []),
        ([1, 0, 0, 1], [[0.0, 0.5], [1.5, 2.0]]),
        ([0, 1, 1, 0], [[0.5, 1.5]]),
        ([1, 1, 1, 1], [[0.0, 2.0]]),
    ],
)
def test_runs_are_half_open_and_the_last_sample_holds_one_more_step(mask, expected):
    assert runs(np.arange(4) / 2, np.array(mask, dtype=bool)) == expected


def test_runs_of_an_empty_grid_are_none():
    assert runs(np.empty(0), np.empty(0, dtype=bool)) == []


def test_a_grid_tells_what_is_marked_when():
    bank = bank_of(model(SHOWN))
    grid = fault_grid(
        alarms_of(
            bank,
            {row(bank, "GPS.x", "BARO.x"): [(10, 20), (30, 31)]},
            unknown={row(bank, "GPS.x", "BARO.x"): [(50, 60)]},
        )
    )
    assert grid.intervals(0, 1) == [[10.0, 20.0], [30.0, 31.0]]
    assert repr(grid) == "<FaultGrid: 2 of 4 faults marked, 400 samples>"
    shown = grid._repr_html_()
    assert "<td>GPS.x</td><td>gps</td><td>10.0 to 20.0, 30.0 to 31.0</td>" in shown
    assert "FaultGrid: 2 of 4 faults marked, 400 samples<" in shown
    assert "RADAR.x" not in shown


def test_a_single_sample_lasts_a_second():
    assert runs(np.array([5.0]), np.array([True])) == [[5.0, 6.0]]
