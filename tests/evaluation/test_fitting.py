"""Fitted weights are those that the lessons follow; what a flight teaches, and how often."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.hypotheses import Case
from fdi.diagnosis.likelihood import Fitted, fitted_of
from fdi.errors import UsageError
from fdi.evaluation import Fault, Label
from fdi.evaluation.fitting import (
    AFTER,
    Flown,
    Lesson,
    _Problem,
    fit,
    fit_text,
    fitted_document,
    lessons,
    lessons_of,
)

NAMES = list(FEATURES)
TRUTH = Fitted(
    {
        "one": -2.0,
        "tests": 1.0,
        "alone": 1.5,
        "fit": 1.0,
        "near": 0.5,
        "quiet": 0.5,
        "healed": -0.5,
        "late": -1.0,
        "explains": 0.5,
        "computed": -1.0,
        "controller": -1.0,
    },
    1.0,
)


def competing(values):
    """A case where all candidates explain the same alarm."""
    names = tuple(map(str, range(len(values))))
    return Case(0.0, names, values, np.full((len(values), 1), Tie.HELD, np.int8))


def drawn(count, truth=TRUTH, seed=0, most=4):
    """Lessons that follow weights: up to so many candidates, one of whom or nobody is right."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        values = rng.uniform(0.0, 2.0, size=(rng.integers(1, most + 1), len(NAMES)))
        values[:, NAMES.index("one")] = 1.0
        shares = truth.probabilities(competing(values))
        chosen = rng.choice(len(values) + 1, p=[*shares, 1 - shares.sum()])
        made.append([Lesson(values, np.arange(len(values)) == chosen, 1.0)])
    return made


def test_weights_that_the_lessons_follow_are_found():
    found = fit(drawn(4000)).fitted
    for name, weight in TRUTH.weights.items():
        assert found.weights[name] == pytest.approx(weight, abs=0.3), name


def test_weights_do_not_depend_on_the_order_of_the_flights():
    known = drawn(300)
    one, two = fit(known).fitted, fit(known[::-1]).fitted
    assert two.vector == pytest.approx(one.vector, abs=2e-2)


def test_probability_of_nobody_is_on_average_the_share_of_lessons_that_are_nobodys():
    """The weight of ``one`` is free: a certificate of the optimum."""
    known = drawn(400)
    found = fit(known).fitted
    said = []
    for (lesson,) in known:
        case = competing(lesson.features)
        said.append(replace(found, most=1.0).probabilities(case).sum())
    right = [lesson.right.any() for (lesson,) in known]
    assert np.mean(said) == pytest.approx(np.mean(right), abs=1e-3)


def test_gradient_is_the_slope_of_the_loss():
    known = [lesson for own in drawn(40) for lesson in own]
    both = Lesson(known[0].features.repeat(2, axis=0), np.ones(2 * len(known[0].right), bool), 0.3)
    problem = _Problem([*known, both])  # in the last any of several is right
    rng = np.random.default_rng(5)
    for _ in range(5):
        at = rng.normal(size=len(NAMES))
        _, gradient = problem.loss(at)
        step = 1e-5
        slope = [
            (problem.loss(at + step * e)[0] - problem.loss(at - step * e)[0]) / (2 * step)
            for e in np.eye(len(NAMES))
        ]
        assert gradient == pytest.approx(slope, rel=1e-5, abs=1e-5)


def test_a_feature_that_is_the_same_everywhere_weighs_nothing():
    """Its deviation is zero but for rounding."""
    known = drawn(40)
    for own in known:
        own[0].features[:, NAMES.index("alone")] = 0.1
    assert fit(known).fitted.weights["alone"] == pytest.approx(0.0, abs=1.0)


