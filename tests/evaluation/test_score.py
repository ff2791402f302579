"""Scores by the words of the definition, on rows made by hand."""

from pathlib import Path

import pytest

from fdi.evaluation import Evaluation, Fault, Label, Rate, score, totals
from fdi.evaluation.calibration import brier_of_constant, reliability, stated
from fdi.evaluation.tables import evaluation_document, evaluation_text
from fdi.evaluation.totals import constant_answer, groups, totals_of


def label(*faults, accept=(), until=None, vehicle="quad"):
    return Label(
        "a", Path("a"), vehicle, "simulated", "diagnosis", faults, frozenset(accept), until
    )


def row(*findings, airborne=3600.0, error=None, **said):
    return {
        **{part: said.get(part, []) for part in ("consequences", "ruled_out", "not_testable")},
        "findings": [
            {
                "rank": rank,
                "component": name,
                "onset_s": onset,
                "alarm_s": onset + 1.0,
                "confidence": 0.9,
            }
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


def test_what_a_healthy_flights_label_accepts_is_no_false_accusation():
    """Whoever labelled it could not say that this part was sound."""
    one = score(label(accept=("motor_4",)), row(("motor_4", 5.0), ("gps", 9.0)))
    assert one.false == ("gps",)
    assert one.wrong == ("gps",)
    early = score(label(GPS, accept=("motor_4",)), row(("motor_4", 5.0)))
    assert early.false == ("motor_4",)


def test_rank_one_decides_who_is_named_first():
    one = score(label(GPS), row(("estimator", 40.5), ("gps", 41.0)))
    assert one.detected
    assert not one.named
    assert one.in_three


def test_what_begins_after_the_end_of_what_counts_is_ignored():
    assert not score(label(GPS, until=50.0), row(("gps", 50.1))).detected


def test_what_begins_at_the_end_of_what_counts_still_counts():
    assert score(label(GPS, until=50.0), row(("gps", 50.0))).detected


def test_any_component_detects_and_one_accused_wrongly_after_the_onset_is_not_false():
    one = score(label(GPS), row(("battery", 90.0)))
    assert one.detected
    assert not one.named
    assert not one.in_three
    assert not one.timely
    assert one.delay is None
    assert one.false == ()


@pytest.mark.parametrize(("rank", "in_three"), [(1, True), (3, True), (4, False)])
def test_the_first_three_ranks_count(rank, in_three):
    others = [(f"motor_{k}", 40.0) for k in range(1, rank)]
    one = score(label(GPS), row(*others, ("gps", 40.0)))
    assert one.in_three is in_three
    assert one.named is (rank == 1)


@pytest.mark.parametrize(
    ("kind", "delay", "timely"),
    [
        *(("step", 5.0, True), ("step", 5.1, False), ("step", -2.0, True)),
        *(("ramp", 20.0, True), ("ramp", 20.1, False), ("freeze", 6.0, False)),
    ],
)
def test_a_ramp_has_more_time(kind, delay, timely):
    slow = Fault("gps", kind, 40.0)
    assert score(label(slow), row(("gps", 40.0 + delay))).timely is timely


@pytest.mark.parametrize("name", ["motor", "propeller"])
def test_any_motor_is_right_where_the_label_itself_says_motor_or_propeller(name):
    assert score(label(Fault(name, "scale", 0.0)), row(("motor_3", 1.0))).named
    assert score(label(Fault(name, "scale", 0.0)), row((name, 1.0))).named
    assert not score(label(Fault(name, "scale", 0.0)), row(("gps", 1.0))).named


def test_words_that_the_label_accepts_are_taken_literally():
    accepted = label(Fault("motor_4", "scale", 0.0), accept=("motor",))
    assert not score(accepted, row(("motor_3", 1.0))).named
    assert score(accepted, row(("motor", 1.0))).named
    assert score(accepted, row(("motor_4", 1.0))).named
    by_kind = label(Fault("motor_4", "scale", 0.0), accept=("propulsion", "propeller"))
    assert score(by_kind, row(("propulsion", 1.0))).named
    assert not score(by_kind, row(("motor_3", 1.0))).named


def test_each_of_several_faults_is_a_right_answer():
    both = label(Fault("motor_1", "stop", 30.0), Fault("motor_4", "stop", 34.0))
    one = score(both, row(("motor_4", 34.5)))
    assert one.named
    assert one.timely
    assert one.delay == 5.5  # alarm minus the onset of the first of them
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
    constant = constant_answer(scores)
    assert (constant.component, constant.onset) == ("gps", 40.0)
    told = totals_of(constant, scores)
    assert (told.named, told.timely, told.detected) == (Rate(3, 4), Rate(3, 4), Rate(3, 4))
    assert constant_answer([score(label(), row())]) is None


@pytest.mark.parametrize(("hits", "of"), [(0, 5), (5, 5), (3, 10), (0, 0)])
def test_the_interval_holds_the_share_and_stays_within_bounds(hits, of):
    low, high = Rate(hits, of).interval
    assert 0 <= low <= (hits / of if of else 0.5) <= high <= 1


def test_the_interval_is_that_of_wilson():
    """Known answers: Newcombe, Statistics in Medicine 17 (1998), 857, table I, method 3."""
    for hits, of, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605)):
        assert Rate(hits, of).interval == pytest.approx((low, high), abs=5e-5)
    assert Rate(0, 20).interval == pytest.approx((0.0, 0.1611), abs=5e-5)


