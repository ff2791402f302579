"""Which sets are implemented: all of them, or a selection that can do the same."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import examples

from fdi import structure
from fdi.analysis import analyze
from fdi.diagnosis.isolability import implementable_isolability
from fdi.model import load_airframe
from fdi.model.parts import Kind
from fdi.model.system import Fault
from fdi.report.model_document import model_document, study
from fdi.residuals import build_bank, sets
from fdi.residuals.cache import cached_bank
from fdi.residuals.rules import NoMatching, best_matchings, choices_of
from fdi.residuals.sets import sets_of
from fdi.structure.isolability import isolability_of_signatures

from .build import GLIDER, airframe

pytestmark = pytest.mark.flights

PAPER = Path(__file__).parents[1] / "models" / "paper_77.yaml"


def untrusted(system):
    """The system with every input a measurement with a fault: all of it hangs together."""
    equations, faults = [], list(system.faults)
    for number, equation in enumerate(system.equations):
        if equation.kind is Kind.INPUT:
            equation = replace(equation, kind=Kind.MEASUREMENT, fault=equation.name)
            faults.append(Fault(equation.name, "outside_model", "other", number))
        equations.append(equation)
    return replace(system, equations=tuple(equations), faults=tuple(faults))


def told_apart(system, signatures):
    """Which fault some signature tells from which, the diagonal: which it shows at all."""
    names = [fault.name for fault in system.faults]
    matrix = np.zeros((len(names), len(names)), dtype=bool)
    for own in signatures:
        row = np.array([name in own for name in names])
        matrix[np.ix_(row, ~row)] = True
        matrix[row, row] = True
    return matrix


def edges_of(system, rows):
    return {name for i in rows for name in system.equations[i].edges}


def all_valid_signatures(system, *, limits=True):
    """Signatures of all MSO sets that have a valid matching."""
    model = system.structure(limits=limits)
    number = {equation.name: i for i, equation in enumerate(system.equations)}
    fault_of = {fault.equation: fault.name for fault in system.faults}
    choices = choices_of(system.equations)
    for bits in structure.mso_sets(model):
        rows = [number[model.equations[row]] for row in structure.members(bits)]
        rows += [shown for name, shown in system.inputs.items() if name in edges_of(system, rows)]
        if not isinstance(best_matchings(choices, rows, 1), NoMatching):
            yield {fault_of[i] for i in rows if i in fault_of}


@pytest.mark.parametrize("name", ["fixed_wing", "quadcopter"])
def test_a_system_with_too_many_sets_to_list_gets_a_bank(name):
    """It was refused: up to 1e19 sets in a graph component of redundancy 30."""
    system = untrusted(load_airframe(name).observe())
    bound = max(
        structure.count_bound(structure.submodel(system.structure(), part.equations))
        for part in structure.graph_components(system.structure())
    )
    assert bound > 1e12
    bank = build_bank(system)
    assert len(bank.generators) < len(system.faults)
    assert not bank.listed
    assert all("were selected" in note for note in bank.notes)
    undecided = [int(n) for note in bank.notes for n in re.findall(r"(\d+) pairs", note)]
    assert sum(undecided) <= 5  # of 6,000
    promised = structure.isolability(system.structure())
    # what conditions and inputs bring besides is no matter of which sets are chosen
    assert bank.incidence.any(axis=0).sum() >= structure.detectable(system.structure()).sum() - 1
    assert isolability_of_signatures(bank.incidence).sum() > 0.99 * promised.sum()


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("fixed_wing", marks=pytest.mark.soak),  # a minute: 100,000 sets one by one
        "any_vehicle",
        "quadcopter",
        str(PAPER),
    ],
)
def test_selection_can_do_all_that_valid_tests_can(name):
    system = load_airframe(name).observe()
    bank = build_bank(system, "selected")
    signatures = [set(generator.faults) for generator in bank.generators]
    every = told_apart(system, all_valid_signatures(system))
    assert (told_apart(system, signatures) == every).all()
    cross_checks = told_apart(system, all_valid_signatures(system, limits=False))
    without_limits = [
        set(generator.faults)
        for generator in bank.generators
        if not any(
            system.equations[i].kind in (Kind.LIMIT, Kind.EQUALITY) for i in generator.equations
        )
    ]
    assert (told_apart(system, without_limits) >= cross_checks).all()


CROSS_CHECKED = (
    "VFR_HUD.airspeed",
    "NAV_CONTROLLER_OUTPUT.aspd_error",
    "POWER_STATUS.Vcc",
    "HWSTATUS.Vcc",
)


@pytest.mark.parametrize("fault", CROSS_CHECKED)
def test_selection_keeps_a_cross_check_beside_the_limit(fault):
    bank = build_bank(load_airframe(PAPER).observe(), "selected")
    limits = {i for i, e in enumerate(bank.system.equations) if e.kind is Kind.LIMIT}
    own = [set(g.equations) for g in bank.generators if fault in g.faults]
    assert any(equations & limits for equations in own)
    assert any(not equations & limits for equations in own)


def test_a_fault_without_a_valid_test_keeps_a_set_that_says_why(tmp_path):
    text = """
