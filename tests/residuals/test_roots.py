"""All solutions of small systems: those that are known, each once, and none besides."""

import numpy as np
import pytest

from fdi.model.expression import parse
from fdi.model.parts import Variable
from fdi.residuals.roots import CHUNK, all_roots, domain_of, polished

X, Y = Variable("x", "m"), Variable("y", "m")
TURN = Variable("c", "rad", circular=True)


def roots(equations, unknowns, columns, size, **more):
    """By sample the sorted roots, and whether these are all."""
    found = all_roots([parse(text) for text in equations], unknowns, columns, size, **more)
    values = [
        sorted(map(tuple, found.values[~np.isnan(found.values[:, 0, k]), :, k].tolist()))
        for k in range(size)
    ]
    return values, found.complete.tolist()


def test_every_sample_has_its_own_roots_each_once():
    given = np.array([4.0, 9.0, -1.0, np.nan, 2.25])
    values, complete = roots(["x**2 - a"], [X], {"a": given}, 5)
    expected = [[(-2.0,), (2.0,)], [(-3.0,), (3.0,)], [], [], [(-1.5,), (1.5,)]]
    for found, known in zip(values, expected, strict=True):
        assert np.array(found) == pytest.approx(np.array(known), abs=1e-9)
    assert complete == [True] * 5


def test_a_sum_and_a_product_are_those_of_two_pairs():
    values, complete = roots(["x + y - s", "x*y - p"], [X, Y], {"s": 3.0, "p": 2.0}, 1)
    assert np.array(values[0]) == pytest.approx(np.array([(1.0, 2.0), (2.0, 1.0)]), abs=1e-9)
    assert complete == [True]


def test_where_nothing_tells_roots_apart_two_are_enough():
    told = np.array([True, False])
    polynomial = "(x - 1)*(x - 2)*(x - 30)*(x + 40)"
    values, complete = roots([polynomial], [X], {}, 2, shown=told)
    assert np.ravel(values[0]) == pytest.approx([-40.0, 1.0, 2.0, 30.0], abs=1e-9)
    assert 2 <= len(values[1]) <= 4
    assert complete == [True, True]


def test_no_root_outside_the_domain_is_given_and_one_on_its_edge_is():
    positive = Variable("x", "m", low=0.0)
    given = {"a": np.array([4.0, 0.0, 25.0])}
    assert np.ravel(roots(["x**2 - a"], [positive], given, 3)[0][2]) == pytest.approx([5.0])
    edge = Variable("x", "m", low=-2.0, high=5.0)
    values, _ = roots(["x**2 - a"], [edge], {"a": np.array([4.0, 25.0])}, 2)
    assert np.ravel(values[0]) == pytest.approx([-2.0, 2.0], abs=1e-9)
    assert np.ravel(values[1]) == pytest.approx([5.0])


def test_an_angle_has_one_turn():
    assert domain_of(TURN) == (-np.pi, np.pi)
    assert domain_of(Variable("c", "rad", circular=True, low=0.0, high=1.0)) == (0.0, 1.0)
    values, _ = roots(["sin(c) - s"], [TURN], {"s": np.array([0.5, -0.5])}, 2)
    assert np.ravel(values[0]) == pytest.approx([np.pi / 6, 5 * np.pi / 6], abs=1e-9)
    assert np.ravel(values[1]) == pytest.approx([-5 * np.pi / 6, -np.pi / 6], abs=1e-9)
    # at half a turn the two ends are one angle
    assert len(roots(["cos(c) + 1.0*a"], [TURN], {"a": np.array([1.0])}, 1)[0][0]) <= 1


def test_many_samples_are_taken_in_parts_and_come_back_in_order():
    given = np.linspace(1.0, 2.0, CHUNK + 3)
    found = all_roots([parse("x**3 - a")], [X], {"a": given, "b": 0.0}, len(given))
    assert found.values.shape == (1, 1, CHUNK + 3)
    assert found.values[0, 0] == pytest.approx(np.cbrt(given), abs=1e-9)
    assert found.complete.all()


def test_what_cannot_be_decided_is_told():
    """Where two unknowns are not told apart there is a line of roots."""
    _, complete = roots(["x + y - 1", "2*x + 2*y - 2"], [X, Y], {}, 1)
    assert complete == [False]


def test_newton_steps_from_beside_a_root_end_on_it_and_nowhere_else():
    near = np.array([[1.5, 1.3, 0.0, 1.4]])
    given = {"a": np.array([2.0, 2.0, 2.0, np.nan])}
    found = polished([parse("x**2 - a")], ["x"], given, near)
    assert found[0, :2] == pytest.approx([np.sqrt(2.0)] * 2, abs=1e-14)
    assert np.isnan(found[0, 2:]).all()  # no slope at zero, no value without a
