import itertools
from functools import reduce
from operator import or_

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import (
    Fault,
    Model,
    bitset,
    count_bound,
    decompose,
    graph_components,
    members,
    mso_sets,
    mtes_sets,
    submodel,
)
from fdi.structure.decomposition import overdetermined

from . import naive
from .models import dense, models, tried


def as_sets(bit_sets):
    found = [frozenset(members(bits)) for bits in bit_sets]
    assert len(found) == len(set(found))  # none twice
    return set(found)


@given(models(max_equations=8))
@tried(1000)
def test_mso_sets_equal_brute_force_on_small_models(model):
    assert as_sets(mso_sets(model)) == naive.mso(model)


@given(models(max_equations=8))
@tried(1000)
def test_mtes_equal_brute_force_on_small_models(model):
    assert as_sets(mtes_sets(model)) == naive.mtes(model)


@given(models(max_equations=8, max_unknowns=2))
@tried(100)
def test_sets_equal_brute_force_at_high_redundancy(model):
    assert as_sets(mso_sets(model)) == naive.mso(model)
    assert as_sets(mtes_sets(model)) == naive.mtes(model)


def test_every_mso_set_is_overdetermined_by_one_and_minimal():
    model = dense(16, 11)
    found = list(mso_sets(model))
    assert len(found) > 100
    for bits in found:
        equations = members(bits)
        rows = [model.rows[e] for e in equations]
        assert overdetermined(rows) == tuple(range(len(rows)))
        assert len(rows) - len({u for row in rows for u in row}) == 1


def test_every_mtes_has_redundancy_one_above_its_fault_free_equations():
    model = dense(16, 11)
    faulty = {e for fault in model.faults for e in fault.equations}
    found = list(mtes_sets(model))
    assert found
    fault_free = submodel(model, set(range(16)) - faulty)
    for bits in found:
        parts = decompose(submodel(model, members(bits)))
        assert len(parts.over.equations) == bits.bit_count()
        assert parts.redundancy == decompose(fault_free).redundancy + 1


def test_with_a_fault_in_every_equation_mtes_are_the_mso_sets():
    model = dense(14, 10)
    faults = tuple(Fault(f"f{i}", (i,)) for i in range(14))
    everywhere = Model(model.equations, model.unknowns, model.rows, faults)
    assert as_sets(mtes_sets(everywhere)) == as_sets(mso_sets(model))


@given(models(), st.randoms(use_true_random=False))
def test_permuting_equations_permutes_the_sets(model, random):
    order = list(range(len(model.rows)))
    random.shuffle(order)
    other = naive.permuted(model, order)
    for search in (mso_sets, mtes_sets):
        moved = {frozenset(order[e] for e in found) for found in as_sets(search(other))}
        assert moved == as_sets(search(model))


def test_sets_come_in_the_same_order_every_time():
    model = dense(16, 11)
    assert list(mso_sets(model)) == list(mso_sets(model))
    assert list(mtes_sets(model)) == list(mtes_sets(model))


def test_sets_come_one_graph_component_after_the_other():
    matrix = [[1, 0], [0, 1], [1, 0], [0, 1], [1, 0], [0, 1]]
    model = Model.from_matrix(matrix)
    parts = [bitset(part.equations) for part in graph_components(model)]
    of = [next(i for i, part in enumerate(parts) if part & bits) for bits in mso_sets(model)]
    assert of == sorted(of) == [0, 0, 0, 1, 1, 1]


def test_search_can_be_stopped_on_a_model_whose_enumeration_ends_nowhere():
    model = dense(90, 30)
    first = list(itertools.islice(mso_sets(model), 10))
    assert len(set(first)) == 10


@pytest.mark.parametrize("search", [mso_sets, mtes_sets])
def test_more_sets_than_the_limit_are_refused_with_the_count_so_far(search):
    model = dense(16, 11)
    count = len(list(search(model)))
    assert len(list(search(model, limit=count))) == count
    with pytest.raises(UsageError, match=rf"more than {count - 1} .* \({count} found so far\)"):
        list(search(model, limit=count - 1))
    with pytest.raises(UsageError, match=r"more than 2 .* found so far"):
        list(search(model, limit=2))


def test_limit_of_an_endless_enumeration_is_reached_quickly():
    with pytest.raises(UsageError, match="found so far"):
        list(mso_sets(dense(90, 30), limit=1000))


def test_fault_free_redundancy_elsewhere_belongs_to_every_mtes_by_definition_only():
    model = Model.from_matrix([[1, 0], [1, 0], [0, 1], [0, 1]], faults={"f": 0})
    assert as_sets(mtes_sets(model)) == {frozenset({0, 1, 2, 3})}
    assert as_sets(mtes_sets(model, by_component=True)) == {frozenset({0, 1})}


@given(models())
def test_mtes_by_component_are_the_mtes_of_the_component_models(model):
    expected = set()
    for part in graph_components(model):
        for found in naive.mtes(submodel(model, part.equations)):
            expected.add(frozenset(part.equations[e] for e in found))
    assert as_sets(mtes_sets(model, by_component=True)) == expected


@given(models())
def test_count_bound_is_not_below_the_number_of_mtes(model):
    assert count_bound(model) >= len(as_sets(mtes_sets(model)))


@pytest.mark.parametrize("search", [mso_sets, mtes_sets])
def test_models_without_overdetermined_part_have_no_sets(search):
    assert list(search(Model((), (), ()))) == []
    assert list(search(Model.from_matrix([[1, 0], [0, 1]], faults={"f": 0}))) == []


def test_model_without_faults_has_mso_sets_and_no_mtes():
    model = Model.from_matrix([[1], [1]])
    assert list(mso_sets(model)) == [0b11]
    assert list(mtes_sets(model)) == []


def test_equation_without_unknowns_is_an_mso_set_and_its_fault_an_mtes():
    """The toolbox of record reports such a fault as not detectable (README section 7)."""
    model = Model(("e", "g"), ("x",), ((), (0,)), (Fault("f", (0,)),))
    assert list(mso_sets(model)) == [0b01]
    assert list(mtes_sets(model)) == [0b01]


def test_two_faults_of_one_equation_count_once_and_a_fault_in_two_equations_twice():
    rows = ((0,), (0,), (0,))
    same = Model(("a", "b", "c"), ("x",), rows, (Fault("f", (0,)), Fault("g", (0,))))
    assert as_sets(mtes_sets(same)) == {frozenset({0, 1, 2})}
    twice = Model(("a", "b", "c"), ("x",), rows, (Fault("f", (0, 1)),))
    assert as_sets(mtes_sets(twice)) == {frozenset({0, 2}), frozenset({1, 2})}


def test_union_of_all_mso_sets_is_the_overdetermined_part():
    model = dense(16, 11)
    union = reduce(or_, mso_sets(model))
    assert members(union) == overdetermined(model.rows)
