"""Holds the structural model: which equation contains which unknown, which fault enters where.

Given labels and, for each equation, the unknowns in it; the result is a checked, frozen value
:class:`Model` that every other file of this room takes. Sets of equations are Python integers
(bit i stands for equation i); :func:`bitset` and :func:`members` convert.

The trap: ``rows`` knows only *unknowns*. Measured and commanded variables, and parameters, are no
part of a structure.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np

from fdi.errors import ModelError, UsageError
from fdi.shown import Shown, html_table

Rows = Sequence[Sequence[int]]


@dataclass(frozen=True, slots=True)
class Fault(Shown):
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
        When labels repeat, an index is no integer or out of range, or an edge is marked that does
        not exist, or as state and derivative at once.

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
        rows = []
        for label, row in zip(self.equations, self.rows, strict=True):
            unknowns = _indices(row, "equation", label, "unknown")
            if unknowns and not (unknowns[0] >= 0 and unknowns[-1] < n):
                wrong = next(unknown for unknown in unknowns if not 0 <= unknown < n)
                place = f" is not in 0..{n - 1}" if n else ", but no unknowns"
                raise ModelError(f"equation {label!r}: unknown index {wrong}{place}")
            rows.append(unknowns)
        # A frozen value normalises its own input here once; nobody writes to it afterwards.
        object.__setattr__(self, "rows", tuple(rows))
        object.__setattr__(self, "faults", tuple(self._checked(fault) for fault in self.faults))
        self._check_edges()

    def _checked(self, fault: Fault) -> Fault:
        equations = _indices(fault.equations, "fault", fault.name, "equation")
        if not equations:
            raise ModelError(f"fault {fault.name!r} enters no equation")
        for equation in equations:
            if not 0 <= equation < len(self.equations):
                raise ModelError(
                    f"fault {fault.name!r}: equation index {equation} of {len(self.equations)} "
                    f"equations does not exist"
                )
        return Fault(fault.name, equations)

    def _check_edges(self) -> None:
        marked = [edge[:2] for edge in self.derivative]
        for equation, unknown in (*marked, *self.nonsolvable):
            if not (0 <= equation < len(self.rows) and unknown in self.rows[equation]):
                raise ModelError(f"edge ({equation}, {unknown}) is marked but is not in the rows")
        kinds: dict[tuple[int, int], str] = {}
        for equation, unknown, kind in self.derivative:
            if kind not in ("i", "d"):
                raise ModelError(f"edge ({equation}, {unknown}): {kind!r} is neither 'i' nor 'd'")
            if kinds.setdefault((equation, unknown), kind) != kind:
                raise ModelError(
                    f"equation {self.equations[equation]!r}: {self.unknowns[unknown]!r} is marked "
                    f"both as state and as derivative"
                )
        edges = tuple((equation, unknown, kind) for (equation, unknown), kind in kinds.items())
        object.__setattr__(self, "derivative", edges)
        object.__setattr__(self, "nonsolvable", tuple(dict.fromkeys(self.nonsolvable)))

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
            When the matrix is not two-dimensional, an entry is unknown (NaN) or no number, the
            labels are not as many as rows and columns, or the model is wrong.

        References
        ----------
        Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

        Examples
        --------
        >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 2})
        >>> model.rows, model.faults[0].equations
        (((0,), (0, 1), (1,)), (2,))
        """
        sparse = hasattr(matrix, "tocoo")  # scipy's, without importing it
        entries: Any = matrix.tocoo() if sparse else np.asarray(matrix)
        shape, values = entries.shape, entries.data if sparse else entries
        if len(shape) != 2:
            raise ModelError(f"an incidence matrix has 2 dimensions, not {len(shape)}")
        if values.dtype.kind not in "biuf" or (values.dtype.kind == "f" and np.isnan(values).any()):
            raise ModelError("an entry of the incidence matrix is no number")
        for what, labels, n in (("rows", equations, shape[0]), ("columns", unknowns, shape[1])):
            if labels is not None and len(labels) != n:
                raise ModelError(f"{n} {what} but {len(labels)} labels")
        where = (
            (entries.row[values != 0], entries.col[values != 0]) if sparse else np.nonzero(entries)
        )
        edges = zip(*(index.tolist() for index in where), strict=True)
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

    Raises
    ------
    UsageError
        When there is no such equation.

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
    kept = existing(model, equations)
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