@pytest.mark.parametrize(
    ("said", "fate"),
    [
        ({"consequences": ["gps"], "ruled_out": ["gps"]}, "consequence"),
        ({"ruled_out": ["gps"]}, "ruled out"),
        ({"not_testable": ["gps"]}, "not testable"),
        ({"not_testable": ["compass"]}, "unknown"),
    ],
)
def test_a_failed_component_that_is_not_accused_has_a_fate(said, fate):
    assert score(label(GPS), row(("battery", 41.0), **said)).fate == fate
    assert score(label(GPS), row(("gps", 41.0), **said)).fate == "accused"


def test_groups_are_by_origin_vehicle_component_and_kind_and_a_flight_may_be_in_several():
    both = score(label(Fault("motor_1", "stop", 3.0), Fault("gps", "loss", 4.0)), row())
    found = groups([both, score(label(), row())])
    assert {kind: list(parts) for kind, parts in found.items()} == {
        "origin": ["simulated"],
        "vehicle": ["quad"],
        "component": ["gps", "healthy", "motor"],
        "kind of fault": ["healthy", "loss", "stop"],
    }


def test_every_total_stands_beside_what_the_constant_answer_scores():
    flights = [(label(GPS), row(("gps", 41.0))), (label(), row())]
    flights.append((label(Fault("compass", "ramp", 60.0)), row()))
    found = Evaluation(tuple(score(*pair) for pair in flights), tuple(r for _, r in flights))
    tree = evaluation_document(found)
    every = [tree["totals"] | {"constant_answer": tree["constant_answer"]}]
    every += [one for parts in tree["groups"].values() for one in parts.values()]
    assert all(one["constant_answer"]["flights"] == one["flights"] for one in every)
    assert tree["groups"]["component"]["gps"]["constant_answer"]["named"]["hits"] == 0  # compass
    told = evaluation_text(found)
    assert "| compass | 1 | 0/1 0% (0%..79%) |" in told
    assert "| a | compass 60.0 ramp | – | missed: unknown |" in told


def test_accusations_are_judged_by_time_and_component_for_their_confidence():
    findings = row(("gps", 41.0), ("battery", 42.0), ("gps", 10.0), ("gps", 99.0))
    for one, confidence in zip(findings["findings"], (0.9, 0.6, 0.97, 0.97), strict=True):
        one["confidence"] = confidence
    told = label(GPS, until=50.0)
    bins = reliability(stated(Evaluation((score(told, findings),), (findings,))))
    assert [(b.low, b.right.hits, b.right.of) for b in bins] == [
        (0.5, 0, 1), (0.9, 1, 1), (0.95, 0, 1)
    ]  # fmt: skip


