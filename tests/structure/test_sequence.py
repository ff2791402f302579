"""Valid sequences, against every matching of small sets under the published rules."""

import pytest
from hypothesis import given, settings

from fdi.errors import UsageError
from fdi.structure import Model, members, mso_sets
from fdi.structure.computation import Rules, compute, steps
from fdi.structure.sequence import Blocked, Obstacle, Order, arrange, orders

from . import naive
from .models import ruled_models


@given(ruled_models())
@settings(max_examples=300, deadline=None)
def test_equations_that_can_be_left_over_are_those_of_brute_force(model):
    own = steps(model, Rules())
    for bits in mso_sets(model):
        equations = members(bits)
        found = {order.residual for order in orders(own, equations) if isinstance(order, Order)}
        expected = {
            residual
            for pairs in naive.sequences(model, equations)
            for residual in set(equations) - set(pairs)
        }
        assert found == expected


@given(ruled_models())
@settings(max_examples=200, deadline=None)
def test_every_sequence_is_a_valid_matching_in_computing_order(model):
    own = steps(model, Rules())
    for bits in mso_sets(model):
        equations = members(bits)
        valid = naive.sequences(model, equations)
        for order in orders(own, equations):
            if isinstance(order, Blocked):
                continue
            pairs = {e: u for block in order.blocks for e, u in block}
            assert pairs in valid
            known = set()
            for block in order.blocks:
                known |= {unknown for _, unknown in block}
                assert all(known.issuperset(model.rows[equation]) for equation, _ in block)
            assert known.issuperset(model.rows[order.residual])


@given(ruled_models())
@settings(max_examples=200, deadline=None)
def test_sequences_come_cheapest_first(model):
    own = steps(model, Rules(costs=tuple(float(1 + e % 3) for e in range(len(model.rows)))))
    for bits in mso_sets(model):
        found = [order.cost for order in orders(own, members(bits)) if isinstance(order, Order)]
        assert found == sorted(found)


@given(ruled_models())
@settings(max_examples=300, deadline=None)
def test_what_a_computation_leaves_over_is_an_mso_set_that_can_be_computed(model):
    mso = set(mso_sets(model))
    found, used = compute(steps(model, Rules()), [range(len(model.rows))])
    assert used.isdisjoint(left.residual for left in found)
    for left in found:
        assert left.equations in mso
        valid = naive.sequences(model, members(left.equations))
        assert any(left.residual not in pairs for pairs in valid)


def test_equations_of_later_stages_are_used_only_if_earlier_ones_lead_no_further():
    model = Model.from_matrix([[1, 0], [1, 0], [0, 1], [1, 1]])
    own = steps(model, None)
    _, used = compute(own, [(1, 2, 3), (0,)])
    assert 0 not in used
    _, used = compute(own, [(3,), (0,)])
    assert used == {0, 3}


def test_a_set_without_an_equation_to_spare_is_blocked():
    (found,) = orders(steps(Model.from_matrix([[1]]), None), (0,))
    assert found == Blocked(Obstacle.NO_REDUNDANCY)


SENSORS = Model(
    ("dx = d/dt x", "y1 = dx", "y2 = x"),
    ("x", "dx"),
    ((0, 1), (1,), (0,)),
    derivative=((0, 0, "i"), (0, 1, "d")),
)
LOOP = Model.from_matrix([[1, 1], [1, 1], [1, 0]])
DYNAMIC_LOOP = Model(
    ("dx = d/dt x", "a(x, dx)", "b(x)"),
    ("x", "dx"),
    ((0, 1), (0, 1), (0,)),
    derivative=((0, 0, "i"), (0, 1, "d")),
)
SQUARES = Model(("y1 = x**2", "y2 = x**2"), ("x",), ((0,), (0,)), nonsolvable=((0, 0), (1, 0)))


@pytest.mark.parametrize(
    ("model", "rules", "residual", "expected"),
    [
        (SENSORS, Rules(), 2, Blocked(Obstacle.INTEGRATION, (0,), 0)),
        (SENSORS, Rules(differentiate=False), 1, Blocked(Obstacle.DIFFERENTIATION, (0,), 1)),
        (SQUARES, Rules(), 0, Blocked(Obstacle.NOT_INVERTIBLE, (1,), 0)),
        (LOOP, Rules(loops=False), 2, Blocked(Obstacle.ALGEBRAIC_LOOP, (0, 1))),
        (DYNAMIC_LOOP, Rules(), 2, Blocked(Obstacle.DYNAMIC_LOOP, (0, 1))),
        (
            Model.from_matrix([[1, 0], [1, 0], [0, 1]]),
            Rules(),
            2,
            Blocked(Obstacle.NO_COMPLETE_MATCHING),
        ),
    ],
)
def test_obstacle_says_what_and_where(model, rules, residual, expected):
    rest = [e for e in range(len(model.rows)) if e != residual]
    assert arrange(steps(model, rules), rest, residual) == expected


def test_a_loop_of_thousands_needs_no_recursion():
    size = 3000
    rows = [(i, (i + 1) % size) for i in range(size)] + [(0,)]
    labels = tuple(f"e{i}" for i in range(size + 1)), tuple(f"x{i}" for i in range(size))
    model = Model(*labels, tuple(rows))
    assert arrange(steps(model, None), range(size), size).loops == size


@pytest.mark.parametrize(
    ("rules", "message"),
    [
        (Rules(costs=(1.0,)), "1 costs for 3 equations"),
        (Rules(costs=(1.0, -1.0, 1.0)), "negative"),
        (Rules(solvable=frozenset({(2, 1)})), r"\(2, 1\) is no entry"),
        (Rules(solvable=frozenset({(9, 0)})), r"\(9, 0\) is no entry"),
    ],
)
def test_rules_that_do_not_fit_the_model_are_refused(rules, message):
    with pytest.raises(UsageError, match=message):
        steps(LOOP, rules)


def test_only_the_entries_that_rules_name_are_solved_along():
    model = Model.from_matrix([[1, 0], [1, 1], [0, 1]])
    allowed = Rules(solvable=frozenset({(0, 0), (1, 1)}))
    found = {o.residual for o in orders(steps(model, allowed), (0, 1, 2)) if isinstance(o, Order)}
    assert found == {2}
