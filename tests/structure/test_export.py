"""The incidence that other programs read is the model's."""

import io

import networkx as nx
import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from fdi.errors import UsageError
from fdi.structure import Fault, Model
from fdi.structure.export import incidence_bytes

MODEL = Model(
    ("p", "balance", "sensor"),
    ("p", "dp"),
    ((0, 1), (1,), (0,)),
    (Fault("leak", (1,)), Fault("stuck", (1, 2))),
    derivative=((0, 0, "i"), (0, 1, "d")),
    nonsolvable=((1, 1),),
    name="tank",
)


def test_csv_holds_entries_and_faults():
    frame = pd.read_csv(io.BytesIO(incidence_bytes(MODEL, "csv")), index_col=0).fillna("")
    assert frame.to_numpy().tolist() == [["i", "d", 0, 0], ["", "x", 1, 1], ["x", "", 0, 1]]
    assert frame.columns.tolist() == ["p", "dp", "fault leak", "fault stuck"]


def test_mat_holds_the_codes_of_the_toolbox():
    found = loadmat(io.BytesIO(incidence_bytes(MODEL, "mat")))
    assert found["X"].tolist() == [[2, 3], [0, 1], [1, 0]]
    assert found["F"].tolist() == [[0, 0], [1, 1], [0, 1]]
    assert [str(name[0]) for name in found["equations"].ravel()] == ["p", "balance", "sensor"]
    assert incidence_bytes(MODEL, "mat") == incidence_bytes(MODEL, "mat")


def test_graphml_is_the_bipartite_graph_though_names_are_shared():
    graph = nx.parse_graphml(incidence_bytes(MODEL, "graphml").decode())
    assert {tuple(sorted(edge)) for edge in graph.edges} == {
        ("e0", "u0"),
        ("e0", "u1"),
        ("e1", "u1"),
        ("e2", "u0"),
    }
    assert graph.nodes["e0"]["label"] == graph.nodes["u0"]["label"] == "p"
    assert graph.nodes["e1"]["faults"] == "leak, stuck"
    assert not graph.edges["e1", "u1"]["solvable"]


def test_an_empty_model_is_written():
    empty = Model.from_matrix(np.zeros((0, 0), bool))
    for kind in ("csv", "mat", "graphml"):
        assert incidence_bytes(empty, kind)


def test_other_kinds_are_refused():
    with pytest.raises(UsageError, match="xml"):
        incidence_bytes(MODEL, "xml")
