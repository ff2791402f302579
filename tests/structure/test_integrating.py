"""Valid tests when states may be integrated: what they reach, and that they can be computed."""

from pathlib import Path

import numpy as np
import pytest

from fdi import structure
from fdi.structure import Model, Rules, load_reference
from fdi.structure.computation import steps
from fdi.structure.sequence import Blocked, Obstacle, Order, arrange, orders

MODELS = Path(__file__).parents[2].parent / "shared" / "structural" / "models"
INTEGRATING = Rules(integrate=True)

needs_models = pytest.mark.skipif(not MODELS.is_dir(), reason="no reference models beside")
NAMES = [
    *("airplane_linear", "electric_motor", "fixed_wing_beard", "fuel_cell_sensors"),
    *("hydraulic_actuator", "induction_motor", "krysander_2010", "three_tank", "two_tank"),
    *("uav_fravolini", "vep4", "rand_b_24_3_1_d4", "rand_b_60_4_1_d8"),
]


def known_in_order(model, order):
    """Walk a sequence as a person would, and return what it computes and what by integration."""
    kinds = {(e, u): kind for e, u, kind in model.derivative}
    known, integrated = set(), set()
    for block in order.blocks:
        inside = {u for _, u in block}
        constraints = [e for e, u in block if kinds.get((e, u)) == "i"]
        for equation, unknown in block:
            assert set(model.rows[equation]) <= known | inside
            if kinds.get((equation, unknown)) == "d":
                assert len(block) == 1
                assert not integrated.intersection(model.rows[equation])
            if len(block) > 1 and any(kinds.get((equation, u)) for u in model.rows[equation]):
                assert equation in constraints
        if constraints or any(integrated.intersection(model.rows[e]) for e, _ in block):
            integrated |= inside
        known |= inside
    assert set(model.rows[order.residual]) <= known
    return integrated


@needs_models
@pytest.mark.parametrize("name", NAMES)
def test_valid_tests_reach_what_integral_causality_promises(name):
    model = load_reference(MODELS / f"{name}.json")
    bank = structure.select_tests(model, INTEGRATING)
    promised = structure.isolability(model, "integral") | structure.isolability(model, "derivative")
    most = structure.isolability(model)
    assert not (promised & ~bank.isolable).any()
    assert not (bank.isolable & ~most).any()
    own = steps(model, INTEGRATING)
    for test in bank.tests:
        found = [o for o in orders(own, structure.members(test.equations)) if isinstance(o, Order)]
        assert found
        for order in found:
            known_in_order(model, order)


@needs_models
@pytest.mark.parametrize(
    ("name", "before", "reached"),
    [
        ("three_tank", 14, 24),
        ("vep4", 31, 108),
        ("fuel_cell_sensors", 20, 130),
        ("induction_motor", 0, 2),
    ],
)
def test_pairs_that_are_reached(name, before, reached):
    model = load_reference(MODELS / f"{name}.json")
    assert structure.select_tests(model, Rules()).isolable.sum() == before
    assert structure.select_tests(model, INTEGRATING).isolable.sum() == reached


FALL = Model(
    ("dx = d/dt x", "dx = -x + u", "y = x"),
    ("x", "dx"),
    ((0, 1), (0, 1), (0,)),
    (),
    ((0, 0, "i"), (0, 1, "d")),
)


def test_a_dynamic_loop_is_integrated_where_the_rules_allow_it():
    assert arrange(steps(FALL, Rules()), (0, 1), 2) == Blocked(Obstacle.DYNAMIC_LOOP, (0, 1))
    order = arrange(steps(FALL, INTEGRATING), (0, 1), 2)
    assert order.blocks == (((0, 0), (1, 1)),)
    assert known_in_order(FALL, order) == {0, 1}


def test_what_was_integrated_is_not_differentiated():
    model = Model(
        ("dx = d/dt x", "dx = u", "dz = d/dt z", "z = x", "y = dz"),
        ("x", "dx", "z", "dz"),
        ((0, 1), (1,), (2, 3), (0, 2), (3,)),
        (),
        ((0, 0, "i"), (0, 1, "d"), (2, 2, "i"), (2, 3, "d")),
    )
    blocked = arrange(steps(model, INTEGRATING), (0, 1, 2, 3), 4)
    assert blocked == Blocked(Obstacle.DIFFERENTIATION, (2,), 3)
    other = arrange(steps(model, INTEGRATING), (0, 1, 2, 4), 3)  # both are integrated instead
    assert known_in_order(model, other) == {0, 2}


def test_an_equation_of_a_dynamic_loop_that_cannot_be_solved_stands_in_the_way():
    model = Model(*_parts(FALL), nonsolvable=((1, 1),))
    assert isinstance(arrange(steps(model, INTEGRATING), (0, 1), 2), Blocked)


def _parts(model):
    return model.equations, model.unknowns, model.rows, model.faults, model.derivative


@pytest.mark.parametrize("seed", range(60))
def test_random_models_every_test_can_be_computed_and_none_is_lost(seed):
    """What derivative causality or none needs is never lost by being allowed to integrate."""
    rng = np.random.default_rng(seed)
    states = int(rng.integers(1, 4))
    n = 2 * states + int(rng.integers(0, 3))
    rows = [(k, states + k) for k in range(states)]
    derivative = [e for k in range(states) for e in ((k, k, "i"), (k, states + k, "d"))]
    count = n - states + int(rng.integers(1, 4))
    for _ in range(count):
        size = min(n, int(rng.integers(1, 4)))
        rows.append(tuple(sorted(rng.choice(n, size, replace=False).tolist())))
    used = sorted({u for row in rows for u in row})
    place = {u: i for i, u in enumerate(used)}
    faults = {f"f{e}": e for e in range(states, len(rows))}
    model = Model(
        tuple(f"e{e}" for e in range(len(rows))),
        tuple(f"u{u}" for u in used),
        tuple(tuple(place[u] for u in row) for row in rows),
        tuple(structure.Fault(name, (e,)) for name, e in faults.items()),
        tuple((e, place[u], kind) for e, u, kind in derivative),
    )
    bank = structure.select_tests(model, INTEGRATING)
    settled = ~bank.undecided
    for promised in (
        structure.select_tests(model, Rules()).isolable,
        structure.isolability(model, "integral"),
    ):
        assert not (promised & ~bank.isolable & settled).any()
    own = steps(model, INTEGRATING)
    for test in bank.tests:
        order = next(
            o for o in orders(own, structure.members(test.equations)) if isinstance(o, Order)
        )
        known_in_order(model, order)
