from hypothesis import given

from fdi.structure.matching import maximum_matching

from . import naive
from .models import models


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
