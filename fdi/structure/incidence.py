"""Holds the structural model: which equation contains which unknown, which fault enters where.

Given labels and, for each equation, the unknowns in it; the result is a checked, frozen value
:class:`Model` that every other file of this room takes. Sets of equations are Python integers
(bit i stands for equation i); :func:`bitset` and :func:`members` convert.

The trap: ``rows`` knows only *unknowns*. Measured and commanded variables, and parameters, are no
part of a structure.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fdi.errors import ModelError
from fdi.structure.display import html_table

Rows = Sequence[Sequence[int]]


@dataclass(frozen=True, slots=True)
class Fault:
    """Is one fault: its name and the equations that it enters.

    Parameters
    ----------
    name : str
        Unique within a model.
    equations : tuple of int
        Indices of the equations, ascending; at least one.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> Fault("GPS_RAW_INT.vel", (2,))
    Fault(name='GPS_RAW_INT.vel', equations=(2,))
    """

    name: str
    equations: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """Is the structure of a set of equations, checked when it is built.

    Parameters
    ----------
    equations, unknowns : tuple of str
        Labels, each unique in its tuple; m and n of them.
    rows : tuple of tuple of int
        For each of the m equations the indices of its unknowns. They are sorted and repeated
        entries merged, so a caller may hand them over in any order.
    faults : tuple of Fault
        Names are unique; a fault may enter several equations, an equation hold several faults.
    derivative : tuple of (int, int, {"i", "d"})
        Edges (equation, unknown) of differential constraints ``dx = d/dt x``: "i" at the state,
        "d" at its derivative.
    nonsolvable : tuple of (int, int)
        Edges (equation, unknown) along which the equation cannot be solved for the unknown.
    name : str
        For messages and ``repr``.

    Raises
    ------
    ModelError
        When labels repeat, an index is out of range, or an edge is marked that does not exist.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> Model(("e1", "e2"), ("x",), ((0,), (0, 0)), (Fault("f", (1,)),), name="pair")
    <Model pair: 2 equations, 1 unknowns, 1 faults>
    >>> Model(("e1",), ("x",), ((3,),))
    Traceback (most recent call last):
    ...
    fdi.errors.ModelError: equation 'e1': unknown index 3 is not in 0..0
    """

    equations: tuple[str, ...]
    unknowns: tuple[str, ...]
    rows: tuple[tuple[int, ...], ...]
    faults: tuple[Fault, ...] = ()
    derivative: tuple[tuple[int, int, str], ...] = ()
    nonsolvable: tuple[tuple[int, int], ...] = ()
    name: str = ""

    def __post_init__(self) -> None:
        _require_unique("equation", self.equations)
        _require_unique("unknown", self.unknowns)
        _require_unique("fault", tuple(fault.name for fault in self.faults))
        if len(self.rows) != len(self.equations):
            raise ModelError(f"{len(self.equations)} equations but {len(self.rows)} rows")
        n = len(self.unknowns)
        for label, row in zip(self.equations, self.rows, strict=True):
            for unknown in row:
                if not 0 <= unknown < n:
                    raise ModelError(
                        f"equation {label!r}: unknown index {unknown} is not in 0..{n - 1}"
                        if n
                        else f"equation {label!r}: unknown index {unknown}, but no unknowns"
                    )
        # A frozen value normalises its own input here once; nobody writes to it afterwards.
        object.__setattr__(self, "rows", tuple(tuple(sorted(set(row))) for row in self.rows))
        object.__setattr__(self, "faults", tuple(self._checked(fault) for fault in self.faults))
        self._check_edges()

    def _checked(self, fault: Fault) -> Fault:
        if not fault.equations:
            raise ModelError(f"fault {fault.name!r} enters no equation")
        for equation in fault.equations:
            if not 0 <= equation < len(self.equations):
                raise ModelError(
                    f"fault {fault.name!r}: equation index {equation} of "
                    f"{len(self.equations)} equations does not exist"
                )
        return Fault(fault.name, tuple(sorted(set(fault.equations))))

    def _check_edges(self) -> None:
        marked = [edge[:2] for edge in self.derivative]
        for equation, unknown in (*marked, *self.nonsolvable):
            if not (0 <= equation < len(self.rows) and unknown in self.rows[equation]):
                raise ModelError(f"edge ({equation}, {unknown}) is marked but is not in the rows")
        for equation, unknown, kind in self.derivative:
            if kind not in ("i", "d"):
                raise ModelError(f"edge ({equation}, {unknown}): {kind!r} is neither 'i' nor 'd'")

    def __repr__(self) -> str:
        name = f" {self.name}" if self.name else ""
        return (
            f"<Model{name}: {len(self.equations)} equations, {len(self.unknowns)} unknowns, "
            f"{len(self.faults)} faults>"
        )

    def _repr_html_(self) -> str:
        cells = [
            (
                label,
                ", ".join(self.unknowns[u] for u in row),
                ", ".join(fault.name for fault in self.faults if e in fault.equations),
            )
            for e, (label, row) in enumerate(zip(self.equations, self.rows, strict=True))
        ]
        return html_table(repr(self)[1:-1], ("equation", "unknowns", "faults"), cells)

    @classmethod
    def from_matrix(
        cls,
        matrix: Any,
        *,
        faults: Mapping[str, int | Iterable[int]] | Iterable[Fault] = (),
        equations: Sequence[str] | None = None,
        unknowns: Sequence[str] | None = None,
        name: str = "",
    ) -> Model:
        """Return the model of an incidence matrix.

        Parameters
        ----------
        matrix : (m, n) array_like or scipy sparse
            Non-zero where the equation (row) contains the unknown (column).
        faults : mapping of name to equation index or indices, or Faults
        equations, unknowns : sequence of str, optional
            Labels; by default e0, e1, ... and x0, x1, ...
        name : str
            For messages and ``repr``.

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            When the matrix is not two-dimensional, or the model is wrong.

        References
        ----------
        Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

        Examples
        --------
        >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 2})
        >>> model.rows, model.faults[0].equations
        (((0,), (0, 1), (1,)), (2,))
        """
        if hasattr(matrix, "tocoo"):  # scipy sparse, without importing it
            entries = matrix.tocoo()
            shape, nonzero = entries.shape, entries.data != 0
            edges = zip(entries.row[nonzero].tolist(), entries.col[nonzero].tolist(), strict=True)
        else:
            dense = np.asarray(matrix)
            shape = dense.shape
            if len(shape) != 2:
                raise ModelError(f"an incidence matrix has 2 dimensions, not {len(shape)}")
            edges = zip(*(index.tolist() for index in np.nonzero(dense)), strict=True)
        rows: list[list[int]] = [[] for _ in range(shape[0])]
        for equation, unknown in edges:
            rows[equation].append(unknown)
        return cls(
            tuple(equations) if equations is not None else tuple(f"e{i}" for i in range(shape[0])),
            tuple(unknowns) if unknowns is not None else tuple(f"x{i}" for i in range(shape[1])),
            tuple(tuple(row) for row in rows),
            _faults(faults),
            name=name,
        )


def load_reference(path: str | Path) -> Model:
    """Return the model of a reference file.

    Parameters
    ----------
    path : str or Path
        JSON with ``equations``, ``unknowns``, ``faults``, ``incidence`` and, optionally,
        ``nonsolvable``. Entries of ``faults`` with one name are one fault in several equations.

    Returns
    -------
    Model
        Faults in order of the first occurrence of their names.

    Raises
    ------
    ModelError
        When the file cannot be read or is no such model.

    References
    ----------
    The format is described in ``shared/structural/README.md``, section 1.

    Examples
    --------
    >>> load_reference("missing.json")
    Traceback (most recent call last):
    ...
    fdi.errors.ModelError: missing.json: cannot be read: No such file or directory
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except ValueError as error:
        raise ModelError(f"is not JSON: {error}", where=str(path)) from error
    try:
        return _from_reference(data)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        raise ModelError(
            f"is not a reference model: {type(error).__name__}: {error}", where=str(path)
        ) from error
    except ModelError as error:
        raise ModelError(error.message, where=str(path)) from error


