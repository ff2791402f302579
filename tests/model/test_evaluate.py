"""Values of expressions over columns, unknown ones included."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fdi.model.evaluate import evaluate, holds, wrap
from fdi.model.expression import Apply, Number, Symbol, parse, symbols

from .trees import NAMES, conditions, quantities

exact = quantities(functions=("sqrt", "abs", "sign"), exponents=(1.0, 2.0), max_leaves=8)
named = st.sampled_from(NAMES).map(Symbol)
values = st.floats(-1e3, 1e3, allow_nan=False)


def by_python(node, names):
    """One value by Python's own floats; NaN where it has none."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Symbol):
        return names[node.name]
    given = [by_python(argument, names) for argument in node.arguments]
    if any(math.isnan(value) for value in given):
        return math.nan
    match node.operator, given:
        case "+", [a, b]:
            return a + b
        case "-", [a]:
            return -a
        case "-", [a, b]:
            return a - b
        case "*", [a, b]:
            return a * b
        case "/", [a, b]:
            return a / b if b and math.isfinite(a / b) else math.nan
        case "**", [a, b]:
            return a * a if b == 2 else a
        case "sqrt", [a]:
            return math.sqrt(a) if a >= 0 else math.nan
        case "abs", [a]:
            return abs(a)
        case "sign", [a]:
            return float((a > 0) - (a < 0))
        case "min", _:
            return min(given)
        case "max", _:
            return max(given)
    raise AssertionError(node)


@given(exact, st.tuples(*[values] * len(NAMES)))
def test_value_equals_that_of_plain_floats(tree, numbers):
    names = dict(zip(NAMES, numbers, strict=True))
    expected = by_python(tree, names)
    assume(not math.isinf(expected))
    columns = {name: np.array([value, 1.0]) for name, value in names.items()}
    found = np.broadcast_to(evaluate(tree, columns), 2)[0]
    assert np.isnan(found) if math.isnan(expected) else found == expected


@pytest.mark.parametrize(
    "name", ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sqrt"]
)
def test_functions_are_those_of_mathematics(name):
    x = np.linspace(0.01, 0.99, 50)
    found = evaluate(Apply(name, (Symbol("x"),)), {"x": x})
    assert found == pytest.approx([getattr(math, name)(value) for value in x], rel=1e-14)


@given(quantities(leaf=named), st.tuples(*[values] * len(NAMES)), st.data())
def test_unknown_survives_every_operation(tree, numbers, data):
    hidden = data.draw(st.sampled_from(symbols(tree)))
    columns = {n: np.array([v, v]) for n, v in zip(NAMES, numbers, strict=True)}
    columns[hidden] = np.array([np.nan, columns[hidden][1]])
    assert np.isnan(evaluate(tree, columns)[0])


@pytest.mark.parametrize(
    "text", ["1/x", "atan(1/x)", "1/(1/x)", "x**(-1)", "log(x)", "exp(log(x))", "min(1/x, 5)"]
)
def test_a_division_by_zero_is_unknown_wherever_it_stands(text):
    assert np.isnan(evaluate(parse(text), {"x": np.array([0.0])})).all()


def test_no_result_is_infinite():
    assert np.isnan(evaluate(parse("exp(x)"), {"x": np.array([1e4])})).all()


def test_a_root_of_a_negative_number_is_unknown_or_its_real_part():
    columns = {"x": np.array([-4.0, 4.0, np.nan])}
    assert evaluate(parse("sqrt(x)"), columns).tolist()[1] == 2.0
    assert np.isnan(evaluate(parse("sqrt(x)"), columns)[[0, 2]]).all()
    real = evaluate(parse("sqrt(x)"), columns, real_part=True)
    assert real[:2].tolist() == [0.0, 2.0]
    assert np.isnan(real[2])


@given(st.floats(-1e4, 1e4))
def test_wrap_folds_into_half_open_turn(angle):
    folded = float(wrap(np.array([angle]))[0])
    assert -math.pi < folded <= math.pi
    assert math.cos(folded - angle) == pytest.approx(1.0, abs=1e-9)


NAN = np.nan


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x > 3", [0, 1, 0]),
        ("not (x > 3)", [1, 0, 0]),
        ("x != 3", [1, 1, 0]),
        ("x == x", [1, 1, 0]),
        ("x > 3 and flag", [0, 1, 0]),
        ("x > 3 or flag", [1, 1, 1]),
        ("not (x > 3 and not flag)", [1, 1, 1]),
        ("mode == 'AUTO'", [1, 1, 0]),
        ("mode != 'AUTO'", [0, 0, 1]),
        ("flag", [1, 1, 1]),
        ("fix >= 3", [1, 0, 0]),
        ("not fix", [0, 1, 0]),
    ],
)
def test_a_condition_on_something_unknown_does_not_hold(text, expected):
    """Kleene's logic: `or` with a true side is true whatever the other is, `not unknown` is not."""
    columns = {
        "x": np.array([1.0, 5.0, NAN]),
        "fix": np.array([3.0, 0.0, NAN]),
        "flag": np.array([True, True, True]),
        "mode": np.array(["AUTO", "AUTO", "RTL"], dtype=object),
    }
    assert holds(parse(text, condition=True), columns).astype(int).tolist() == expected


@given(conditions())
def test_a_condition_holds_or_does_not(tree):
    size = 3
    columns = {name: np.array([-1.0, 0.5, np.nan]) for name in NAMES}
    columns["mode"] = np.array(["AUTO", "FBWA", ""], dtype=object)
    columns["airborne"] = np.array([True, False, True])
    found = np.broadcast_to(holds(tree, columns), size)
    assert found.dtype == bool


def test_arguments_are_never_written():
    x = np.array([1.0, np.nan, -2.0])
    x.flags.writeable = False
    for text in ("x", "-x", "abs(x)", "max(x, 0)", "wrap(x)", "x**2"):
        evaluate(parse(text), {"x": x})


def test_longest_allowed_expression_is_evaluated():
    assert evaluate(parse("+".join(["x"] * 150)), {"x": np.ones(2)}).tolist() == [150, 150]


def test_a_condition_on_an_imaginary_root_does_not_hold():
    """Of a negative number nothing is known, and no root of it is below one."""
    given_ = {"x": np.array([-1.0, 0.25, 4.0])}
    assert holds(parse("sqrt(x) < 1", condition=True), given_).tolist() == [False, True, False]
    assert holds(parse("sqrt(x) >= 1", condition=True), given_).tolist() == [False, False, True]
