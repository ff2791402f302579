"""What is kept on disk comes back as it was, and whatever else stands there is refused."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import EntryError
from fdi.model import load_airframe, shipped_models
from fdi.model.airframe import Airframe
from fdi.model.codec import MAX_LEVELS, MAX_TEXT, MAX_TOKENS, decode, encode
from fdi.model.expression import FUNCTIONS, Apply, Expression, Number, Symbol, parse
from fdi.model.parts import Equation, Kind

from .trees import conditions, quantities

REFUSED = (EntryError, ValueError, TypeError, KeyError, AttributeError, OverflowError)
"""What :func:`fdi.model.cache.recall` takes for a damaged entry."""
plain = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5),
    st.sampled_from(["a", "+", "sin", "limit", "v_ground"]),
)  # fmt: skip
trees = st.recursive(
    plain,
    lambda inner: st.one_of(
        st.lists(inner, max_size=6),
        st.dictionaries(st.sampled_from(["text", "a", "looked"]), inner, max_size=3),
        st.tuples(st.sampled_from(["+", "-", "min", "der", "no", "=="]), st.integers(-1, 4)).map(
            list
        ),
    ),
    max_leaves=25,
)


def through_json(value, kind):
    return decode(kind, json.loads(json.dumps(encode(value))))


@given(st.one_of(quantities(), conditions()))
def test_an_expression_comes_back_as_it_was(expression):
    assert through_json(expression, Expression) == expression


@pytest.mark.parametrize("name", shipped_models())
def test_a_shipped_model_comes_back_as_it_was(name):
    airframe = load_airframe(name)
    back = through_json(airframe, Airframe)
    for field in airframe.__slots__:
        assert getattr(back, field) == getattr(airframe, field), field
        value = getattr(airframe, field)
        assert not isinstance(value, dict) or list(getattr(back, field)) == list(value)


@given(trees, st.sampled_from([Expression, Airframe, Equation, tuple[Equation, ...], Kind]))
@settings(max_examples=300)
def test_any_other_tree_is_refused_by_an_error_that_is_caught(tree, kind):
    try:
        value = decode(kind, tree)
    except REFUSED:
        return
    assert through_json(value, kind) == value


@given(st.lists(st.one_of(plain, st.tuples(st.text(max_size=3), st.integers(-2, 3)).map(list))))
def test_what_is_read_as_an_expression_is_one_of_the_language(tokens):
    """Whatever tokens say: nothing that evaluation does not know."""
    try:
        expression = decode(Expression, tokens)
    except REFUSED:
        return
    assert decode(Expression, encode(expression)) == expression


def deep(levels):
    expression = Symbol("x")
    for _ in range(levels):
        expression = Apply("-", (expression,))
    return expression


def test_depth_and_size_have_bounds_and_need_no_recursion():
    tree = encode(deep(MAX_LEVELS))
    assert encode(decode(Expression, tree)) == tree
    with pytest.raises(EntryError, match="nested deeper"):
        decode(Expression, ["x", *[["-", 1]] * 50_000][:MAX_TOKENS])
    with pytest.raises(EntryError, match="nodes"):
        decode(Expression, [1.0] * (MAX_TOKENS + 1))


@pytest.mark.parametrize(
    "tokens",
    [
        [],
        ["x", "y"],
        [["+", 2]],
        ["x", ["+", 1]],
        ["x", "y", ["__import__", 2]],
        ["x", ["sin", 2]],
        ["x", "y", ["**", 2]],
        ["x", float("inf"), ["**", 2]],
        ["x", 1.0, ["<", 2], "y", ["+", 2]],
        ["x", 1.0, ["+", 2], ["not", 1]],
        [{"text": "AUTO"}],
        [{"text": "AUTO"}, "mode", ["==", 2]],
        ["x; y"],
        [*["x", 1.0, ["<", 2]] * 1001, ["and", 1001]],
        [*["x", 1.0, ["<", 2]] * 1001, ["or", 1001]],
        [True],
    ],
)
def test_what_the_parser_would_refuse_is_refused_here(tokens):
    with pytest.raises(EntryError):
        decode(Expression, tokens)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_comes_back_with_as_few_and_as_many_arguments_as_it_takes(name):
    for count in FUNCTIONS[name]:
        expression = parse(f"{name}({', '.join(['x', *['2'] * (count - 1)])})")
        assert decode(Expression, encode(expression)) == expression
    few, most = FUNCTIONS[name]
    for count in (few - 1, most + 1):
        with pytest.raises(EntryError, match=r"arguments|not a node"):
            decode(Expression, [*["x"] * count, [name, count]])


@pytest.mark.parametrize(
    ("kind", "tree"),
    [
        (Mapping[str, float], [["x", 1.0]]),
        (Mapping[str, float], {"x": "1"}),
        (bool, 1),
        (bool, "true"),
        (bool | None, 0),
        (float, True),
        (float, "1"),
        (int, 1.0),
        (str, 1),
        (Literal["left", "right"], "up"),
        (tuple[int, str], [1]),
        (tuple[int, str], [1, "a", 2]),
        (tuple[int, ...], {"0": 1}),
        (frozenset[str], "ab"),
        (str, "x" * (MAX_TEXT + 1)),
    ],
)
def test_a_tree_of_another_kind_is_refused(kind, tree):
    with pytest.raises(REFUSED):
        decode(kind, tree)


@pytest.mark.parametrize(
    ("kind", "tree", "value"),
    [
        (Mapping[str, float], {"x": 1}, {"x": 1.0}),
        (bool | None, None, None),
        (bool | None, True, True),
        (float | None, 2, 2.0),
        (Literal["left", "right"], "left", "left"),
        (tuple[int, str], [1, "a"], (1, "a")),
        (frozenset[str], ["a", "b"], frozenset("ab")),
        (str, "x" * MAX_TEXT, "x" * MAX_TEXT),
    ],
)
def test_a_tree_of_its_kind_is_read(kind, tree, value):
    assert decode(kind, tree) == value


def test_a_value_of_another_shape_is_refused():
    equation = Equation(
        "k", Kind.RELATION, "x = 1", Symbol("x"), Number(1.0), parse("x > 0", condition=True)
    )
    tree = encode(equation)
    assert decode(Equation, tree) == equation
    for place, wrong in ((0, 1), (1, "no kind"), (3, "x"), (6, 5), (7, True), (8, [])):
        with pytest.raises(REFUSED):
            decode(Equation, [*tree[:place], wrong, *tree[place + 1 :]])
    with pytest.raises(REFUSED):
        decode(Equation, tree[:-1])
    with pytest.raises(EntryError, match="is not written"):
        encode(replace(equation, text=object()))
