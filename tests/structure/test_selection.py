"""Tests for a purpose and small banks, against all that enumeration finds."""

import json
from pathlib import Path

import numpy as np
import pytest
from counting import calls
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import (
    Fault,
    Model,
    bitset,
    detectable,
    find_test,
    finder,
    isolability,
    load_reference,
    members,
    mso_sets,
    select_tests,
    submodel,
)
from fdi.structure.computation import Rules, steps
from fdi.structure.sequence import Order, orders

from . import naive
from .models import REFERENCE, SHARED, models, needs_shared, ruled_models


def valid_sets(model, rules):
    """MSO sets that have a valid sequence."""
    own = steps(model, rules)
    return [
        bits
        for bits in mso_sets(model)
        if any(isinstance(order, Order) for order in orders(own, members(bits)))
    ]


def check(model, selection, sets, assumptions):
    """The bank serves all purposes that the sets serve, by sets among them."""
    assert {test.equations for test in selection.tests} <= set(sets)
    columns = [set(fault.equations) for fault in model.faults]
    columns += [{equation} for equation in assumptions] + [set()]
    chosen = [set(members(test.equations)) for test in selection.tests]
    served = naive.purposes(model, chosen, columns)
    assert served == naive.purposes(model, [set(members(bits)) for bits in sets], columns)
    n = range(len(model.faults))
    assert selection.isolable.tolist() == [[(i, j) in served and i != j for j in n] for i in n]
    assert selection.detectable.tolist() == [(i, len(columns) - 1) in served for i in n]
    assert selection.reacts.tolist() == [
        [not own.isdisjoint(fault.equations) for fault in model.faults] for own in chosen
    ]
    assert not selection.undecided.any()


def assert_none_is_superfluous(model, selection, assumptions):
    columns = [set(fault.equations) for fault in model.faults]
    columns += [{equation} for equation in assumptions] + [set()]
    chosen = [set(members(test.equations)) for test in selection.tests]
    for left_out in chosen:
        rest = [own for own in chosen if own is not left_out]
        assert naive.purposes(model, rest, columns) != naive.purposes(model, chosen, columns)


@given(models(), st.sets(st.integers(0, 6)))
@settings(max_examples=200, deadline=None)
def test_bank_can_do_all_that_structure_allows(model, some):
    assumptions = sorted(e for e in some if e < len(model.rows))
    selection = select_tests(model, assumptions=assumptions)
    check(model, selection, list(mso_sets(model)), assumptions)
    assert_none_is_superfluous(model, selection, assumptions)
    assert (selection.isolable == isolability(model)).all()
    assert (selection.detectable == detectable(model)).all()


RULES = st.builds(Rules, loops=st.booleans(), differentiate=st.booleans())


@given(ruled_models(), RULES)
@settings(max_examples=200, deadline=None)
def test_bank_can_do_all_that_valid_tests_can(model, rules):
    selection = select_tests(model, rules, assumptions=())
    check(model, selection, valid_sets(model, rules), ())
    assert_none_is_superfluous(model, selection, ())
    own = steps(model, rules)
    for test in selection.tests:
        found = [o for o in orders(own, members(test.equations)) if isinstance(o, Order)]
        assert test.residual in {order.residual for order in found}
        assert test.cost == sum(own.costs[e] for e in members(test.equations))


@given(ruled_models(), RULES | st.none())
@settings(max_examples=200, deadline=None)
def test_a_test_is_found_exactly_if_there_is_one_and_near_the_cheapest(model, rules):
    own = steps(model, rules)
    cost = {
        bits: sum(own.costs[e] for e in members(bits))
        for bits in (valid_sets(model, rules) if rules else mso_sets(model))
    }
    for i, fault in enumerate(model.faults):
        for j, other in [(None, None), *enumerate(model.faults)]:
            wanted, avoided = bitset(fault.equations), bitset(other.equations) if other else 0
            all_tests = [bits for bits in cost if bits & wanted and not bits & avoided]
            found = find_test(model, i, j, rules=rules)
            assert (found is None) == (not all_tests)
            if found is not None:
                assert found.equations in all_tests
                assert found.cost == cost[found.equations]
                assert found.cost <= 1.5 * min(cost[bits] for bits in all_tests)


def test_default_assumptions_are_limits_under_rules_and_none_for_structure_alone():
    model = Model(
        ("y1 = x", "y2 = x", "x < 5"),
        ("x",),
        ((0,), (0,), (0,)),
        (Fault("f", (0,)), Fault("g", (1,))),
        nonsolvable=((2, 0),),
    )
    assert len(select_tests(model).tests) == 2
    with_comparison = [test.equations for test in select_tests(model, Rules()).tests]
    assert with_comparison == [0b011, 0b101, 0b110]


def test_loop_of_equations_that_cannot_be_solved_alone_is_found_beside_its_sensors():
    """Ground speed and course give the velocity in a loop only; its parts are measured, too."""
    model = Model(
        ("v = |v_n, v_e|", "c = arc(v_n, v_e)", "v shown", "c shown", "v_n shown"),
        ("v", "c", "v_n", "v_e"),
        ((0, 2, 3), (1, 2, 3), (0,), (1,), (2,)),
        (Fault("v", (2,)), Fault("c", (3,)), Fault("n", (4,))),
        nonsolvable=((0, 2), (0, 3), (1, 1), (1, 2), (1, 3)),
    )
    (test,) = select_tests(model, Rules()).tests
    assert test.residual == 4
    assert test.equations == 0b11111


