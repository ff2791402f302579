"""What is a test good for: to which faults does it react, and what does it do without?

In: a model, assumptions and tests. Out: the purposes that each test serves. A purpose is a pair of
a fault (row) and of equations to do without (column): those of a fault, of an assumption, or none
at all, which is mere detection. Sets of purposes are integers: bit (row x columns + column).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.structure.incidence import Fault, Model
from fdi.structure.isolability import Mask, detectable, isolability


@dataclass(frozen=True, slots=True, eq=False)
class Purposes:
    """Are the purposes that the tests of a model can have.

    Parameters
    ----------
    model : Model
        With n faults.
    assumptions : tuple of int
        a equations that may be violated although nothing failed.
    columns : tuple of tuple of int
        For each of the n + a + 1 columns the equations to do without.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008 (detectability and isolability).

    Examples
    --------
    >>> purposes(Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1}), [2]).columns
    ((0,), (1,), (2,), ())
    """

    model: Model
    assumptions: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]

    def possible(self) -> int:
        """Return the purposes that structure allows."""
        marks = (Fault(f"assumption {e}", (e,)) for e in self.assumptions)
        model = replace(self.model, faults=(*self.model.faults, *marks))
        n = len(self.model.faults)
        return _packed(np.column_stack([isolability(model)[:n], detectable(model)[:n]]))

    def served(self, sets: Sequence[int]) -> list[int]:
        """Return the purposes that sets of equations, as bit sets, serve."""
        reacts, touches = self.reacts(sets), _touch(sets, self.columns, self._size)
        return [_packed(row[:, None] & ~other) for row, other in zip(reacts, touches, strict=True)]

    def reacts(self, sets: Sequence[int]) -> Mask:
        """Return which sets react to which fault, (t, n) bool."""
        return _touch(sets, [fault.equations for fault in self.model.faults], self._size)

    def mask(self, served: int) -> Mask:
        """Return purposes as an array, (n, n + a + 1) bool."""
        shape = len(self.model.faults), len(self.columns)
        packed = served.to_bytes(-(-shape[0] * shape[1] // 8), "little")
        held = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), bitorder="little")
        return held[: shape[0] * shape[1]].reshape(shape).astype(bool)

    @property
    def _size(self) -> int:
        return -(-len(self.model.rows) // 8)


def purposes(model: Model, assumptions: Iterable[int]) -> Purposes:
    """Return the purposes that tests of a model can have.

    Parameters
    ----------
    model : Model
    assumptions : iterable of int
        Equations that may be violated although nothing failed.

    Returns
    -------
    Purposes

    Raises
    ------
    UsageError
        When there is no such equation.

    References
    ----------
    As :class:`Purposes`.

    Examples
    --------
    A limit beside two sensors:

    >>> two = purposes(Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1}), [2])
    >>> two.mask(two.possible())
    array([[False,  True,  True,  True],
           [ True, False,  True,  True]])
    """
    chosen = tuple(sorted(set(assumptions)))
    for equation in chosen:
        if not 0 <= equation < len(model.rows):
            raise UsageError(f"equation {equation} is not in 0..{len(model.rows) - 1}")
    columns = [fault.equations for fault in model.faults]
    columns += [(equation,) for equation in chosen]
    return Purposes(model, chosen, (*columns, ()))


def _packed(mask: Mask) -> int:
    return int.from_bytes(np.packbits(mask, bitorder="little").tobytes(), "little")


def _touch(sets: Sequence[int], groups: Sequence[Sequence[int]], size: int) -> Mask:
    """Return which sets hold an equation of which group."""
    result: Mask = np.zeros((len(sets), len(groups)), dtype=bool)
    if not len(sets) or not size:
        return result
    packed = b"".join(bits.to_bytes(size, "little") for bits in sets)
    rows: NDArray[np.uint8] = np.frombuffer(packed, dtype=np.uint8).reshape(len(sets), size)
    held = np.unpackbits(rows, axis=1, bitorder="little")
    flat = [(column, equation) for column, group in enumerate(groups) for equation in group]
    if flat:
        columns, equations = np.array(flat).T
        starts = np.flatnonzero(np.diff(columns, prepend=-1))
        result[:, columns[starts]] = np.logical_or.reduceat(held[:, equations], starts, axis=1)
    return result
