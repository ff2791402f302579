"""Gives the matrices of a structure names: pandas frames with labelled rows and columns.

The functions of the other files return arrays and bit sets, which computing needs; these are for
reading. In: a model, and sets where they are asked for. Out: a frame whose rows and columns are
equations, unknowns, faults or tests by name. pandas is imported inside the functions.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from fdi.structure.incidence import Model, members
from fdi.structure.isolability import isolability

if TYPE_CHECKING:
    import pandas as pd


def incidence_frame(model: Model) -> pd.DataFrame:
    """Return which equation contains which unknown.

    Parameters
    ----------
    model : Model

    Returns
    -------
    (m, n) pandas.DataFrame of str
        "x", "i" at the state and "d" at the derivative of a differential constraint, else "".

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> incidence_frame(Model.from_matrix([[1, 1], [0, 1]]))
       x0 x1
    e0  x  x
    e1     x
    """
    import pandas as pd

    entries = np.full((len(model.equations), len(model.unknowns)), "", dtype=object)
    for e, row in enumerate(model.rows):
        entries[e, list(row)] = "x"
    for e, u, kind in model.derivative:
        entries[e, u] = kind
    return pd.DataFrame(entries, index=list(model.equations), columns=list(model.unknowns))


def fault_frame(model: Model) -> pd.DataFrame:
    """Return which fault enters which equation.

    Parameters
    ----------
    model : Model

    Returns
    -------
    (m, n_f) pandas.DataFrame of bool

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II.

    Examples
    --------
    >>> fault_frame(Model.from_matrix([[1], [1]], faults={"f": 1}))
            f
    e0  False
    e1   True
    """
    return signature_frame(model, (1 << e for e in range(len(model.equations)))).set_axis(
        list(model.equations)
    )


def signature_frame(model: Model, sets: Iterable[int]) -> pd.DataFrame:
    """Return which test is sensitive to which fault.

    Parameters
    ----------
    model : Model
    sets : iterable of int
        Tests as bit sets of equations, see :func:`fdi.structure.testsets.mso_sets`.

    Returns
    -------
    (n_tests, n_f) pandas.DataFrame of bool
        Rows t1, t2, ... in the order of the sets.

    References
    ----------
    Gertler, "Fault Detection and Diagnosis in Engineering Systems", 1998, chapter 6.

    Examples
    --------
    >>> from fdi.structure import mso_sets
    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> signature_frame(model, mso_sets(model)).astype(int)
        f  g
    t1  0  1
    t2  1  0
    t3  1  1
    """
    import pandas as pd

    masks = [sum(1 << e for e in fault.equations) for fault in model.faults]
    rows = [[bool(test & mask) for mask in masks] for test in sets]
    entries = np.array(rows, dtype=bool).reshape(len(rows), len(masks))
    labels = [f"t{i}" for i in range(1, len(rows) + 1)]
    return pd.DataFrame(entries, index=labels, columns=[fault.name for fault in model.faults])


def isolability_frame(model: Model, causality: str = "mixed") -> pd.DataFrame:
    """Return which fault can be told from which other.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
        As for :func:`fdi.structure.isolability.isolability`.

    Returns
    -------
    (n_f, n_f) pandas.DataFrame of bool
        True in row f, column g when a test exists that reacts to f and not to g.

    Raises
    ------
    UsageError
        When the causality is none of the three.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definition 3.

    Examples
    --------
    >>> isolability_frame(Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})).astype(int)
       f  g
    f  0  1
    g  1  0
    """
    import pandas as pd

    labels = [fault.name for fault in model.faults]
    return pd.DataFrame(isolability(model, causality), index=labels, columns=labels)


def set_frame(model: Model, sets: Iterable[int]) -> pd.DataFrame:
    """Return what the sets hold, by name.

    Parameters
    ----------
    model : Model
    sets : iterable of int
        Bit sets of equations.

    Returns
    -------
    (n_sets, 2) pandas.DataFrame of tuple
        Columns ``equations`` and ``faults``; rows t1, t2, ...

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section III.

    Examples
    --------
    >>> set_frame(Model.from_matrix([[1], [1]], faults={"f": 1}), [0b11])
       equations faults
    t1  (e0, e1)   (f,)
    """
    import pandas as pd

    chosen = list(sets)
    held = [tuple(model.equations[e] for e in members(test)) for test in chosen]
    signatures = signature_frame(model, chosen)
    names = [tuple(signatures.columns[row]) for row in signatures.to_numpy()]
    return pd.DataFrame({"equations": held, "faults": names}, index=signatures.index)