def test_on_a_healthy_flight_an_accusation_that_the_label_accepts_is_neither_right_nor_wrong():
    findings = row(("gps", 10.0), ("battery", 20.0))
    for one in findings["findings"]:
        one["confidence"] = 0.9
    told = label(accept=("gps",))
    found = Evaluation((score(told, findings),), (findings,))
    assert stated(found) == [(0.9, False)]


def test_whoever_is_accused_and_had_nothing_to_do_with_it_is_wrong_whenever_that_begins():
    found = row(("battery", 90.0), ("gps", 10.0), ("power", 39.0), ("battery", 95.0))
    one = score(label(GPS, accept=("power",)), found)
    assert one.wrong == ("battery",)
    assert one.false == ("gps",)  # too early, and yet the one that failed
    assert score(label(), row(("gps", 3.0), ("gps", 9.0))).wrong == ("gps",)
    assert score(label(GPS, until=50.0), row(("battery", 51.0))).wrong == ()


def test_a_component_that_failed_and_is_ruled_out_is_cleared_wrongly():
    both = label(GPS, Fault("compass", "step", 50.0))
    one = score(both, row(("gps", 41.0), ruled_out=["barometer", "compass"]))
    assert one.cleared == ("compass",)
    assert one.named
    assert score(label(), row(ruled_out=["gps"])).cleared == ()


def test_an_unknown_motor_is_cleared_with_all_that_the_label_accepts():
    propeller = label(Fault("propeller", "scale", 0.0), accept=("motor_1", "motor_4", "propulsion"))
    assert score(propeller, row(ruled_out=["motor_1", "motor_2", "motor_3"])).cleared == ()
    assert score(propeller, row(ruled_out=["motor_1", "motor_4"])).cleared == ("motor_1", "motor_4")


def test_totals_and_tables_tell_of_wrong_and_cleared_and_of_answers_without_commands():
    flights = [
        (label(GPS), row(("gps", 41.0)), row(("battery", 90.0))),
        (label(GPS), row(("battery", 41.0), ruled_out=["gps"]), row(("gps", 41.0))),
        (label(GPS), row(("gps", 41.0)), row(("gps", 41.0))),
        (label(), row(("battery", 41.0)), row()),
    ]
    found = Evaluation(tuple(score(*one) for one in flights), tuple(r for _, r, _ in flights))
    told = totals(found.scores)
    assert (told.wrong, told.cleared) == (2, 1)
    assert (told.named, told.bare_named) == (Rate(2, 3), Rate(2, 3))
    tree = evaluation_document(found)
    assert (tree["totals"]["wrong"], tree["totals"]["cleared_wrongly"]) == (2, 1)
    assert [one["without_commands"]["named"] for one in tree["flights"]] == [
        *(False, True, True, False)
    ]
    lines = evaluation_text(found).splitlines()
    start = next(i for i, text in enumerate(lines) if text.startswith("| selection |"))
    head, _, line = lines[start : start + 3]
    cells = dict(zip(head.split(" | "), line.split(" | "), strict=True))
    assert (cells["wrong"], cells["cleared wrongly"]) == ("2", "1")
    assert cells["without command evidence"].startswith("2/3")
    assert "| battery 41.0 | wrong: battery, cleared: gps, not named: ruled out |" in (
        evaluation_text(found)
    )


def test_flights_that_were_scored_once_have_no_answer_without_commands():
    found = Evaluation((score(label(GPS), row(("gps", 41.0))),), (row(("gps", 41.0)),))
    assert evaluation_document(found)["flights"][0]["without_commands"] is None
    assert totals(found.scores).bare_named == Rate(0, 0)


def test_confidence_is_set_against_saying_the_same_of_every_accusation():
    pairs = [(0.9, True), (0.9, True), (0.9, True), (0.1, False)]
    assert brier_of_constant(pairs) == pytest.approx(0.1875)  # 0.75 said of each
    assert brier_of_constant([]) is None
