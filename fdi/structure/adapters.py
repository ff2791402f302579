"""Converts models from and to what other libraries use: networkx, scipy, sympy, the toolbox.

In: a bipartite graph, a sparse matrix, equations as expressions, or a model definition of
faultdiagnosistoolbox. Out: a checked :class:`~fdi.structure.incidence.Model`; and back. A dense or
sparse matrix comes in through :meth:`~fdi.structure.incidence.Model.from_matrix`, matrices with
named rows and columns go out through ``frames.py``.

networkx, scipy and sympy are imported inside the functions that need them. Nothing is guessed: a
name that is in none of the lists is an error, not a parameter.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fdi.errors import ModelError, UsageError
from fdi.structure.incidence import Fault, Model, place_of

if TYPE_CHECKING:
    import networkx as nx
    from scipy.sparse import csr_array


def to_networkx(model: Model) -> nx.Graph:
    """Return the bipartite graph of a model.

    Parameters
    ----------
    model : Model

    Returns
    -------
    networkx.Graph
        Nodes are labels, equations first. ``bipartite`` is 0 for an equation, 1 for an unknown;
        ``faults`` lists the names of an equation's faults. Of an edge ``kind`` is "x", "i" (state)
        or "d" (derivative), ``solvable`` whether the equation can be solved for the unknown.

    Raises
    ------
    ModelError
        When an equation and an unknown have the same label.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958 (structures as bipartite graphs).

    Examples
    --------
    >>> graph = to_networkx(Model.from_matrix([[1, 1], [0, 1]], faults={"f": 1}))
    >>> sorted(graph.edges), graph.nodes["e1"]["faults"]
    ([('e0', 'x0'), ('e0', 'x1'), ('e1', 'x1')], ['f'])
    """
    import networkx as nx

    if shared := sorted(set(model.equations).intersection(model.unknowns)):
        raise ModelError(f"{shared[0]!r} is the label of an equation and of an unknown")
    graph = nx.Graph(name=model.name)
    for e, label in enumerate(model.equations):
        names = [fault.name for fault in model.faults if e in fault.equations]
        graph.add_node(label, bipartite=0, faults=names)
    for label in model.unknowns:
        graph.add_node(label, bipartite=1)
    kind = {(e, u): kind for e, u, kind in model.derivative}
    nonsolvable = set(model.nonsolvable)
    for e, row in enumerate(model.rows):
        for u in row:
            graph.add_edge(
                model.equations[e],
                model.unknowns[u],
                kind=kind.get((e, u), "x"),
                solvable=(e, u) not in nonsolvable,
            )
    return graph


def from_networkx(graph: nx.Graph, equations: Iterable[Any] | None = None) -> Model:
    """Return the model of a bipartite graph.

    Parameters
    ----------
    graph : networkx.Graph
        Nodes and edges with the attributes of :func:`to_networkx`; all but ``bipartite`` may be
        missing.
    equations : iterable of nodes, optional
        Which nodes are equations; by default those whose ``bipartite`` is 0.

    Returns
    -------
    Model
        Equations, unknowns and faults in the order of the nodes; labels are the nodes as text.

    Raises
    ------
    ModelError
        When a node is neither, an edge joins two equations or two unknowns, or the model is wrong.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958 (structures as bipartite graphs).

    Examples
    --------
    >>> import networkx as nx
    >>> graph = nx.Graph([("balance", "flow"), ("sensor", "flow")])
    >>> model = from_networkx(graph, equations=["balance", "sensor"])
    >>> model.equations, model.unknowns, model.rows
    (('balance', 'sensor'), ('flow',), ((0,), (0,)))
    """
    if equations is None:
        side = {node: data.get("bipartite") for node, data in graph.nodes(data=True)}
    else:
        chosen = set(equations)
        if missing := [node for node in chosen if node not in graph]:
            raise ModelError(f"equation {missing[0]!r} is no node of the graph")
        side = {node: 0 if node in chosen else 1 for node in graph}
    for node, value in side.items():
        if value not in (0, 1):
            raise ModelError(
                f"node {node!r} is neither equation nor unknown",
                hint="set its attribute bipartite to 0 or 1, or name the equations",
            )
    row_of = {node: i for i, node in enumerate(n for n in graph if side[n] == 0)}
    column_of = {node: i for i, node in enumerate(n for n in graph if side[n] == 1)}
    rows: list[list[int]] = [[] for _ in row_of]
    derivative: list[tuple[int, int, str]] = []
    nonsolvable: list[tuple[int, int]] = []
    for a, b, data in graph.edges(data=True):
        if side[a] == side[b]:
            kind = "unknowns" if side[a] else "equations"
            raise ModelError(f"edge {a!r} - {b!r} joins two {kind}")
        edge = (row_of[b], column_of[a]) if side[a] else (row_of[a], column_of[b])
        rows[edge[0]].append(edge[1])
        if data.get("kind", "x") != "x":
            derivative.append((*edge, data["kind"]))
        if not data.get("solvable", True):
            nonsolvable.append(edge)
    faults: dict[str, list[int]] = {}
    for node, row in row_of.items():
        for name in graph.nodes[node].get("faults", ()):
            faults.setdefault(name, []).append(row)
    return Model(
        tuple(map(str, row_of)),
        tuple(map(str, column_of)),
        tuple(map(tuple, rows)),
        tuple(Fault(name, tuple(where)) for name, where in faults.items()),
        tuple(sorted(derivative)),
        tuple(sorted(nonsolvable)),
        name=str(graph.name or ""),
    )


def to_sparse(model: Model) -> csr_array:
    """Return the incidence matrix of a model.

    Parameters
    ----------
    model : Model

    Returns
    -------
    (m, n) scipy.sparse.csr_array of bool

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> to_sparse(Model.from_matrix([[1, 0], [1, 1]])).toarray().astype(int)
    array([[1, 0],
           [1, 1]])
    """
    import numpy as np
    from scipy.sparse import csr_array

    ends = np.cumsum([0, *map(len, model.rows)])
    columns = np.array([u for row in model.rows for u in row], dtype=np.intp)
    entries = np.ones(len(columns), dtype=bool)
    return csr_array((entries, columns, ends), shape=(len(model.equations), len(model.unknowns)))


def from_sympy(
    equations: Mapping[str, Any] | Iterable[Any],
    *,
    known: Iterable[Any] = (),
    faults: Iterable[Any] = (),
    time: Any = None,
    name: str = "",
) -> Model:
    """Return the structure of symbolic equations.

    Parameters
    ----------
    equations : mapping of name to equation, or iterable of equations
        Each a ``sympy.Eq``, or an expression that is zero. Without names they are e1, e2, ...
    known : iterable of symbols, functions or names
        Measured and commanded variables, and parameters.
    faults : iterable of symbols, functions or names
        Each enters the equations in which it occurs.
    time : symbol, optional
        By default what is differentiated by, else the symbol t. A function of time alone is a
        variable, any other undefined function stands for its arguments.
    name : str
        For messages and ``repr``.

    Returns
    -------
    Model
        Every other symbol and every other function of time is an unknown. A derivative
        ``Derivative(x(t), t)`` is an unknown ``der(x)`` of its own, with a differential constraint
        ``der(x) = d/dt x`` after the equations; higher derivatives are a chain of them.

    Raises
    ------
    ModelError
        When something is no equation, an integral or the derivative of no function occurs, two
        variables have one name, or a known variable or fault occurs nowhere.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section II (structure of equations);
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012 (constraints).

    Examples
    --------
    >>> import sympy as sp
    >>> t, a, f, y = sp.symbols("t a f y")
    >>> v = sp.Function("v")(t)
    >>> model = from_sympy({"motion": sp.Eq(v.diff(t), a + f), "sensor": y - v},
    ...                    known=[a, y], faults=[f])
    >>> model.equations, model.unknowns
    (('motion', 'sensor', 'der(v) = d/dt v'), ('v', 'der(v)'))
    >>> model.faults, model.derivative
    ((Fault(name='f', equations=(0,)),), ((2, 0, 'i'), (2, 1, 'd')))
    """
    if not isinstance(equations, Mapping):
        equations = {f"e{i}": equation for i, equation in enumerate(equations, start=1)}
    found = _variables(dict(equations), time)
    known_names = {_name(variable): variable for variable in known}
    fault_names = {_name(variable): variable for variable in faults}
    used = {base for terms in found for base, _ in terms}
    for base in (*known_names, *fault_names):
        if base not in used:
            raise ModelError(f"{base!r} occurs in no equation")
    if both := known_names.keys() & fault_names.keys():
        raise ModelError(f"{sorted(both)[0]!r} is known and a fault")
    outline = _Outline(list(equations), [[] for _ in found], {}, [])
    enters: dict[str, list[int]] = {base: [] for base in fault_names}
    for e, terms in enumerate(found):
        for base, order in terms:
            if base in fault_names:
                enters[base].append(e)
            elif base not in known_names:
                outline.rows[e].append(outline.unknown(base, order))
    return outline.model(enters, name)


@dataclass(frozen=True, slots=True)
class _Outline:
    """Is a model in the making."""

    equations: list[str]
    rows: list[list[int]]
    unknowns: dict[str, int]
    derivative: list[tuple[int, int, str]]

    def unknown(self, base: str, order: int = 0) -> int:
        """Return the number of an unknown or of its derivative, with all constraints below it."""
        label = _der(base, order)
        if label not in self.unknowns:
            state = self.unknown(base, order - 1) if order else -1
            self.unknowns[label] = len(self.unknowns)
            if order:
                text = f"{label} = d/dt {_der(base, order - 1)}"
                self.constrain(text, self.unknowns[label], state)
        return self.unknowns[label]

    def constrain(self, label: str, derivative: int, state: int) -> None:
        """Add a differential constraint."""
        e = len(self.equations)
        self.equations.append(label)
        self.rows.append([state, derivative])
        self.derivative.extend([(e, state, "i"), (e, derivative, "d")])

    def model(self, faults: Mapping[str, Sequence[int]], name: str) -> Model:
        return Model(
            tuple(self.equations),
            tuple(self.unknowns),
            tuple(map(tuple, self.rows)),
            tuple(Fault(fault, tuple(where)) for fault, where in faults.items()),
            tuple(self.derivative),
            name=name,
        )


def from_toolbox(definition: Mapping[str, Any], name: str = "") -> Model:
    """Return the model of a definition as faultdiagnosistoolbox takes it.

    Parameters
    ----------
    definition : mapping
        With ``type`` "VarStruc" (``rels`` are lists of names or symbols, or of indices: of ``x``,
        then ``f``, then ``z`` and ``parameters``), "Symbolic" (``rels`` are sympy
        expressions) or "MatrixStruc" (``X`` and ``F`` are matrices, entries 2 and 3 of ``X`` mark
        state and derivative), and ``x``, ``f``, ``z``, ``parameters``. A differential constraint
        among ``rels`` is ``[derivative, state, "diff"]``, the result of its ``DiffConstraint``.
    name : str
        For messages and ``repr``.

    Returns
    -------
    Model
        Equations are called e1, e2, ... as there.

    Raises
    ------
    UsageError
        When this is no definition.
    ModelError
        When the type is none of these, a name is in none of the lists, a relation is none, a
        differential constraint is not about two unknowns, or the model is wrong.

    References
    ----------
    Frisk, Krysander, Jung, "A Toolbox for Analysis and Design of Model Based Diagnosis Systems for
    Large Scale Models", IFAC-PapersOnLine 50(1), 2017.

    Examples
    --------
    >>> model = from_toolbox({"type": "VarStruc", "x": ["p", "dp"], "f": ["leak"], "z": ["y"],
    ...                       "rels": [["dp", "leak"], ["y", "p"], ["dp", "p", "diff"]]})
    >>> model.rows, model.derivative
    (((1,), (0,), (0, 1)), ((2, 0, 'i'), (2, 1, 'd')))
    """
    if not isinstance(definition, Mapping):
        raise UsageError(
            f"a {type(definition).__name__} is no model definition",
            hint="give the mapping that DiagnosisModel takes",
        )
    kind = definition.get("type")
    if kind == "MatrixStruc":
        return _from_matrices(definition, name)
    if kind not in ("VarStruc", "Symbolic"):
        raise ModelError(
            f"model type {kind!r} is none of VarStruc, Symbolic, MatrixStruc", where=name
        )
    if missing := [key for key in ("x", "rels") if key not in definition]:
        raise ModelError(f"the definition has no {missing[0]!r}", where=name)
    lists = {key: list(map(str, definition.get(key, ()))) for key in ("x", "f", "z", "parameters")}
    outline = _Outline([], [], {label: i for i, label in enumerate(lists["x"])}, [])
    faults: dict[str, list[int]] = {label: [] for label in lists["f"]}
    for key, seen in (("x", outline.unknowns), ("f", faults)):
        if len(seen) < len(lists[key]):
            raise ModelError(f"a name occurs more than once in {key!r}", where=name)
    other = {*lists["z"], *lists["parameters"]}
    every = [label for labels in lists.values() for label in labels]
    for e, relation in enumerate(definition["rels"]):
        label = f"e{e + 1}"
        if isinstance(relation, list | tuple) and len(relation) == 3 and relation[2] == "diff":
            ends = [outline.unknowns.get(str(end)) for end in relation[:2]]
            if None in ends:
                raise ModelError(
                    f"the differential constraint of {relation[0]} and {relation[1]} is not about "
                    f"two unknowns",
                    where=label,
                )
            outline.constrain(label, *ends)  # type: ignore[arg-type]
            continue
        outline.equations.append(label)
        outline.rows.append([])
        for variable in _names_in(relation, label, every):
            if variable in outline.unknowns:
                outline.rows[-1].append(outline.unknowns[variable])
            elif variable in faults:
                faults[variable].append(e)
            elif variable not in other:
                raise ModelError(f"{variable!r} is in none of x, f, z, parameters", where=label)
    return outline.model(faults, name)


def _names_in(relation: Any, label: str, every: Sequence[str]) -> list[str]:
    """Return the names of the variables in a relation."""
    if hasattr(relation, "free_symbols"):
        return sorted(map(str, relation.free_symbols))
    if not isinstance(relation, list | tuple):
        raise ModelError(f"{relation!r} is no relation: neither list nor expression", where=label)
    return [
        every[place_of(entry, every, "variable")] if isinstance(entry, int) else str(entry)
        for entry in relation
    ]


def _from_matrices(definition: Mapping[str, Any], name: str) -> Model:
    import numpy as np

    if "X" not in definition:
        raise ModelError("the definition has no 'X'", where=name)
    entries = np.asarray(definition["X"])
    model = Model.from_matrix(
        entries,
        equations=[f"e{i}" for i in range(1, len(entries) + 1)],
        unknowns=definition.get("x") or [f"x{i}" for i in range(1, entries.shape[1] + 1)],
        name=name,
    )
    enters = np.asarray(definition.get("F", ()))
    if enters.ndim < 2:  # no fault, or one
        enters = enters.reshape(-1, 1) if enters.size else np.empty((len(entries), 0))
    labels = definition.get("f") or [f"f{i}" for i in range(1, enters.shape[1] + 1)]
    if enters.shape != (len(entries), len(labels)):
        raise ModelError(
            f"F has the shape {enters.shape}, of {len(entries)} equations and {len(labels)} faults",
            where=name,
        )
    faults = (
        Fault(label, tuple(np.flatnonzero(enters[:, k]).tolist())) for k, label in enumerate(labels)
    )
    edges = (
        (int(e), int(u), mark)
        for value, mark in ((2, "i"), (3, "d"))
        for e, u in np.argwhere(entries == value)
    )
    return replace(model, faults=tuple(faults), derivative=tuple(sorted(edges)))


def _der(base: str, order: int) -> str:
    return "der(" * order + base + ")" * order


def _name(variable: Any) -> str:
    """Return the name of a symbol or of a function of time, or the name that is handed over."""
    return str(variable.func) if getattr(variable, "args", ()) else str(variable)


def _variables(equations: Mapping[str, Any], time: Any) -> list[list[tuple[str, int]]]:
    """Return for each equation its variables: name and order of differentiation, sorted."""
    import sympy as sp

    expressions = {}
    for label, equation in equations.items():
        if isinstance(equation, sp.Equality):
            equation = equation.lhs - equation.rhs
        if not isinstance(equation, sp.Expr):
            raise ModelError(f"{equation} is no equation", where=str(label))
        expressions[str(label)] = equation.doit()  # derivatives of products, and the like
    if time is None:
        by = {v for e in expressions.values() for d in e.atoms(sp.Derivative) for v in d.variables}
        if len(by) > 1:
            raise ModelError(
                f"derivatives by {' and by '.join(sorted(map(str, by)))}", hint="name the time"
            )
        time = by.pop() if by else sp.Symbol("t")
    kinds: dict[str, Any] = {}
    found = []
    for label, expression in expressions.items():
        terms = set()
        for node, base, order in _terms(expression, time, label):
            if kinds.setdefault(base, node) != node:
                raise ModelError(f"{kinds[base]} and {node} have one name", where=label)
            terms.add((base, order))
        found.append(sorted(terms))
    return found


def _terms(expression: Any, time: Any, label: str) -> Iterator[tuple[Any, str, int]]:
    """Yield each variable of an expression: itself, its name, how often it is differentiated."""
    import sympy as sp
    from sympy.core.function import AppliedUndef

    todo = [expression]
    while todo:
        node = todo.pop()
        if isinstance(node, sp.Derivative):
            inner = node.expr
            if not (isinstance(inner, AppliedUndef) and inner.args == (time,)):
                raise ModelError(f"{node} is no derivative of a function of {time}", where=label)
            yield inner, _name(inner), len(node.variables)
        elif isinstance(node, sp.Integral):
            raise ModelError(f"{node} is an integral", where=label, hint="write it as a derivative")
        elif isinstance(node, AppliedUndef) and node.args == (time,):
            yield node, _name(node), 0
        elif isinstance(node, sp.Symbol):
            if node != time:
                yield node, node.name, 0
        else:
            todo.extend(node.args)
