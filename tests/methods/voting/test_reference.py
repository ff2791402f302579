"""The published voter: its record cycle for cycle, its reaction times, at any phase.

Source: voter_reference.json (the record of five logs of the thesis' tests) and, where they are at
hand, the logs themselves. Times agree to the record's own resolution, 4 ms steps told in ms.
"""

import hashlib
import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from flights import ROOT, SHARED

import fdi
from fdi.methods.voting import PRESETS
from fdi.methods.voting.flags import FlagSamples, flags_of
from fdi.methods.voting.reaction import THESIS
from fdi.methods.voting.recorded import recorded_of
from fdi.methods.voting.replay import PHASES, View, free_cycles, replay
from fdi.methods.voting.settings import microseconds

FILE = ROOT.parent / "shared" / "methods" / "voter_reference.json"
pytestmark = pytest.mark.skipif(not FILE.is_file(), reason="no ../shared")
REFERENCE = json.loads(FILE.read_text()) if FILE.is_file() else {"logs": []}
RECORDED = PRESETS["recorded"]
EXACT_S = 0.0005


def stored():
    """The logs at hand by their SHA-256."""
    return {
        hashlib.sha256(path.read_bytes()).hexdigest(): path
        for path in sorted((SHARED / "triplex").glob("*/*.ulg"))
    }


STORED = stored()
ALL = [pytest.param(one, id=f"{one['test']}-{one['instance']}") for one in REFERENCE["logs"]]
AT_HAND = [param for param in ALL if param.values[0]["file_sha256"] in STORED]


@lru_cache
def read(sha256):
    return fdi.read(STORED[sha256])


def log_of(one):
    return read(one["file_sha256"])


def at_hand(*tests):
    """Return (record, log) of the tests whose logs are at hand, or skip."""
    wanted = [p.values[0] for p in AT_HAND if p.values[0]["test"] in tests]
    if not wanted:
        pytest.skip("these logs are not at hand")
    return [(one, log_of(one)) for one in wanted]


def us(seconds):
    return np.rint(np.asarray(seconds, float) * 1e6).astype(np.int64)


def values_at(changes, t):
    """Return the value that a list of [time, value] gives at times t; the first one before."""
    times, values = np.array(changes, float).T
    return values[np.maximum(np.searchsorted(times, t + 1e-9, side="right") - 1, 0)]


def stated_inputs(one):
    """Return what the reference states of an autopilot's inputs, as its view of all three.

    Of received flags it states the changes, the first and the last reception and the last stamp:
    between them a message is taken to come once a second, stamped as it comes.
    """
    boot, end = one["header_start_s"], one["last_flight_sample_s"]
    changes = {k: v for k, v in one["own_flags"].items() if k in RECORDED.flags}
    t = np.unique([*(x for of_flag in changes.values() for x, _ in of_flag), end])
    takeoff = values_at(one["own_flags"]["takeoff_time"], t)
    at = us(t + boot)
    seen = [FlagSamples(at, at, bad_at(changes, t), us(takeoff), takeoff > 0)]
    for said in (one["first_pilot_received"], one["second_pilot_received"]):
        changes = said["flags_changed"]
        changed = [x for of_flag in changes.values() for x, _ in of_flag]
        first, last = said["first_received_s"], said["last_received_s"]
        t = np.unique([*changed, *np.arange(first, last), last])
        sent = np.where(t == last, min(said["last_sender_timestamp_s"], last), t)
        none = np.zeros(t.size, np.int64)
        seen.append(FlagSamples(us(t + boot), us(sent + boot), bad_at(changes, t), none, none > 0))
    place = one["own_pilot_number"] - 1
    seen.insert(place, seen.pop(0))
    return View(place, tuple(seen), 0)


def bad_at(changes, t):
    """Return which flags are bad at times t, (m, f); one that never changed is good."""
    columns = []
    for name in RECORDED.flags:
        good = float(name.startswith("condition"))
        columns.append(values_at(changes.get(name, [[0.0, good]]), t) != good)
    return np.stack(columns, axis=-1).astype(float)