def test_loss_of_one_lesson_by_hand():
    """Two candidates as probable as nobody: a third each; weights of zero are not penalised."""
    values = np.array([[1.0] * len(NAMES), [2.0] * len(NAMES)])
    for right, share in (([True, False], 1 / 3), ([True, True], 2 / 3), ([False, False], 1 / 3)):
        problem = _Problem([Lesson(values, np.array(right), 0.5)])
        loss, _ = problem.loss(np.zeros(len(NAMES)))
        assert loss == pytest.approx(-0.5 * np.log(share))


@pytest.mark.parametrize("scale", [-1e3, 1e3])
def test_loss_is_finite_however_far_the_search_goes(scale):
    problem = _Problem([lesson for own in drawn(20) for lesson in own])
    loss, gradient = problem.loss(np.full(len(NAMES), scale))
    assert np.isfinite(loss)
    assert np.isfinite(gradient).all()


@pytest.mark.parametrize("turned", ["alone", "late", "controller"])
def test_weight_that_the_lessons_would_turn_round_is_zero(turned):
    wrong = replace(TRUTH, weights={**TRUTH.weights, turned: -TRUTH.weights[turned]})
    found = fit(drawn(1500, wrong))
    assert found.fitted.weights[turned] == 0.0
    low, high = found.intervals[turned]
    assert (low == 0.0) if FEATURES[turned].sign > 0 else (high == 0.0)


@given(st.integers(0, 10**6), st.integers(5, 30))
@settings(max_examples=25, deadline=None)
def test_weights_have_the_signs_that_their_features_may_have(seed, count):
    known = drawn(count, seed=seed)
    right = [own[0].right.any() for own in known]
    if any(right) and not all(right):
        found = fit(known)
        for name, feature in FEATURES.items():
            low, high = found.intervals[name]
            assert low <= found.fitted.weights[name] <= high
            assert found.fitted.weights[name] * feature.sign >= 0
            assert min(low * feature.sign, high * feature.sign) >= 0


def test_intervals_mostly_contain_the_weights_that_the_lessons_follow():
    held = []
    for seed in range(20):
        found = fit(drawn(1000, seed=seed))
        for name, (low, high) in found.intervals.items():
            held.append(low <= TRUTH.weights[name] <= high)
    assert 0.9 < np.mean(held) < 1.0


def test_more_lessons_say_more_exactly():
    few, many = fit(drawn(300)), fit(drawn(3000))
    for name in NAMES:
        assert np.ptp(many.intervals[name]) < np.ptp(few.intervals[name])


@pytest.mark.parametrize("right", [True, False])
def test_where_there_is_nothing_to_tell_apart_nothing_is_learned(right):
    known = [[replace(own[0], right=np.full(len(own[0].right), right))] for own in drawn(20)]
    with pytest.raises(UsageError, match="teach nothing"):
        fit(known)
    with pytest.raises(UsageError, match="teach nothing"):
        fit([])


def test_no_probability_beyond_what_the_number_of_flights_can_teach():
    assert fit(drawn(98)).fitted.most == pytest.approx(99 / 100)
    assert fit([*drawn(98), []]).fitted.most == pytest.approx(99 / 100)  # it taught nothing


# What a flight teaches.

GPS = Fault("gps", "step", 40.0)


def label(*faults, key="a.BIN", accept=(), until=None):
    return Label(key, Path(key), "quad", "simulated", "diagnosis", faults, frozenset(accept), until)


def flown(said, *moments, names=("gps", "baro"), origin="simulated"):
    """A labelled flight with a case of the same candidates at each of some moments."""
    rng = np.random.default_rng(len(moments))
    cases = [
        replace(
            competing(rng.uniform(0, 2, size=(len(names), len(NAMES)))), at=float(at), names=names
        )
        for at in moments
    ]
    return Flown(said, (SimpleNamespace(cases=lambda: iter(cases)),), origin, ())


def taught(*args, **more):
    return [lesson.right.tolist() for lesson in lessons(flown(*args, **more))]


def test_before_a_fault_it_is_nobodys_and_from_then_on_it_is_a_right_one():
    assert taught(label(GPS), 20, 30, 40, 50) == [[False, False]] * 2 + [[True, False]] * 2


