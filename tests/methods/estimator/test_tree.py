"""Fault trees: gates, the window, the path to the top."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.methods.estimator.failsafe import tripped
from fdi.methods.estimator.spans import gaps, lasting, spans_of, within
from fdi.methods.estimator.tree import (
    Node,
    all_of,
    any_of,
    cut,
    first_path,
    joined,
    path,
    unexplained,
    walk,
    without_effect,
)
from fdi.report.estimator_text import gate_of

SPANS = st.lists(st.tuples(st.floats(0, 50), st.floats(0, 10)), max_size=6).map(
    lambda found: joined([(low, low + length) for low, length in found])
)


def holds(spans: object, t: float) -> bool:
    return any(low <= t <= high for low, high in spans or ())  # type: ignore[attr-defined]


@given(SPANS, SPANS, st.floats(0, 60))
def test_gates_say_at_every_moment_what_logic_says(a: object, b: object, t: float) -> None:
    children = (Node("a", a), Node("b", b))  # type: ignore[arg-type]
    assert holds(any_of("or", children).spans, t) == (holds(a, t) or holds(b, t))
    assert holds(all_of("and", children).spans, t) == (holds(a, t) and holds(b, t))


def test_unknown_stays_unknown_where_it_decides() -> None:
    known, unknown = Node("k", ((1.0, 2.0),)), Node("u", None)
    assert any_of("or", (known, unknown)).spans == ((1.0, 2.0),)
    assert any_of("or", (unknown,)).spans is None
    assert all_of("and", (known, unknown)).spans is None


def test_the_path_takes_the_last_straw_of_an_or() -> None:
    early, late = Node("early", ((1.0, 9.0),)), Node("late", ((4.9, 9.0),))
    top = Node("top", ((5.0, 9.0),), "", "any", (early, late))
    assert [node.name for node in path(top)] == ["late", "top"]


def test_the_path_goes_down_to_the_cause_with_its_times() -> None:
    cause = Node("cause", ((1.0, 9.0),))
    middle = Node("middle", ((3.0, 9.0),), "", "any", (cause,))
    top = Node("top", ((3.5, 9.0),), "", "any", (Node("other", ()), middle))
    assert [(node.name, node.since) for node in path(top)] == [
        ("cause", 1.0),
        ("middle", 3.0),
        ("top", 3.5),
    ]


def test_a_child_recorded_later_counts_within_one_record() -> None:
    def names(resolution: float) -> list[str]:
        child = Node("child", ((3.1, 9.0),), resolution=resolution)
        return [node.name for node in path(Node("top", ((3.0, 9.0),), "", "any", (child,)))]

    assert names(0.2) == ["child", "top"]
    assert names(0.05) == ["top"]


def test_a_child_that_was_over_is_not_on_the_path() -> None:
    child = Node("child", ((1.0, 2.0),))
    assert [n.name for n in path(Node("top", ((5.0, 6.0),), "", "any", (child,)))] == ["top"]


def test_without_the_top_event_the_highest_node_that_came_is_told() -> None:
    child = Node("child", ((1.0, 2.0),), "", "any", (Node("grandchild", ((0.5, 2.0),)),))
    top = Node("top", (), "", "any", (child,))
    assert path(top) == ()
    assert [node.name for node in first_path(top)] == ["grandchild", "child"]


def test_cutting_leaves_nothing_outside_and_keeps_unknown() -> None:
    top = Node("top", ((0.0, 2.0), (5.0, 9.0)), "", "any", (Node("u", None),))
    made = cut(top, (4.0, 6.0))
    assert made.spans == ((5.0, 6.0),)
    assert made.children[0].spans is None


def test_a_shared_branch_is_walked_once() -> None:
    shared = Node("shared", ((1.0, 2.0),), "", "any", (Node("leaf", ()),))
    top = Node("top", (), "", "any", (shared, Node("b", (), "", "any", (shared,))))
    told = [(node.name, depth, again) for node, depth, again in walk(top)]
    assert told == [
        ("top", 0, False),
        ("shared", 1, False),
        ("leaf", 2, False),
        ("b", 1, False),
        ("shared", 2, True),
    ]


@given(st.lists(st.booleans(), min_size=2, max_size=40))
def test_spans_hold_exactly_where_the_records_say(flags: list[bool]) -> None:
    t = np.arange(len(flags), dtype=float)
    spans = spans_of(t, np.array(flags))

    def says(at: float) -> bool:
        return any(low <= at < high for low, high in spans)

    assert [says(at) for at in t[:-1]] == flags[:-1]  # nobody knows how long the last one holds
    assert any(high == t[-1] for _, high in spans) == (flags[-1] or flags[-2])


def test_gaps_and_what_lasts() -> None:
    t = np.array([0.0, 1.0, 6.0, 7.0])
    assert gaps(t, 2.0, 20.0) == ((1.0, 6.0), (7.0, 20.0))
    assert lasting(((1.0, 6.0), (7.0, 8.0)), 5.0) == ()
    assert lasting(((1.0, 9.0),), 5.0) == ((6.0, 9.0),)
    assert within(((1.0, 6.0),), (2.0, 3.0)) == ((2.0, 3.0),)


def counted(bad: list[tuple[float, float]], end: float) -> list[tuple[float, float]]:
    """Return what `tripped` has to: the counter of Copter::ekf_check, step by step."""
    count, since, found = 0, None, []
    steps = [round(0.1 * k, 9) for k in range(round(end * 10))]
    for t in steps:
        fails = any(low <= t < high for low, high in bad)
        if fails and since is None:
            count += 1
            if count >= 10:
                since = t
        elif not fails and count > 0:
            count -= 1
            if since is not None and count == 0:
                found.append((since, t))
                since = None
    return [*found, (since, steps[-1])] if since is not None else found


@given(st.lists(st.tuples(st.integers(0, 80), st.integers(1, 40)), max_size=6))
def test_the_failsafes_counter_equals_the_autopilots(found: list[tuple[int, int]]) -> None:
    bad = [(low / 10 - 0.05, (low + length) / 10 - 0.05) for low, length in found]
    expected = [pytest.approx(span) for span in counted(bad, 12.0)]
    assert list(tripped(bad, (0.0, 12.0), records=120)) == expected


@given(SPANS, SPANS)
def test_a_computed_or_is_never_contradicted_by_its_children(a: object, b: object) -> None:
    top = any_of("or", (Node("a", a), Node("b", b)))  # type: ignore[arg-type]
    assert unexplained(top) == ()
    assert not any(without_effect(top, child) for child in top.children)


def test_an_or_that_the_log_tells_without_any_child_says_so() -> None:
    children = (Node("a", ((4.0, 5.0),)), Node("b", ()))
    top = Node("top", ((1.0, 2.0), (4.5, 6.0)), "its flag", "any", children)
    assert unexplained(top) == ((1.0, 2.0),)
    assert gate_of(top) == "OR, though 1 time by none of these"
    assert gate_of(cut(top, (0.0, 3.0))) == "OR, though by none of these"
    assert gate_of(cut(top, (3.0, 6.0))) == "OR"


def test_a_cause_recorded_up_to_one_record_later_explains() -> None:
    late = Node("late", ((1.3, 9.0),), resolution=0.2)
    assert unexplained(Node("top", ((1.0, 9.0),), "", "any", (late,), 0.1)) == ()
    assert unexplained(Node("top", ((1.0, 9.0),), "", "any", (late,), 0.05)) == ((1.0, 9.0),)


def test_a_child_that_was_true_while_the_log_says_no_is_named_as_not_enough() -> None:
    child, other = Node("idle", ((1.0, 2.0),)), Node("cause", ((4.0, 9.0),))
    top = Node("top", ((4.0, 9.0),), "its flag", "any", (child, other))
    assert without_effect(top, child) == ((1.0, 2.0),)
    assert without_effect(top, other) == ()
    assert gate_of(top) == "OR, though not by 'idle' alone"
    unknown = Node("top", None, "", "any", (child,))
    assert without_effect(unknown, child) == ()
    assert gate_of(unknown) == ""
