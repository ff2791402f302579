"""Enumeration by alternating paths gives what vectors give, in the same order, and at once."""

import signal
import time
from itertools import islice

import pytest
from counting import calls
from hypothesis import given

from fdi.structure import Model, mso_sets, paths, search
from fdi.structure.decomposition import overdetermined
from fdi.structure.incidence import members
from fdi.structure.matching import in_order
from fdi.structure.testsets import mso_groups, mtes_groups

from .models import dense, models, tried
from .test_compiled import SEARCHES, redundant


def by(find, group):
    return [one for batch in find(group.rows, group.sets, group.may_go) for one in batch]


def by_vectors(rows, sets, may_go):
    return search.search(rows, sets, may_go, False)


@given(redundant())
@tried(200)
def test_paths_find_the_same_sets_in_the_same_order_as_vectors(model):
    for groups in (mso_groups, mtes_groups):
        for group in groups(model):
            if len(group.rows) - len({u for row in group.rows for u in row}) >= 3:
                assert by(paths.minimal_sets, group) == by(by_vectors, group)


@pytest.mark.parametrize("groups", [mso_groups, mtes_groups])
def test_paths_find_the_same_sets_on_a_dense_model(groups):
    (*_, group) = groups(dense(17, 11))
    assert by(paths.minimal_sets, group) == by(by_vectors, group) != []


@pytest.mark.parametrize("find", SEARCHES)
def test_a_component_that_is_too_large_for_vectors_is_searched_all_the_same(find, monkeypatch):
    model = dense(14, 9)
    expected = list(find(model, compiled=False))
    monkeypatch.setattr(search, "ROOM", 0)
    assert list(find(model)) == list(find(model, compiled=False)) == expected
    monkeypatch.setattr(search, "ROOM", 1 << 30)
    monkeypatch.setattr(search, "LARGE", 0)
    monkeypatch.setattr(search, "PATIENCE", 1e-9)
    assert list(find(model)) == list(find(model, compiled=False)) == expected


@given(models())
@tried(100)
def test_a_matching_in_order_uses_the_first_rows_that_fit_together(model):
    n = len(model.unknowns)
    order = list(range(len(model.rows)))[::-1]
    equation_of, unknown_of = in_order(model.rows, n, order)
    used = []
    for row in order:  # a row is used exactly when those before it and itself can all be matched
        alone = [model.rows[r] for r in (*used, row)]
        fits = sum(u >= 0 for u in in_order(alone, n, range(len(alone)))[1]) == len(alone)
        assert (unknown_of[row] >= 0) == fits
        used += [row] if fits else []
    assert all(equation_of[u] == r for r, u in enumerate(unknown_of) if u >= 0)


def chain(length, redundancy):
    """A long model in one piece: an equation between neighbours, measured here and there twice."""
    rows = [(k, k + 1) for k in range(length - 1)]
    rows += [(k * (length - 1) // redundancy,) for k in range(redundancy + 1)]
    return Model(
        tuple(f"e{i}" for i in range(len(rows))),
        tuple(f"x{i}" for i in range(length)),
        tuple(rows),
    )


def test_the_first_sets_of_ten_thousand_equations_come_at_once():
    model = chain(9_700, 300)
    found = []
    assert calls(lambda: found.extend(islice(mso_sets(model), 20))) < 1_000_000
    assert len(set(found)) == 20
    for one in found:
        rows = [model.rows[e] for e in members(one)]
        assert len(overdetermined(rows)) == len(rows) == 1 + len({u for r in rows for u in r})


class StoppedError(Exception):
    pass


@pytest.mark.parametrize("compiled", [True, False])
def test_an_alarm_ends_a_search_that_would_go_on_for_hours(compiled):
    """Of CPU time, so that a loaded machine does not matter; it is heard within milliseconds."""
    model = dense(400, 370, 3)
    list(mso_sets(dense(6, 2), compiled=compiled))  # load it

    def stop(*_):
        raise StoppedError

    before = signal.signal(signal.SIGPROF, stop)
    try:
        for after in (0.02, 0.15, 0.4):
            start = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, after)
            with pytest.raises(StoppedError):
                list(mso_sets(model, compiled=compiled))
            assert time.process_time() - start < after + 5
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
