from random import Random

import pytest
from hypothesis import given
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from fdi.structure import classes, decompose, matching
from fdi.structure.matching import match, maximum_matching

from . import naive
from .models import models, tried


def assert_is_matching(matching, rows):
    equations = matching.unknown_of_equation
    for equation, unknown in enumerate(equations):
        if unknown >= 0:
            assert unknown in rows[equation]
            assert matching.equation_of_unknown[unknown] == equation
    assert len(matching) == (equations >= 0).sum()


@given(models())
def test_matching_pairs_each_equation_and_unknown_once_along_edges(model):
    assert_is_matching(maximum_matching(model.rows, len(model.unknowns)), model.rows)


@given(models())
def test_matching_is_as_large_as_the_rank_by_brute_force(model):
    assert len(maximum_matching(model.rows, len(model.unknowns))) == naive.rank(list(model.rows))


@pytest.mark.parametrize("seed", range(20))
def test_matching_of_a_larger_model_is_as_large_as_that_of_scipy(seed):
    random = Random(seed)
    n = random.randrange(50, 400)
    m = n + random.randrange(-20, 40)
    rows = [[random.randrange(n) for _ in range(random.randrange(4))] for _ in range(m)]
    matching = maximum_matching(rows, n)
    assert_is_matching(matching, rows)
    edges = [(e, u) for e, row in enumerate(rows) for u in row]
    graph = csr_array(([1] * len(edges), tuple(zip(*edges, strict=True))), shape=(m, n))
    assert len(matching) == (maximum_bipartite_matching(graph) >= 0).sum()


def test_matching_of_a_long_chain_needs_no_recursion():
    """The greedy start matches (i, i); only one path through all equations makes it perfect."""
    n = 5000
    rows = [(i, i + 1) for i in range(n - 1)] + [(0,)]
    matching = maximum_matching(rows, n)
    assert len(matching) == n
    assert_is_matching(matching, rows)


def test_matching_cannot_be_written_to():
    assert not maximum_matching(((0,),), 1).equation_of_unknown.flags.writeable


def test_nothing_is_matched_in_an_empty_model():
    assert len(maximum_matching((), 0)) == 0
    assert len(maximum_matching(((), ()), 3)) == 0


@given(model=models())
@tried(100)
def test_scipy_matches_as_many_and_the_parts_are_the_same(model):
    rows, n = model.rows, len(model.unknowns)
    own = match(rows, n)
    before = decompose(model), classes(model)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matching, "LARGE", 0)
        equation_of, unknown_of = match(rows, n)
        assert (decompose(model), classes(model)) == before
    assert sum(u >= 0 for u in unknown_of) == sum(u >= 0 for u in own[1])
    pairs = [(e, u) for e, u in enumerate(unknown_of) if u >= 0]
    assert all(u in rows[e] and equation_of[u] == e for e, u in pairs)
    assert sum(e >= 0 for e in equation_of) == len(pairs)
