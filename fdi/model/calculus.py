"""Can an equation be solved for a variable, what is the solution, what is a derivative?

In: expressions. Out: expressions. An equation is solved here without a computer algebra system in
the two cases that make up nearly all of a model: the variable occurs once, so that the operations
around it can be undone one by one from the outside, or the equation is linear in it. Every
operation undone is monotone on the domain of its argument, or brings its second root along. What
is left over (a variable that occurs several times in a nonlinear way) is for sympy, or for Newton's
method, in ``fdi.residuals.solve``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from fdi.model.expression import (
    Apply,
    Expression,
    Number,
    Symbol,
    count,
    negative,
    substitute,
    symbols,
    walk,
)
from fdi.model.given import Given

ZERO: Final = Number(0.0)
ONE: Final = Number(1.0)
MAX_ROOTS: Final = 8
"""Nested squares double the roots each; beyond three the equation is solved numerically."""


def add(left: Expression, right: Expression) -> Expression:
    """Return a sum, zeros and numbers folded."""
    if isinstance(left, Number) and isinstance(right, Number):
        return Number(left.value + right.value)
    if left == ZERO:
        return right
    if right == ZERO:
        return left
    return Apply("+", (left, right))


def subtract(left: Expression, right: Expression) -> Expression:
    """Return a difference, zeros and numbers folded."""
    if isinstance(left, Number) and isinstance(right, Number):
        return Number(left.value - right.value)
    if right == ZERO:
        return left
    if left == ZERO:
        return negative(right)
    return Apply("-", (left, right))


def multiply(left: Expression, right: Expression) -> Expression:
    """Return a product, zeros, ones and numbers folded."""
    if isinstance(left, Number) and isinstance(right, Number):
        return Number(left.value * right.value)
    if ZERO in (left, right):
        return ZERO
    if left == ONE:
        return right
    if right == ONE:
        return left
    return Apply("*", (left, right))


def divide(left: Expression, right: Expression) -> Expression:
    """Return a quotient, zeros and ones folded."""
    if left == ZERO:
        return ZERO
    if right == ONE:
        return left
    if isinstance(left, Number) and isinstance(right, Number) and right.value:
        return Number(left.value / right.value)
    return Apply("/", (left, right))


def power(base: Expression, exponent: float) -> Expression:
    """Return a constant power, exponents 0 and 1 folded."""
    if exponent == 0:
        return ONE
    return base if exponent == 1 else Apply("**", (base, Number(exponent)))


def derivative(expression: Expression, name: str) -> Expression | None:
    """Return the partial derivative, or None where the expression has none (max, abs, a condition).

    Examples
    --------
    >>> from fdi.model.expression import parse, to_text
    >>> to_text(derivative(parse("v*sin(a) + v**2"), "v"))
    'sin(a) + 2*v'
    """
    if not count(expression, name):
        return ZERO
    if isinstance(expression, Symbol):
        return ONE
    if not isinstance(expression, Apply):
        return None
    inner = [derivative(argument, name) for argument in expression.arguments]
    if any(term is None for term in inner):
        return None
    return _chain(expression, [term for term in inner if term is not None])


def _chain(node: Apply, inner: list[Expression]) -> Expression | None:
    a, b = node.arguments[0], node.arguments[-1]
    da, db = inner[0], inner[-1]
    match node.operator, len(inner):
        case "+", _:
            return add(da, db)
        case "-", 1:
            return negative(da)
        case "-", _:
            return subtract(da, db)
        case "*", _:
            return add(multiply(da, b), multiply(a, db))
        case "/", _:
            return divide(subtract(multiply(da, b), multiply(a, db)), power(b, 2))
        case "**", _:
            exponent = b.value if isinstance(b, Number) else 0.0
            return multiply(multiply(Number(exponent), power(a, exponent - 1)), da)
        case "atan2", _:
            square = add(power(a, 2), power(b, 2))
            return divide(subtract(multiply(b, da), multiply(a, db)), square)
        case operator, _ if operator in OUTER:
            return multiply(OUTER[operator](a), da)
    return None


OUTER: Final[Mapping[str, Callable[[Expression], Expression]]] = {
    "sqrt": lambda a: divide(Number(0.5), Apply("sqrt", (a,))),
    "sin": lambda a: Apply("cos", (a,)),
    "cos": lambda a: negative(Apply("sin", (a,))),
    "tan": lambda a: divide(ONE, power(Apply("cos", (a,)), 2)),
    "asin": lambda a: divide(ONE, Apply("sqrt", (subtract(ONE, power(a, 2)),))),
    "acos": lambda a: negative(divide(ONE, Apply("sqrt", (subtract(ONE, power(a, 2)),)))),
    "atan": lambda a: divide(ONE, add(ONE, power(a, 2))),
    "exp": lambda a: Apply("exp", (a,)),
    "log": lambda a: divide(ONE, a),
    "wrap": lambda a: ONE,
}
"""Derivative of a function at its argument; wrap has slope one everywhere but at its jump."""

INVERSES: Final = {"exp": "log", "log": "exp", "asin": "sin", "acos": "cos", "atan": "tan"}
"""Functions that are monotone where they are defined, with what undoes them."""


@dataclass(frozen=True, slots=True)
class Solution:
    """What an equation gives for a variable: one expression for each root."""

    roots: tuple[Expression, ...]


def is_linear(residual: Expression, name: str) -> bool:
    """Return whether the expression is linear in a name."""
    if any(
        isinstance(n, Apply) and n.operator == "wrap" and count(n, name) for n in walk(residual)
    ):
        return False  # slope one, but for its jumps
    slope = derivative(residual, name)
    return slope not in (None, ZERO) and name not in symbols(slope)


def isolate(left: Expression, right: Expression, name: str, *, signed: bool) -> Solution | None:
    """Return the solution of ``left = right`` for a name, or None if undoing does not reach it.

    Parameters
    ----------
    left, right : Expression
        The two sides.
    name : str
        The variable sought.
    signed : bool
        Whether the variable may be negative; an even power then has two roots.

    Examples
    --------
    >>> from fdi.model.expression import parse, to_text
    >>> solution = isolate(parse("q"), parse("0.5*rho*v**2"), "v", signed=False)
    >>> [to_text(root) for root in solution.roots]
    ['sqrt(q/(0.5*rho))']
    """
    occurrences = count(left, name) + count(right, name)
    if occurrences == 1:
        holder, other = (left, right) if count(left, name) else (right, left)
        return _undo(holder, other, name, signed)
    residual = subtract(left, right)
    if occurrences > 1 and is_linear(residual, name):
        slope = derivative(residual, name)
        assert slope is not None
        return Solution((divide(negative(substitute(residual, {name: ZERO})), slope),))
    return None


def _undo(holder: Expression, other: Expression, name: str, signed: bool) -> Solution | None:
    """Undo the operations around the one occurrence of a name, from the outside in."""
    roots: tuple[Expression, ...] = (other,)
    while isinstance(holder, Apply):
        place = next(i for i, a in enumerate(holder.arguments) if count(a, name))
        inner = holder.arguments[place]
        stepped: list[Expression] = []
        for root in roots:
            step = _step(holder, place, root, inner, name, signed)
            if step is None:
                return None
            stepped.extend(step)
        if len(stepped) > MAX_ROOTS:
            return None
        roots, holder = tuple(stepped), inner
    return Solution(roots)


def _step(
    node: Apply, place: int, value: Expression, inner: Expression, name: str, signed: bool
) -> tuple[Expression, ...] | None:
    rest = node.arguments[1 - place] if len(node.arguments) == 2 else ZERO
    match node.operator, len(node.arguments), place:
        case "+", _, _:
            return (subtract(value, rest),)
        case "-", 1, _:
            return (negative(value),)
        case "-", _, 0:
            return (add(value, rest),)
        case "-", _, _:
            return (subtract(rest, value),)
        case "*", _, _:
            return (divide(value, rest),)
        case "/", _, 0:
            return (multiply(value, rest),)
        case "/", _, _:
            return (divide(rest, value),)
        case "**", _, _:
            return _root(node, value, inner == Symbol(name) and not signed)
        case "sqrt", _, _:
            return (power(value, 2),)
        case Given() as operator, 1, _:
            undone = operator.undone()
            return None if undone is None else (Apply(undone, (value,)),)
        case operator, 1, _ if operator in INVERSES:
            return (Apply(INVERSES[operator], (value,)),)
    return None


def _root(node: Apply, value: Expression, positive: bool) -> tuple[Expression, ...] | None:
    exponent = node.arguments[1].value if isinstance(node.arguments[1], Number) else 0.0
    if exponent in (2.0, -2.0):
        root = Apply("sqrt", (value if exponent > 0 else divide(ONE, value),))
        return (root,) if positive else (root, negative(root))
    if exponent == -1.0:
        return (divide(ONE, value),)
    if positive and exponent:
        return (power(value, 1.0 / exponent),)
    if exponent in (3.0, 5.0, 7.0):
        magnitude = power(Apply("abs", (value,)), 1.0 / exponent)
        return (multiply(Apply("sign", (value,)), magnitude),)
    return None