def test_what_no_search_decides_is_decided_by_listing_or_said_to_be_undecided(monkeypatch):
    """All of a, b and c lie on cycles, so that loosely x and y follow; by the rules they do not."""
    model = Model(
        ("z = a(x, y)", "y shown", "b(x, y)", "z**2 shown"),
        ("x", "y", "z"),
        ((0, 1, 2), (1,), (0, 1), (2,)),
        (Fault("f", (0,)),),
        nonsolvable=((0, 0), (0, 1), (2, 0), (2, 1), (3, 2)),
    )
    decided = select_tests(model, Rules())
    assert not decided.detectable.any()
    assert not decided.undecided.any()
    monkeypatch.setattr(finder, "MAX_LISTED", 0)
    assert select_tests(model, Rules()).undecided.tolist() == [[True]]


def test_a_loop_is_found_although_a_sensor_could_be_used_first():
    model = Model(
        ("y shown", "x**2 shown", "a(x, y)", "y = b(x)"),
        ("x", "y"),
        ((1,), (0,), (0, 1), (0, 1)),
        (Fault("f", (1,)),),
        nonsolvable=((1, 0), (2, 0), (2, 1), (3, 0)),
    )
    (test,) = select_tests(model, Rules()).tests
    assert members(test.equations) == (1, 2, 3)


def test_names_stand_for_indices():
    model = Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]], faults={"f": 0, "g": 2})
    assert find_test(model, "f") == find_test(model, 0)
    assert find_test(model, "f", "g") == find_test(model, 0, 1) == find_test(model, "f", 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda model: find_test(model, 5), r"fault 5 of 2 faults does not exist"),
        (lambda model: find_test(model, 0, -1), r"fault -1 of 2 faults does not exist"),
        (lambda model: find_test(model, "h"), r"the model has no fault 'h' \(there are f, g\)"),
        (lambda model: find_test(model, "f", 1.5), r"1.5 is neither index nor name of a fault"),
        (lambda model: find_test(model, None), r"None is neither index nor name of a fault"),
        (lambda model: select_tests(model, assumptions=[7]), r"equation 7 is not in 0..2"),
    ],
)
def test_what_is_no_fault_or_equation_is_refused(call, message):
    model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    with pytest.raises(UsageError, match=message):
        call(model)


def test_models_without_faults_or_equations_have_an_empty_bank():
    for model in (Model((), (), ()), Model.from_matrix([[1], [1]])):
        selection = select_tests(model)
        assert selection.tests == ()
        assert selection.isolable.shape == (0, 0)


@needs_shared
@pytest.mark.parametrize("path", REFERENCE, ids=lambda path: path.stem)
def test_bank_of_reference_model_isolates_all_and_is_near_the_smallest(path):
    model = load_reference(path)
    selection = select_tests(model)
    assert (selection.isolable == isolability(model)).all()
    assert (selection.detectable == detectable(model)).all()
    n = range(len(model.faults))
    reacts = selection.reacts
    by_tests = [[bool((reacts[:, i] & ~reacts[:, j]).any()) for j in n] for i in n]
    assert by_tests == selection.isolable.tolist()
    extras = json.loads((SHARED / "structural" / "extras.json").read_text(encoding="utf-8"))
    smallest = extras.get(model.name, {}).get("smallest_bank_mso")
    if smallest:
        assert len(selection.tests) <= 1.1 * smallest["size"] + 1


@needs_shared
def test_published_model_needs_at_most_70_tests():
    model = load_reference(SHARED / "structural" / "models" / "mavlink_arduplane.json")
    assert 62 <= len(select_tests(model).tests) <= 70


@needs_shared
def test_published_model_handed_over_whole_needs_no_enumeration():
    model = load_reference(SHARED / "structural" / "models" / "mavlink_arduplane.json")
    assert calls(lambda: select_tests(model)) < 300_000  # a tenth of a second


CROSS_CHECKED = ("airspeed_vfr_hud", "aspd_error_nav_controller_output", "vcc_power_status")


@needs_shared
def test_valid_tests_of_published_model_keep_the_cross_checks():
    model = load_reference(SHARED / "structural" / "models" / "mavlink_arduplane.json")
    selection = select_tests(model, Rules())
    limits = [e for e, row in enumerate(model.rows) if len(row) == 1 and 10 <= e <= 40]
    check(model, selection, valid_sets(model, Rules()), limits)
    faults = {fault.name: fault.equations[0] for fault in model.faults}
    for name in (*CROSS_CHECKED, "vcc_hwstatus"):
        own = [test for test in selection.tests if test.equations >> faults[f"f_{name}"] & 1]
        for limit in limits:
            assert any(not test.equations >> limit & 1 for test in own)


@needs_shared
def test_a_model_that_no_enumeration_ends_on_has_a_bank():
    model = load_reference(SHARED / "structural" / "models" / "fixed_wing_uav_f.json")
    selection = select_tests(model)
    assert (selection.isolable == isolability(model)).all()
    assert len(selection.tests) <= 15


@pytest.mark.parametrize("band", [None, 40])
def test_a_model_of_a_thousand_equations_has_a_bank_that_isolates_all(band, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    from random_models import random_model

    model = random_model(1000, 30, 150, band=band)
    selection = select_tests(model)
    found = np.zeros((150, 150), dtype=bool)
    for row in selection.reacts:
        found[np.ix_(row, ~row)] = True
    assert (found == isolability(model)).all()
    for test, row in zip(selection.tests, selection.reacts, strict=True):
        assert [bool(test.equations >> f.equations[0] & 1) for f in model.faults] == row.tolist()
        rest = submodel(model, members(test.equations))
        assert next(mso_sets(rest)) == (1 << len(rest.rows)) - 1


def test_same_model_gives_the_same_bank():
    rng = np.random.default_rng(3)
    model = Model.from_matrix(rng.random((30, 24)) < 0.12, faults={f"f{i}": i for i in range(12)})
    first, second = select_tests(model), select_tests(model)
    assert first.tests == second.tests
