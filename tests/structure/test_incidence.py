import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array, csr_array

from fdi.errors import ModelError
from fdi.structure import Fault, Model, bitset, load_reference, members, submodel

from .models import models


@given(st.sets(st.integers(0, 300)))
def test_members_are_the_indices_that_made_the_bit_set(indices):
    assert members(bitset(indices)) == tuple(sorted(indices))


def test_duplicate_entries_of_a_row_are_merged_and_sorted():
    assert Model(("e",), ("x", "y"), ((1, 0, 1),)).rows == ((0, 1),)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((("e", "e"), ("x",), ((0,), (0,))), "equation 'e' occurs more than once"),
        ((("e",), ("x", "x"), ((0,),)), "unknown 'x' occurs more than once"),
        ((("e",), ("x",), ((1,),)), "equation 'e': unknown index 1 is not in 0..0"),
        ((("e",), ("x",), ((-1,),)), "unknown index -1"),
        ((("e",), (), ((0,),)), "unknown index 0, but no unknowns"),
        ((("e",), ("x",), ((0,), (0,))), "1 equations but 2 rows"),
        ((("e",), ("x",), ((0,),), (Fault("f", (1,)),)), "fault 'f': equation index 1"),
        ((("e",), ("x",), ((0,),), (Fault("f", ()),)), "fault 'f' enters no equation"),
        (
            (("e",), ("x",), ((0,),), (Fault("f", (0,)), Fault("f", (0,)))),
            "fault 'f' occurs more than once",
        ),
        ((("e",), ("x", "y"), ((0,),), (), ((0, 1, "i"),)), "is marked but is not in the rows"),
        ((("e",), ("x",), ((0,),), (), ((0, 0, "x"),)), "'x' is neither 'i' nor 'd'"),
        ((("e",), ("x",), ((0,),), (), (), ((1, 0),)), "is marked but is not in the rows"),
    ],
)
def test_wrong_model_is_refused_in_one_line_that_says_what_is_wrong(arguments, text):
    with pytest.raises(ModelError) as caught:
        Model(*arguments)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_model_does_not_change():
    model = Model(("e",), ("x",), ((0,),))
    with pytest.raises(AttributeError):
        model.name = "other"


def test_dense_and_sparse_matrices_give_the_same_model():
    matrix = np.array([[1, 0, 1], [0, 0, 0], [0, 2, 0]])
    dense = Model.from_matrix(matrix, faults={"f": [0, 2]})
    for sparse in (csr_array(matrix), coo_array(matrix)):
        assert Model.from_matrix(sparse, faults={"f": [0, 2]}).rows == dense.rows
    assert dense.rows == ((0, 2), (), (1,))
    assert dense.faults == (Fault("f", (0, 2)),)


def test_explicit_zero_of_a_sparse_matrix_is_no_entry():
    assert Model.from_matrix(coo_array(([0, 1], ([0, 0], [0, 1])))).rows == ((1,),)


def test_matrix_of_one_dimension_is_refused():
    with pytest.raises(ModelError, match="2 dimensions, not 1"):
        Model.from_matrix([1, 0])


def test_faults_of_one_name_are_one_fault_in_several_equations(tmp_path):
    path = tmp_path / "model.json"
    faults = [{"name": "f", "equation": 1}, {"name": "g", "equation": 0}]
    data = {"name": "m", "equations": ["a", "b"], "unknowns": ["x"], "incidence": [[0, 0, "i"]]}
    path.write_text(json.dumps({**data, "faults": [*faults, {"name": "f", "equation": 0}]}))
    model = load_reference(path)
    assert model.faults == (Fault("f", (0, 1)), Fault("g", (0,)))
    assert model.derivative == ((0, 0, "i"),)


@pytest.mark.parametrize(
    "text", ["{", "[]", "{}", '{"equations": ["a"], "incidence": [[5, 0, 0]]}']
)
def test_file_that_is_no_reference_model_is_a_model_error_with_its_name(tmp_path, text):
    path = tmp_path / "broken.json"
    path.write_text(text)
    with pytest.raises(ModelError, match=r"broken\.json"):
        load_reference(path)


@given(models(), st.data())
def test_submodel_keeps_labels_of_equations_unknowns_and_faults(model, data):
    kept = data.draw(st.sets(st.sampled_from(range(len(model.rows))))) if model.rows else set()
    part = submodel(model, kept)
    labels = {model.equations[e]: {model.unknowns[u] for u in model.rows[e]} for e in sorted(kept)}
    assert labels == {
        label: {part.unknowns[u] for u in row}
        for label, row in zip(part.equations, part.rows, strict=True)
    }
    assert set(part.unknowns) == set().union(*labels.values())
    faults = {
        fault.name: {model.equations[e] for e in fault.equations if e in kept}
        for fault in model.faults
    }
    assert {name: where for name, where in faults.items() if where} == {
        fault.name: {part.equations[e] for e in fault.equations} for fault in part.faults
    }
