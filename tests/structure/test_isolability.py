import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import Fault, Model, detectable, isolability, members, mso_sets
from fdi.structure.isolability import (
    detectable_of_signatures,
    isolability_of_signatures,
    not_isolable_groups,
)

from . import naive
from .models import models, tried


def signatures_of(model, bit_sets):
    tests = [set(members(bits)) for bits in bit_sets]
    signatures = np.zeros((len(tests), len(model.faults)), dtype=bool)
    for i, test in enumerate(tests):
        for j, fault in enumerate(model.faults):
            signatures[i, j] = not test.isdisjoint(fault.equations)
    return signatures


@given(models())
@tried(1000)
def test_isolability_equals_brute_force(model):
    n = range(len(model.faults))
    expected = [[naive.isolable(model, i, j) for j in n] for i in n]
    assert isolability(model).tolist() == expected
    assert isolability(model).shape == (len(n), len(n))


@given(models())
def test_detectability_equals_brute_force(model):
    expected = [naive.detectable(model, i) for i in range(len(model.faults))]
    assert detectable(model).tolist() == expected


@given(models())
def test_all_mso_sets_together_reach_what_structure_promises(model):
    signatures = signatures_of(model, mso_sets(model))
    assert (isolability_of_signatures(signatures) == isolability(model)).all()
    assert (detectable_of_signatures(signatures) == detectable(model)).all()


def test_fault_in_two_equations_of_different_classes_is_isolable_by_either():
    """The toolbox of record raises ValueError for its detectability (README section 7)."""
    model = Model(
        ("a", "b", "c"), ("x",), ((0,), (0,), (0,)), (Fault("f", (0, 1)), Fault("g", (0,)))
    )
    assert detectable(model).tolist() == [True, True]
    assert isolability(model).tolist() == [[False, True], [False, False]]


def test_model_without_faults_gives_empty_arrays():
    model = Model.from_matrix([[1], [1]])
    assert detectable(model).shape == (0,)
    assert isolability(model).shape == (0, 0)


@given(
    st.integers(1, 6).flatmap(
        lambda n: st.lists(st.lists(st.booleans(), min_size=n, max_size=n), min_size=1)
    )
)
def test_isolable_by_signatures_means_that_a_test_reacts_to_one_and_not_the_other(rows):
    n = range(len(rows[0]))
    expected = [[any(row[i] and not row[j] for row in rows) for j in n] for i in n]
    assert isolability_of_signatures(rows).tolist() == expected


@given(models())
def test_groups_equal_brute_force(model):
    pairs, seen = isolability(model), detectable(model)
    assert not_isolable_groups(pairs, seen) == naive.groups(pairs, seen)


def test_groups_join_faults_over_one_way_relations_and_leave_undetectable_ones_out():
    pairs = np.ones((4, 4), dtype=bool)
    pairs[0, 2] = False
    pairs[2, 3] = pairs[1, 0] = False
    assert not_isolable_groups(pairs, [True, False, True, True]) == ((0, 2, 3),)


def test_arrays_of_wrong_shape_are_refused():
    with pytest.raises(UsageError, match="2 dimensions"):
        isolability_of_signatures([True, False])
    with pytest.raises(UsageError, match=r"shape \(2, 2\), but there are 3 faults"):
        not_isolable_groups(np.ones((2, 2)), [True] * 3)