def submodel(model: Model, equations: Iterable[int]) -> Model:
    """Return the model of some of the equations, with the unknowns that occur in them.

    Parameters
    ----------
    model : Model
    equations : iterable of int
        Indices into ``model.equations``; taken in ascending order, repeats merged.

    Returns
    -------
    Model
        Labels are kept. Faults keep the equations that remain; faults without any are dropped.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": (0, 2)})
    >>> part = submodel(model, (2,))
    >>> part.equations, part.unknowns, part.rows, part.faults
    (('e2',), ('x1',), ((0,),), (Fault(name='f', equations=(0,)),))
    """
    kept = sorted(set(equations))
    used = sorted({unknown for equation in kept for unknown in model.rows[equation]})
    row_of = {equation: i for i, equation in enumerate(kept)}
    column_of = {unknown: j for j, unknown in enumerate(used)}
    faults = (
        Fault(fault.name, tuple(row_of[e] for e in fault.equations if e in row_of))
        for fault in model.faults
    )
    return Model(
        tuple(model.equations[e] for e in kept),
        tuple(model.unknowns[u] for u in used),
        tuple(tuple(column_of[u] for u in model.rows[e]) for e in kept),
        tuple(fault for fault in faults if fault.equations),
        tuple((row_of[e], column_of[u], kind) for e, u, kind in model.derivative if e in row_of),
        tuple((row_of[e], column_of[u]) for e, u in model.nonsolvable if e in row_of),
        model.name,
    )


