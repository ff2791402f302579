"""Simulated voters: what must come out for sure, and that chance is the seed's alone."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.errors import UsageError
from fdi.methods.voting import PRESETS, Failure, Scenario, simulate
from fdi.methods.voting.scenarios import first_fail, parse_failures, run_one, run_standard, standard
from fdi.methods.voting.simulate import share

RULES = PRESETS["recorded"]


def outcome(n, *kinds, rules=RULES, runs=60, seed=1, **more):
    return simulate(Scenario(n, first_fail(*kinds), **more), rules, runs=runs, seed=seed)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_where_nothing_fails_nothing_changes(n):
    found = outcome(n)
    assert (found.wrong.value, found.stopped.value, found.needless.value) == (0, 0, 0)
    assert found.reaction is None


@pytest.mark.parametrize("n", [3, 4, 7])
@pytest.mark.parametrize("kinds", [("faulty",), ("faulty", "faulty"), ("mute",), ("stuck",)])
def test_one_or_two_that_say_so_are_replaced(n, kinds):
    found = outcome(n, *kinds)
    assert found.wrong.value == 0
    assert found.needless.value == 0
    assert 1.0 < found.reaction <= found.slowest < 9.0


@pytest.mark.parametrize(("n", "share_wrong"), [(3, 1.0), (4, 0.0), (5, 0.0)])
def test_two_that_vote_for_themselves_beat_one_of_three_but_not_two_of_four(n, share_wrong):
    """Of three different votes the first wins, which is wrong; of four, two agree."""
    assert outcome(n, "stuck", "stuck").wrong.value == share_wrong


@pytest.mark.parametrize("n", [3, 7])
def test_one_that_lies_about_itself_is_never_found(n):
    assert outcome(n, "lying").wrong.value == 1.0
    jammed = Scenario(n, (Failure("lying", 2),), outside=True)
    assert simulate(jammed, RULES, runs=40).wrong.value == 1.0


def test_a_cause_outside_alone_changes_nothing():
    found = outcome(3, outside=True)
    assert (found.wrong.value, found.needless.value) == (0, 0)


def test_a_dead_autopilot_stops_a_count_that_waits_for_all():
    found = outcome(3, "dead")
    assert (found.wrong.value, found.stopped.value) == (1, 1)
    most = outcome(3, "dead", rules=replace(RULES, quorum=2))
    assert (most.wrong.value, most.stopped.value) == (0, 0)


def test_without_any_message_everybody_votes_for_itself_and_the_first_stays():
    assert outcome(3, "faulty", loss=1.0).wrong.value == 1.0


def test_a_dead_link_is_found_by_silence_after_three_seconds():
    """Onset to vote 3 to 4 s (the last stamp is up to a cycle old), and up to 3 s to the count."""
    found = outcome(3, "mute", runs=400)
    assert 2.9 < found.reaction < 6.0
    quick = outcome(3, "mute", runs=400, rules=replace(RULES, cycle=0.1, silence=1.0))
    assert quick.reaction < found.reaction - 1.5


def test_a_vote_can_be_taken_over_no_sooner_than_its_persistence():
    rules = replace(RULES, cycle=0.05, selection_hold=0.0)
    found = outcome(3, "faulty", rules=rules, runs=50, lasts=10.0)
    assert 1.0 < found.reaction < 1.3


def test_the_seed_decides_and_nothing_else():
    a, b, c = (outcome(4, "faulty", loss=0.3, seed=seed) for seed in (5, 5, 6))
    assert a == b
    assert a != c


def test_more_runs_do_not_change_what_is_drawn_in_blocks():
    """Blocks bound the memory: a run of many autopilots is drawn in several."""
    found = outcome(15, "faulty", runs=200, lasts=15.0)
    assert found.runs == 200
    assert found.wrong.value == 0


@pytest.mark.parametrize(
    ("hits", "n", "low", "high"),
    [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (10, 10, 0.7225, 1.0)],
)
def test_shares_carry_wilsons_interval(hits, n, low, high):
    found = share(np.arange(n) < hits)
    assert found == pytest.approx((hits / n, low, high), abs=5e-5)


def test_failures_are_written_as_kind_and_number():
    assert parse_failures(["faulty", "mute:1", "dead"]) == (
        Failure("faulty", 2),
        Failure("mute", 1),
        Failure("dead", 3),
    )
    for wrong in ("", "evil", "faulty:", "faulty:x", "faulty:-1", "faulty:²"):
        with pytest.raises(UsageError):
            parse_failures([wrong])


@pytest.mark.parametrize(
    "wrong",
    [
        {"autopilots": 1},
        {"autopilots": 16},
        {"autopilots": 3, "failures": (Failure("faulty", 4),)},
        {"autopilots": 3, "failures": (Failure("faulty", 1), Failure("dead", 1))},
        {"autopilots": 2, "failures": first_fail("faulty", "dead")},
        {"autopilots": 3, "loss": float("nan")},
        {"autopilots": 3, "loss": 1.1},
        {"autopilots": 3, "lasts": float("nan")},
    ],
)
def test_impossible_scenarios_are_refused(wrong):
    with pytest.raises(UsageError):
        Scenario(**wrong)


@pytest.mark.parametrize("wrong", [{"runs": 0}, {"runs": 10**6}, {"seed": -1}])
def test_impossible_numbers_of_runs_are_refused(wrong):
    with pytest.raises(UsageError):
        simulate(Scenario(3), RULES, **{"runs": 10, **wrong})
    with pytest.raises(UsageError, match="cycles"):
        simulate(Scenario(3), replace(RULES, cycle=0.001), runs=10)


def test_enough_is_the_number_from_which_on_all_are():
    rows = run_one((3, 4, 5), Scenario(3, first_fail("stuck", "stuck")), RULES, runs=400, seed=0)
    assert rows[0].enough == 4
    rows = run_one((3, 5), Scenario(3, first_fail("lying")), RULES, runs=20, seed=0)
    assert rows[0].enough is None


def test_of_two_autopilots_the_scenarios_with_two_failures_are_left_out():
    names = standard(2, RULES)
    assert "1 faulty" in names
    assert "2 faulty" not in names
    rows = run_standard((2, 3), RULES, runs=5, seed=0)
    by_name = {row.name: [one.scenario.autopilots for one in row.outcomes] for row in rows}
    assert by_name["2 faulty"] == [3]
    assert by_name["1 faulty"] == [2, 3]


def test_a_liar_also_votes_for_itself():
    """Stuck 1, well 2, lying 3: three different votes, and the first wins; 1 and 3 alone do not."""
    scenario = Scenario(3, (Failure("stuck", 1), Failure("lying", 3)))
    assert simulate(scenario, RULES, runs=40).wrong.value == 1.0
    assert simulate(Scenario(3, (Failure("stuck", 1),)), RULES, runs=40).wrong.value == 0.0


def test_under_loss_the_published_table_of_three_does_better_than_the_rule_for_n(monkeypatch):
    """It ranks one with errors as low as a silent one, which so keeps its vote for another."""
    by_table = outcome(3, "faulty", loss=0.3, runs=400)
    monkeypatch.setattr("fdi.methods.voting.priorities.THREE", 99)
    by_rule = outcome(3, "faulty", loss=0.3, runs=400)
    assert by_table.wrong.high < 0.06
    assert by_rule.wrong.low > 0.2
