"""What is the value of an expression over whole columns?

In: an expression and columns by name. Out: one column. Unknown (NaN) survives every operation; what
has no real value (the root of a negative number, a division by zero) is unknown too. The tree is
walked once per call with numpy operations on whole columns: 1 us of Python per node against 10 us
of arithmetic per 10,000 samples, so no code is generated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.expression import Apply, Expression, Number, Symbol, Text

Floats = NDArray[np.float64]
Column = NDArray[Any]


def wrap(angle: Floats) -> Floats:
    """Return angles, rad, folded into (-pi, pi]."""
    return -np.remainder(-angle + np.pi, 2 * np.pi) + np.pi


def _known(operation: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a comparison so that an unknown side makes it false: unknown is no evidence."""

    def compare(left: Column, right: Column) -> NDArray[np.bool_]:
        return np.asarray(operation(left, right), dtype=bool)

    return compare


OPERATIONS: Final[Mapping[str, Callable[..., Any]]] = {
    "+": np.add,
    "*": np.multiply,
    "/": np.divide,
    "**": np.power,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "sign": np.sign,
    "wrap": wrap,
    "bit": lambda word, place: np.floor(word / 2.0**place) % 2,
    "min": lambda *terms: reduce(np.minimum, terms),
    "max": lambda *terms: reduce(np.maximum, terms),
    "<": _known(np.less),
    "<=": _known(np.less_equal),
    ">": _known(np.greater),
    ">=": _known(np.greater_equal),
    "==": _known(np.equal),
    "!=": _known(np.not_equal),
    "and": lambda *terms: reduce(np.logical_and, terms),
    "or": lambda *terms: reduce(np.logical_or, terms),
    "not": np.logical_not,
}


def evaluate(
    expression: Expression, columns: Mapping[str, Column], *, real_part: bool = False
) -> Column:
    """Return the column of an expression.

    Parameters
    ----------
    expression : Expression
    columns : mapping of str to (n,) array
        The value of every name in the expression, in the model's units.
    real_part : bool
        Take the real part where a root is imaginary, as the published analysis does, which is 0
        for a square root; by default it is unknown.

    Returns
    -------
    (n,) float or bool array, or a scalar if no column takes part.

    Raises
    ------
    KeyError
        A name has no column.
    """
    with np.errstate(all="ignore"):
        value = _evaluate(expression, columns, real_part)
        if value.dtype == bool:
            return value
        return np.where(np.isfinite(value), value, np.nan)


def _evaluate(expression: Expression, columns: Mapping[str, Column], real_part: bool) -> Column:
    match expression:
        case Number(value):
            return np.float64(value)  # type: ignore[return-value]
        case Symbol(name):
            return columns[name]
        case Text(value):
            return np.str_(value)  # type: ignore[return-value]
        case Apply("-", (argument,)):
            return -_evaluate(argument, columns, real_part)
        case Apply("-", (left, right)):
            difference = _evaluate(left, columns, real_part) - _evaluate(right, columns, real_part)
            return difference
        case Apply("der", _):
            raise KeyError("der")
        case Apply(operator, arguments):
            values = [_evaluate(argument, columns, real_part) for argument in arguments]
            if real_part and operator == "sqrt":
                values = [np.maximum(values[0], 0.0)]
            return OPERATIONS[operator](*values)  # type: ignore[no-any-return]
