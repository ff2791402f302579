"""Compiled code returns what Python returns, in the same order, and is only loaded when it pays."""

import subprocess
import sys
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import Fault, Model, load_reference, mso_sets, mtes_sets, search

from .models import REFERENCE, dense, needs_shared, tried

SEARCHES = (mso_sets, mtes_sets)


@st.composite
def redundant(draw):
    """A model of redundancy 3 to 6 with dependencies between points: lines with many of them."""
    n = draw(st.integers(1, 6))
    rows = draw(
        st.lists(st.lists(st.integers(0, n - 1), max_size=3), min_size=n + 3, max_size=n + 6)
    )
    where = draw(st.lists(st.integers(0, len(rows) - 1), max_size=6))
    return Model(
        tuple(f"e{i}" for i in range(len(rows))),
        tuple(f"x{i}" for i in range(n)),
        tuple(map(tuple, rows)),
        tuple(Fault(f"f{k}", (i,)) for k, i in enumerate(where)),
    )


@given(redundant())
@tried(500)
def test_compiled_code_finds_the_same_sets_in_the_same_order(model):
    for find in SEARCHES:
        assert list(find(model, compiled=True)) == list(find(model, compiled=False))


@pytest.mark.parametrize("find", SEARCHES)
def test_compiled_code_fills_its_buffer_more_than_once_and_loses_nothing(find, monkeypatch):
    from fdi.structure import compiled

    model = dense(24, 17)
    expected = list(find(model, compiled=False))
    monkeypatch.setattr(compiled, "BUFFER", 1)  # the least there is room for: one node
    assert len(expected) > 24**2
    assert list(find(model, compiled=True)) == expected


@pytest.mark.parametrize("find", SEARCHES)
def test_sets_of_more_equations_than_a_word_has_bits(find):
    tail = dense(16, 11)
    shift = 150  # chain of equations that are just determined, in front
    rows = tuple((k,) for k in range(shift))
    rows += tuple(tuple(shift + u for u in row) for row in tail.rows)
    model = Model(
        tuple(f"e{i}" for i in range(len(rows))),
        tuple(f"x{i}" for i in range(shift + 11)),
        rows,
        tuple(Fault(f.name, tuple(shift + e for e in f.equations)) for f in tail.faults),
    )
    found = list(find(model, compiled=True))
    assert found == [bits << shift for bits in find(tail, compiled=False)]


@needs_shared
@pytest.mark.parametrize("path", REFERENCE, ids=[path.stem for path in REFERENCE])
def test_compiled_code_finds_the_same_sets_on_the_reference_models(path):
    model = load_reference(path)
    for find in SEARCHES:
        try:
            expected = list(find(model, limit=7000, compiled=False))
        except UsageError:
            continue
        assert list(find(model, compiled=True)) == expected


def test_a_caller_can_stop_compiled_code_early():
    endless = dense(90, 30)
    assert len(list(islice(mso_sets(endless, compiled=True), 1000))) == 1000
    with pytest.raises(UsageError, match="more than 1000 MSO sets"):
        list(mso_sets(endless, limit=1000, compiled=True))


@pytest.mark.parametrize("find", SEARCHES)
def test_handing_over_changes_nothing(find, monkeypatch):
    model = dense(16, 11)
    expected = list(find(model, compiled=False))
    monkeypatch.delitem(sys.modules, search.COMPILED, raising=False)
    monkeypatch.setattr(search, "PATIENCE", 1e-9)
    assert list(find(model)) == expected
    assert search.COMPILED in sys.modules


def test_without_the_extra_python_goes_on_and_asking_for_it_is_an_error(monkeypatch):
    model = dense(16, 11)
    expected = list(mso_sets(model, compiled=False))
    monkeypatch.setitem(sys.modules, search.COMPILED, None)
    monkeypatch.setattr(search, "PATIENCE", 1e-9)
    assert list(mso_sets(model)) == expected
    with pytest.raises(UsageError, match=r"compiled code cannot be used.*uav-fdi\[fast\]"):
        list(mso_sets(model, compiled=True))


def test_a_small_search_does_not_load_compiled_code():
    code = (
        "import sys; from fdi.structure import Model, mso_sets\n"
        "print(len(list(mso_sets(Model.from_matrix([[1]] * 8)))), 'numba' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["28", "False"]
