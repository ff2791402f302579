from hypothesis import given
from hypothesis import strategies as st

from fdi.structure.field import WIDTH, P, cells, fold, inverses, nonzero, ones

values = st.lists(
    st.one_of(st.sampled_from([0, 1, P - 1, P, P + 1]), st.integers(0, 2**127 - 1)), max_size=6
)


def pack(numbers):
    return sum(number << WIDTH * k for k, number in enumerate(numbers))


@given(values)
def test_folding_keeps_each_cell_modulo_p_and_brings_it_below_twice_p(numbers):
    n = len(numbers)
    folded = cells(fold(pack(numbers), ones(n)), n)
    assert [value % P for value in folded] == [number % P for number in numbers]
    assert all(value < 2 * P for value in folded)


@given(values)
def test_a_cell_of_p_counts_as_zero(numbers):
    n = len(numbers)
    mask = nonzero(fold(pack(numbers), ones(n)), ones(n))
    assert mask == pack([int(number % P != 0) for number in numbers])


@given(st.lists(st.integers(-P + 1, 2 * P).filter(lambda x: x % P), max_size=8))
def test_inverse_times_number_is_one(numbers):
    assert [x * y % P for x, y in zip(numbers, inverses(numbers), strict=True)] == [1] * len(
        numbers
    )
