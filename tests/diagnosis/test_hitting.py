"""Minimal hitting sets: against brute force, and what they are by definition."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.hitting import minimal_hitting_sets

CONFLICTS = st.lists(st.frozensets(st.sampled_from("abcdef"), max_size=4), max_size=6)


def naive(conflicts, most):
    """Every set of components, by size; minimal if no smaller one is inside."""
    found = []
    for size in range(most + 1):
        for names in combinations("abcdef", size):
            own = frozenset(names)
            if all(own & c for c in conflicts) and not any(known < own for known in found):
                found.append(own)
    return found


@given(CONFLICTS, st.integers(0, 4))
def test_hitting_sets_equal_brute_force_in_order_of_size_and_name(conflicts, most):
    assert list(minimal_hitting_sets(conflicts, most=most)) == naive(conflicts, most)


@given(CONFLICTS)
def test_hitting_set_hits_every_conflict_and_needs_each_of_its_members(conflicts):
    for own in minimal_hitting_sets(conflicts):
        assert all(own & conflict for conflict in conflicts)
        for name in own:
            assert not all((own - {name}) & conflict for conflict in conflicts)


@given(CONFLICTS, st.randoms())
def test_order_of_conflicts_does_not_matter(conflicts, random):
    shuffled = list(conflicts)
    random.shuffle(shuffled)
    assert minimal_hitting_sets(shuffled) == minimal_hitting_sets(conflicts)


def test_without_conflict_nothing_has_failed():
    assert minimal_hitting_sets([]) == (frozenset(),)


def test_empty_conflict_cannot_be_hit():
    assert minimal_hitting_sets([frozenset("a"), frozenset()]) == ()
