"""Derivatives, and equations solved for a variable."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fdi.model.calculus import MAX_ROOTS, derivative, isolate
from fdi.model.evaluate import evaluate
from fdi.model.expression import Apply, Number, Symbol, count, parse, to_text

from .trees import NAMES, quantities

tame = quantities(
    leaf=st.one_of(
        st.sampled_from(NAMES).map(Symbol), st.integers(1, 3).map(lambda i: Number(float(i)))
    ),
    functions=("sqrt", "sin", "cos", "tan", "exp", "log", "atan", "asin", "acos"),
    exponents=(-2.0, -1.0, 0.0, 1.0, 2.0, 3.0),
    max_leaves=6,
)
points = st.tuples(*[st.floats(0.2, 1.7)] * len(NAMES))


def value(tree, names):
    return float(evaluate(tree, {n: np.array([v]) for n, v in names.items()}).reshape(-1)[0])


@given(tame, points, st.sampled_from(NAMES))
def test_derivative_equals_finite_differences(tree, at, name):
    slope = derivative(tree, name)
    if slope is None:
        assert any(op in to_text(tree) for op in ("max", "min"))
        return
    names = dict(zip(NAMES, at, strict=True))

    def difference(step):
        ends = [value(tree, {**names, name: names[name] + s}) for s in (step, -step)]
        return (ends[0] - ends[1]) / (2 * step)

    rough, fine = difference(1e-4), difference(1e-5)
    assume(np.isfinite([rough, fine]).all() and abs(fine) < 1e3)
    assume(abs(rough - fine) < 1e-5 * (1 + abs(fine)))  # smooth enough for a difference
    assert value(slope, names) == pytest.approx(fine, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("text", ["max(x, 1)", "abs(x)", "min(x, 2)*x", "sign(x)"])
def test_what_has_no_derivative_gives_none(text):
    assert derivative(parse(text), "x") is None


UNDOABLE = st.sampled_from(
    [
        lambda v: Apply("+", (v, Symbol("a"))),
        lambda v: Apply("+", (Symbol("a"), v)),
        lambda v: Apply("-", (v,)),
        lambda v: Apply("-", (v, Symbol("b"))),
        lambda v: Apply("-", (Symbol("b"), v)),
        lambda v: Apply("*", (v, Symbol("a"))),
        lambda v: Apply("/", (v, Symbol("a"))),
        lambda v: Apply("/", (Symbol("a"), v)),
        lambda v: Apply("sqrt", (v,)),
        lambda v: Apply("exp", (v,)),
        lambda v: Apply("log", (v,)),
        lambda v: Apply("atan", (v,)),
        lambda v: Apply("asin", (v,)),
        lambda v: Apply("acos", (v,)),
        lambda v: Apply("**", (v, Number(2.0))),
        lambda v: Apply("**", (v, Number(-2.0))),
        lambda v: Apply("**", (v, Number(-1.0))),
        lambda v: Apply("**", (v, Number(3.0))),
    ]
)


@given(
    st.lists(UNDOABLE, max_size=5),
    st.floats(0.3, 2.5),
    st.booleans(),
    st.tuples(st.floats(0.3, 3), st.floats(0.3, 3)),
)
def test_one_of_the_roots_is_the_value_that_gave_the_other_side(steps, size, negative, sides):
    """Operations around one occurrence are undone; every square brings its second root along."""
    holder = Symbol("v")
    for step in steps:
        holder = step(holder)
    names = {"v": -size if negative else size, "a": sides[0], "b": sides[1]}
    given_value = value(holder, names)
    assume(np.isfinite(given_value) and 1e-4 < abs(given_value) < 1e4)
    solution = isolate(Symbol("q"), holder, "v", signed=True)
    squares = sum(1 for step in steps if "2" in to_text(step(Symbol("z"))))
    if 2**squares > MAX_ROOTS:
        assert solution is None
        return
    found = [value(root, {**names, "q": given_value}) for root in solution.roots]
    assert min(abs(root - names["v"]) for root in found if np.isfinite(root)) < 1e-5 * size
    assert all(not count(root, "v") for root in solution.roots)


@given(
    *[st.floats(-3, 3).filter(lambda x: abs(x) > 0.1)] * 4,
    st.sampled_from(["a*v + b*v + c", "a*(v + b) - c*v", "(v*a + b)/c - v", "a - (v - b*v)*c"]),
)
def test_solution_of_a_linear_equation_satisfies_it(a, b, c, q, text):
    right = parse(text)
    solution = isolate(Symbol("q"), right, "v", signed=True)
    names = {"a": a, "b": b, "c": c, "q": q}
    root = value(solution.roots[0], names)
    assume(np.isfinite(root) and abs(root) < 1e4)
    assert value(right, {**names, "v": root}) == pytest.approx(q, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "signed", "roots"),
    [
        ("0.5*rho*v**2", False, 1),
        ("0.5*rho*v**2", True, 2),
        ("v**3", True, 1),
        ("v**0.5", False, 1),
        ("rho*exp(v)", True, 1),
    ],
)
def test_a_variable_that_cannot_be_negative_has_one_square_root(text, signed, roots):
    assert len(isolate(Symbol("q"), parse(text), "v", signed=signed).roots) == roots


@pytest.mark.parametrize(
    "text",
    [
        "sin(v)",  # not monotone
        "abs(v)",
        "max(v, 0)",
        "wrap(v)",
        "wrap(v) + v",  # slope two, but for the jumps
        "v*sin(v)",
        "v - v",  # holds v, says nothing of it
        "atan2(v, a)",
        "v**0.5",  # of a number that may be negative
    ],
)
def test_what_cannot_be_undone_has_no_solution(text):
    assert isolate(Symbol("q"), parse(text), "v", signed=True) is None


def test_nested_squares_do_not_explode():
    text = "v"
    for _ in range(20):
        text = f"({text})**2"
    assert isolate(Symbol("q"), parse(text), "v", signed=True) is None
