"""The published MAVLink model: the figures of shared/paper/paper_model.md, section 6."""

import json

import pytest

from fdi.structure import (
    count_bound,
    decompose,
    detectable,
    graph_components,
    isolability,
    members,
    mso_sets,
    mtes_sets,
)
from fdi.structure.isolability import not_isolable_groups

from .models import SHARED, needs_shared, paper_model

pytestmark = [needs_shared, pytest.mark.parametrize("faults", [77, 79])]

FIGURES = {  # equations, unknowns, redundancy, graph components, MTES, MSO sets, detectable
    77: (116, 59, 57, 32, 147, 290, 71),
    79: (120, 61, 59, 34, 149, 292, 73),
}


def reference(faults):
    path = SHARED / "paper" / "reference.json"
    return json.loads(path.read_text(encoding="utf-8"))["models"][str(faults)]


def test_counts_are_those_of_the_paper(faults):
    model = paper_model(faults)
    assert len(model.faults) == faults
    assert (
        len(model.equations),
        len(model.unknowns),
        decompose(model).redundancy,
        len(graph_components(model)),
        sum(1 for _ in mtes_sets(model)),
        sum(1 for _ in mso_sets(model)),
        int(detectable(model).sum()),
    ) == FIGURES[faults]


def test_mtes_by_component_are_the_published_tests(faults):
    model = paper_model(faults)
    found = {
        frozenset(model.equations[e] for e in members(bits))
        for bits in mtes_sets(model, by_component=True)
    }
    assert found == {frozenset(test["equations"]) for test in reference(faults)["tests"]}


def test_bound_equals_equation_5_component_by_component(faults):
    assert count_bound(paper_model(faults)) == reference(faults)["upper_bound_psos_components"]


def test_just_determined_part_is_the_published_one(faults):
    model = paper_model(faults)
    just, expected = decompose(model).just, reference(faults)["dm"]["just_determined"]
    assert {model.equations[e] for e in just.equations} == set(expected["equations"])
    assert {model.unknowns[u] for u in just.unknowns} == set(expected["unknowns"])


def test_undetectable_faults_are_the_published_ones(faults):
    model = paper_model(faults)
    missed = {f.name for f, seen in zip(model.faults, detectable(model), strict=True) if not seen}
    assert missed == set(reference(faults)["undetectable_faults"])


def test_structure_alone_separates_the_course_from_the_wind(faults):
    """Table IV groups 24/cog with the wind only because loops were not implemented."""
    model = paper_model(faults)
    groups = {
        frozenset(model.faults[i].name for i in group)
        for group in not_isolable_groups(isolability(model), detectable(model))
    }
    assert frozenset({"168/direction", "168/speed"}) in groups
    assert not any("24/cog" in group for group in groups)
    assert len(groups) == 5
