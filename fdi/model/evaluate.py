"""What is the value of an expression over whole columns?

In: an expression and columns by name. Out: one column. Unknown (NaN) survives every operation; what
has no real value (the root of a negative number, a division by zero) is unknown too. Conditions
follow Kleene's logic of three values (true, false, unknown as 1, 0, NaN), and one that is unknown
does not hold: ``not (v > 3)`` is no evidence where v is unknown. The tree is walked once per call
with numpy operations on whole columns: 1 us of Python per node against 10 us of arithmetic per
10,000 samples, so no code is generated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.expression import Apply, Expression, Number, Symbol, Text
from fdi.model.given import Given
from fdi.model.records import change, integral, kept, noise, recent, sampled, span, still
from fdi.telemetry.signals import TIME

Floats = NDArray[np.float64]
Column = NDArray[Any]


def wrap(angle: Floats) -> Floats:
    """Return angles, rad, folded into (-pi, pi]."""
    return -np.remainder(-angle + np.pi, 2 * np.pi) + np.pi


def _divide(left: Column, right: Column) -> Column:
    quotient = np.divide(left, right)
    return np.where(np.isinf(quotient), np.nan, quotient)


def _power(base: Column, exponent: Column) -> Column:
    # numpy has nan**0 = 1, and inf for 0 to a negative power
    result = np.where(np.isnan(base), np.nan, np.power(base, exponent))
    return np.where(np.isinf(result), np.nan, result)


def _log(value: Column) -> Column:
    return np.where(value > 0, np.log(value), np.nan)


def _compare(operation: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a comparison so that it is unknown where a side is."""

    def compare(left: Column, right: Column) -> Floats:
        result = np.asarray(operation(left, right), dtype=np.float64)
        for side in (left, right):
            if np.asarray(side).dtype.kind == "f":
                result = np.where(np.isnan(side), np.nan, result)
        return result

    return compare


def _truth(value: Column) -> Floats:
    """Return 1, 0 or NaN for a flag or a number."""
    number = np.asarray(value, dtype=np.float64)
    return np.where(np.isnan(number), np.nan, number != 0)


def _all(*terms: Column) -> Floats:
    values = [_truth(term) for term in terms]
    return np.where(reduce(np.fmin, values) == 0, 0.0, reduce(np.minimum, values))


def _any(*terms: Column) -> Floats:
    values = [_truth(term) for term in terms]
    return np.where(reduce(np.fmax, values) == 1, 1.0, reduce(np.maximum, values))


OPERATIONS: Final[Mapping[str, Callable[..., Any]]] = {
    "+": np.add,
    "*": np.multiply,
    "/": _divide,
    "**": _power,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "exp": np.exp,
    "log": _log,
    "abs": np.abs,
    "sign": np.sign,
    "wrap": wrap,
    "bit": lambda word, place: np.floor(word / 2.0**place) % 2,
    "min": lambda *terms: reduce(np.minimum, terms),
    "max": lambda *terms: reduce(np.maximum, terms),
    "<": _compare(np.less),
    "<=": _compare(np.less_equal),
    ">": _compare(np.greater),
    ">=": _compare(np.greater_equal),
    "==": _compare(np.equal),
    "!=": _compare(np.not_equal),
    "and": _all,
    "or": _any,
    "not": lambda term: 1.0 - _truth(term),
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
    (n,) float array, or a scalar if no column takes part.

    Raises
    ------
    KeyError
        A name has no column.
    """
    with np.errstate(all="ignore"):
        value = _evaluate(expression, columns, real_part)
        return np.where(np.isfinite(value), value, np.nan)


def holds(condition: Expression, columns: Mapping[str, Column]) -> NDArray[np.bool_]:
    """Return where a condition holds; where it is unknown it does not.

    Parameters
    ----------
    condition : Expression
        A comparison, a combination of comparisons, or the name of a flag.
    columns : mapping of str to (n,) array
        Likewise.

    Examples
    --------
    >>> from fdi.model.expression import parse
    >>> v = np.array([1.0, 5.0, np.nan])
    >>> holds(parse("not (v > 3)", condition=True), {"v": v}).tolist()
    [True, False, False]
    """
    with np.errstate(all="ignore"):
        truth = _truth(_evaluate(condition, columns, False))
    return np.asarray(truth == 1.0)


_OF_RECORDS: Final[Mapping[str, Callable[[Column, Column], Floats]]] = {
    "still": still,
    "recent": recent,
}
_OF_A_WHILE: Final[Mapping[str, Callable[[Column, Column, float], Floats]]] = {
    "change": change,
    "integral": integral,
    "span": span,
    "noise": noise,
    "kept": kept,
    "sampled": sampled,
}


def _at_each(t: Column, value: Column) -> Column:
    """Return a value at every record: what is made of parameters alone is one number."""
    return np.broadcast_to(value, np.shape(t))


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
        case Apply("der" | "slope" | "jump" as windowed, _):
            raise KeyError(windowed)
        case Apply("still" | "recent" as name, (argument,)):
            t = columns[TIME]
            return _OF_RECORDS[name](t, _at_each(t, _evaluate(argument, columns, real_part)))
        case Apply(name, (argument, Number(seconds))) if name in _OF_A_WHILE:
            t = columns[TIME]
            of = _at_each(t, _evaluate(argument, columns, real_part))
            return _OF_A_WHILE[name](t, of, seconds)
        case Apply(operator, arguments):
            values = [_evaluate(argument, columns, real_part) for argument in arguments]
            if real_part and operator == "sqrt":
                values = [np.maximum(values[0], 0.0)]
            if isinstance(operator, Given):
                return operator(*values)
            return OPERATIONS[operator](*values)  # type: ignore[no-any-return]
