"""What speaks for and against a component: known answers by hand, over small models."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.features import FEATURES, LEAST, MOST, SIMULTANEOUS_S, WELL
from fdi.diagnosis.hypotheses import inquire

from .build import RATE, WEIGHTS, alarms_of, bank_of, limit_row, model, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "estimator": ["y"], "camera": ["y"]}
TEXT = model(SHOWN, {"gps": ["estimator"], "estimator": ["control"], "control": []})
BANK = bank_of(TEXT)
PAIR = row(BANK, "GPS.x", "BARO.x")
OTHER = row(BANK, "GPS.x", "RADAR.x")
AGREE = row(BANK, "BARO.x", "RADAR.x")
DISTURBED = row(BANK, "ESTIMATOR.y", "CAMERA.y")
FOLD = math.log(3)
"""The evidence of an alarm of three times its threshold."""
T = np.arange(400) / RATE


def told(raised, *, bank=BANK, at=None, share=None, **more):
    """The features of every candidate at the first alarm; ``share`` sets what quiet tests reach."""
    alarms = alarms_of(bank, raised, **more)
    if share:
        strength = alarms.strength.copy()
        for place, value in share.items():
            strength[place] = value
        alarms = replace(alarms, strength=strength)
    (one,) = inquire(alarms)
    case = one.case(one.runs[0].onset if at is None else at, one.runs)
    return {
        name: dict(zip(FEATURES, values, strict=True))
        for name, values in zip(case.names, case.features, strict=True)
    }


def test_every_feature_has_a_weight_of_the_sign_it_may_have():
    for name, feature in FEATURES.items():
        assert feature.sign * WEIGHTS.weights[name] == abs(WEIGHTS.weights[name]) or name == "one"


def test_tests_are_counted_by_the_equation_left_over():
    found = told({PAIR: [(40, 60)], OTHER: [(40, 60)]})
    assert found["gps"]["tests"] == pytest.approx(math.log(3))
    assert found["baro"]["tests"] == found["radar"]["tests"] == pytest.approx(math.log(2))


def test_tests_that_leave_the_same_equation_over_count_once():
    whom = inquire(alarms_of(BANK, {}))[0].whom
    alarms = alarms_of(BANK, {PAIR: [(40, 60)], OTHER: [(40, 60)]})
    (one,) = inquire(alarms)
    same = replace(whom, residual=np.zeros_like(whom.residual))
    case = replace(one, whom=same).case(40.0, one.runs)
    values = dict(zip(FEATURES, case.features[case.names.index("gps")], strict=True))
    assert values["tests"] == pytest.approx(math.log(2))
    assert values["fit"] == pytest.approx(FOLD / (1 + FOLD))


@pytest.mark.parametrize("peak", [0.5, 1.0])
def test_an_alarm_that_does_not_pass_its_threshold_is_no_evidence(peak):
    """It stands by persistence alone."""
    found = told({PAIR: [(40, 60)], DISTURBED: [(40, 60)]}, peak=peak)
    for name in ("fit", "explains"):
        assert found["gps"][name] == 0.0
    assert found["gps"]["tests"] == pytest.approx(math.log(2))  # it is counted all the same
    assert told({FAR: [(40, 60)]}, bank=LIMITED, peak=peak)["gps"]["alone"] == 0.0


LIMITED = bank_of(
    model(
        {**SHOWN, "monitor": ["load", "ratio"]},
        {"gps": ["estimator"]},
        "limits:\n  far: {variable: load, max: 9, component: gps}\n"
        "  said: {variable: ratio, max: 9, component: estimator, suspects: [gps]}\n",
    )
)
FAR, SAID = limit_row(LIMITED, "far"), limit_row(LIMITED, "said")


@pytest.mark.parametrize(("peak", "said"), [(1.0, 0.0), (3.0, math.log(3)), (1e6, math.log(MOST))])
def test_how_far_an_alarm_goes_is_told_up_to_a_bound(peak, said):
    assert told({FAR: [(40, 60)]}, bank=LIMITED, peak=peak)["gps"]["alone"] == pytest.approx(said)


def test_only_a_test_that_concerns_nobody_else_is_one_of_its_own():
    assert told({FAR: [(40, 60)]}, bank=LIMITED)["gps"]["alone"] == pytest.approx(FOLD)
    shared = told({SAID: [(40, 60)]}, bank=LIMITED)
    assert shared["estimator"]["alone"] == shared["gps"]["alone"] == 0.0
    assert told({PAIR: [(40, 60)]})["gps"]["alone"] == 0.0


def test_that_a_sensor_does_not_scatter_says_little_of_it():
    """It may drift as well; where it does scatter that counts as any other test."""
    text = model({"gps": ["x"], "baro": ["x"]}).replace(
        "variables:\n", "variables:\n  v: {unit: m}\n  b: {unit: m}\n"
    )
    text += (
        "equations:\n  of: {text: b = v, solves: [b], fault: gps.way, component: gps}\n"
        "limits:\n  most: {variable: b, max: 1, component: gps}\n"
        'inputs:\n  RAW:\n    fields:\n      "w:over": {variable: v, value: "noise(w, 5)"}\n'
    )
    wide, narrow = (bank_of(text.replace("noise", word)) for word in ("change", "noise"))
    for bank, quiet in ((wide, math.log(LEAST)), (narrow, 0.0)):
        pair, own = row(bank, "GPS.x", "BARO.x"), limit_row(bank, "most")
        assert told({pair: [(40, 60)]}, bank=bank)["gps"]["quiet"] == pytest.approx(quiet)
        assert told({own: [(40, 60)]}, bank=bank)["gps"]["alone"] == pytest.approx(FOLD)


def test_what_merely_supports_is_counted_and_says_nothing_else():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=more))
    level, pair = row(bank, "GPS.x"), row(bank, "GPS.x", "BARO.x")
    raised = {level: [(40, 60)], pair: [(40, 60)]}
    strong = np.where((T >= 40) & (T < 60), MOST, 0.0)
    gps = told(raised, bank=bank, share={level: strong})["gps"]
    assert gps["tests"] == pytest.approx(math.log(3))
    assert gps["alone"] == 0.0
    assert gps["fit"] == pytest.approx(FOLD / (1 + FOLD))
    # nor does it lessen what is explained by who is not in it
    baro = told(raised, bank=bank, unknown={row(bank, "BARO.x"): [(0, 100)]})["baro"]
    assert baro["fit"] == pytest.approx(FOLD / (1 + FOLD))


def test_a_fault_that_explains_all_and_misses_nothing_fits_but_for_chance():
    """The more the stronger: what hardly alarms hardly fits."""
    alarms = {PAIR: [(40, 60)], OTHER: [(40, 60)]}
    assert told(alarms)["gps"]["fit"] == pytest.approx(2 * FOLD / (1 + 2 * FOLD))
    strong = told(alarms, peak=1e6)["gps"]["fit"]
    assert strong == pytest.approx(2 * math.log(MOST) / (1 + 2 * math.log(MOST)))
    assert told(alarms, peak=1.0)["gps"]["fit"] == 0.0


def test_a_quiet_test_that_should_have_alarmed_and_an_alarm_it_does_not_hold_lessen_the_fit():
    found = told({PAIR: [(40, 60)], DISTURBED: [(40, 60)]})
    assert found["gps"]["fit"] == pytest.approx(
        FOLD / (1 + 2 * FOLD + 1)
    )  # one missed, one not its own
    assert found["camera"]["fit"] == pytest.approx(FOLD / (1 + 2 * FOLD))


def test_a_test_that_is_unknown_misses_nothing():
    found = told({PAIR: [(40, 60)]}, unknown={OTHER: [(0, 100)]})
    assert found["gps"]["fit"] == pytest.approx(FOLD / (1 + FOLD))
    assert found["baro"]["fit"] == pytest.approx(FOLD / (1 + FOLD + 1))


@pytest.mark.parametrize("first", [PAIR, OTHER, AGREE])
def test_two_that_share_a_third_in_one_alarm_each_fit_equally_well(first):
    """Though some of the tests leave the same equation over, and count once."""
    found = told({place: [(40, 60)] for place in {PAIR, OTHER, AGREE} - {first}})
    fits = sorted(values["fit"] for values in found.values())
    assert fits[0] == pytest.approx(fits[1])
    assert fits[0] > 0
    assert fits[2] > fits[1]  # the one that both hold


def test_who_is_merely_suspected_has_no_fault_that_fits():
    found = told({SAID: [(40, 60)]}, bank=LIMITED)
    assert found["gps"]["fit"] == 0.0
    assert found["estimator"]["fit"] == pytest.approx(FOLD / (1 + FOLD))


NOT_SAID = [place for place in range(len(LIMITED.generators)) if place != SAID]


@pytest.mark.parametrize(("reached", "said"), [(0.0, LEAST), (0.5, 0.5), (0.95, 0.95)])
def test_how_close_the_closest_of_its_own_tests_comes_is_told_where_none_alarms(reached, said):
    found = told({SAID: [(40, 60)]}, bank=LIMITED, share={FAR: reached})
    assert found["gps"]["near"] == pytest.approx(math.log(said))  # it is merely suspected
    assert found["estimator"]["near"] == 0.0


@pytest.mark.parametrize("reached", [0.0, 0.5])
def test_who_has_an_alarming_test_of_its_own_comes_as_close_as_can_be(reached):
    found = told({PAIR: [(40, 60)]}, share={OTHER: reached, AGREE: reached})
    assert found["gps"]["near"] == found["baro"]["near"] == 0.0


def test_who_has_no_test_of_its_own_that_is_known_has_none_that_is_far():
    unknown = {place: [(0, 100)] for place in NOT_SAID}
    assert told({SAID: [(40, 60)]}, bank=LIMITED, unknown=unknown)["gps"]["near"] == 0.0


QUIETS = [(0.0, LEAST), (0.01, LEAST), (0.5, 0.5), (0.95, 0.95)]


@pytest.mark.parametrize(("reached", "said"), QUIETS)
def test_how_quiet_the_test_is_that_would_show_it_alone_is_told(reached, said):
    """``far`` is of the gps alone; the others of it are of two."""
    others = dict.fromkeys(NOT_SAID, 0.99) | {FAR: reached}
    found = told({SAID: [(40, 60)]}, bank=LIMITED, share=others)
    assert found["gps"]["quiet"] == pytest.approx(math.log(said))
    assert found["gps"]["near"] == pytest.approx(math.log(0.99))


def test_who_has_no_test_that_would_show_it_alone_is_not_said_to_be_quiet():
    found = told({PAIR: [(40, 60)]}, share={OTHER: 0.1, AGREE: 0.1})
    assert found["gps"]["quiet"] == found["baro"]["quiet"] == 0.0
    estimator = told({SAID: [(40, 60)]}, bank=LIMITED, share={FAR: 0.1})["estimator"]
    assert estimator["quiet"] == 0.0  # what is quiet is not of it


@pytest.mark.parametrize("peak", [1.0, 3.0])
def test_a_test_that_shows_it_alone_and_alarms_is_not_quiet(peak):
    for raised in ({FAR: [(40, 60)]}, {FAR: [(40, 60)], SAID: [(40, 60)]}):
        assert told(raised, bank=LIMITED, peak=peak)["gps"]["quiet"] == 0.0


def test_a_test_that_would_show_it_alone_and_is_unknown_is_not_quiet():
    unknown = {FAR: [(0, 100)]}
    found = told({SAID: [(40, 60)]}, bank=LIMITED, unknown=unknown, share={FAR: np.nan})
    assert found["gps"]["quiet"] == 0.0


def test_of_several_tests_that_would_show_it_alone_the_nearest_counts():
    more = "limits:\n" + "".join(
        f"  {name}: {{variable: {of}, max: 9, component: gps{suspects}}}\n"
        for name, of, suspects in (
            ("far", "load", ""),
            ("high", "heat", ""),
            ("said", "ratio", ", suspects: [monitor]"),
        )
    )
    bank = bank_of(model({"gps": ["x"], "monitor": ["load", "heat", "ratio"]}, more=more))
    far, high, said = (limit_row(bank, name) for name in ("far", "high", "said"))
    found = told({said: [(40, 60)]}, bank=bank, share={far: 0.2, high: 0.6})
    assert found["gps"]["quiet"] == pytest.approx(math.log(0.6))


def test_what_merely_supports_is_not_quiet_evidence():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=more))
    pair = row(bank, "GPS.x", "BARO.x")
    assert told({pair: [(40, 60)]}, bank=bank)["gps"]["quiet"] == 0.0


def well_for(raised, **more):
    """For how long the gps is said to have been well again, s."""
    return math.expm1(told(raised, **more)["gps"]["healed"])


SAMPLE = 1.0 / RATE


def test_time_since_it_is_well_again_is_told_in_logarithms():
    assert well_for({PAIR: [(40, 60)]}) == pytest.approx(40, abs=1.01 * SAMPLE)
    assert well_for({PAIR: [(40, 100)]}) == 0.0
    assert well_for({PAIR: [(40, 60), (80, 95)]}) == pytest.approx(5, abs=1.01 * SAMPLE)


@pytest.mark.parametrize(
    ("reached", "part"), [(0.0, 1.0), (WELL / 4, 0.75), (WELL / 2, 0.5), (WELL, 0.0), (0.9, 0.0)]
)
def test_the_closer_a_test_stays_to_its_threshold_after_the_alarm_the_less_is_healed(reached, part):
    after = np.where((T >= 40) & (T < 60), 3.0, reached)
    found = well_for({PAIR: [(40, 60)]}, share={PAIR: after})
    assert found == pytest.approx(40 * part, abs=1.01 * SAMPLE)


def test_of_several_tests_the_last_alarm_and_the_worst_since_tell_what_is_healed():
    raised = {PAIR: [(40, 60)], OTHER: [(40, 80)]}
    assert well_for(raised) == pytest.approx(20, abs=1.01 * SAMPLE)
    still = np.where((T >= 40) & (T < 60), 3.0, WELL / 2)
    assert well_for(raised, share={PAIR: still}) == pytest.approx(10, abs=1.01 * SAMPLE)
    # a test of it that never alarmed has nothing to heal
    assert well_for({PAIR: [(40, 60)]}, share={OTHER: 0.9}) == pytest.approx(40, abs=1.01 * SAMPLE)


def test_while_a_test_is_unknown_nothing_is_seen_to_be_healed():
    unknown = {PAIR: [(70, 100)]}
    assert well_for({PAIR: [(40, 60)]}, unknown=unknown) == pytest.approx(10, abs=1.01 * SAMPLE)


def test_who_shows_later_than_the_first_alarm_is_late():
    found = told({DISTURBED: [(40, 60)], PAIR: [(44, 60)]})
    assert found["gps"]["late"] == pytest.approx(math.log(5))
    assert found["estimator"]["late"] == found["camera"]["late"] == 0.0


def test_who_disturbs_another_explains_it_and_nobody_explains_who_disturbs_it():
    found = told({PAIR: [(40, 60)], DISTURBED: [(40, 60)]})
    assert found["gps"]["explains"] == pytest.approx(FOLD)
    assert found["estimator"]["explains"] == found["camera"]["explains"] == 0.0


@pytest.mark.parametrize(
    ("later", "counts"),
    [(-5.0, True), (0.0, True), (SIMULTANEOUS_S, True), (SIMULTANEOUS_S + SAMPLE, False)],
)
def test_what_shows_clearly_before_what_disturbs_it_is_not_explained_by_it(later, counts):
    found = told({PAIR: [(40 + later, 60)], DISTURBED: [(40, 60)]})
    assert found["gps"]["explains"] == pytest.approx(FOLD if counts else 0.0)


def test_who_is_suspected_explains_the_alarm_of_what_it_disturbs():
    """The statement holds the estimator, and suspects the gps, of which nothing alarms."""
    found = told({SAID: [(40, 60)]}, bank=LIMITED)
    assert found["gps"]["explains"] == pytest.approx(FOLD)


@pytest.mark.parametrize(
    ("said", "values"),
    [
        ("computed: true", {"computed": 1.0, "controller": 0.0}),
        ("group: autopilot", {"computed": 0.0, "controller": 1.0}),
        ("group: sensor", {"computed": 0.0, "controller": 0.0}),
    ],
)
def test_what_is_computed_and_who_controls_is_told(said, values):
    bank = bank_of(TEXT.replace("gps: {affects", f"gps: {{{said}, affects"))
    found = told({PAIR: [(40, 60)]}, bank=bank)
    assert {name: found["gps"][name] for name in values} == values
    assert found["baro"]["computed"] == found["baro"]["controller"] == 0.0


SOME = st.sets(st.sampled_from(range(len(BANK.generators))), min_size=1)


@given(SOME, st.floats(1.0, 100.0), st.floats(1.0, 100.0))
def test_a_stronger_alarm_never_lessens_what_speaks_for_whom_it_concerns_alone(rows, one, other):
    raised = {place: [(40, 100)] for place in rows}
    weak, strong = (told(raised, peak=peak) for peak in sorted((one, other)))
    for name, values in weak.items():
        for feature in ("tests", "alone", "explains"):
            assert strong[name][feature] >= values[feature]


@pytest.mark.parametrize("already", [1, 2, 3, 4])
def test_a_test_of_it_that_goes_from_just_quiet_to_alarm_never_speaks_against_it(already):
    """Of six tests of the gps some alarm; one more is just below its threshold, then beyond."""
    others = ("BARO", "RADAR", "SUN", "STAR", "MARS", "MOON")
    bank = bank_of(model({name.lower(): ["x"] for name in ("gps", *others)}))
    own = [row(bank, "GPS.x", f"{name}.x") for name in others]

    def odds(count, reached):
        raised = {place: [(40, 100)] for place in own[:count]}
        share = {own[already]: np.where(np.arange(400) >= 160, reached, 0.0)}
        values = told(raised, bank=bank, share=share)["gps"]
        return sum(WEIGHTS.weights[name] * value for name, value in values.items())

    assert odds(already + 1, 1.05) >= odds(already, 0.95)
