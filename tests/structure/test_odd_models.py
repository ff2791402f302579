"""Odd models have defined results; wrong models and calls are refused in one clear line."""

import numpy as np
import pytest
from hypothesis import given
from scipy.sparse import csr_array

from fdi.errors import ModelError, UsageError
from fdi.structure import (
    Fault,
    Model,
    bitset,
    classes,
    count_bound,
    decompose,
    detectable,
    graph_components,
    isolability,
    members,
    mso_sets,
    mtes_sets,
    place_sensors,
    sample_sets,
    select_tests,
    submodel,
)
from fdi.structure.causality import CAUSALITIES, causally_overdetermined
from fdi.structure.explain import why
from fdi.structure.frames import incidence_frame, isolability_frame, signature_frame
from fdi.structure.index import is_low_index, is_observable, residual_causality, structural_index
from fdi.structure.isolability import double_isolability

from .models import models, tried

EMPTY = Model((), (), ())


def everything(model):
    """Ask for all that can be asked of any model; return it in a comparable form."""
    sets = list(mso_sets(model))
    return (
        decompose(model),
        classes(model),
        graph_components(model),
        sets,
        list(mtes_sets(model)),
        list(mtes_sets(model, by_component=True)),
        count_bound(model),
        [detectable(model, causality).tolist() for causality in CAUSALITIES],
        [isolability(model, causality).tolist() for causality in CAUSALITIES],
        double_isolability(model).tolist(),
        is_low_index(model),
        is_observable(model),
        [residual_causality(model, bits) for bits in sets],
        place_sensors(model),
        [sample_sets(model, 3, kind=kind) for kind in ("mso", "mtes")],
        [test.equations for test in select_tests(model).tests],
    )


@given(models())
@tried(100)
def test_any_model_can_be_asked_anything(model):
    everything(model)


def test_an_empty_model_has_empty_answers():
    found = everything(EMPTY)
    assert (found[0].rank, found[0].redundancy) == (0, 0)
    assert found[2:7] == ((), [], [], [], 0)
    assert place_sensors(EMPTY) == ((),)
    assert structural_index(EMPTY) == (0, ())
    assert incidence_frame(EMPTY).shape == isolability_frame(EMPTY).shape == (0, 0)
    assert signature_frame(EMPTY, []).shape == (0, 0)


def test_equations_without_unknowns_are_each_overdetermined_alone():
    model = Model(("a", "b"), (), ((), ()), (Fault("f", (0,)), Fault("g", (1,))))
    assert list(mso_sets(model)) == [0b01, 0b10]
    assert decompose(model).redundancy == 2
    for causality in CAUSALITIES:
        assert isolability(model, causality).tolist() == [[False, True], [True, False]]


def test_unknowns_that_occur_nowhere_change_nothing_but_the_underdetermined_part():
    rows = ((0,), (0,), (1,), (1,))
    model = Model(("a", "b", "c", "d"), ("x", "y"), rows, (Fault("f", (0,)), Fault("g", (2,))))
    wider = Model(model.equations, ("x", "y", "unused"), rows, model.faults)
    assert everything(wider)[1:] == everything(model)[1:]
    assert decompose(wider).under.unknowns == (2,)


@given(models())
@tried(100)
def test_entries_faults_and_marks_that_are_repeated_are_one(model):
    twice = Model(
        model.equations,
        model.unknowns,
        tuple(row + row for row in model.rows),
        tuple(Fault(f.name, f.equations + f.equations) for f in model.faults),
    )
    assert everything(twice) == everything(model)


def test_marks_that_are_repeated_are_one():
    marks = ((0, 0, "i"), (0, 1, "d"))
    model = Model(("e",), ("x", "dx"), ((0, 1),), (), marks + marks, ((0, 0), (0, 0)))
    assert model.derivative == marks
    assert model.nonsolvable == ((0, 0),)


def test_a_fault_in_several_equations_is_gone_only_when_all_of_them_are():
    model = Model.from_matrix([[1], [1], [1]], faults={"f": (0, 1), "g": 2})
    assert isolability(model).tolist() == [[False, True], [False, False]]
    assert detectable(model).all()


WRONG_MODELS = {
    "unknown index 1.5 is no integer": lambda: Model(("e",), ("x", "y"), ((1.5,),)),
    "unknown index '0' is no integer": lambda: Model(("e",), ("x",), (("0",),)),
    "fault 'f': equation index None is no integer": lambda: Model(
        ("e",), ("x",), ((0,),), (Fault("f", (None,)),)
    ),
    "'x' is marked both as state and as derivative": lambda: Model(
        ("e",), ("x",), ((0,),), (), ((0, 0, "i"), (0, 0, "d"))
    ),
    # the constraint is about an unknown that the model does not have
    r"edge \(0, 7\) is marked but is not in the rows": lambda: Model(
        ("e",), ("x",), ((0,),), (), ((0, 0, "i"), (0, 7, "d"))
    ),
    "an entry of the incidence matrix is no number": lambda: Model.from_matrix([[np.nan]]),
    "of the incidence matrix is no number": lambda: Model.from_matrix([["x"]]),
    "matrix is no number": lambda: Model.from_matrix(csr_array([[np.nan]])),
    "1 columns but 2 labels": lambda: Model.from_matrix([[1]], unknowns=["x", "y"]),
    "2 rows but 1 labels": lambda: Model.from_matrix([[1], [1]], equations=["e"]),
    "fault 'f': equation index -1": lambda: Model.from_matrix([[1]], faults={"f": -1}),
}


@pytest.mark.parametrize("text", WRONG_MODELS)
def test_wrong_models_are_refused(text):
    with pytest.raises(ModelError, match=text) as caught:
        WRONG_MODELS[text]()
    assert "\n" not in str(caught.value)


def test_numpy_integers_are_integers():
    model = Model(("e",), ("x",), ((np.int64(0),),), (Fault("f", (np.int32(0),)),))
    assert model.rows == ((0,),)
    assert type(model.rows[0][0]) is type(model.faults[0].equations[0]) is int


PAIR = Model.from_matrix([[1], [1]], faults={"f": 0})
WRONG_CALLS = {
    "equation 5 of 2 equations does not exist": lambda: submodel(PAIR, [0, 5]),
    "equation -1 of 2 equations": lambda: submodel(PAIR, [-1]),
    "equation 7 of 2": lambda: graph_components(PAIR, [7]),
    "equation 3 of 2 equations does not": lambda: causally_overdetermined(PAIR, without=[3]),
    "equation 9 of 2 equations": lambda: is_low_index(PAIR, 1 << 9),
    "equation 8 of 2 equations": lambda: is_observable(PAIR, bitset([0, 8])),
    "equation 2 of 2 equations": lambda: residual_causality(PAIR, 0b100),
    "bit set -1 is negative": lambda: members(-1),
    "index -2 is negative": lambda: bitset([-2]),
    "unknown 1 of 1 unknowns does not exist": lambda: place_sensors(PAIR, [1]),
    "the model has no fault 'z'": lambda: why(PAIR, "z"),
    "'fast' is none of mixed": lambda: detectable(PAIR, "fast"),
}


@pytest.mark.parametrize("text", WRONG_CALLS)
def test_wrong_calls_are_refused(text):
    with pytest.raises(UsageError, match=text) as caught:
        WRONG_CALLS[text]()
    assert "\n" not in str(caught.value)
