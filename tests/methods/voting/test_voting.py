"""From logs to votes: what is read, what is inferred, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import fdi
from fdi.errors import LogError, UsageError
from fdi.methods.voting import PRESETS
from fdi.methods.voting.flags import flags_of
from fdi.report.vote_rows import pauses

from .build import CONDITIONS, UTC_US, S

RECORDED = PRESETS["recorded"]
LOST = {name: (lambda t: t >= 20.2) for name in CONDITIONS[3:6]}


def test_own_and_received_flags_are_those_of_the_log(load):
    found = flags_of(load(2, bad={"failsafe": lambda t: 10 <= t < 12}), RECORDED)
    assert found.number == 2
    assert sorted(found.received) == [1, 3]
    bad = found.own.bad[:, RECORDED.flags.index("failsafe")]
    assert found.own.t[bad == 1][[0, -1]].tolist() == [10 * S, 11.5 * S]
    assert not found.own.bad[:, RECORDED.flags.index("data_link_lost")].any()
    np.testing.assert_array_equal(found.received[1].t - found.received[1].sent, S // 2)
    assert not found.notes


def test_lost_flags_vote_an_autopilot_out_and_the_reaction_is_told(load):
    found = fdi.vote(load(1, bad=LOST), onset=15.0)
    (one,) = found.reactions
    assert (one.pilot, one.to, one.cause) == (1, 2, "errors")
    assert found.seconds(one.sign) == pytest.approx(19.5)  # 20.5 s since boot, 1 s of it before t=0
    low, high = (found.seconds(at) for at in one.detected_any_phase)
    assert 20.5 <= low <= found.seconds(one.detected) <= high <= 21.5
    assert found.voters[0].replay.counters[-1].tolist() == [3, 0, 0]
    assert one.takeover.high - one.takeover.low == 3 * S


def test_a_peer_that_falls_silent_is_voted_out(load):
    found = fdi.vote(load(2, silent_from={1: 20.0}))
    (one,) = found.reactions
    assert (one.pilot, one.to, one.cause) == (1, 2, "silence")
    assert found.seconds(one.sign) == pytest.approx(19 - 0.5 - 1.0)


def test_a_cause_outside_blames_nobody(load):
    logs = [load(number, peers=(), bad=LOST) for number in (1, 2, 3)]
    found = fdi.vote(logs)
    assert found.voters[0].witness.view.samples[0].bad.any()
    assert not found.reactions
    assert not any(voter.replay.counted.any() for voter in found.voters)


def test_stamps_of_another_clock_give_way_to_the_reception(load):
    found = flags_of(load(1, stamp_ahead_s=10.9), RECORDED)
    np.testing.assert_array_equal(found.received[2].sent, found.received[2].t)
    assert any("another clock" in note for note in found.notes)


def test_a_flag_that_the_log_lacks_is_unknown_and_told(load):
    found = flags_of(load(1, without=("failsafe",)), RECORDED)
    assert np.isnan(found.own.bad[:, RECORDED.flags.index("failsafe")]).all()
    assert found.notes == ("the log has no flag failsafe: not compared",)


def test_a_value_that_is_no_flag_is_unknown_and_told(load):
    log = load(1, raw={"condition_local_position_valid": 7})
    found = fdi.vote(log)
    assert np.isnan(found.voters[0].witness.view.samples[0].bad[:, 3]).all()
    assert any("unknown in part (condition_local_position_valid)" in note for note in found.notes)
    assert not found.reactions


def test_a_log_without_any_of_the_flags_is_refused(load):
    log = load(1, without=("failsafe", "mission_failure"))
    with pytest.raises(LogError, match="holds none of the 2 flags") as told:
        fdi.vote(log, replace(RECORDED, flags=("failsafe", "mission_failure")))
    assert told.value.where == "autopilot_1.ulg"


def test_a_single_log_without_received_flags_says_what_is_missing(load):
    with pytest.raises(LogError, match="redundancy_firstpilot and redundancy_secondpilot"):
        fdi.vote(load(1, peers=()))


def test_several_logs_without_received_flags_are_compared_with_each_other(load):
    logs = [load(1, peers=(), bad=LOST), load(2, peers=()), load(3, peers=())]
    found = fdi.vote(logs)
    assert found.numbers == (1, 2, 3)
    assert not any(voter.witness.is_inferred for voter in found.voters)
    (one,) = found.reactions
    assert (one.pilot, one.to, len(one.changes)) == (1, 2, 3)
    assert any("no log holds received flags" in note for note in found.notes)


def test_two_autopilots_and_six_vote_as_three_do(load):
    for n in (2, 6):
        logs = [load(k, peers=(), bad=LOST if k == 1 else None) for k in range(1, n + 1)]
        (one,) = fdi.vote(logs).reactions
        assert (one.pilot, one.to) == (1, 2)
        assert one.majority is not None


def test_the_order_of_the_logs_changes_nothing_but_the_clock(load):
    logs = [load(1, peers=(), bad=LOST), load(2, peers=()), load(3, peers=())]
    votes = [v.replay.vote.tolist() for v in fdi.vote(logs).voters]
    assert votes == [v.replay.vote.tolist() for v in fdi.vote(logs[::-1]).voters]


def test_transport_delays_what_was_received(load):
    log = load(2, bad={}, silent_from={1: 20.0})
    late = fdi.vote(log, replace(RECORDED, transport=0.9))
    received = late.voters[1].witness.view.samples[0]
    np.testing.assert_array_equal(received.t - received.sent, round(0.9 * S))


def test_logs_of_one_boot_without_a_common_clock_are_refused(load):
    logs = [load(1, utc=False), load(2, utc=False)]
    with pytest.raises(UsageError, match="cannot be put on the clock of autopilot_1"):
        fdi.vote(logs)


def test_logs_of_different_flights_are_refused_with_their_times(load):
    logs = [load(1), load(2, booted_utc_us=UTC_US + 3600 * S)]
    with pytest.raises(UsageError, match=r"begins at 2021-09-28T15:18:4\d UTC"):
        fdi.vote(logs)


def test_logs_of_one_autopilot_and_the_same_log_twice_are_refused(load):
    with pytest.raises(UsageError, match="both say that they are of autopilot 1"):
        fdi.vote([load(1), load(1, "copy.ulg", bad=LOST)])
    with pytest.raises(UsageError, match="are the same log"):
        fdi.vote([load(1), load(1, "copy.ulg")])


def test_a_log_whose_name_another_has_is_told_by_its_path(load, tmp_path):
    (tmp_path / "b").mkdir()
    found = fdi.vote([load(1, "log.ulg"), load(2, "b/log.ulg")])
    assert [one.name for one in found.logs] == [
        str(tmp_path / "log.ulg"),
        str(tmp_path / "b/log.ulg"),
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        {"cycle": 0.0},
        {"cycle": float("nan")},
        {"silence": -1.0},
        {"hold": float("inf")},
        {"transport": float("nan")},
        {"flags": ()},
        {"flags": ("failsafe", "failsafe")},
        {"flags": ("no_such_flag",)},
        {"quorum": 0},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(UsageError):
        replace(RECORDED, **wrong)


def test_impossible_arguments_are_refused(load):
    log = load(1)
    for wrong in ({"onset": float("nan")}, {"onset": 1e4}, {"phase": 1.0}, {"phase": float("nan")}):
        with pytest.raises(UsageError):
            fdi.vote(log, **wrong)
    with pytest.raises(UsageError, match="no preset"):
        fdi.vote(log, "best")
    with pytest.raises(UsageError, match="no log"):
        fdi.vote([])


def test_an_autopilot_that_changes_its_vote_twice_counts_once_for_the_majority(load):
    """Flags lost, found after the hold, and lost again: one voter is no majority of three."""
    again = {"failsafe": lambda t: 20 <= t < 23 or 28 <= t < 31}
    rules = replace(RECORDED, hold=1.0)
    logs = [load(1, peers=(), bad=again), load(2, peers=()), load(3, peers=())]
    found = fdi.vote(logs, rules)
    out = next(one for one in found.reactions if (one.pilot, one.to) == (1, 2))
    assert [change.voter for change in out.changes] == [1, 2, 3]
    back = next(one for one in found.reactions if (one.pilot, one.to) == (2, 1))
    assert len(back.changes) == 3


def test_values_print_themselves(load):
    found = fdi.vote(load(1, bad=LOST))
    assert repr(found) == "<Voting of 3 autopilots, rules recorded: 1 voted out at 21.0 s>"
    assert "&lt;Voting of 3" in found._repr_html_()
    assert repr(found.voters[1]).startswith("<Voter 2: inferred, ")


def test_pauses_are_where_nothing_is_compared(load):
    """Until 10 s after take-off (5 s since boot, 4 s of the log); on the ground after 10 s."""
    found = fdi.vote(load(1, takeoff_s=15.0))
    assert pauses(found, found.voters[0]) == [(0.0, 10.0), (14.0, 25.0)]
