"""Irreducible signatures carry the isolability of any faults that occur together."""

from itertools import chain, combinations

import pytest
from hypothesis import given

from fdi.errors import UsageError
from fdi.structure import Model, members, mtes_sets
from fdi.structure.causality import CAUSALITIES, causally_overdetermined
from fdi.structure.signatures import irreducible_signatures

from .models import dense, dynamic_models, models, tried


def subsets(items):
    items = list(items)
    return chain.from_iterable(combinations(items, n) for n in range(len(items) + 1))


def signature_without(model, gone, causality):
    """The faults of what stays testable when these faults are decoupled: by definition."""
    equations = {e for j in gone for e in model.faults[j].equations}
    part = set(causally_overdetermined(model, causality, without=equations))
    return frozenset(
        j for j, fault in enumerate(model.faults) if not part.isdisjoint(fault.equations)
    )


def all_signatures(model, causality):
    everyone = range(len(model.faults))
    return {signature_without(model, gone, causality) for gone in subsets(everyone)} - {frozenset()}


def found_signatures(model, causality="mixed"):
    found = [frozenset(members(bits)) for bits in irreducible_signatures(model, causality)]
    assert len(found) == len(set(found))
    return set(found)


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models())
@tried(200)
def test_they_are_the_signatures_that_are_no_union_of_smaller_ones(model, causality):
    everything = all_signatures(model, causality)
    expected = {s for s in everything if frozenset().union(*(t for t in everything if t < s)) != s}
    assert found_signatures(model, causality) == expected


@given(model=models(max_equations=9))
@tried(200)
def test_they_are_the_signatures_that_are_no_union_of_smaller_ones_without_dynamics(model):
    everything = all_signatures(model, "mixed")
    expected = {s for s in everything if frozenset().union(*(t for t in everything if t < s)) != s}
    assert found_signatures(model) == expected


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models())
@tried(100)
def test_they_tell_any_fault_from_any_faults_together_that_can_be_told(model, causality):
    signatures = found_signatures(model, causality)
    everyone = range(len(model.faults))
    for j in everyone:
        for gone in subsets(set(everyone) - {j}):
            possible = j in signature_without(model, gone, causality)
            assert possible == any(j in s and s.isdisjoint(gone) for s in signatures)


@given(models(max_equations=8))
@tried(200)
def test_mtes_are_the_smallest_of_them(model):
    """For faults that enter one equation each, by which supports are counted."""
    if any(len(fault.equations) > 1 for fault in model.faults):
        return
    found = found_signatures(model)
    smallest = {s for s in found if not any(t < s for t in found)}
    supports = {
        frozenset(j for j, fault in enumerate(model.faults) if bits >> fault.equations[0] & 1)
        for bits in mtes_sets(model)
    }
    assert supports == smallest


def test_a_signature_that_is_no_mtes_support_can_be_needed():
    """f is seen alone or with g and h; g and h only together with another one."""
    rows = [[1, 0], [1, 0], [0, 1], [1, 1]]
    model = Model.from_matrix(rows, faults={"f": 0, "g": 2, "h": 3})
    assert found_signatures(model) == {frozenset({0}), frozenset({1, 2})}


def test_more_than_the_limit_are_refused():
    model = dense(14, 10)
    count = len(found_signatures(model))
    assert len(list(irreducible_signatures(model, limit=count))) == count
    with pytest.raises(UsageError, match=f"more than {count - 1} irreducible"):
        list(irreducible_signatures(model, limit=count - 1))
    with pytest.raises(UsageError, match="'int' is none of"):
        next(irreducible_signatures(model, "int"))
