"""Bounds of expressions over boxes: no value, slope or solution is lost, and none is needless."""

import numpy as np
import pytest

from fdi.model.evaluate import evaluate
from fdi.model.expression import Number, parse
from fdi.residuals.interval import Bounds, enclose, inverse, meet, multiply, narrow

ONE = [
    *("-x", "x*x", "x**2", "x**3", "x**(-2)", "x**(-3)", "x**1.5", "sqrt(x)", "exp(x)", "log(x)"),
    *("x**0", "x**0.5", "x**(-0.5)", "x**4"),
    *("sin(x)", "cos(x)", "tan(x)", "asin(x)", "acos(x)", "atan(x)", "abs(x)", "wrap(x)"),
]
TWO = ["x + y", "x - y", "y - x", "x*y", "x/y", "y/x", "atan2(x, y)", "atan2(y, x)"]
PICK = ["min(x, y)", "max(x, y)"]
OTHERS = ["sign(x)", "sin(x*y) - 2*cos(x)", "sqrt(x**2 + y**2) - 1", "3 - x/(1 + y**2)"]
EVERY = pytest.mark.parametrize("text", [*ONE, *TWO, *PICK, *OTHERS])
UNDONE = ["-x", "x*x", "x**2", "x**3", "x**(-2)", "x**(-3)", "x**1.5", "sqrt(x)", "exp(x)"]
UNDONE += ["x**0.5", "x**(-0.5)", "x**4", "x**(-1)", "log(x)", "asin(x)", "atan(x)", "abs(x)", *TWO]
BOXES, POINTS = 400, 5


