"""Diagnoses are all minimal hitting sets of the conflicts, and only these."""

import time
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import bitset
from fdi.structure.hitting import diagnoses, minimal_hitting_sets


def brute_force(conflicts, n, most):
    found = []
    for size in range(most + 1):
        for some in combinations(range(n), size):
            if any(set(other) <= set(some) for other in found):
                continue
            if all(set(some) & conflict for conflict in conflicts):
                found.append(some)
    return tuple(found)


@given(
    conflicts=st.lists(st.sets(st.integers(0, 6)), max_size=7),
    most=st.integers(0, 5),
)
@settings(max_examples=300, deadline=None)
def test_they_equal_brute_force_in_their_order(conflicts, most):
    reacts = np.zeros((len(conflicts) + 1, 7), dtype=bool)
    for row, conflict in zip(reacts, conflicts, strict=False):
        row[list(conflict)] = True
    reacts[-1] = True  # a quiet test that concerns everybody excuses nobody
    alarmed = np.array([True] * len(conflicts) + [False])
    assert diagnoses(reacts, alarmed, most=most) == brute_force(conflicts, 7, most)


def test_they_equal_those_of_the_toolbox_of_record():
    toolbox = pytest.importorskip("faultdiagnosistoolbox")
    random = np.random.default_rng(1)
    for _ in range(30):
        conflicts = [
            np.sort(random.choice(8, random.integers(1, 5), replace=False)) for _ in range(5)
        ]
        theirs = {tuple(sorted(map(int, one))) for one in toolbox.MHS(conflicts)}
        ours = minimal_hitting_sets([bitset(map(int, c)) for c in conflicts], most=8)
        assert {tuple(i for i in range(8) if one >> i & 1) for one in ours} == theirs


def test_no_alarm_needs_no_fault_and_an_alarm_of_nobody_has_no_diagnosis():
    assert diagnoses([[True, False]], [False]) == ((),)
    assert diagnoses([[False, False]], [True]) == ()


def test_pairs_among_a_thousand_faults_and_tests_are_found_in_seconds():
    random = np.random.default_rng(2)
    reacts = random.random((1000, 1000)) < 0.2
    reacts[:500, 3], reacts[500:, 7] = True, True
    start = time.process_time()
    found = diagnoses(reacts, np.ones(1000, dtype=bool))
    assert time.process_time() - start < 10  # measured: 0.14
    assert found == ((3, 7),)


def test_wrong_shapes_are_refused():
    with pytest.raises(UsageError, match="are needed"):
        diagnoses([[True]], [True, False])
    with pytest.raises(UsageError, match="most is -1"):
        diagnoses([[True]], [True], most=-1)
