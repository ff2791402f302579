"""Writes which equation contains which unknown for other programs: CSV, MATLAB, GraphML.

In: a model and a kind of file. Out: its bytes. In a CSV a row is an equation; a cell is empty, "x",
"i" at the state or "d" at the derivative of a differential constraint, and 1 under the faults that
enter it, which stand last as ``fault NAME``. A .mat holds ``X`` (0, 1, and 2 and 3 for state and
derivative, as the toolbox of record has it), ``F`` and the names. GraphML is the bipartite graph:
nodes ``e0`` and ``u0`` with their names as ``label``, edges with ``kind`` and ``solvable``.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from fdi.errors import UsageError
from fdi.structure.frames import fault_frame, incidence_frame
from fdi.structure.incidence import Model

CODES: Final = {"": 0, "x": 1, "i": 2, "d": 3}


def incidence_bytes(model: Model, kind: str) -> bytes:
    """Return the incidence of a model as a file.

    Parameters
    ----------
    model : Model
    kind : {"csv", "mat", "graphml"}

    Raises
    ------
    UsageError
        There is no such kind.

    References
    ----------
    Frisk, Krysander, Jung, "A toolbox for analysis and design of model based diagnosis systems for
    large scale models", IFAC World Congress 2017 (the codes of ``X``).

    Examples
    --------
    >>> print(incidence_bytes(Model.from_matrix([[1, 1], [0, 1]], faults={"f": 1}), "csv").decode())
    equation,x0,x1,fault f
    e0,x,x,0
    e1,,x,1
    <BLANKLINE>
    """
    if kind not in KINDS:
        raise UsageError(f"no incidence is written as {kind!r}", hint=", ".join(KINDS))
    return KINDS[kind](model)


def _csv(model: Model) -> bytes:
    frame = incidence_frame(model)
    faults = fault_frame(model).astype(int)
    for name in faults:
        frame[f"fault {name}"] = faults[name]
    return frame.to_csv(index_label="equation", lineterminator="\n").encode()


def _mat(model: Model) -> bytes:
    from scipy.io import savemat

    entries = incidence_frame(model).to_numpy(dtype=object)
    codes = [[CODES[entry] for entry in row] for row in entries]
    out = io.BytesIO()
    told = {
        "X": np.array(codes, dtype=np.float64).reshape(entries.shape),
        "F": fault_frame(model).to_numpy(dtype=np.float64),
        "equations": np.array(model.equations, dtype=object),
        "unknowns": np.array(model.unknowns, dtype=object),
        "faults": np.array([fault.name for fault in model.faults], dtype=object),
        "name": model.name,
    }
    savemat(out, told, do_compression=True)
    # the head names the day and the machine: the same model has the same bytes
    return b"MATLAB 5.0 MAT-file".ljust(116) + out.getvalue()[116:]


def _graphml(model: Model) -> bytes:
    import networkx as nx

    entering: dict[int, list[str]] = {}
    for fault in model.faults:
        for e in fault.equations:
            entering.setdefault(e, []).append(fault.name)
    kind = {(e, u): kind for e, u, kind in model.derivative}
    fixed = set(model.nonsolvable)
    graph = nx.Graph(name=model.name)
    # An equation and an unknown may have one name, so that is a label and not the node.
    for e, label in enumerate(model.equations):
        faults = ", ".join(entering.get(e, []))
        graph.add_node(f"e{e}", label=label, bipartite=0, faults=faults)
    for u, label in enumerate(model.unknowns):
        graph.add_node(f"u{u}", label=label, bipartite=1)
    for e, row in enumerate(model.rows):
        for u in row:
            graph.add_edge(
                f"e{e}", f"u{u}", kind=kind.get((e, u), "x"), solvable=(e, u) not in fixed
            )
    out = io.BytesIO()
    nx.write_graphml_xml(graph, out, prettyprint=True)
    return out.getvalue()


KINDS: Final[Mapping[str, Callable[[Model], bytes]]] = {
    "csv": _csv,
    "mat": _mat,
    "graphml": _graphml,
}