def boxes(seed=0):
    """Boxes of x and y, (2, BOXES), some with an edge at zero, and points within them."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.uniform(-5, 5, (2, 2, BOXES)) * rng.choice([0.1, 1.0], BOXES), axis=0)
    edges[0, :, :20], edges[1, :, 20:40] = np.maximum(edges[0, :, :20], 0.0), edges[1, :, 20:40]
    edges[0, :, :20] = 0.0 * edges[0, :, :20]
    edges[1, :, :20] = np.abs(edges[1, :, :20])
    share = rng.uniform(0, 1, (POINTS, 2, BOXES))
    share[0], share[1] = 0.0, 1.0
    return edges, np.clip(edges[0] + share * (edges[1] - edges[0]), edges[0], edges[1])


def enclosed(text, edges):
    unknowns = {n: (i, Bounds(edges[0, i], edges[1, i])) for i, n in enumerate("xy")}
    return enclose(parse(text), unknowns, {})


def value(text, point):
    with np.errstate(all="ignore"):
        found = evaluate(parse(text), {"x": point[0], "y": point[1]})
    return np.broadcast_to(found, point[0].shape)


@EVERY
def test_no_value_within_a_box_is_outside_its_bounds(text):
    edges, points = boxes()
    found = enclosed(text, edges).value
    for point in points:
        own = value(text, point)
        known = np.isfinite(own)
        assert known.any()
        slack = 1e-14 * (text == "wrap(x)")  # whose evaluation goes another way round
        assert (found.low[known] <= own[known] + slack).all()
        assert (own[known] - slack <= found.high[known]).all()


@EVERY
@pytest.mark.parametrize("place", [0, 1])
def test_no_secant_within_a_box_is_steeper_than_its_slopes_say(text, place):
    """By the mean value theorem, which says nothing across a pole: there no value is bounded."""
    edges, points = boxes()
    whole = enclosed(text, edges)
    found, bounded = whole.slope, np.isfinite(whole.value.low) & np.isfinite(whole.value.high)
    for point in points[2:]:
        other = point.copy()
        other[place] = points[0][place]
        rise, run = value(text, point) - value(text, other), point[place] - other[place]
        known = np.isfinite(rise) & (run > 1e-3) & bounded
        secant = rise[known] / run[known]
        slack = 1e-9 * (1 + np.abs(secant))
        assert known.any()
        assert (found.low[place, known] <= secant + slack).all()
        assert (secant - slack <= found.high[place, known]).all()


@pytest.mark.parametrize("text", [*ONE, *TWO, *OTHERS])
@pytest.mark.parametrize("at", [(0.7, 0.4), (0.3, 0.8)])
def test_bounds_of_a_point_are_its_value_and_its_slopes(text, at):
    point, step = np.array(at)[:, None], 1e-6
    found = enclosed(text, np.array([point, point]))
    assert np.ravel(found.value) == pytest.approx(value(text, point)[0], abs=1e-12)
    for place in (0, 1):
        side = step * np.eye(2)[place][:, None]
        slope = (value(text, point + side) - value(text, point - side))[0] / (2 * step)
        assert [bound[place, 0] for bound in found.slope] == pytest.approx([slope] * 2, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "low", "high", "expected"),
    [
        ("cos(x)", -0.5, 0.2, (np.cos(0.5), 1.0)),
        ("cos(x)", 3.0, 3.5, (-1.0, np.cos(3.5))),
        ("cos(x)", 0.5, 7.0, (-1.0, 1.0)),
        ("cos(x)", 0.5, 2.5, (np.cos(2.5), np.cos(0.5))),
        ("sin(x)", 1.0, 2.0, (np.sin(1.0), 1.0)),
        ("sin(x)", -2.0, -1.0, (-1.0, np.sin(-1.0))),
        ("tan(x)", 1.0, 2.0, (-np.inf, np.inf)),
        ("tan(x)", -1.0, 1.0, (np.tan(-1.0), np.tan(1.0))),
        ("x**2", -3.0, 2.0, (0.0, 9.0)),
        ("x**2", -3.0, -2.0, (4.0, 9.0)),
        ("x**3", -3.0, 2.0, (-27.0, 8.0)),
        ("x**(-2)", 2.0, 4.0, (1 / 16, 1 / 4)),
        ("x**1.5", 4.0, 9.0, (8.0, 27.0)),
        ("abs(x)", -3.0, 2.0, (0.0, 3.0)),
        ("abs(x)", -3.0, -2.0, (2.0, 3.0)),
        ("1/x", -1.0, 1.0, (-np.inf, np.inf)),
        ("1/x", 0.0, 2.0, (0.5, np.inf)),
        ("1/x", -2.0, 0.0, (-np.inf, -0.5)),
        ("wrap(x)", 4.0, 5.0, (4.0 - 2 * np.pi, 5.0 - 2 * np.pi)),
        ("wrap(x)", 3.0, 4.0, (-np.pi, np.pi)),
        ("max(x, 1)", -3.0, 2.0, (1.0, 2.0)),
        ("min(x, 1)", -3.0, 2.0, (-3.0, 1.0)),
        ("acos(x)", 0.0, 1.0, (0.0, np.pi / 2)),
        ("sqrt(x)", -1.0, 4.0, (0.0, 2.0)),
        ("sign(x)", -1.0, 4.0, (-1.0, 1.0)),
        ("x*x - x*x", 1.0, 2.0, (-3.0, 3.0)),
        ("atan2(1, x)", -1.0, 1.0, (np.pi / 4, 3 * np.pi / 4)),
        ("atan2(x, -1)", -1.0, 1.0, (-np.pi, np.pi)),
    ],
)
def test_bounds_over_a_box_are_as_known(text, low, high, expected):
    found = enclose(parse(text), {"x": (0, Bounds(np.array([low]), np.array([high])))}, {})
    assert np.ravel(found.value) == pytest.approx(expected, abs=1e-9)


def narrowed(text, edges, target):
    box = {name: Bounds(edges[0, i], edges[1, i]) for i, name in enumerate("xy")}
    narrow(enclosed(text, edges), target, box)
    return box


@EVERY
def test_no_solution_is_lost_when_a_box_is_made_smaller(text):
    edges, points = boxes(1)
    for point in points:
        own = value(text, point)
        known = np.isfinite(own)
        slack = 1e-9 * (1 + np.abs(own))
        low, high = np.where(known, own - slack, -np.inf), np.where(known, own + slack, np.inf)
        for i, bounds in enumerate(narrowed(text, edges, Bounds(low, high)).values()):
            assert (bounds.low <= point[i] + 1e-9)[known].all()
            assert (point[i] - 1e-9 <= bounds.high)[known].all()


@pytest.mark.parametrize("text", UNDONE)
def test_one_operation_undone_leaves_its_solution_alone(text):
    """x within 0.1 to 0.9 and y known: the value tells x."""
    solution = np.array([[0.7], [0.4]])
    edges = np.array([[[0.1], [0.4]], [[0.9], [0.4]]])
    own = value(text, solution)
    found = narrowed(text, edges, Bounds(own, own))["x"]
    assert np.ravel(found) == pytest.approx([0.7, 0.7], abs=1e-9)


@pytest.mark.parametrize(("text", "x"), [("x**2", -0.7), ("x*x", -0.7), ("abs(x)", -0.7)])
def test_an_even_power_is_undone_on_the_side_where_the_box_lies(text, x):
    own = value(text, np.array([[x], [0.0]]))
    found = narrowed(text, np.array([[[-2.0], [0.0]], [[-0.1], [0.0]]]), Bounds(own, own))["x"]
    assert np.ravel(found) == pytest.approx([x, x], abs=1e-9)
    both = narrowed(text, np.array([[[-2.0], [0.0]], [[2.0], [0.0]]]), Bounds(own, own))["x"]
    assert np.ravel(both) == pytest.approx([x, -x], abs=1e-9)


def test_a_box_without_a_solution_has_nothing_left():
    edges = np.array([[[1.0], [1.0]], [[2.0], [2.0]]])
    for bounds in narrowed("x + y", edges, Bounds(np.array([9.0]), np.array([9.5]))).values():
        assert bounds.low > bounds.high


def test_where_both_factors_may_be_zero_the_other_may_be_anything():
    edges = np.array([[[-5.0], [-1.0]], [[5.0], [1.0]]])
    zero = Bounds(np.array([-0.1]), np.array([0.1]))
    assert np.ravel(narrowed("x*y", edges, zero)["x"]).tolist() == [-5.0, 5.0]
    zero = Bounds(np.array([0.0]), np.array([0.0]))
    assert np.ravel(narrowed("x/y", edges, zero)["y"]).tolist() == [-1.0, 1.0]


def test_a_known_number_is_its_own_bounds():
    box = Bounds(np.array([0.0]), np.array([1.0]))
    found = enclose(Number(3.0), {"x": (0, box)}, {})
    assert found.slope is None
    assert np.ravel(found.value) == pytest.approx([3.0, 3.0], abs=1e-12)


def test_nothing_times_infinity_is_nothing():
    zero, whole = Bounds(np.zeros(1), np.zeros(1)), inverse(Bounds(-np.ones(1), np.ones(1)))
    assert np.ravel(whole).tolist() == [-np.inf, np.inf]
    with np.errstate(invalid="ignore"):
        found = multiply(zero, whole)
    assert np.abs(np.ravel(found)).max() < 1e-300
    assert np.ravel(meet(zero, whole)).tolist() == [0.0, 0.0]


def test_what_has_no_rule_lies_anywhere_and_tells_nothing():
    edges = np.array([[[1.0], [1.0]], [[2.0], [2.0]]])
    found = enclosed("bit(x, 1)", edges)
    for low, high in (found.value, found.slope):
        assert np.isneginf(low).all()
        assert np.isposinf(high).all()
    one = Bounds(np.ones(1), np.ones(1))
    assert np.ravel(narrowed("bit(x, 1)", edges, one)["x"]).tolist() == [1.0, 2.0]
