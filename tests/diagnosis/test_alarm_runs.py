"""Which alarms a flight holds: every one once, with its bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.alarm_runs import find_runs
from fdi.diagnosis.hypotheses import inquire
from fdi.telemetry.events import Flight

from .build import CONFIRM_S, RATE, alarms_of, bank_of, limit_row, model

BANK = bank_of(model({"gps": ["x"], "baro": ["x"], "radar": ["x"]}))
ROWS = range(len(BANK.generators))
whole = st.integers(0, 90).map(float)
raised = st.dictionaries(
    st.sampled_from(ROWS),
    st.lists(st.tuples(whole, st.integers(2, 30)).map(lambda p: (p[0], p[0] + p[1])), max_size=3),
)


def test_a_run_has_the_bounds_of_its_alarm():
    (run,) = find_runs(alarms_of(BANK, {1: [(40, 60)]}, peak=7.0), 0, 100)
    assert (run.row, run.first, run.last) == (1, 40 * RATE, 60 * RATE)
    assert (run.onset, run.known, run.end) == (40.0, 40.0 + CONFIRM_S, 60.0)
    assert run.peak == 7.0


def test_onset_of_a_test_that_looks_ahead_lies_after_its_first_sample():
    """A centred window feels a change before it is in its middle."""
    delay = np.full(len(BANK.generators), 2.0)
    (run,) = find_runs(alarms_of(BANK, {0: [(40, 60)]}, delay_s=delay), 0, 100)
    assert run.onset == 40.0 + 0.75 * 2.0
    assert run.known == 40.0 + CONFIRM_S + 2.0


def test_what_has_lasted_too_long_failed_when_it_began():
    """An alarm at 40 s of a channel that has stood still for 6 s then."""
    shown = "    fields:\n      x: {variable: x, accuracy: 1 m"
    text = model({"gps": ["x"], "baro": ["x"]}).replace(shown, f"{shown}, freeze: 4 s", 1)
    bank = bank_of(text)
    number = limit_row(bank, "GPS.x:frozen")
    alarms = alarms_of(bank, {number: [(40, 60)]})
    (held,) = [c for c in alarms.residuals.signals.columns if c.field == "x:still"]
    alarms.residuals.signals.columns[held][:] = np.clip(alarms.residuals.t - 34, 0, None)
    (run,) = find_runs(alarms, 0, 100)
    assert (run.onset, run.known) == (34.0, 40.0 + CONFIRM_S)
    (late,) = find_runs(alarms, 38, 100)  # a flight that begins later
    assert late.onset == 38.0


def test_of_several_things_that_stand_still_the_longest_tells_when_it_began():
    """A limit on how long both of two channels have shown the same."""
    text = model({"gps": ["x"], "baro": ["y"]}).replace(
        "variables:", "variables:\n  a: {unit: s}\n  b: {unit: s}\n  both: {unit: s}"
    )
    text += (
        "equations:\n"
        "  whole: {text: both = a + b, solves: [both], fault: gps.way, component: gps}\n"
        "limits:\n  long: {variable: both, max: 9, elapsed: true, component: gps}\n"
        "inputs:\n  RAW:\n    fields:\n      p:still: {variable: a}\n      q:still: {variable: b}\n"
    )
    bank = bank_of(text)
    alarms = alarms_of(bank, {limit_row(bank, "long"): [(40, 60)]})
    for channel, column in alarms.residuals.signals.columns.items():
        lasted = {"p:still": 3.0, "q:still": 7.0}.get(channel.field, 0.0)
        column[:] = np.where(alarms.residuals.t == 40, lasted, np.nan)
    (run,) = find_runs(alarms, 0, 100)
    assert run.onset == 40.0 - 7.0


@pytest.mark.parametrize("start", [1 / RATE, 10.0])
def test_of_an_alarm_that_stands_when_the_time_begins_as_much_must_be_left_as_makes_one(start):
    alarms = alarms_of(BANK, {0: [(0, 60)]})
    (run,) = find_runs(alarms, start, 100)
    assert (run.onset, run.known) == (start, start + CONFIRM_S)
    assert find_runs(alarms, 60 - CONFIRM_S, 100) == []


def test_alarm_that_is_never_certain_is_none():
    assert find_runs(alarms_of(BANK, {0: [(40, 41)]}), 0, 100) == []


@given(raised, whole, st.integers(1, 100))
def test_runs_are_the_alarms_in_the_time_asked_for_each_once(raised, start, length):
    alarms = alarms_of(BANK, raised)
    end = start + length
    found = find_runs(alarms, start, end)
    assert found == sorted(found, key=lambda run: (run.onset, run.row))
    covered = np.zeros_like(alarms.alarm)
    for run in found:
        assert start <= run.onset <= min(run.known, run.end)
        assert run.end <= end
        assert alarms.alarm[run.row, run.first : run.last].all()
        assert not covered[run.row, run.first : run.last].any()
        covered[run.row, run.first : run.last] = True
    t = alarms.residuals.t
    missed = alarms.alarm & ~covered & (t >= start) & (t < end)
    for row in ROWS:  # what is left out was too short to be one, or too little of it is left
        ends = np.flatnonzero(np.diff([0, *missed[row].astype(int), 0]))
        assert all(b - a <= CONFIRM_S * RATE for a, b in zip(ends[::2], ends[1::2], strict=True))


@given(raised, whole)
def test_what_ends_before_a_moment_does_not_depend_on_what_follows(raised, cut):
    alarms = alarms_of(BANK, raised)
    until = find_runs(alarms, 0, cut)
    assert all(run in until for run in find_runs(alarms, 0, 200) if run.end < cut)


@pytest.mark.parametrize(("since", "onset"), [(-np.inf, 5.0), (20.0, 20.0), (60.0, 30.0)])
def test_what_holds_always_is_dated_on_the_ground_but_not_in_the_flight_before(since, onset):
    """An alarm from 5 s on, a flight from 30 s on; of any other statement it begins with that."""
    text = model({"gps": ["x"]})
    limit = "limits:\n  far: {variable: x, max: 9, component: gps%s}\n"
    for more, right in ((", always: true", onset), ("", 30.0)):
        bank = bank_of(text + limit % more)
        alarms = alarms_of(bank, {limit_row(bank, "far"): [(5, 60)]})
        (run,) = find_runs(alarms, 30, 100, since)
        assert run.onset == right


def test_of_a_second_flight_it_is_dated_after_the_first():
    text = (
        model({"gps": ["x"]})
        + "limits:\n  far: {variable: x, max: 9, component: gps, always: true}\n"
    )
    bank = bank_of(text)
    flights = (Flight(0, 40, takeoff=10, landing=30), Flight(50, 100, takeoff=60, landing=90))
    alarms = alarms_of(bank, {limit_row(bank, "far"): [(5, 95)]}, flights=flights)
    first, second = inquire(alarms)
    assert [one.runs[0].onset for one in (first, second)] == [5.0, 30.0]
