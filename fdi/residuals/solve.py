"""What does an equation give for an unknown?

In: an equation of a system and the unknown it is matched to. Out: one expression per root. Undoing
operations and linear equations (``fdi.model.calculus``) covers nearly every edge of the shipped
models; sympy is imported only for what is left, for instance a variable that occurs in two powers.
What sympy cannot solve within its own means is solved by Newton's method (``newton.py``) instead.
"""

from __future__ import annotations

from functools import reduce
from typing import Any, Final

from fdi.model.calculus import isolate, subtract
from fdi.model.expression import (
    FUNCTIONS,
    Apply,
    Expression,
    Number,
    Symbol,
    count,
    walk,
)
from fdi.model.parts import Variable
from fdi.model.system import SystemEquation

MAX_OCCURRENCES: Final = 3
"""Beyond this sympy takes seconds, and what it finds is a formula of pages."""
TRANSCENDENTAL: Final = ("sin", "cos", "exp", "log")
EXPONENTS: Final = (-2, -1, 0.5, 2, 3, 4)


class _NumericalError(Exception):
    """An expression, or a root that sympy found, for which the language has no formula."""


def solve(equation: SystemEquation, name: str, variable: Variable) -> tuple[Expression, ...] | None:
    """Return the roots of an equation for one of its unknowns, or None if no formula is found.

    Examples
    --------
    >>> from fdi.model.expression import parse, to_text
    >>> from fdi.model.parts import Kind
    >>> q = SystemEquation("m", Kind.RELATION, parse("q"), parse("a*v**2 + b*v"), {})
    >>> len(solve(q, "v", Variable("v", "m/s")))
    2
    """
    signed = variable.low is None or variable.low < 0
    solution = isolate(equation.left, equation.right, name, signed=signed)
    if solution is not None:
        return solution.roots
    return _by_sympy(equation, name)


def _by_sympy(equation: SystemEquation, name: str) -> tuple[Expression, ...] | None:
    difference = subtract(equation.right, equation.left)
    outer = [n for n in walk(difference) if isinstance(n, Apply) and n.operator in TRANSCENDENTAL]
    inside = sum(count(node, name) for node in outer)
    if count(difference, name) > MAX_OCCURRENCES or 0 < inside != count(difference, name):
        return None
    import sympy

    unknown = sympy.Symbol("x", real=True)
    known: dict[Expression, Any] = {}
    try:
        roots = sympy.solve(_to_sympy(difference, name, unknown, known), unknown)
        back = {symbol: part for part, symbol in known.items()}
        return tuple(_from_sympy(root, back) for root in roots) or None
    # sympy's words for "I cannot", and for a complex number
    except (_NumericalError, NotImplementedError, ValueError, TypeError):
        return None


def _to_sympy(node: Expression, name: str, unknown: Any, known: dict[Expression, Any]) -> Any:
    """Return sympy's form; what does not hold the unknown becomes one symbol."""
    import sympy

    if node == Symbol(name):
        return unknown
    if isinstance(node, Number):
        return sympy.nsimplify(node.value, rational=True)
    if not count(node, name):
        return known.setdefault(node, sympy.Symbol(f"k{len(known)}", real=True))
    if not isinstance(node, Apply):
        raise _NumericalError("not a quantity")
    inner = [_to_sympy(argument, name, unknown, known) for argument in node.arguments]
    match node.operator, inner:
        case "+", [left, right]:
            return left + right
        case "-", [only]:
            return -only
        case "-", [left, right]:
            return left - right
        case "*", [left, right]:
            return left * right
        case "/", [left, right]:
            return left / right
        case "**", [base, exponent] if exponent in EXPONENTS:
            return base**exponent
        case (("sqrt" | "sin" | "cos" | "exp" | "log"), [only]):
            return getattr(sympy, node.operator)(only)
    # sympy loses roots of abs, sign, min, max and atan2, and takes seconds over other powers.
    raise _NumericalError(f"{node.operator} is solved numerically")


def _from_sympy(value: Any, known: dict[Any, Expression]) -> Expression:
    if value.is_Symbol:
        return known[value]
    if value.is_number:
        return Number(float(value))
    inner = [_from_sympy(argument, known) for argument in value.args]
    operator = {"Add": "+", "Mul": "*"}.get(value.func.__name__)
    if operator:
        return reduce(lambda left, right: Apply(operator, (left, right)), inner)
    if value.is_Pow:
        if not isinstance(inner[1], Number):
            raise _NumericalError("an exponent that is not a number")
        if inner[1].value == 0.5:
            return Apply("sqrt", (inner[0],))
        return Apply("**", (inner[0], inner[1]))
    name = {"Abs": "abs"}.get(value.func.__name__, value.func.__name__)
    if name not in FUNCTIONS:
        raise _NumericalError(f"{name} is not a function of the language")
    return Apply(name, tuple(inner))