def existing(model: Model, equations: Iterable[int] | int) -> list[int]:
    """Return equations that a caller named, ascending, each once, if all of them exist.

    Parameters
    ----------
    model : Model
    equations : iterable of int, or int
        Indices, or a bit set.

    Returns
    -------
    list of int

    Raises
    ------
    UsageError
        When there is no such equation.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> model = Model.from_matrix([[1], [1]])
    >>> existing(model, [1, 0, 1]), existing(model, 0b10)
    ([0, 1], [1])
    >>> existing(model, [2])
    Traceback (most recent call last):
    ...
    fdi.errors.UsageError: equation 2 of 2 equations does not exist
    """
    chosen = members(equations) if isinstance(equations, int) else sorted(set(equations))
    for equation in (*chosen[:1], *chosen[-1:]):
        if not 0 <= equation < len(model.equations):
            raise UsageError(
                f"equation {equation} of {len(model.equations)} equations does not exist"
            )
    return list(chosen)


def bitset(indices: Iterable[int]) -> int:
    """Return the bit set of indices: bit i is set when i is among them.

    Parameters
    ----------
    indices : iterable of int
        Not negative, in any order.

    Returns
    -------
    int

    Raises
    ------
    UsageError
        When one is negative.

    References
    ----------
    Knuth, The Art of Computer Programming 4A, 7.1.3 (sets as integers).

    Examples
    --------
    >>> bitset((0, 3))
    9
    """
    result = 0
    for index in indices:
        if index < 0:
            raise UsageError(f"index {index} is negative")
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

    Raises
    ------
    UsageError
        When it is negative.

    References
    ----------
    As :func:`bitset`.

    Examples
    --------
    >>> members(9)
    (0, 3)
    """
    if bits < 0:
        raise UsageError(f"bit set {bits} is negative")
    return tuple(index for index, bit in enumerate(reversed(bin(bits))) if bit == "1")


def _faults(faults: Mapping[str, int | Iterable[int]] | Iterable[Fault]) -> tuple[Fault, ...]:
    if not isinstance(faults, Mapping):
        return tuple(faults)
    return tuple(
        Fault(name, (where,) if isinstance(where, int) else tuple(where))
        for name, where in faults.items()
    )


def place_of(value: int | str, labels: Sequence[str], what: str) -> int:
    """Return the index that an index or a label stands for.

    Parameters
    ----------
    value : int or str
    labels : sequence of str
    what : str
        Of what these are the labels, for the message.

    Returns
    -------
    int

    Raises
    ------
    UsageError
        When there is no such label, or the index is none of theirs.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II (equations, unknowns and
    faults of a structural model).

    Examples
    --------
    >>> place_of("y", ["x", "y"], "unknown"), place_of(0, ["x", "y"], "unknown")
    (1, 0)
    >>> place_of("z", ["x", "y"], "unknown")
    Traceback (most recent call last):
    fdi.errors.UsageError: the model has no unknown 'z' (there are x, y)
    """
    if isinstance(value, str):
        if value not in labels:
            most = ", ".join(get_close_matches(value, labels, 3) or labels[:5])
            raise UsageError(f"the model has no {what} {value!r}", hint=f"there are {most}")
        return labels.index(value)
    try:
        place = operator.index(value)
    except TypeError:
        raise UsageError(f"{value!r} is neither index nor name of a {what}") from None
    if isinstance(value, bool) or not 0 <= place < len(labels):
        raise UsageError(f"{what} {value} of {len(labels)} {what}s does not exist")
    return place


def places_of(values: Iterable[int | str], labels: Sequence[str], what: str) -> list[int]:
    """Return the indices that several indices or labels stand for; see :func:`place_of`.

    Parameters
    ----------
    values : iterable of int or str
    labels, what
        As of :func:`place_of`.

    Returns
    -------
    list of int

    Raises
    ------
    UsageError
        When there is no such label or index, or a single label stands for the whole iterable.

    References
    ----------
    As :func:`place_of`.

    Examples
    --------
    >>> places_of([1, "x"], ["x", "y"], "unknown")
    [1, 0]
    """
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise UsageError(f"{values!r} is no list of {what}s", hint=f"write [{values!r}]")
    return [place_of(value, labels, what) for value in values]


def _indices(values: Iterable[Any], owner: str, name: str, what: str) -> tuple[int, ...]:
    """Return indices ascending, each once; fast, as placing sensors builds thousands of models."""
    try:
        return tuple(sorted(set(map(operator.index, values))))
    except TypeError:
        wrong = next((v for v in values if not hasattr(v, "__index__")), values)
        raise ModelError(f"{owner} {name!r}: {what} index {wrong!r} is no integer") from None


def _require_unique(what: str, labels: tuple[str, ...]) -> None:
    if len(set(labels)) == len(labels):
        return
    seen: set[str] = set()
    for label in labels:
        if label in seen:
            raise ModelError(f"{what} {label!r} occurs more than once")
        seen.add(label)
