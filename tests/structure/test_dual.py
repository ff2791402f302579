import itertools

from fdi.structure.dual import null_space, without
from fdi.structure.field import WIDTH, nonzero, ones

COMPLETE = tuple(itertools.combinations(range(5), 2))  # 10 rows, 5 unknowns, redundancy 5


def test_null_space_has_one_vector_for_each_degree_of_redundancy():
    assert len(null_space(COMPLETE)) == 5


def test_vectors_of_the_basis_are_zero_nowhere():
    everywhere = ones(len(COMPLETE))
    assert all(nonzero(vector, everywhere) == everywhere for vector in null_space(COMPLETE))


def test_entry_that_cancels_during_elimination_is_no_obstacle():
    """Rows 0 to 2 determine x and y; what is left of row 2 has no z, though by pattern it might."""
    rows = ((0, 1), (0, 1), (0, 1, 2), (0, 1, 2), (2,), (1, 2))
    assert len(null_space(rows)) == 3


def test_what_is_left_without_a_cell_is_zero_there_and_generic_elsewhere():
    everywhere = ones(len(COMPLETE))
    vectors = null_space(COMPLETE)
    for dimension, k in ((4, 3), (3, 7)):
        vectors = without(vectors, WIDTH * k, everywhere)
        everywhere &= ~(1 << WIDTH * k)
        assert len(vectors) == dimension
        assert all(nonzero(v, ones(len(COMPLETE))) == everywhere for v in vectors)


def test_equal_input_gives_equal_vectors():
    assert null_space(COMPLETE) == null_space(COMPLETE)
