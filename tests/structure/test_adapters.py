"""Models go out to other libraries and come back the same; what cannot be a model is refused."""

import networkx as nx
import pytest
import sympy as sp
from hypothesis import given
from scipy.sparse import coo_array, csc_array

from fdi.errors import ModelError, UsageError
from fdi.structure import Model, load_reference, mso_sets
from fdi.structure.adapters import (
    from_networkx,
    from_sympy,
    from_toolbox,
    to_networkx,
    to_sparse,
)

from .models import REFERENCE, dynamic_models, models, needs_shared


def content(model):
    return (
        model.equations,
        model.unknowns,
        model.rows,
        model.faults,
        tuple(sorted(model.derivative)),
        tuple(sorted(model.nonsolvable)),
        model.name,
    )


def by_name(model):
    """The content with faults in the order of their names."""
    parts = list(content(model))
    parts[3] = tuple(sorted(parts[3], key=lambda fault: fault.name))
    return parts


@given(models())
def test_a_model_survives_networkx(model):
    assert by_name(from_networkx(to_networkx(model))) == by_name(model)


@given(dynamic_models())
def test_differential_constraints_survive_networkx(model):
    assert by_name(from_networkx(to_networkx(model))) == by_name(model)


@needs_shared
@pytest.mark.parametrize("path", REFERENCE, ids=[path.stem for path in REFERENCE])
def test_reference_models_survive_networkx(path):
    model = load_reference(path)
    assert by_name(from_networkx(to_networkx(model))) == by_name(model)


def test_a_graph_is_bipartite_for_networkx():
    graph = to_networkx(Model.from_matrix([[1, 1], [0, 1]]))
    assert nx.bipartite.sets(graph, [n for n, d in graph.nodes(data=True) if not d["bipartite"]])
    matching = nx.bipartite.hopcroft_karp_matching(graph, ["e0", "e1"])
    assert len(matching) == 4


def test_graphs_that_are_no_structure_are_refused():
    half = nx.Graph([("a", "b")])
    half.nodes["a"]["bipartite"] = 0
    with pytest.raises(ModelError, match="'b' is neither equation nor unknown"):
        from_networkx(half)
    with pytest.raises(ModelError, match="'a' - 'b' joins two equations"):
        from_networkx(nx.Graph([("a", "b")]), equations=["a", "b"])
    with pytest.raises(ModelError, match="'a' - 'b' joins two unknowns"):
        from_networkx(nx.Graph([("a", "b")]), equations=[])
    with pytest.raises(ModelError, match="'z' is no node"):
        from_networkx(nx.Graph([("a", "b")]), equations=["a", "z"])
    with pytest.raises(ModelError, match="'x' is the label of an equation and of an unknown"):
        to_networkx(Model(("x",), ("x",), ((0,),)))


@given(models())
def test_a_sparse_matrix_comes_out_and_back_in(model):
    matrix = to_sparse(model)
    for again in (matrix, csc_array(matrix), coo_array(matrix), matrix.toarray()):
        assert Model.from_matrix(again).rows == model.rows


def test_repeated_entries_of_a_sparse_matrix_are_one():
    matrix = coo_array(([1, 1, 1], ([0, 0, 1], [0, 0, 1])), shape=(2, 2))
    assert Model.from_matrix(matrix).rows == ((0,), (1,))


def test_derivatives_become_constraints_once_however_often_they_occur():
    t, m, y, z = sp.symbols("t m y z")
    x, u = sp.Function("x")(t), sp.Function("u")(t)
    model = from_sympy(
        {"newton": sp.Eq(m * x.diff(t, 2), u), "rate": y - x.diff(t), "place": z - x},
        known=[m, y, z, u],
    )
    assert model.unknowns == ("x", "der(x)", "der(der(x))")
    assert model.equations[3:] == ("der(x) = d/dt x", "der(der(x)) = d/dt der(x)")
    assert model.rows == ((2,), (1,), (0,), (0, 1), (1, 2))
    assert set(model.derivative) == {(3, 0, "i"), (3, 1, "d"), (4, 1, "i"), (4, 2, "d")}


def test_products_are_differentiated_and_known_derivatives_stay_known():
    t = sp.Symbol("t")
    a, b = sp.Function("a")(t), sp.Function("b")(t)
    model = from_sympy([sp.Derivative(a * b, t)], known=[b])
    assert model.unknowns == ("a", "der(a)")
    assert from_sympy([a - b.diff(t)], known=["b"]).unknowns == ("a",)


def test_a_function_of_other_things_than_time_stands_for_its_arguments():
    p, q, gain = sp.symbols("p q gain")
    table = sp.Function("table")
    assert from_sympy([q - table(p, gain)], known=[gain]).unknowns == ("p", "q")


def test_what_cancels_is_no_unknown():
    x, y = sp.symbols("x y")
    assert from_sympy([sp.Eq(x + y, y + 3)]).unknowns == ("x",)


def test_expressions_that_are_no_equations_are_refused():
    t, s, x = sp.symbols("t s x")
    f = sp.Function("f")
    cases = [
        ([sp.Eq(x, x)], "True is no equation"),
        ([x > 3], "x > 3 is no equation"),
        (["x"], "x is no equation"),
        ([sp.Integral(f(t), t)], "is an integral"),
        ([sp.Derivative(f(x, t), t)], "is no derivative of a function of t"),
        ([f(t).diff(t) + f(s).diff(s)], "derivatives by s and by t"),
        ([f(t) + sp.Symbol("f")], "have one name"),
    ]
    for equations, message in cases:
        with pytest.raises(ModelError, match=message):
            from_sympy(equations)
    with pytest.raises(ModelError, match="'y' occurs in no equation"):
        from_sympy([x - 1], known=["y"])
    with pytest.raises(ModelError, match="'x' is known and a fault"):
        from_sympy([x - 1], known=["x"], faults=["x"])