def bitset(indices: Iterable[int]) -> int:
    """Return the bit set of indices: bit i is set when i is among them.

    Parameters
    ----------
    indices : iterable of int
        Not negative, in any order.

    Returns
    -------
    int

    References
    ----------
    ``shared/structural/README.md``, section 6, idea 3 (sets of equations as integers).

    Examples
    --------
    >>> bitset((0, 3))
    9
    """
    result = 0
    for index in indices:
        result |= 1 << index
    return result


def members(bits: int) -> tuple[int, ...]:
    """Return the indices in a bit set, ascending; the inverse of :func:`bitset`.

    Parameters
    ----------
    bits : int
        Not negative.

    Returns
    -------
    tuple of int

    References
    ----------
    ``shared/structural/README.md``, section 6, idea 3.

    Examples
    --------
    >>> members(9)
    (0, 3)
    """
    return tuple(index for index, bit in enumerate(reversed(bin(bits))) if bit == "1")


def _faults(faults: Mapping[str, int | Iterable[int]] | Iterable[Fault]) -> tuple[Fault, ...]:
    if not isinstance(faults, Mapping):
        return tuple(faults)
    return tuple(
        Fault(name, (where,) if isinstance(where, int) else tuple(where))
        for name, where in faults.items()
    )


def _from_reference(data: dict[str, Any]) -> Model:
    rows: list[list[int]] = [[] for _ in data["equations"]]
    for equation, unknown, _ in data["incidence"]:
        rows[equation].append(unknown)
    equations_of: dict[str, list[int]] = {}
    for fault in data["faults"]:
        equations_of.setdefault(fault["name"], []).append(fault["equation"])
    return Model(
        tuple(data["equations"]),
        tuple(data["unknowns"]),
        tuple(tuple(row) for row in rows),
        tuple(Fault(name, tuple(where)) for name, where in equations_of.items()),
        tuple((e, u, kind) for e, u, kind in data["incidence"] if kind != "x"),
        tuple((e, u) for e, u in data.get("nonsolvable", ())),
        data["name"],
    )


def _require_unique(what: str, labels: tuple[str, ...]) -> None:
    seen: set[str] = set()
    for label in labels:
        if label in seen:
            raise ModelError(f"{what} {label!r} occurs more than once")
        seen.add(label)
