"""Priorities: the published table of three, the rule for n, and what holds for both."""

import itertools
import json

import numpy as np
import pytest
from flights import ROOT
from hypothesis import given
from hypothesis import strategies as st

from fdi.methods.voting.priorities import patterns, priorities

REFERENCE = ROOT.parent / "shared" / "methods" / "voter_reference.json"
TRIPLES = np.array(list(itertools.product(range(12), repeat=3)))
COUNTERS = st.lists(st.integers(0, 12), min_size=2, max_size=7).map(np.array)


def vote_of(ranked, before=0):
    """The lowest number among those with the smallest priority; all at the worst keep the vote."""
    return before if min(ranked) == len(ranked) else int(np.argmin(ranked))


@pytest.mark.skipif(not REFERENCE.is_file(), reason="no ../shared")
def test_every_row_of_the_reference_table_is_returned():
    rows = json.loads(REFERENCE.read_text())["priority_table"]["rows"]
    assert len(rows) == 26
    for row in rows:
        assert priorities(np.array(row["pattern"])).tolist() == row["priorities"]


@pytest.mark.parametrize(
    ("counters", "expected"),
    [
        ([4, 0, 0], [3, 1, 1]),
        ([0, 0, 0], [1, 1, 1]),
        ([7, 7, 7], [3, 3, 3]),
        ([5, 2, 5], [3, 1, 3]),
        ([1, 11, 11], [1, 3, 3]),
        ([3, 3, 1], [3, 3, 2]),
    ],
)
def test_of_three_the_order_alone_decides(counters, expected):
    assert priorities(np.array(counters)).tolist() == expected


def test_of_1728_triples_110_look_different_to_two_autopilots_and_none_votes_differently():
    """Those with the same three counters, each seen in the order own, first, second."""
    differing = 0
    for triple in TRIPLES:
        seen = []
        for own in range(3):
            order = [own, *(k for k in range(3) if k != own)]
            ranked = np.empty(3, int)
            ranked[order] = priorities(triple[order])
            seen.append(ranked.tolist())
        differing += any(ranked != seen[0] for ranked in seen)
        assert len({vote_of(ranked, before=1) for ranked in seen}) == 1
    assert differing == 110


def test_of_three_the_lowest_number_with_fewest_errors_is_voted_for():
    ranked = priorities(TRIPLES)
    for triple, row in zip(TRIPLES, ranked, strict=True):
        if len(set(triple)) == 1 and triple[0]:
            assert row.tolist() == [3, 3, 3]
        else:
            assert vote_of(row) == int(np.argmin(triple))


@given(COUNTERS)
def test_equal_counters_get_equal_priorities(counters):
    ranked = priorities(counters)
    for value in set(counters.tolist()):
        assert len(set(ranked[counters == value].tolist())) == 1


@given(COUNTERS)
def test_fewer_errors_never_rank_worse(counters):
    ranked = priorities(counters)
    order = np.argsort(counters, kind="stable")
    assert np.all(np.diff(ranked[order]) >= 0)
    assert ranked.min() >= 1
    assert ranked.max() <= counters.size


@given(COUNTERS)
def test_patterns_are_dense_ranks_of_those_with_errors(counters):
    ordered = sorted(set(counters.tolist()) - {0})
    expected = [0 if c == 0 else ordered.index(c) + 1 for c in counters.tolist()]
    assert patterns(counters).tolist() == expected


@given(st.integers(2, 7), st.integers(1, 9))
def test_errors_that_all_have_leave_nobody_better_than_the_one_in_charge(n, count):
    equal = np.full(n, count)
    assert set(priorities(equal).tolist()) == {n}
    assert set(priorities(equal, keeps_vote_when_equal=False).tolist()) == {1}


@given(st.lists(st.lists(st.integers(0, 4), min_size=4, max_size=4), min_size=1, max_size=5))
def test_many_cases_at_once_are_each_as_alone(cases):
    together = priorities(np.array(cases))
    assert together.tolist() == [priorities(np.array(case)).tolist() for case in cases]