def assert_as_recorded(found, one):
    """Every recorded cycle: vote, best priority, priorities, counters, marks of health."""
    t, record = np.array(one["record_cycles_s"]), one["record"]
    assert found.is_open.all()
    np.testing.assert_array_equal(found.vote + 1, values_at(record["pilot_selection"], t))
    np.testing.assert_array_equal(found.best, values_at(record["best_pilot_priority"], t))
    for place in range(3):
        for name, values in (
            ("priority", found.priorities),
            ("error_count", found.counters),
            ("healthy", found.healthy),
        ):
            expected = values_at(record[f"pilot{place + 1}_{name}"], t)
            np.testing.assert_array_equal(values[:, place], expected, name)


@pytest.mark.parametrize("one", ALL)
def test_every_recorded_cycle_follows_from_the_inputs_that_the_reference_states(one):
    cycles = us(np.array(one["record_cycles_s"]) + one["header_start_s"])
    assert_as_recorded(replay(stated_inputs(one), cycles, RECORDED), one)


@pytest.mark.parametrize("one", ALL)
def test_at_any_phase_every_change_comes_within_a_cycle_of_the_record(one):
    seen = stated_inputs(one)
    own = seen.samples[seen.own].t
    span, phases = (int(own[0]), int(own[-1])), np.arange(PHASES) / PHASES
    cycles = free_cycles(span, RECORDED, phases, records=own.size)
    free = replay(seen, cycles, RECORDED)
    changes = one["record"]["pilot_selection"][1:]
    for t, votes in zip(free.t, free.vote, strict=True):
        at = np.flatnonzero(np.diff(votes)) + 1
        assert [int(votes[k]) + 1 for k in at] == [vote for _, vote in changes]
        for k, (recorded, _) in zip(at, changes, strict=True):
            late = int(t[k]) - int(us(recorded + one["header_start_s"]))
            assert abs(late) <= microseconds(RECORDED.cycle)


@pytest.mark.parametrize("one", AT_HAND)
def test_every_recorded_cycle_follows_from_the_log(one):
    found = fdi.vote(log_of(one))
    voter = found.voters[one["own_pilot_number"] - 1]
    assert voter.is_at_record
    assert voter.replay.t.size == len(one["record_cycles_s"])
    assert set(voter.differing.values()) == {0}
    assert "counted" in voter.differing or one["record_flag_columns"] == 0
    assert_as_recorded(voter.replay, one)


@pytest.mark.parametrize("one", AT_HAND)
def test_the_log_says_what_the_reference_states_of_it(one):
    log = log_of(one)
    flags = flags_of(log, RECORDED)
    assert flags.number == one["own_pilot_number"]
    assert log.clock.boot(0.0) == pytest.approx(one["header_start_s"], abs=EXACT_S)
    assert log["vehicle_status"].t[-1] == pytest.approx(one["last_flight_sample_s"], abs=EXACT_S)
    stated = recorded_of(log, RECORDED)
    np.testing.assert_allclose(
        stated.t / 1e6 - one["header_start_s"], one["record_cycles_s"], atol=EXACT_S
    )
    boot = us(one["header_start_s"])
    for name, key in (("first", "first_pilot_received"), ("second", "second_pilot_received")):
        said = one[key]
        samples = flags.received[one[f"{name}_pilot_is_number"]]
        message = log[f"redundancy_{name}pilot"]
        assert message.stamp.size == said["count"]
        ends = (samples.t[[0, -1]] - boot) / 1e6
        np.testing.assert_allclose(
            ends, [said["first_received_s"], said["last_received_s"]], atol=EXACT_S
        )
        stamp = float(message.si("timestamp_pilot")[-1]) / 1e6 - one["header_start_s"]
        assert stamp == pytest.approx(said["last_sender_timestamp_s"], abs=EXACT_S)
    for index, name in enumerate(RECORDED.flags):
        t = (flags.own.t - boot) / 1e6
        expected = values_at(one["own_flags"][name], t) > 0
        np.testing.assert_array_equal(
            flags.own.bad[:, index] == 1, expected != name.startswith("condition"), name
        )


