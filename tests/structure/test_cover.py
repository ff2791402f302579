"""Set covers, against all choices of sets."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from fdi.structure.cover import cover, greedily

bit_sets = st.lists(st.integers(0, 2**8 - 1), max_size=7)


def union(sets):
    total = 0
    for own in sets:
        total |= own
    return total


@given(bit_sets)
def test_cover_covers_all_and_no_set_of_it_is_superfluous(sets):
    chosen = cover(sets, [1.0] * len(sets))
    assert union(sets[i] for i in chosen) == union(sets)
    for dropped in chosen:
        assert union(sets[i] for i in chosen if i != dropped) != union(sets)


@given(bit_sets)
def test_cover_of_a_few_sets_is_at_most_one_larger_than_the_smallest(sets):
    numbers = range(len(sets))
    smallest = next(
        size
        for size in range(len(sets) + 1)
        if any(union(sets[i] for i in some) == union(sets) for some in combinations(numbers, size))
    )
    assert len(cover(sets, [1.0] * len(sets))) <= smallest + 1


def test_repetitions_find_what_greed_misses():
    """Greed takes the large set first and then needs both of the small ones."""
    sets = [0b01111110, 0b00001111, 0b11110000]
    assert cover(sets, [1.0] * 3) == [1, 2]


def test_of_two_sets_that_cover_the_same_the_cheaper_is_chosen():
    assert cover([0b11, 0b11], [2.0, 1.0]) == [1]


@given(bit_sets, st.integers(0, 2**8 - 1))
def test_greed_yields_falling_gains_that_add_up(sets, wanted):
    steps = list(greedily(sets, [1.0] * len(sets), wanted))
    gains = [gain for _, gain in steps]
    assert gains == sorted(gains, reverse=True)
    assert sum(gains) == (union(sets) & wanted).bit_count()
    assert len({number for number, _ in steps}) == len(steps)
