"""The published analysis of a real crash, reproduced: figures, tests, thresholds, cells, marks.

Reference data: ../shared/paper (see paper_model.md there), recomputed by an independent program.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from fdi.decision import load_policy
from fdi.diagnosis import diagnose
from fdi.model import load_airframe
from fdi.residuals import build_bank
from fdi.structure import decompose, graph_components
from fdi.telemetry import Channel, read

HERE = Path(__file__).parent
PAPER = HERE.parents[1] / "shared" / "paper"
LOG = HERE.parents[1] / "shared" / "flights" / "paper" / "afrika.tlog"
pytestmark = pytest.mark.skipif(not PAPER.is_dir() or not LOG.is_file(), reason="no ../shared")

FIGURES = {  # equations, faults, unknowns, graph components, redundancy, MTES, detectable
    "77": (116, 77, 59, 32, 57, 147, 71),
    "79": (120, 79, 61, 34, 59, 149, 73),
}
RESTRICTED = {"77": 108, "79": 110}
FULL = {"77": 120, "79": 122}


def load(name):
    return json.loads((PAPER / name).read_text(encoding="utf-8"))


def named(fault):
    """The name of a fault in the published notation."""
    return str(Channel.parse(fault))


@pytest.fixture(scope="module", params=["77", "79"])
def case(request):
    """Model, reference, and the analysis by the published recipe."""
    reference = load("reference.json")["models"][request.param]
    labels = {  # of the published equations, by our names
        entry["label"]: named(entry["fault"]) if entry.get("fault") else entry["label"]
        for entry in load(f"model_{request.param}.json")["equations"]
    }
    system = load_airframe(HERE / "models" / f"paper_{request.param}.yaml").observe(read(LOG))
    policy = load_policy("paper").resample(window=(2000.0, 2332.0), rate_hz=1.0)
    bank = build_bank(system, policy.tests)
    residuals = bank.evaluate(
        read(LOG).signals(system.channels, policy.sampling), policy.differentiation
    )
    alarms = policy.decide(residuals)
    return request.param, reference, labels, bank, alarms, diagnose(alarms, bank)


def marked(diagnosis):
    rows = zip(diagnosis.grid.faults, diagnosis.grid.marks, strict=True)
    return {fault: np.flatnonzero(marks == 1).tolist() for fault, marks in rows}


def equations_of(bank, numbers):
    return frozenset(bank.system.equations[i].name for i in numbers)


def published_generators(reference, labels):
    """Reference tests that have a generator, by their equations in our names."""
    return {
        frozenset(labels[name] for name in test["equations"]): test
        for test in reference["tests"]
        if test["generator"]
    }


def test_figures_are_those_of_the_paper(case):
    name, _, _, bank, _, diagnosis = case
    system = bank.system
    structure = system.structure()
    assert (
        len(system.equations),
        len(system.faults),
        len(system.unknowns),
        len(graph_components(structure)),
        decompose(structure).redundancy,
        len(bank.generators) + len(bank.not_implementable),
        int(diagnosis.implementable.detectable.sum()),
    ) == FIGURES[name]


def test_number_of_generators_is_that_of_the_paper(case):
    name, _, _, bank, _, _ = case
    assert sum(generator.restricted for generator in bank.generators) == RESTRICTED[name]
    assert len(bank.generators) == FULL[name]


def test_sets_equal_the_reference_one_by_one(case):
    _, reference, labels, bank, _, _ = case
    sets = [
        *(equations_of(bank, g.equations) for g in bank.generators),
        *(equations_of(bank, n.equations) for n in bank.not_implementable),
    ]
    # The one set with redundancy two keeps both limits; its generator needs only the first.
    expected = {frozenset(labels[n] for n in t["equations"]) for t in reference["tests"]}
    double = {s for s in expected if {"l17", "e5"} <= s}
    assert len(double) == 1
    assert set(sets) == (expected - double) | {s - {"e5"} for s in double}
    assert len(sets) == len(expected)


def test_generators_are_those_of_the_reference(case):
    _, reference, labels, bank, _, _ = case
    expected = published_generators(reference, labels)
    for generator in bank.generators:
        own = equations_of(bank, generator.equations)
        test = expected[own if own in expected else own | {"e5"}]
        assert generator.restricted == (test["generator"] == "published")
        assert set(generator.faults) == {named(fault) for fault in test["faults"]}


def test_groups_are_those_of_table_iv(case):
    _, reference, _, _, _, diagnosis = case
    for found, key in ((diagnosis.implementable, "full_rules"), (diagnosis.structural, "all_mtes")):
        groups = reference["isolability"][key]["groups_as_in_table_IV"]
        assert {frozenset(g) for g in found.groups} == {frozenset(map(named, g)) for g in groups}


def test_course_is_isolable_from_the_wind_but_not_the_wind_from_it(case):
    *_, diagnosis = case
    faults = list(diagnosis.implementable.faults)
    cog = faults.index("GPS_RAW_INT.cog")
    wind = [faults.index(f"WIND.{field}") for field in ("direction", "speed")]
    assert diagnosis.implementable.matrix[cog, wind].all()
    assert not diagnosis.implementable.matrix[wind, cog].any()
    assert diagnosis.structural.matrix[wind, cog].all()


def test_all_published_cells_and_no_other_in_these_rows(case):
    *_, diagnosis = case
    grid = load("fault_grid.json")
    rows = {named(row["fault"]): set(row["t_paper"]) for row in grid["rows"]}
    further = {
        named(fault): set(cells)
        for fault, cells in grid["algorithm_rows_not_in_figure"][
            "removed_by_hand_in_the_figure"
        ].items()
    }
    low, high = grid["window_t_paper"]
    found = {
        fault: {k for k in cells if low <= k <= high} for fault, cells in marked(diagnosis).items()
    }
    assert sum(map(len, rows.values())) == 144
    assert {fault: cells for fault, cells in found.items() if cells} == rows | further


def test_marks_over_the_whole_window_equal_the_reference(case):
    _, reference, _, _, _, diagnosis = case
    expected = reference["fault_marks_t_paper_0_332"]["full_rules"]
    found = {fault: cells for fault, cells in marked(diagnosis).items() if cells}
    assert found == {named(fault): cells for fault, cells in expected.items() if cells}


def compared(bank, reference, labels, kind):
    """Row, generator and reference test for the generators of one kind."""
    expected = published_generators(reference, labels)
    for row, generator in enumerate(bank.generators):
        own = equations_of(bank, generator.equations)
        test = expected[own if own in expected else own | {"e5"}]
        if test["generator"] == kind:
            yield row, generator, test


def test_triggered_seconds_equal_the_reference(case):
    name, reference, labels, bank, alarms, _ = case
    rows = list(compared(bank, reference, labels, "published"))
    for row, _, test in rows:
        assert np.flatnonzero(alarms.state[row] == 1).tolist() == test["triggered_t_paper"]
    assert len(rows) == RESTRICTED[name]


def test_thresholds_agree_where_the_residual_equation_is_the_same(case):
    name, reference, labels, bank, alarms, _ = case
    rows = [
        (alarms.threshold[row, 0], test["threshold"])
        for row, generator, test in compared(bank, reference, labels, "published")
        if labels[test["residual_equation"]] == bank.system.equations[generator.residual].name
    ]
    for found, expected in rows:
        assert found == pytest.approx(expected, rel=1e-4, abs=1e-12)
    assert len(rows) > 0.9 * RESTRICTED[name]


def test_loops_find_the_velocity_and_not_its_reverse(case):
    """The reference took v_n = v_ground*cos(cog) for what tan(cog) = v_e/v_n leaves open."""
    _, reference, labels, bank, alarms, _ = case
    rows = list(compared(bank, reference, labels, "algebraic loop"))
    assert len(rows) == 12
    for row, _, test in rows:
        assert 0.5 < alarms.threshold[row, 0] / test["threshold"] < 2.0  # the reverse has 20
