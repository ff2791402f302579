"""What does an equation give for an unknown?

In: an equation of a system and the unknown it is matched to. Out: one expression per root. Undoing
operations and linear equations (``fdi.model.calculus``) covers nearly every edge of the shipped
models; sympy is imported only for what is left, for instance a variable that occurs in two powers.
What sympy cannot solve within its own means is solved by Newton's method (``newton.py``) instead.
"""

from __future__ import annotations

from typing import Any

from fdi.model.calculus import isolate
from fdi.model.expression import Apply, Expression, Number, Symbol, symbols
from fdi.model.parts import Variable
from fdi.model.system import SystemEquation


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
    import sympy

    names = dict.fromkeys((*symbols(equation.left), *symbols(equation.right)))
    table = {n: sympy.Symbol(f"x{i}", real=True) for i, n in enumerate(names)}
    try:
        difference = _to_sympy(equation.right, table) - _to_sympy(equation.left, table)
        roots = sympy.solve(difference, table[name])
        back = {symbol: n for n, symbol in table.items()}
        return tuple(_from_sympy(root, back) for root in roots) or None
    except (NotImplementedError, ValueError):  # sympy's own words for "I cannot"
        return None


def _to_sympy(expression: Expression, table: dict[str, Any]) -> Any:
    import sympy

    functions = {"abs": sympy.Abs, "min": sympy.Min, "max": sympy.Max}
    match expression:
        case Number(value):
            return sympy.nsimplify(value, rational=True)
        case Symbol(name):
            return table[name]
        case Apply("-", (argument,)):
            return -_to_sympy(argument, table)
        case Apply(operator, arguments):
            inner = [_to_sympy(argument, table) for argument in arguments]
            match operator:
                case "+":
                    return inner[0] + inner[1]
                case "-":
                    return inner[0] - inner[1]
                case "*":
                    return inner[0] * inner[1]
                case "/":
                    return inner[0] / inner[1]
                case "**":
                    return inner[0] ** inner[1]
                case "wrap":
                    raise ValueError("wrap has no inverse")
            return functions.get(operator, getattr(sympy, operator, None))(*inner)  # type: ignore[misc]
    raise ValueError("not a quantity")


def _from_sympy(value: Any, names: dict[Any, str]) -> Expression:
    if value.is_Symbol:
        return Symbol(names[value])
    if value.is_number:
        return Number(float(value))
    inner = [_from_sympy(argument, names) for argument in value.args]
    operator = {"Add": "+", "Mul": "*"}.get(value.func.__name__)
    if operator:
        result = inner[0]
        for term in inner[1:]:
            result = Apply(operator, (result, term))
        return result
    if value.is_Pow:
        if not isinstance(inner[1], Number):
            raise ValueError("an exponent that is not a number")
        if inner[1].value == 0.5:
            return Apply("sqrt", (inner[0],))
        return Apply("**", (inner[0], inner[1]))
    spelled = {"Abs": "abs", "Min": "min", "Max": "max"}
    name = spelled.get(value.func.__name__, value.func.__name__)
    if name not in ("abs", "min", "max", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"):
        raise ValueError(f"{name} is not a function of the language")
    return Apply(name, tuple(inner))
