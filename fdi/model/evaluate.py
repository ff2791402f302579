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
from fdi.telemetry.signals import TIME
from fdi.windows import sums_between

Floats = NDArray[np.float64]
Column = NDArray[Any]


FEW_RECORDS: Final = 6
RECENT_S: Final = 3.0
"""The last seconds: longer than a command needs to change, shorter than a vehicle takes to."""


def wrap(angle: Floats) -> Floats:
    """Return angles, rad, folded into (-pi, pi]."""
    return -np.remainder(-angle + np.pi, 2 * np.pi) + np.pi


def _still(t: Column, values: Column) -> Floats:
    """Return for how long, s, a quantity has been exactly the same, record by record.

    A few equal records in a row happen by chance, and count as none. Until it has moved once it is
    unknown: what never moves may be connected to nothing.
    """
    with np.errstate(invalid="ignore"):
        moves = np.append(True, values[1:] != values[:-1])  # unknown is not the same
    known = np.isfinite(values)
    moved = np.logical_or.accumulate(np.append(False, moves[1:] & known[1:] & known[:-1]))
    place = np.arange(len(values))
    last = np.maximum.accumulate(np.where(moves, place, 0))
    since: Floats = np.where(place - last >= FEW_RECORDS, t - t[last], 0.0)
    return np.where(known & moved, since, np.nan)


def _recent(t: Column, values: Column) -> Floats:
    """Return the mean over the records of the last seconds, this one included; record by record.

    Unknown records do not count; without so many seconds of records before it, it is unknown.
    """
    known = np.isfinite(values)
    first = np.searchsorted(t, t - RECENT_S, side="right")
    last = np.arange(1, len(t) + 1)
    total = sums_between(np.where(known, values, 0.0), first, last)
    mean: Floats = _divide(total, sums_between(known.astype(float), first, last))
    return np.where(known & (t - t[:1] >= RECENT_S), mean, np.nan)


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
        case Apply("der" | "slope" as windowed, _):
            raise KeyError(windowed)
        case Apply("still", (argument,)):
            return _still(columns[TIME], _evaluate(argument, columns, real_part))
        case Apply("recent", (argument,)):
            return _recent(columns[TIME], _evaluate(argument, columns, real_part))
        case Apply(operator, arguments):
            values = [_evaluate(argument, columns, real_part) for argument in arguments]
            if real_part and operator == "sqrt":
                values = [np.maximum(values[0], 0.0)]
            return OPERATIONS[operator](*values)  # type: ignore[no-any-return]
