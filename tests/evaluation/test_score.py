"""Scores by the words of the definition, on rows made by hand."""

from pathlib import Path

import pytest

from fdi.evaluation import Fault, Label, Rate, score, totals
from fdi.evaluation.totals import constant_answer


def label(*faults, accept=(), until=None, vehicle="quad"):
    return Label(
        "a", Path("a"), vehicle, "simulated", "diagnosis", faults, frozenset(accept), until
    )


def row(*findings, airborne=3600.0, error=None):
    return {
        "findings": [
            {"rank": rank, "component": name, "onset_s": onset, "alarm_s": onset + 1.0}
            for rank, (name, onset) in enumerate(findings, 1)
        ],
        "airborne_s": airborne,
        "error": error,
    }


GPS = Fault("gps", "step", 40.0)


def test_a_right_and_early_accusation_scores_everywhere():
    one = score(label(GPS), row(("gps", 41.0)))
    assert (one.detected, one.named, one.in_three, one.timely) == (True,) * 4
    assert one.delay == 2.0
    assert not one.false


def test_two_seconds_before_the_true_onset_still_count_and_more_is_false():
    assert score(label(GPS), row(("gps", 38.0))).named
    early = score(label(GPS), row(("gps", 37.9)))
    assert early.false == ("gps",)
    assert not early.detected


def test_rank_one_decides_who_is_named_first():
    one = score(label(GPS), row(("estimator", 40.5), ("gps", 41.0)))
    assert one.detected
    assert not one.named
    assert one.in_three


def test_what_begins_after_the_end_of_what_counts_is_ignored():
    assert not score(label(GPS, until=50.0), row(("gps", 50.1))).detected


@pytest.mark.parametrize(("kind", "delay", "timely"), [("step", 6, False), ("ramp", 19, True)])
def test_a_ramp_has_more_time(kind, delay, timely):
    slow = Fault("gps", kind, 40.0)
    assert score(label(slow), row(("gps", 40.0 + delay))).timely is timely


def test_any_motor_is_right_only_where_the_label_itself_says_motor():
    assert score(label(Fault("propeller", "scale", 0.0)), row(("motor_3", 1.0))).named
    accepted = label(Fault("motor_4", "scale", 0.0), accept=("motor",))
    assert not score(accepted, row(("motor_3", 1.0))).named


def test_each_of_several_faults_is_a_right_answer():
    both = label(Fault("motor_1", "stop", 30.0), Fault("motor_4", "stop", 34.0))
    one = score(both, row(("motor_4", 34.5)))
    assert one.named
    assert one.timely
    assert not one.false


def test_an_accused_component_counts_once_on_a_healthy_flight():
    one = score(label(), row(("gps", 3.0), ("gps", 30.0), ("compass", 40.0)))
    assert one.false == ("gps", "compass")
    told = totals([one])
    assert told.clean == Rate(0, 1)
    assert told.false_per_hour == 2.0


def test_a_log_without_an_analysis_is_neither_clean_nor_detected():
    told = totals([score(label(), row(error="is empty")), score(label(GPS), row(error="is empty"))])
    assert told.errors == 2
    assert told.clean.hits == 0
    assert told.detected.hits == 0


def test_a_constant_answer_is_the_commonest_component_at_the_median_onset():
    scores = [score(label(GPS), row()) for _ in range(3)]
    scores.append(score(label(Fault("compass", "step", 60.0)), row()))
    component, onset, told = constant_answer(scores)
    assert (component, onset) == ("gps", 40.0)
    assert told.named == Rate(3, 4)


@pytest.mark.parametrize(("hits", "of"), [(0, 5), (5, 5), (3, 10), (0, 0)])
def test_the_interval_holds_the_share_and_stays_within_bounds(hits, of):
    low, high = Rate(hits, of).interval
    assert 0 <= low <= (hits / of if of else 0.5) <= high <= 1
