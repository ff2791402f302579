"""The program outside that counts the votes: whom it takes, when, and what stops it."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.methods.voting import PRESETS
from fdi.methods.voting.selection import FOREVER, select

from .build import S

RULES = PRESETS["recorded"]


def counted(votes, *, rules=RULES, phases=(0.0, 0.0, 0.0), dead_from=None):
    """Return (time, place) of each count of votes (n, k) that come once a second."""
    votes = np.array(votes)
    t = (np.arange(votes.shape[1]) + np.array(phases[: len(votes)])[:, None]) * S
    t = np.rint(t).astype(np.int64)
    for place, start in (dead_from or {}).items():
        t[place, start:] = FOREVER
    found = select(t, votes, rules)
    return [(x / S, int(y)) for x, y in zip(found.t, found.selected, strict=True) if x < FOREVER]


def test_a_count_follows_as_soon_as_all_have_voted_and_then_sleeps_three_seconds():
    times = [t for t, _ in counted(np.zeros((3, 10), int), phases=(0.0, 0.3, 0.7))]
    assert times == pytest.approx([0.7, 3.7, 6.7, 9.7])


@pytest.mark.parametrize(
    ("votes", "selected"),
    [([0, 1, 1], 1), ([1, 1, 0], 1), ([2, 1, 0], 0), ([2, 2, 2], 2), ([2, 0, 2], 2)],
)
def test_most_votes_win_and_of_three_different_ones_autopilot_1(votes, selected):
    assert counted(np.array(votes)[:, None]) == [(0.0, selected)]


def test_the_latest_votes_count():
    votes = [[0, 0, 1, 1, 1, 1]] * 3
    assert counted(votes) == [(0.0, 0), (3.0, 1)]


def test_one_that_stops_voting_stops_a_program_that_waits_for_all():
    votes = np.ones((3, 12), int)
    assert counted(votes, dead_from={0: 4})[-1][0] == 3.0
    most = replace(RULES, quorum=2)
    assert counted(votes, dead_from={0: 4}, rules=most)[-1][0] == 9.0


def test_a_vote_that_is_not_new_does_not_count():
    """Of a dead autopilot nothing is left after the next count."""
    votes = [[0] * 12, [1] * 12, [2] * 12]
    found = counted(votes, dead_from={0: 2}, rules=replace(RULES, quorum=2))
    assert found[0] == (0.0, 0)
    assert [place for _, place in found[2:]] == [1, 1]


def test_without_a_vote_nothing_is_counted():
    assert counted(np.zeros((3, 2), int), dead_from={0: 0}) == []
