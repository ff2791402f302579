"""One cycle after another: who is blamed, what counts, who is silent, who gets the vote."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fdi.methods.voting import PRESETS
from fdi.methods.voting.rules import Inputs, begin, blame, step

from .build import inputs

RULES = replace(PRESETS["recorded"], flags=("failsafe",))
GOOD, BAD, UNKNOWN = 0.0, 1.0, np.nan
FLAGS = arrays(
    float,
    st.tuples(st.integers(2, 5), st.integers(1, 3)),
    elements=st.sampled_from([0.0, 1.0, np.nan]),
)


def run(cycles, *, n=3, flags=1, rules=RULES):
    """Return what is concluded in each of some cycles."""
    state, found = begin((), n, flags), []
    for one in cycles:
        state, concluded = step(state, one, rules)
        found.append(concluded)
    return found


def first_is(value, *, t, n=3, **more):
    """Cycles in which autopilot 1's flag has a value and all others' are good."""
    return [inputs(at, [[value]] + [[GOOD]] * (n - 1), **more) for at in t]


@pytest.mark.parametrize(
    ("values", "blamed"),
    [
        ([GOOD, GOOD, GOOD], []),
        ([BAD, GOOD, GOOD], [0]),
        ([GOOD, BAD, BAD], [1, 2]),
        ([BAD, BAD, BAD], []),
        ([BAD, UNKNOWN, GOOD], [0]),
        ([BAD, UNKNOWN, BAD], []),
        ([UNKNOWN, UNKNOWN, UNKNOWN], []),
    ],
)
def test_bad_flags_are_blamed_unless_nobody_known_has_a_good_one(values, blamed):
    found = blame(np.array(values)[:, None])
    assert np.flatnonzero(found[:, 0]).tolist() == blamed


@given(FLAGS)
def test_nobody_is_blamed_where_all_agree(bad):
    agrees = [len(set(column[np.isfinite(column)].tolist())) <= 1 for column in bad.T]
    assert not blame(bad)[:, agrees].any()


@given(FLAGS)
def test_only_bad_flags_are_blamed(bad):
    assert np.all(bad[blame(bad)] == BAD)


@pytest.mark.parametrize(("cycle", "counts_in"), [(1.0, 2), (1.004, 1), (0.5, 3), (0.25, 5)])
def test_an_error_counts_once_it_was_blamed_for_more_than_a_second(cycle, counts_in):
    """From the last cycle in which it was not blamed: at 1.000 s the second one that blames."""
    t = 20 + cycle * np.arange(9)
    cycles = [*first_is(GOOD, t=t[:1]), *first_is(BAD, t=t[1:])]
    counters = [one.counters[0] for one in run(cycles)]
    assert counters.index(1) == counts_in
    assert sum(counters) == len(counters) - counts_in


def test_what_is_bad_from_the_first_cycle_on_is_blamed_from_there_on():
    counters = [one.counters[0] for one in run(first_is(BAD, t=[10, 11, 11.5]))]
    assert counters == [0, 0, 1]


def test_one_good_cycle_starts_the_second_anew():
    cycles = [
        *first_is(GOOD, t=[20]),
        *first_is(BAD, t=[21]),
        *first_is(GOOD, t=[22]),
        *first_is(BAD, t=[23, 24]),
    ]
    assert [one.counters[0] for one in run(cycles)] == [0, 0, 0, 0, 1]


def test_a_counted_error_outlives_its_cause_by_600_s():
    cycles = [
        *first_is(GOOD, t=[20]),
        *first_is(BAD, t=[21, 22]),
        *first_is(GOOD, t=[23, 622, 622.004]),
    ]
    assert [one.counters[0] for one in run(cycles)] == [0, 0, 1, 1, 1, 0]


@pytest.mark.parametrize(("age", "is_silent"), [(2.996, False), (3.0, False), (3.000001, True)])
def test_silence_is_more_than_three_seconds(age, is_silent):
    """The record has a cycle at which the stamp is exactly 3.000 s old: not yet silent."""
    now = 45.072
    (found,) = run([inputs(now, [[GOOD]] * 3, own=2, heard_s=[now - age, now, now])])
    assert found.silent.tolist() == [is_silent, False, False]
    assert int(found.vote) == (1 if is_silent else 0)
    assert int(found.priorities[0]) == (3 if is_silent else 1)


def test_who_was_silent_once_stays_so():
    heard_again = inputs(50, [[GOOD]] * 3, own=1)
    found = run([inputs(45, [[GOOD]] * 3, own=1, heard_s=[40, 45, 45]), heard_again])
    assert [one.silent[0] for one in found] == [True, True]


def test_where_all_are_at_the_worst_the_vote_stays():
    bad = [[BAD], [GOOD], [GOOD]]
    silent = {"own": 0, "heard_s": [30, 20, 20]}
    cycles = [
        inputs(20, [[GOOD]] * 3),
        inputs(21, bad),
        inputs(22, bad),
        inputs(30, bad, **silent),
    ]
    found = run(cycles)
    assert [int(one.vote) for one in found] == [0, 0, 1, 1]
    assert found[-1].priorities.tolist() == [3, 3, 3]
    assert int(found[-1].best) == 3


@pytest.mark.parametrize(
    ("place", "own", "falls_after"), [(0, 0, 4), (1, 0, 3), (2, 0, 4), (0, 1, 3)]
)
def test_health_goes_after_three_seconds_of_errors_of_the_first_peer_after_two(
    place, own, falls_after
):
    """Cycles of 1 s from the first with a counted error, strictly more than 3 s or 2 s on."""
    bad = [[GOOD]] * 3
    bad[place] = [BAD]
    cycles = [inputs(20, [[GOOD]] * 3, own=own), *(inputs(21 + k, bad, own=own) for k in range(9))]
    marks = [bool(one.healthy[place]) for one in run(cycles)]
    counted = next(k for k, one in enumerate(run(cycles)) if one.counters[place])
    assert marks.index(False) == counted - 1 + falls_after


def test_health_comes_back_150_s_after_the_last_error():
    rules = replace(RULES, hold=0.0)
    cycles = [
        *first_is(GOOD, t=[20]),
        *first_is(BAD, t=range(21, 30)),
        *first_is(GOOD, t=[30, 179, 180, 181]),
    ]
    marks = [bool(one.healthy[0]) for one in run(cycles, rules=rules)]
    assert marks[-4:] == [False, False, True, True]


@st.composite
def histories(draw, most=5, least=2, fewest=1):
    """Some cycles of n autopilots with two flags, at steps of a grid on which limits fall."""
    n = draw(st.integers(least, most))
    own = draw(st.integers(0, n - 1))
    cycles, now = [], 20_000_000
    for _ in range(draw(st.integers(fewest, 8))):
        now += draw(st.sampled_from([500_000, 1_000_000, 1_004_000, 3_000_000]))
        bad = draw(arrays(float, (n, 2), elements=st.sampled_from([0.0, 1.0, np.nan])))
        age = draw(
            arrays(np.int64, n, elements=st.sampled_from([0, 1_000_000, 3_000_000, 3_004_000]))
        )
        age[own] = 0
        cycles.append(Inputs(np.array(now), np.array(own), bad, now - age))
    return n, cycles


@given(histories())
def test_the_vote_has_the_smallest_priority_and_the_lowest_number(history):
    n, cycles = history
    before = 0
    for one in run(cycles, n=n, flags=2):
        smallest = int(one.priorities.min())
        expected = before if smallest == n else one.priorities.tolist().index(smallest)
        assert int(one.vote) == expected
        assert int(one.best) == smallest
        before = int(one.vote)


@given(histories(), st.floats(0, 3), st.floats(0, 3))
def test_longer_persistence_counts_no_further_error(history, a, b):
    n, cycles = history
    quick, slow = (replace(RULES, persistence=x) for x in (min(a, b), max(a, b)))
    pairs = zip(
        run(cycles, n=n, flags=2, rules=quick), run(cycles, n=n, flags=2, rules=slow), strict=True
    )
    assert all(np.all(more.counted >= less.counted) for more, less in pairs)


@given(histories(), st.floats(0, 5), st.floats(0, 5))
def test_more_patience_finds_nobody_else_silent(history, a, b):
    n, cycles = history
    quick, slow = (replace(RULES, silence=x) for x in (min(a, b), max(a, b)))
    pairs = zip(
        run(cycles, n=n, flags=2, rules=quick), run(cycles, n=n, flags=2, rules=slow), strict=True
    )
    assert all(np.all(more.silent >= less.silent) for more, less in pairs)


@given(histories())
def test_inputs_are_left_as_they_are(history):
    n, cycles = history
    before = [one.bad.copy() for one in cycles]
    run(cycles, n=n, flags=2)
    for one, bad in zip(cycles, before, strict=True):
        np.testing.assert_array_equal(one.bad, bad)


@given(st.lists(histories(3, 3, 2), min_size=2, max_size=3))
def test_cases_together_conclude_as_each_alone(found):
    alone = [[one.vote for one in run(cycles[:2], flags=2)] for _, cycles in found]
    state = begin((len(found),), 3, 2)
    for k in range(2):
        now, own, bad, heard = (
            np.stack([getattr(cycles[k], name) for _, cycles in found])
            for name in ("now", "own", "bad", "heard_at")
        )
        state, concluded = step(state, Inputs(now, own, bad, heard), RULES)
        assert concluded.vote.tolist() == [int(votes[k]) for votes in alone]