@pytest.mark.parametrize("one", AT_HAND)
def test_silence_from_the_reception_differs_as_the_reference_states(one):
    found = fdi.vote(log_of(one), replace(RECORDED, age_from="received"))
    differing = found.voters[one["own_pilot_number"] - 1].differing
    expected = one["replay_on_recorded_cycles"]["silence_from_reception_time"]
    assert differing["any"] == expected["cycles_with_any_difference"]


@pytest.mark.parametrize(
    ("test", "number", "low", "high"),
    [("gps_fail", 1, 43.64, 44.62), ("communication_fail", 2, 45.08, 46.06)],
)
def test_votes_of_free_running_cycles_change_in_the_stated_range(test, number, low, high):
    for one, log in at_hand(test):
        if one["own_pilot_number"] == number:
            found = fdi.vote(log)
            (change,) = [c for r in found.reactions for c in r.changes if c.voter == number]
            ends = [found.seconds(at) for at in change.any_phase]
            assert ends == pytest.approx([low, high], abs=0.0201)
            assert found.seconds(change.recorded) == pytest.approx(found.seconds(change.at))


def test_the_gps_failure_is_detected_and_taken_over_as_the_thesis_says():
    """Table 6.1: 6 and 10 s, in whole seconds, from the injection at 37.624 s."""
    ((_, log),) = at_hand("gps_fail")
    (one,) = fdi.vote(log, onset=37.624).reactions
    assert (one.pilot, one.to, one.cause) == (1, 2, "errors")
    assert (one.detected - one.onset) / 1e6 == pytest.approx(6.448, abs=EXACT_S)
    detection, takeover = THESIS["GPS"]
    assert abs((one.detected - one.onset) / 1e6 - detection) < 1.0
    earliest, latest = ((at - one.onset) / 1e6 for at in one.takeover_any_phase)
    assert earliest < takeover < latest


def test_the_communication_failure_is_found_by_the_two_that_miss_the_third():
    """From the stop, 30 s after take-off; table 6.1: 4 and 7 s, from an onset 1.9 s too early."""
    logs = [log for _, log in at_hand("communication_fail")]
    found = fdi.vote(logs, onset=42.68)
    (one,) = found.reactions
    assert (one.pilot, one.to, one.cause) == (1, 2, "silence")
    assert found.seconds(one.sign) == pytest.approx(42.072, abs=EXACT_S)
    assert (one.detected - one.onset) / 1e6 == pytest.approx(3.376, abs=EXACT_S)
    assert 1 not in {change.voter for change in one.changes}
    assert found.seconds(one.takeover.low) < 47.78 < found.seconds(one.takeover.high)


def test_logs_of_two_tests_are_refused_although_their_clocks_agree():
    ((_, gps),) = at_hand("gps_fail")
    for _, other in at_hand("communication_fail"):
        assert abs(gps.clock.boot(0.0) - other.clock.boot(0.0)) < 0.01
        with pytest.raises(fdi.UsageError, match="is of another flight"):
            fdi.vote([gps, other])


def test_the_attitude_flag_makes_the_first_autopilot_lose_votes_before_any_fault():
    """Why the recorded program disables it: votes 1 to 2 to 3 at 26 and 27 s of the GPS log."""
    ((_, log),) = at_hand("gps_fail")
    flags = (*RECORDED.flags, "condition_attitude_valid")
    found = fdi.vote(log, replace(RECORDED, flags=flags))
    voter = found.voters[0]
    at = np.flatnonzero(np.diff(voter.replay.vote)) + 1
    assert [round(found.seconds(int(voter.replay.t[k]))) for k in at[:2]] == [26, 27]
    assert [int(voter.replay.vote[k]) + 1 for k in at[:2]] == [2, 3]


def test_two_flights_of_one_plan_that_moved_alike_are_told_apart_by_their_satellite_times():
    """They begin 219 s from each other, and the first lasts 22."""
    paths = [SHARED / "px4_motor" / f"hil_0{k}.ulg" for k in (0, 2)]
    if not all(path.is_file() for path in paths):
        pytest.skip("these logs are not at hand")
    with pytest.raises(fdi.UsageError, match="by satellite time 197 s lie between them"):
        fdi.vote([fdi.read(path) for path in paths])
