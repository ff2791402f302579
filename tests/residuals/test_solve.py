"""Equations solved by a formula: every root satisfies them, and what has none is told."""

import numpy as np
import pytest

from fdi.model.evaluate import evaluate
from fdi.model.expression import parse, symbols
from fdi.model.parts import Kind, Variable
from fdi.model.system import SystemEquation
from fdi.residuals.solve import solve

FREE, POSITIVE = Variable("x", "m"), Variable("x", "m", low=0.0)
GIVEN = {"a": np.array([0.5, 1.0, 2.5]), "b": np.array([3.0, 2.0, 1.5])}


def roots(left, right, unknown=FREE):
    equation = SystemEquation("e", Kind.RELATION, parse(left), parse(right), {})
    return solve(equation, "x", unknown)


@pytest.mark.parametrize(
    ("left", "right", "unknown", "count"),
    [
        ("a", "2*x + b", FREE, 1),
        ("a", "b/x", FREE, 1),
        ("a", "x**2", FREE, 2),
        ("a", "x**2", POSITIVE, 1),
        ("a", "x*x + b*x", FREE, 2),
        ("0", "x**2 - b*x", FREE, 2),
        ("x*x - 3*x", "a - 2", FREE, 2),
        ("a", "x + b/x", FREE, 2),
        ("a", "exp(x) + b*exp(2*x)", FREE, None),
    ],
)
def test_a_root_satisfies_its_equation(left, right, unknown, count):
    found = roots(left, right, unknown)
    assert count is None or len(found) == count
    seen = np.zeros(3, bool)
    for root in found or ():
        assert "x" not in symbols(root)
        with np.errstate(invalid="ignore", divide="ignore"):
            x = np.broadcast_to(evaluate(root, GIVEN), 3)
        sides = [evaluate(parse(side), GIVEN | {"x": x}) for side in (left, right)]
        known = np.isfinite(x) & np.isfinite(sides[0] + sides[1])
        np.testing.assert_allclose(*(np.broadcast_to(s, 3)[known] for s in sides), atol=1e-9)
        seen |= known
    assert seen.any() or count is None


@pytest.mark.parametrize(
    "right",
    [
        "abs(x) + x**3",  # sympy loses roots of it
        "max(x, b) + x",
        "x**5 + x",  # no formula
        "x + sin(x)",  # inside and outside
        "x*x + x**3 + x*b + 2/x",  # too many places
    ],
)
def test_what_has_no_formula_is_solved_numerically(right):
    assert roots("a", right) is None
