"""Cycles over time: their phase, the gate, the last message, what is unknown."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.methods.voting import PRESETS
from fdi.methods.voting.replay import free_cycles, replay

from .build import S, samples, view

RULES = replace(PRESETS["recorded"], flags=("failsafe",), delay=0.0)
WELL = samples(np.arange(100), np.zeros(100))


def lost_at(t):
    """Flags that are lost at t, and told twice a second."""
    at = np.union1d(np.arange(0, 100, 0.5), [t])
    return samples(at, at >= t)


def at(view_, t, rules=RULES):
    return replay(view_, np.rint(np.asarray(t, float) * S).astype(np.int64), rules)


def test_free_cycles_of_any_phase_react_within_two_cycles_of_the_cause():
    """Flags lost at 42.628 s: the vote changes from 43.64 to 44.62 s at steps of 20 ms."""
    cycles = free_cycles((20 * S, 60 * S), RULES, np.arange(50) / 50, records=2000)
    found = replay(view(lost_at(42.628), WELL, WELL), cycles, RULES)
    changes = [
        t[np.flatnonzero(np.diff(v))[0] + 1] / S for t, v in zip(found.t, found.vote, strict=True)
    ]
    assert (min(changes), max(changes)) == pytest.approx((43.64, 44.62))


def test_a_message_that_comes_at_the_cycle_is_known_in_it():
    found = at(view(lost_at(5.0), WELL), [4.999999, 5.0])
    assert found.blamed[:, 0, 0].tolist() == [False, True]


def test_who_was_never_heard_of_is_silent_once_the_autopilot_is_old_enough():
    nobody = samples([], np.empty((0, 1)))
    found = at(view(WELL, nobody, WELL), [2.0, 3.0, 3.5])
    assert found.silent[:, 1].tolist() == [False, False, True]
    assert not found.blamed.any()


@pytest.mark.parametrize(("age_from", "silent_at"), [("sent", 13.5), ("received", 14.5)])
def test_silence_counts_from_the_stamp_or_from_the_reception(age_from, silent_at):
    heard = samples([1.0, 11.0], [0, 0], sent_s=[0.0, 10.0])
    cycles = np.arange(11.5, 20.0)
    found = at(view(WELL, heard), cycles, replace(RULES, age_from=age_from))
    assert cycles[np.argmax(found.silent[:, 1])] == silent_at


def test_nothing_is_compared_until_the_delay_after_take_off_is_over():
    own = samples([0.0, 5.0, 8.0], [1, 1, 1], takeoff_s=5.0)
    found = at(view(own, WELL), [14.9, 15.0, 15.1], replace(RULES, delay=10.0))
    assert found.is_open.tolist() == [False, False, True]
    assert found.blamed[:, 0, 0].tolist() == [False, False, True]


def test_on_the_ground_the_delay_counts_from_the_start_unless_a_take_off_is_needed():
    own = samples([0.0, 90.0], [0, 0], takeoff_s=0.0)
    for needs_takeoff in (False, True):
        rules = replace(RULES, delay=10.0, needs_takeoff=needs_takeoff)
        assert at(view(own, WELL), [10.0, 10.1], rules).is_open.tolist() == [
            False,
            not needs_takeoff,
        ]


def test_what_counted_stays_while_nothing_is_compared():
    """The vehicle lands: no comparison follows, priorities and vote stay."""
    own = lost_at(20.0)
    has_landed = own.t >= 25 * S
    own = replace(own, since=np.where(has_landed, 0, S), is_airborne=~has_landed)
    found = at(view(own, WELL, WELL), [19, 20, 21, 22, 26, 27], replace(RULES, needs_takeoff=True))
    assert found.is_open.tolist() == [True] * 4 + [False] * 2
    assert found.vote.tolist() == [0, 0, 1, 1, 1, 1]
    assert found.priorities[-1].tolist() == [3, 1, 1]
    assert found.counters[-1].tolist() == [1, 0, 0]


def test_an_unknown_flag_neither_accuses_nor_exonerates():
    unknown = samples(np.arange(100), np.full(100, np.nan))
    assert not at(view(unknown, lost_at(0.5)), [2, 3, 4]).blamed.any()
    assert at(view(WELL, lost_at(0.5), unknown), [2, 3, 4]).counters[-1].tolist() == [0, 1, 0]