def test_the_tutorial_model_of_the_toolbox_is_the_reference_model():
    three_tank = next((path for path in REFERENCE if path.stem == "three_tank"), None)
    if three_tank is None:
        pytest.skip("the shared reference data are not here")
    expected = load_reference(three_tank)
    definition = {
        "type": "VarStruc",
        "x": ["p1", "p2", "p3", "q0", "q1", "q2", "q3", "dp1", "dp2", "dp3"],
        "f": ["fV1", "fV2", "fV3", "fT1", "fT2", "fT3"],
        "z": ["y1", "y2", "y3"],
        "rels": [
            ["q1", "p1", "p2", "fV1"],
            ["q2", "p2", "p3", "fV2"],
            ["q3", "p3", "fV3"],
            ["dp1", "q0", "q1", "fT1"],
            ["dp2", "q1", "q2", "fT2"],
            ["dp3", "q2", "q3", "fT3"],
            ["y1", "p1"],
            ["y2", "q2"],
            ["y3", "q0"],
            ["dp1", "p1", "diff"],
            ["dp2", "p2", "diff"],
            ["dp3", "p3", "diff"],
        ],
    }
    model = from_toolbox(definition)
    assert (model.unknowns, model.rows, model.faults) == (
        expected.unknowns,
        expected.rows,
        expected.faults,
    )
    assert set(model.derivative) == set(expected.derivative)
    entries = to_sparse(model).toarray().astype(int)
    for e, u, kind in model.derivative:
        entries[e, u] = 2 if kind == "i" else 3
    enters = [[int(e in fault.equations) for fault in model.faults] for e in range(12)]
    matrices = {"type": "MatrixStruc", "X": entries, "F": enters, "Z": [], "f": definition["f"]}
    again = from_toolbox(matrices)
    assert (again.rows, again.faults) == (model.rows, model.faults)
    assert set(again.derivative) == set(model.derivative)
    assert list(mso_sets(again)) == list(mso_sets(model))


def test_wrong_definitions_are_refused():
    good = {"type": "VarStruc", "x": ["a", "da"], "f": ["f"], "z": ["y"], "rels": [["a", "f"]]}
    cases = [
        ({"type": "Matlab"}, "'Matlab' is none of"),
        ({"rels": [["a", "b", "f"]]}, "e1: 'b' is in none of x, f, z, parameters"),
        ({"rels": [["a", "f"], ["da", "y", "diff"]]}, "e2: .* is not about two unknowns"),
        ({"x": ["a", "a"]}, "more than once in 'x'"),
        ({"rels": [["a"]]}, "fault 'f' enters no equation"),
    ]
    assert from_toolbox(good).rows == ((0,),)
    for change, message in cases:
        with pytest.raises(ModelError, match=message):
            from_toolbox({**good, **change})
    with pytest.raises(ModelError, match="has no 'rels'"):
        from_toolbox({"type": "VarStruc", "x": []})


def test_relations_may_hold_symbols_and_indices():
    names = {"type": "VarStruc", "x": ["a", "b"], "f": ["f"], "z": ["y"], "parameters": ["c"]}
    expected = from_toolbox({**names, "rels": [["a", "b", "f"], ["b", "y", "c"]]})
    a, b, f, y, c = sp.symbols("a b f y c")
    for relations in ([[a, b, f], [b, y, c]], [[0, 1, 2], [1, 3, 4]], [["a", 1, f], [b, 3, "c"]]):
        found = from_toolbox({**names, "rels": relations})
        assert (found.rows, found.faults) == (expected.rows, expected.faults)
    with pytest.raises(UsageError, match="variable 5 of 5 variables does not exist"):
        from_toolbox({**names, "rels": [[5]]})


@pytest.mark.parametrize("wrong", [None, "tanks.json", [["a", "f"]], Model.from_matrix([[1]])])
def test_what_is_no_definition_is_refused(wrong):
    with pytest.raises(UsageError, match="is no model definition"):
        from_toolbox(wrong)


def test_wrong_matrices_and_relations_are_refused():
    matrices = {"type": "MatrixStruc", "X": [[1, 0], [1, 1]], "F": [[1], [0]]}
    assert from_toolbox(matrices).faults[0].equations == (0,)
    for change in ({"F": [[1, 0]]}, {"f": ["f", "g"]}, {"F": 1}):
        with pytest.raises(ModelError, match="F has the shape"):
            from_toolbox({**matrices, **change})
    with pytest.raises(ModelError, match="has no 'X'"):
        from_toolbox({"type": "MatrixStruc"})
    with pytest.raises(ModelError, match="e1: 'a' is no relation"):
        from_toolbox({"type": "VarStruc", "x": ["a"], "rels": ["a"]})


def test_a_symbolic_definition_has_the_structure_of_its_expressions():
    q1, p1, p2, Rv1, fV1 = sp.symbols("q1 p1 p2 Rv1 fV1")
    definition = {
        "type": "Symbolic",
        "x": ["q1", "p1", "p2"],
        "f": ["fV1"],
        "z": [],
        "parameters": ["Rv1"],
        "rels": [-q1 + (p1 - p2) / Rv1 + fV1],
    }
    model = from_toolbox(definition)
    assert (model.rows, model.faults[0].equations) == (((0, 1, 2),), (0,))
