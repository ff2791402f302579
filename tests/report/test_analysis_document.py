"""What analysis.json holds: plain values, finite or null, intervals half open, rows by hand."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis import FaultGrid, Isolability
from fdi.report import analysis_document as document
from fdi.report.json_text import number
from fdi.report.model_document import isolability_rows

from .build import small_analysis


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return small_analysis(tmp_path_factory.mktemp("model"))


def leaves(tree, path=()):
    """Every value of a tree with its path."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def test_document_holds_plain_values_finite_or_null(analysis):
    for path, value in leaves(document(analysis)):
        assert value is None or type(value) in (str, bool, int, float), path
        assert not isinstance(value, float) or math.isfinite(value), path


def test_what_is_unknown_becomes_null(analysis):
    """A threshold that cannot be stated, a parameter of an unknown place, a time that never was."""
    threshold = np.full_like(analysis.alarms.threshold, np.nan)
    system = analysis.system
    lost = {n: replace(p, value=math.nan) for n, p in system.parameters.items()}
    made = document(
        replace(
            analysis,
            alarms=replace(analysis.alarms, threshold=threshold),
            system=replace(system, parameters=lost),
        )
    )
    assert {row["threshold"] for row in made["residuals"]} == {None}
    assert made["model"]["parameters"]["lowest"]["value"] is None
    assert made["log"]["flights"][0]["landing_s"] is None
    json.dumps(made, allow_nan=False)


def test_document_is_the_same_twice(analysis):
    assert json.dumps(document(analysis)) == json.dumps(document(analysis))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (None, None),
        (math.nan, None),
        (math.inf, None),
        (1 / 3, 0.333333333),
        (123456789.4, 123456789.0),
        (-0.25, -0.25),
        (np.float64(2), 2.0),
    ],
)
def test_number_has_nine_digits_or_is_null(value, expected):
    found = number(value)
    assert found == expected
    assert found is None or type(found) is float


def test_triggered_intervals_hold_exactly_the_triggered_samples(analysis):
    t = analysis.signals.t
    rows = {row["id"]: row for row in document(analysis)["residuals"]}
    for place, generator in enumerate(analysis.bank.generators):
        inside = np.zeros(len(t), dtype=bool)
        for start, end in rows[generator.id]["triggered"]:
            assert start < end
            inside |= (t >= start) & (t < end)
        assert np.array_equal(inside, analysis.alarms.state[place] == 1)
    assert any(row["triggered"] for row in rows.values())


def test_fault_grid_intervals_are_half_open_and_by_state(analysis):
    marks = np.array([[0, 1, 1, -1, 1]], dtype=np.int8)
    t = np.array([10.0, 10.5, 11.0, 11.5, 12.0])
    grid = FaultGrid(t, ("GPS_RAW_INT.alt",), ("gps",), ("sensor",), marks)
    made = document(replace(analysis, diagnosis=replace(analysis.diagnosis, grid=grid)))
    assert made["fault_grid"] == {
        "t": t.tolist(),
        "rows": [
            {
                "fault": "GPS_RAW_INT.alt",
                "component": "gps",
                "group": "sensor",
                "intervals": [[10.5, 11.5], [12.0, 12.5]],
                "unknown": [[11.5, 12.0]],
            }
        ],
    }


def test_isolability_rows_are_those_written_by_hand():
    value = Isolability(
        ("a", "b", "c"),
        np.array([True, True, False]),
        np.array([[0, 1, 1], [0, 0, 1], [0, 0, 0]], dtype=bool),
        (("a", "b"),),
    )
    assert isolability_rows(value) == {
        "detectable": ["a", "b"],
        "undetectable": ["c"],
        "isolability": {"faults": ["a", "b", "c"], "rows": ["011", "001", "000"]},
        "not_isolable_groups": [["a", "b"]],
    }


def test_moments_are_told_by_every_clock(analysis):
    (finding,) = document(analysis)["findings"]
    assert finding["onset"]["log_s"] == 40.0
    assert finding["onset"]["boot_s"] == 70.0  # the log began 30 s after boot
    assert finding["onset"]["utc"] == "2023-11-14T22:14:00.000Z"


def test_finding_without_an_end_has_null(analysis):
    (finding,) = analysis.findings
    lasting = replace(analysis.diagnosis, findings=(replace(finding, end=None),))
    assert document(replace(analysis, diagnosis=lasting))["findings"][0]["end"] is None


def test_sets_that_are_not_implementable_are_listed_with_the_reason(analysis):
    rows = document(analysis)["residuals"]
    refused = [row for row in rows if row["status"] != "ok"]
    assert len(refused) == len(analysis.bank.not_implementable)
    assert len({row["id"] for row in rows}) == len(rows)
    for row in rows:
        assert bool(row["why"]) == (row["status"] == "not implementable")