format: 1
name: squares
components: {a: {group: sensor}}
variables:
  x: {unit: m}
  y: {unit: m}
  z: {unit: m}
equations:
  k_1: {text: "y = x**2", solves: [y]}
  k_2: {text: "z = x**2 + x", solves: [z]}
measurements:
  M: {component: a, fields: {y: {variable: y, accuracy: 1}, z: {variable: z, accuracy: 1}}}
"""
    bank = build_bank(
        airframe(tmp_path, text.replace("unit: m}", 'unit: "1"}')).observe(), "selected"
    )
    assert bank.generators == ()
    (refused,) = bank.not_implementable
    assert set(refused.faults) == {"M.y", "M.z"}
    assert refused.reason == "not invertible"


def test_an_equation_whose_condition_cannot_be_read_is_in_no_selected_set(tmp_path):
    """The wind is a variable of no other equation and no channel."""
    text = GLIDER.replace("v_ground > slow", "wind > slow").replace(
        "  climb: {unit: m/s}", "  climb: {unit: m/s}\n  wind: {unit: m/s}"
    )
    bank = build_bank(airframe(tmp_path, text).observe(), "selected")
    used = {bank.system.equations[i].name for g in bank.generators for i in g.equations}
    assert "k_2" not in used
    assert "k_1" in used


def test_too_many_listed_sets_are_replaced_by_a_selection(monkeypatch):
    system = load_airframe("quadcopter").observe()
    every = build_bank(system)
    monkeypatch.setattr(sets, "MAX_CANDIDATES", 20)
    some = build_bank(system)
    assert not some.listed
    assert {g.origin for g in some.generators} == {"mtes", "selected", "cross_check"}
    before, after = implementable_isolability(every), implementable_isolability(some)
    assert (before.matrix == after.matrix).all()


def test_a_selected_bank_comes_back_from_the_cache_with_its_notes(tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(sets, "MAX_CANDIDATES", 20)
    system = load_airframe("quadcopter").observe()
    first, second = cached_bank(system), cached_bank(system)
    assert first.generators == second.generators
    assert first.not_implementable == second.not_implementable
    assert (first.listed, first.notes) == (second.listed, second.notes)


def test_a_component_is_selected_from_when_the_sets_of_all_are_too_many(monkeypatch):
    system = load_airframe("quadcopter").observe()
    monkeypatch.setattr(sets, "MAX_SETS", 40)
    some = sets_of(system, "mtes")
    assert not some.listed
    assert {origin for _, origin in some.sets} == {"mtes", "selected"}


def test_a_study_of_selected_tests_counts_no_minimal_supports(monkeypatch):
    monkeypatch.setattr(sets, "MAX_CANDIDATES", 20)
    airframe = load_airframe("quadcopter")
    found = study(airframe, airframe.observe())
    told = model_document(found)
    counted = told["structure"]
    assert (counted["mtes"], counted["restricted_generators"], counted["cross_checks"]) == (
        None,
    ) * 3
    assert all("were selected" in line for line in told["warnings"])
    assert sum(counted["not_implementable"].values()) == len(found.bank.not_implementable)


@pytest.mark.parametrize("case", examples())
def test_the_verdict_on_a_crash_stands_also_on_selected_tests(case, monkeypatch, tmp_path):
    """As for telemetry with too many test sets; the reader is told that not all were tried."""
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(sets, "MAX_CANDIDATES", 0)
    found = analyze(case.path)
    assert found.findings[0].component in case.right
    assert any("were selected" in line for line in found.warnings)


def test_the_same_system_gives_the_same_sets():
    system = untrusted(load_airframe("any_vehicle").observe())
    assert sets_of(system, "selected") == sets_of(system, "selected")