@pytest.mark.parametrize(("at", "counts"), [(37.75, False), (38.0, True)])
def test_what_begins_a_moment_before_the_onset_belongs_to_it(at, counts):
    assert taught(label(GPS), at) == [[counts, False]]


def test_on_a_healthy_flight_it_is_always_nobodys():
    assert taught(label(), 20, 90) == [[False, False]] * 2


def test_every_accepted_component_is_right():
    assert taught(label(GPS, accept=["baro"]), 50) == [[True, True]]


def test_where_none_of_the_candidates_is_right_it_is_nobodys():
    assert taught(label(Fault("battery", "step", 40.0)), 50) == [[False, False]]


@pytest.mark.parametrize(("at", "counts"), [(60.0, 1), (60.25, 0)])
def test_what_begins_after_the_end_of_what_counts_teaches_nothing(at, counts):
    assert len(taught(label(GPS, until=60.0), at)) == counts
    assert len(taught(label(until=60.0), at)) == counts


def test_only_the_first_after_the_fault_teach():
    found = taught(label(GPS), *range(10, 30), *range(40, 60))
    assert found.count([False, False]) == 20
    assert found.count([True, False]) == AFTER


def test_cases_of_one_flight_count_as_their_root_before_the_fault_and_after():
    found = lessons(flown(label(GPS), 10, 15, 20, 25, 50, 55, 60, 65))
    assert sum(one.weight for one in found if not one.right.any()) == pytest.approx(2.0)
    assert sum(one.weight for one in found if one.right.any()) == pytest.approx(2.0)


def flights():
    every = [flown(label(GPS, key=f"x/{i}.BIN"), 20, 40, 50) for i in range(4)]
    return [*every, flown(label(key="x/healthy.BIN"), 20, 40, 60, 80)]


def twice(every):
    """The same flights with each recorded in a second format as well."""
    other = [
        replace(one, label=replace(one.label, path=one.label.path.with_suffix(".tlog")))
        for one in every
    ]
    return [*every, *other]


def test_a_recording_in_two_formats_counts_once():
    one, two = fit(lessons_of(flights())), fit(lessons_of(twice(flights())))
    assert two.fitted.vector == pytest.approx(one.fitted.vector, abs=1e-2)
    assert np.array([*two.intervals.values()]) == pytest.approx(
        np.array([*one.intervals.values()]), abs=2e-2
    )


def test_a_recording_in_two_formats_makes_nobody_surer():
    one, two = fit(lessons_of(flights())), fit(lessons_of(twice(flights())))
    assert two.fitted.most == one.fitted.most
    assert two.flights == one.flights == 5


def test_a_flight_knows_its_recording_and_the_kinds_of_what_failed():
    one = flown(label(Fault("motor_3", "stop", 40.0), GPS, key="x/a.BIN"))
    assert one.recording == "x/a"
    assert one.components == {"motor", "gps"}
    # and of what may be said to have failed
    other = flown(label(GPS, accept=["motor_1", "esc"], key="x/b.BIN"))
    assert other.components == {"gps", "motor", "esc"}


# What is written.


def test_document_holds_what_is_needed_to_use_the_weights():
    found = fit(drawn(200))
    again = fitted_of(fitted_document(found))
    assert again.vector == pytest.approx(found.fitted.vector, abs=1e-4)
    assert again.most == pytest.approx(found.fitted.most, abs=1e-4)
    assert fitted_document(found)["cases"] == 200
    assert fitted_document(found)["recordings"] == 200


def test_table_has_a_line_for_every_feature_with_its_interval():
    found = fit(drawn(200))
    lines = fit_text(found).splitlines()
    for name, (low, high) in found.intervals.items():
        (line,) = [line for line in lines if line.startswith(f"| {name} |")]
        assert line.split(" | ")[1:4] == [
            f"{value:.2f}" for value in (found.fitted.weights[name], low, high)
        ]
