"""Between which bounds do an expression and its slopes lie over a box of its unknowns?

In: an expression, what is known, and boxes. Out: bounds of its value and of its slopes, and boxes
made smaller by undoing its operations (hull consistency). Every operation is rounded outward, so no
root is ever lost; a function without a rule here lies between minus and plus infinity.

References
----------
Neumaier, Interval Methods for Systems of Equations, 1990; Benhamou, Goualard, Granvilliers, Puget,
"Revising hull and box consistency", ICLP 1999.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Final, NamedTuple

import numpy as np

from fdi.model.evaluate import Column, Floats, evaluate
from fdi.model.expression import Apply, Expression, Number, Symbol, count

TURN: Final = 2 * np.pi


class Bounds(NamedTuple):
    """Lower and upper bounds, arrays of one shape; where low is above high there is nothing."""

    low: Floats
    high: Floats


Unknowns = Mapping[str, tuple[int, Bounds]]
"""Of every unknown its place and its bounds, (b,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Enclosure:
    """Bounds of a value, (b,), and of its slopes, (m, b), None for what holds no unknown."""

    node: Expression
    value: Bounds
    slope: Bounds | None = None
    parts: tuple[Enclosure, ...] = ()


def enclose(node: Expression, unknowns: Unknowns, columns: Mapping[str, Column]) -> Enclosure:
    """Return bounds of an expression and its slopes.

    Parameters
    ----------
    node : Expression
    unknowns : mapping of str to (int, Bounds)
    columns : mapping of str to (b,) or scalar
        All that is known.
    """
    size = next(iter(unknowns.values()))[1].low.shape
    if not any(count(node, name) for name in unknowns):
        known = np.broadcast_to(evaluate(node, columns), size).astype(float)
        return Enclosure(node, _out(known, known))
    if isinstance(node, Symbol):
        place, own = unknowns[node.name]
        slope = np.zeros((len(unknowns), *size))
        slope[place] = 1.0
        return Enclosure(node, own, Bounds(slope, slope))
    assert isinstance(node, Apply)
    parts = tuple(enclose(argument, unknowns, columns) for argument in node.arguments)
    with np.errstate(all="ignore"):
        value, slope_bounds = _apply(node, parts, (len(unknowns), *size))
    return Enclosure(node, value, slope_bounds, parts)


def narrow(found: Enclosure, target: Bounds, box: dict[str, Bounds]) -> None:
    """Make a box smaller by what an expression must lie between.

    Parameters
    ----------
    found : Enclosure
    target : Bounds
    box : dict of str to Bounds
        By unknown, changed in place.
    """
    target = meet(found.value, target)
    nothing = target.low > target.high
    if nothing.any():
        for name, own in box.items():
            low, high = np.where(nothing, np.inf, own.low), np.where(nothing, -np.inf, own.high)
            box[name] = Bounds(low, high)
    if isinstance(found.node, Symbol):
        box[found.node.name] = meet(box[found.node.name], target)
        return
    with np.errstate(all="ignore"):
        for place, part in enumerate(found.parts):
            if part.slope is not None:
                inner = _undo(found, place, target)
                if inner is not None:
                    narrow(part, inner, box)


def meet(one: Bounds, other: Bounds) -> Bounds:
    """Return what lies between both."""
    return Bounds(np.maximum(one.low, other.low), np.minimum(one.high, other.high))


def _out(low: Floats, high: Floats) -> Bounds:
    """Round outward; what is not a number is not bounded."""
    low = np.where(np.isnan(low), -np.inf, low)
    high = np.where(np.isnan(high), np.inf, high)
    for _ in range(2):
        low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    return Bounds(low, high)


def _hull(*values: Floats) -> Bounds:
    return _out(reduce(np.minimum, values), reduce(np.maximum, values))


def _whole(shape: tuple[int, ...]) -> Bounds:
    return Bounds(np.full(shape, -np.inf), np.full(shape, np.inf))


def add(a: Bounds, b: Bounds) -> Bounds:
    """Return the bounds of a sum."""
    return _out(a.low + b.low, a.high + b.high)


def subtract(a: Bounds, b: Bounds) -> Bounds:
    """Return the bounds of a difference."""
    return _out(a.low - b.high, a.high - b.low)


def multiply(a: Bounds, b: Bounds) -> Bounds:
    """Return the bounds of a product; nothing times infinity is nothing."""
    corners = [np.where((x == 0) | (y == 0), 0.0, x * y) for x in a for y in b]
    return _hull(*corners)


def inverse(a: Bounds) -> Bounds:
    """Return the bounds of 1/a, unbounded where a may be zero within."""
    low, high = 1.0 / a.high, 1.0 / a.low
    low = np.where(a.high == 0, -np.inf, low)
    high = np.where(a.low == 0, np.inf, high)
    inside = (a.low < 0) & (a.high > 0)
    return _out(np.where(inside, -np.inf, low), np.where(inside, np.inf, high))


def _power(a: Bounds, exponent: float) -> Bounds:
    if exponent < 0:
        return inverse(_power(a, -exponent))
    if exponent == 0:
        return Bounds(np.ones_like(a.low), np.ones_like(a.low))
    if exponent % 2 == 1:
        return _out(a.low**exponent, a.high**exponent)
    if exponent % 2 == 0:
        low = np.where((a.low <= 0) & (a.high >= 0), 0.0, np.minimum(abs(a.low), abs(a.high)))
        high = np.maximum(np.abs(a.low), np.abs(a.high))
        low = np.where(low == 0, 0.0, low**exponent)
        return Bounds(np.maximum(_out(low, low).low, 0.0), _out(high, high**exponent).high)
    return _rising(a, lambda x: x**exponent, 0.0)


def _rising(
    a: Bounds, function: Callable[[Floats], Floats], least: float = -np.inf, most: float = np.inf
) -> Bounds:
    """Return the bounds of a rising function that is defined from ``least`` to ``most``."""
    bounds = _out(function(np.clip(a.low, least, most)), function(np.clip(a.high, least, most)))
    nothing = (a.high < least) | (a.low > most)
    return Bounds(np.where(nothing, np.inf, bounds.low), np.where(nothing, -np.inf, bounds.high))


def _cosine(a: Bounds) -> Bounds:
    whole = ~(a.high - a.low < TURN)
    top = np.floor(a.high / TURN) >= np.ceil(a.low / TURN)
    bottom = np.floor(a.high / TURN - 0.5) >= np.ceil(a.low / TURN - 0.5)
    ends = _hull(np.cos(a.low), np.cos(a.high))
    low = np.where(whole | bottom, -1.0, ends.low)
    return Bounds(low, np.where(whole | top, 1.0, ends.high))


def _sine(a: Bounds) -> Bounds:
    quarter = np.full_like(a.low, np.pi / 2)
    return _cosine(subtract(a, Bounds(quarter, quarter)))


def _tangent(a: Bounds) -> Bounds:
    pole = np.floor(a.high / np.pi - 0.5) >= np.ceil(a.low / np.pi - 0.5)
    ends = _out(np.tan(a.low), np.tan(a.high))
    cut = pole | ~np.isfinite(a.low) | ~np.isfinite(a.high)
    return Bounds(np.where(cut, -np.inf, ends.low), np.where(cut, np.inf, ends.high))


def _sqrt_slope(a: Bounds) -> Bounds:
    low = np.where(a.high > 0, 0.5 / np.sqrt(a.high), np.inf)
    return _out(low, np.where(a.low > 0, 0.5 / np.sqrt(np.maximum(a.low, 0)), np.inf))


def _arc_slope(a: Bounds) -> Bounds:
    square = _power(a, 2)
    inside = Bounds(1 - square.high, 1 - square.low)
    return inverse(_rising(inside, np.sqrt, 0.0))


def _one_plus_square(a: Bounds) -> Bounds:
    square = _power(a, 2)
    return _out(1 + square.low, 1 + square.high)


def _negative(a: Bounds) -> Bounds:
    return Bounds(-a.high, -a.low)


def _absolute(a: Bounds) -> Bounds:
    low = np.where((a.low <= 0) & (a.high >= 0), 0.0, np.minimum(abs(a.low), abs(a.high)))
    return Bounds(low, np.maximum(np.abs(a.low), np.abs(a.high)))


def _sign(a: Bounds) -> Bounds:
    return Bounds(np.sign(a.low), np.sign(a.high))


def _sign_slope(a: Bounds) -> Bounds:
    jumps = (a.low <= 0) & (a.high >= 0)
    return Bounds(np.where(jumps, -np.inf, 0.0), np.where(jumps, np.inf, 0.0))


def _wrapped(a: Bounds) -> Bounds:
    turns = np.ceil((a.low - np.pi) / TURN)
    jumps = ~(turns == np.ceil((a.high - np.pi) / TURN))
    shifted = _out(a.low - turns * TURN, a.high - turns * TURN)
    return Bounds(np.where(jumps, -np.pi, shifted.low), np.where(jumps, np.pi, shifted.high))


def _wrap_slope(a: Bounds) -> Bounds:
    jumps = ~(np.ceil((a.low - np.pi) / TURN) == np.ceil((a.high - np.pi) / TURN))
    return Bounds(np.where(jumps, -np.inf, 1.0), np.where(jumps, np.inf, 1.0))


_ONE: Final[Mapping[str, tuple[Callable[[Bounds], Bounds], Callable[[Bounds, Bounds], Bounds]]]] = {
    "sqrt": (lambda a: _rising(a, np.sqrt, 0.0), lambda a, y: _sqrt_slope(a)),
    "exp": (lambda a: _rising(a, np.exp), lambda a, y: y),
    "log": (lambda a: _rising(a, np.log, 0.0), lambda a, y: inverse(a)),
    "sin": (_sine, lambda a, y: _cosine(a)),
    "cos": (_cosine, lambda a, y: _negative(_sine(a))),
    "tan": (_tangent, lambda a, y: _one_plus_square(y)),
    "asin": (lambda a: _rising(a, np.arcsin, -1, 1), lambda a, y: _arc_slope(a)),
    "acos": (
        lambda a: _negative(_rising(a, lambda x: -np.arccos(x), -1, 1)),
        lambda a, y: _negative(_arc_slope(a)),
    ),
    "atan": (lambda a: _rising(a, np.arctan), lambda a, y: inverse(_one_plus_square(a))),
    "abs": (_absolute, lambda a, y: _sign(a)),
    "sign": (_sign, lambda a, y: _sign_slope(a)),
    "wrap": (_wrapped, lambda a, y: _wrap_slope(a)),
}
"""Functions of one argument: their bounds, and those of their slope by argument and value."""


def _apply(
    node: Apply, parts: tuple[Enclosure, ...], shape: tuple[int, ...]
) -> tuple[Bounds, Bounds]:
    zero = Bounds(np.zeros(shape), np.zeros(shape))
    values = [part.value for part in parts]
    slopes = [zero if part.slope is None else part.slope for part in parts]
    match node.operator, len(parts):
        case "+", 2:
            return add(*values), add(*slopes)
        case "-", 1:
            return _negative(values[0]), _negative(slopes[0])
        case "-", 2:
            return subtract(*values), subtract(*slopes)
        case "*", 2:
            a, b = values
            if node.arguments[0] == node.arguments[1]:
                twice = multiply(Bounds(2 * a.low, 2 * a.high), slopes[0])
                return _power(a, 2), twice
            return multiply(a, b), add(multiply(a, slopes[1]), multiply(b, slopes[0]))
        case "/", 2:
            upside = inverse(values[1])
            value = multiply(values[0], upside)
            return value, multiply(subtract(slopes[0], multiply(value, slopes[1])), upside)
        case "**", 2 if isinstance(exponent := node.arguments[1], Number):
            n = float(exponent.value)
            rate = multiply(_number(n, shape[1:]), _power(values[0], n - 1))
            return _power(values[0], n), multiply(rate, slopes[0])
        case ("min" | "max") as name, _:
            pick = np.minimum if name == "min" else np.maximum
            value = Bounds(
                reduce(pick, [v.low for v in values]), reduce(pick, [v.high for v in values])
            )
            low, high = [s.low for s in slopes], [s.high for s in slopes]
            return value, Bounds(reduce(np.minimum, low), reduce(np.maximum, high))
        case "atan2", 2:
            return _angle(values, slopes)
        case name, 1 if name in _ONE:
            own, slope = _ONE[name]
            value = own(values[0])
            return value, multiply(slope(values[0], value), slopes[0])
    return _whole(shape[1:]), _whole(shape)


def _number(value: float, shape: tuple[int, ...]) -> Bounds:
    return Bounds(np.full(shape, value), np.full(shape, value))


def _angle(values: list[Bounds], slopes: list[Bounds]) -> tuple[Bounds, Bounds]:
    """Return the bounds of atan2(y, x): at the corners, where its cut is not in the box."""
    y, x = values
    cut = (x.low <= 0) & (y.low <= 0) & (y.high >= 0)
    corners = _hull(*(np.arctan2(b, a) for a in x for b in y))
    value = Bounds(np.where(cut, -np.pi, corners.low), np.where(cut, np.pi, corners.high))
    radius = inverse(add(_power(x, 2), _power(y, 2)))
    turning = subtract(multiply(x, slopes[0]), multiply(y, slopes[1]))
    slope = multiply(turning, radius)
    return value, Bounds(np.where(cut, -np.inf, slope.low), np.where(cut, np.inf, slope.high))


def _undo(found: Enclosure, place: int, target: Bounds) -> Bounds | None:
    """Return between which bounds an argument must lie, None where no rule tells."""
    assert isinstance(found.node, Apply)
    parts = [part.value for part in found.parts]
    other = parts[1 - place] if len(parts) == 2 else parts[0]
    match found.node.operator, len(parts), place:
        case "+", 2, _:
            return subtract(target, other)
        case "-", 1, _:
            return _negative(target)
        case "-", 2, 0:
            return add(target, other)
        case "-", 2, _:
            return subtract(other, target)
        case "*", 2, _ if found.node.arguments[0] == found.node.arguments[1]:
            return _root(target, 2.0, parts[0])
        case "*", 2, _:
            # Where both may be zero, anything may be the other factor.
            free = (other.low <= 0) & (other.high >= 0) & (target.low <= 0) & (target.high >= 0)
            quotient = multiply(target, inverse(other))
            return Bounds(
                np.where(free, -np.inf, quotient.low), np.where(free, np.inf, quotient.high)
            )
        case "/", 2, 0:
            return multiply(target, other)
        case "/", 2, _:
            free = (target.low <= 0) & (target.high >= 0)
            quotient = multiply(other, inverse(target))
            return Bounds(
                np.where(free, -np.inf, quotient.low), np.where(free, np.inf, quotient.high)
            )
        case "**", 2, 0 if isinstance(exponent := found.node.arguments[1], Number):
            return _root(target, float(exponent.value), parts[0])
        case "sqrt", 1, _:
            return _power(Bounds(np.maximum(target.low, 0.0), target.high), 2)
        case "exp", 1, _:
            return _rising(target, np.log, 0.0)
        case "log", 1, _:
            return _rising(target, np.exp)
        case "asin", 1, _:
            return _rising(target, np.sin, -np.pi / 2, np.pi / 2)
        case "atan", 1, _:
            return _rising(target, np.tan, -np.pi / 2, np.pi / 2)
        case "atan2", 2, _:
            return _leg(target, place, other)
        case "abs", 1, _:
            return _root(_power(target, 2), 2.0, parts[0])
    return None


def _root(target: Bounds, exponent: float, base: Bounds) -> Bounds | None:
    """Return between which bounds a base must lie whose power lies between some."""
    if exponent < 0:
        return _root(inverse(target), -exponent, base)
    if exponent == 0:
        return None
    if exponent % 2 == 1:
        ends = [np.sign(end) * np.abs(end) ** (1 / exponent) for end in target]
        return _out(ends[0], ends[1])
    size = _rising(target, lambda x: x ** (1 / exponent), 0.0)
    if exponent % 2 == 0:
        size = Bounds(np.where(size.low < 0, 0.0, size.low), size.high)
        low = np.where(base.low >= 0, size.low, -size.high)
        high = np.where(base.high <= 0, -size.low, size.high)
        return Bounds(low, high)
    return size


def _leg(target: Bounds, place: int, other: Bounds) -> Bounds:
    """Return where y (place 0) or x of an angle must lie, the other given: y = x tan(angle)."""
    slope = _tangent(target)
    if place == 0:
        line = multiply(other, slope)
        positive, negative = target.low > 0, target.high < 0
    else:
        free = (slope.low <= 0) & (slope.high >= 0)
        line = multiply(other, inverse(slope))
        line = Bounds(np.where(free, -np.inf, line.low), np.where(free, np.inf, line.high))
        positive = (target.low > -np.pi / 2) & (target.high < np.pi / 2)
        negative = (target.low > np.pi / 2) | (target.high < -np.pi / 2)
    side = Bounds(np.where(positive, 0.0, -np.inf), np.where(negative, 0.0, np.inf))
    return meet(line, side)
