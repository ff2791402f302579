"""Which functions does Python hand to the equations of a model?

In: a Python function, or a table of one or two dimensions, with the units of its arguments and of
its value. Out: a :class:`Function`, which ``load_airframe(path, functions={"pump": ...})`` makes
known to the equations of that model: ``k_1: q = pump(omega)``. A model file can use such a name and
never define it: a file of a stranger runs nothing.

An expression holds a function as the name of its operator, which carries what computes it
(:class:`Given`), so that all that is done with expressions is done with these as well. What has no
other way is solved numerically; a table that rises or falls throughout is undone by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import ModelError
from fdi.shown import Shown

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Function(Shown):
    """A function for equations.

    Attributes
    ----------
    compute : callable
        Takes as many arrays, (n,) float, as ``takes`` has units, in these, and returns an (n,)
        float array in ``gives``; each value from the arguments at its own place alone. NaN in an
        argument is unknown and has to give NaN; what is not finite counts as unknown.
    takes : tuple of str
        Units of the arguments; "1" is a number.
    gives : str
        Unit of the value.
    undo : callable, optional
        Of a function of one argument: the argument for a value.

    Examples
    --------
    >>> head = Function(lambda omega: 1e-3 * omega**2, ("rad/s",), "m", lambda h: (1e3 * h) ** 0.5)
    """

    compute: Callable[..., Any]
    takes: tuple[str, ...]
    gives: str
    undo: Callable[[Any], Any] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.takes, str) or not self.takes:
            raise ModelError(f"takes is {self.takes!r}, must be a tuple of units, one at least")
        if self.undo is not None and len(self.takes) != 1:
            raise ModelError("only a function of one argument can be undone")


class Given(str):
    """The name of a function in an expression, with what computes it; equal by name."""

    function: Function

    def __new__(cls, name: str, function: Function) -> Given:
        """Return the name with its function."""
        made = super().__new__(cls, name)
        made.function = function
        return made

    def undone(self) -> Given | None:
        """Return the function that gives the argument for a value, where there is one."""
        own = self.function
        if own.undo is None:
            return None
        back = Function(own.undo, (own.gives,), own.takes[0], own.compute)
        return Given(f"{self}_undone", back)

    def __call__(self, *arguments: Floats) -> Floats:
        """Return the value at the arguments, each (n,) or a number."""
        shape = np.broadcast_shapes(*(np.shape(a) for a in arguments))
        whole = [np.broadcast_to(a, shape) for a in arguments]
        value = np.asarray(self.function.compute(*whole), dtype=np.float64)
        if value.shape != shape:
            raise ModelError(
                f"returned the shape {value.shape} for arguments of {shape}",
                where=f"the function {self}",
            )
        return value


def table(
    points: ArrayLike | Sequence[ArrayLike], values: ArrayLike, takes: Sequence[str], gives: str
) -> Function:
    """Return the function that interpolates a table linearly; beyond its ends it is unknown.

    Parameters
    ----------
    points : (n,) float, or ((n,) float, (m,) float)
        Where the table is known, ascending; of two dimensions one array for each.
    values : (n,) or (n, m) float
        What it is there; finite.
    takes, gives
        As of :class:`Function`.

    Raises
    ------
    ModelError
        The points do not ascend, or there are not as many values.

    Notes
    -----
    Of two dimensions bilinear within each cell. One of one dimension whose values only rise or only
    fall can be undone exactly.

    Examples
    --------
    >>> thrust = table([0.0, 1.0, 2.0], [0.0, 1.0, 4.0], ["1"], "N")
    >>> thrust.compute(np.array([0.5, 1.5, 3.0])).tolist()
    [0.5, 2.5, nan]
    >>> thrust.undo(np.array([2.5])).tolist()
    [1.5]
    """
    known = np.asarray(values, dtype=np.float64)
    given: Any = (points,) if len(takes) == 1 else points
    axes = [np.asarray(axis, dtype=np.float64) for axis in given]
    if len(axes) != len(takes) or len(takes) not in (1, 2):
        raise ModelError(f"a table of {len(axes)} dimensions takes {len(takes)} arguments")
    for axis in axes:
        if axis.ndim != 1 or axis.size < 2 or not (np.diff(axis) > 0).all():
            raise ModelError("the points of a table must ascend, two at least")
    shape = tuple(axis.size for axis in axes)
    if known.shape != shape or not np.isfinite(known).all():
        raise ModelError(f"the values of a table must be finite, of the shape {shape}")
    if len(axes) == 2:
        return Function(lambda x, y: _between(axes, known, x, y), tuple(takes), gives)
    slopes = np.diff(known)
    undo: Callable[[Any], Any] | None = None
    if (slopes > 0).all():
        undo = lambda y: np.interp(y, known, axes[0], np.nan, np.nan)  # noqa: E731
    elif (slopes < 0).all():
        undo = lambda y: np.interp(y, known[::-1], axes[0][::-1], np.nan, np.nan)  # noqa: E731
    return Function(
        lambda x: np.interp(x, axes[0], known, np.nan, np.nan), tuple(takes), gives, undo
    )


def _between(axes: Sequence[Floats], known: Floats, x: Floats, y: Floats) -> Floats:
    """Return the bilinear value of a table at (x, y), NaN outside."""
    result = np.full(np.shape(x), np.nan)
    first, second = axes
    inside = (x >= first[0]) & (x <= first[-1]) & (y >= second[0]) & (y <= second[-1])
    u, v = x[inside], y[inside]
    i = np.clip(np.searchsorted(first, u, side="right") - 1, 0, first.size - 2)
    j = np.clip(np.searchsorted(second, v, side="right") - 1, 0, second.size - 2)
    a = (u - first[i]) / (first[i + 1] - first[i])
    b = (v - second[j]) / (second[j + 1] - second[j])
    low = (1 - b) * known[i, j] + b * known[i, j + 1]
    high = (1 - b) * known[i + 1, j] + b * known[i + 1, j + 1]
    result[inside] = (1 - a) * low + a * high
    return result


def named(functions: Mapping[str, Function], taken: Mapping[str, Any]) -> dict[str, Given]:
    """Return functions as what expressions hold.

    Raises
    ------
    ModelError
        A name is none, or one of the language's own functions (``taken``).
    """
    for name in functions:
        if not name.isidentifier() or not name.isascii():
            raise ModelError(f"{name[:40]!r} is no name of a function")
        if name in taken:
            raise ModelError(f"{name!r} is a function of the language already")
    return {name: Given(name, function) for name, function in functions.items()}
