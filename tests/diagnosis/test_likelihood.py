"""How probable a candidate is: rivals and nobody sum to one, and more evidence never harms."""

import json
from importlib.resources import files
from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.hypotheses import Case
from fdi.diagnosis.likelihood import FILE, Fitted, fitted_of, load_fitted

from .build import WEIGHTS

NAMES = list(FEATURES)


def case_of(values, ties=None):
    """A case where all explain the same alarm, unless ``ties`` tell otherwise."""
    rows = np.array(values, float).reshape(-1, len(NAMES))
    shared = np.full((len(rows), 1), Tie.HELD, np.int8)
    own = shared if ties is None else np.array(ties, np.int8)
    return Case(0.0, tuple(f"c{i}" for i in range(len(rows))), rows, own)


def said(**values):
    """The features of a candidate, zero where nothing is given."""
    return [values.get(name, 0.0) for name in NAMES]


def unlimited(weights):
    return Fitted(weights, 1.0)


def rows_of(number):
    row = st.lists(st.floats(0, 20), min_size=len(NAMES), max_size=len(NAMES))
    return st.lists(row, min_size=1, max_size=number)


CASES = rows_of(5).map(case_of)
TIE = st.sampled_from(list(Tie))


@st.composite
def tied(draw):
    """Cases where each candidate explains some of the alarms."""
    rows, alarms = draw(rows_of(5)), draw(st.integers(1, 4))
    ties = st.lists(TIE, min_size=alarms, max_size=alarms).filter(any)
    return case_of(rows, draw(st.lists(ties, min_size=len(rows), max_size=len(rows))))


def rivals(case, who):
    """The places of those who explain any alarm that one of them explains."""
    return [i for i, own in enumerate(case.ties) if ((own > 0) & (case.ties[who] > 0)).any()]


WEIGHTED = st.fixed_dictionaries(
    {
        name: {0: st.floats(-9, 9), 1: st.floats(0, 9), -1: st.floats(-9, 0)}[feature.sign]
        for name, feature in FEATURES.items()
    }
)


def test_one_candidate_without_evidence_for_or_against_is_as_probable_as_nobody():
    case = case_of(np.zeros((1, len(NAMES))))
    assert WEIGHTS.probabilities(case) == pytest.approx([0.5])


def test_probabilities_of_two_by_hand():
    # -4 before any evidence, twice 2.5: +1 in the end
    first = said(one=1, alone=2)
    # -4, twice 3.5, three times -1.5: -1.5 in the end
    second = said(one=1, tests=2, late=3)
    total = 1 + exp(1) + exp(-1.5)
    found = WEIGHTS.probabilities(case_of([first, second]))
    assert found == pytest.approx([exp(1) / total, exp(-1.5) / total])


def test_those_who_share_no_alarm_do_not_compete():
    """Both may have failed: each has nobody alone against it."""
    strong = said(one=1, alone=2)
    found = WEIGHTS.probabilities(case_of([strong, strong], [[Tie.HELD, 0], [0, Tie.HELD]]))
    assert found == pytest.approx([exp(1) / (1 + exp(1))] * 2)
    assert found.sum() > 1


@pytest.mark.parametrize("tie", [Tie.SUSPECTED, Tie.HELD])
def test_one_that_shares_an_alarm_with_each_of_two_competes_with_both(tie):
    even = said()
    ties = [[Tie.HELD, 0], [tie, tie], [0, Tie.HELD]]
    found = WEIGHTS.probabilities(case_of([even] * 3, ties))
    assert found == pytest.approx([1 / 3, 1 / 4, 1 / 3])


@given(tied(), WEIGHTED)
def test_each_is_as_probable_as_among_its_rivals_alone(case, weights):
    model = unlimited(weights)
    found = model.probabilities(case)
    for who in range(len(case.names)):
        among = rivals(case, who)
        alone = model.probabilities(case_of(case.features[among]))
        assert found[who] == pytest.approx(alone[among.index(who)], abs=1e-9)


@given(CASES, WEIGHTED)
def test_probabilities_leave_a_share_for_nobody_and_sum_with_it_to_one(case, weights):
    found = unlimited(weights).probabilities(case)
    assert ((found >= 0) & (found <= 1)).all()
    nobody = 1 - found.sum()
    assert nobody >= -1e-9
    # against nobody each has the odds that its features give it, where floats can tell
    for share, row in zip(found, case.features, strict=True):
        odds = sum(weights[name] * value for name, value in zip(NAMES, row, strict=True))
        if nobody > 1e-6 and share > 1e-6:
            assert np.log(share / nobody) == pytest.approx(odds, abs=1e-3)


@given(tied(), WEIGHTED, st.floats(0.5, 0.999))
def test_no_probability_exceeds_what_so_many_flights_can_teach(case, weights, most):
    assert (Fitted(weights, most).probabilities(case) <= most).all()


def test_overwhelming_evidence_is_as_sure_as_can_be():
    values = np.zeros((2, len(NAMES)))
    values[0, NAMES.index("alone")] = 1e6
    found = WEIGHTS.probabilities(case_of(values))
    assert found.tolist() == [WEIGHTS.most, 0.0]


@given(
    tied(),
    WEIGHTED,
    st.sampled_from([name for name, feature in FEATURES.items() if feature.sign]),
    st.integers(0, 4),
    st.floats(0, 10),
)
def test_more_evidence_never_makes_an_accusation_less_likely(case, weights, feature, who, more):
    """Nor anybody else, or nobody, more likely."""
    who %= len(case.names)
    changed = case.features.copy()
    changed[who, NAMES.index(feature)] += FEATURES[feature].sign * more
    model = unlimited(weights)
    before = model.probabilities(case)
    after = model.probabilities(case_of(changed, case.ties))
    assert after[who] >= before[who] - 1e-12
    others = np.arange(len(before)) != who
    assert (after[others] <= before[others] + 1e-12).all()
    together = model.probabilities(case_of(case.features)).sum()
    assert model.probabilities(case_of(changed)).sum() >= together - 1e-12


@given(tied(), WEIGHTED, st.randoms())
def test_order_of_the_candidates_changes_nothing(case, weights, random):
    order = list(range(len(case.names)))
    random.shuffle(order)
    model = unlimited(weights)
    turned = model.probabilities(case_of(case.features[order], case.ties[order]))
    assert turned == pytest.approx(model.probabilities(case)[order])


def test_nobody_is_asked_about():
    assert WEIGHTS.probabilities(case_of(np.zeros((0, len(NAMES))))).tolist() == []


# What failed before in this flight.


@pytest.mark.parametrize("before", [0.02, 0.5, 0.9])
def test_what_failed_stays_failed_where_nothing_speaks_for_or_against_it(before):
    """What was said of it replaces what is thought before any evidence."""
    case = case_of([said(one=1)])
    assert WEIGHTS.probabilities(case, {"c0": before}) == pytest.approx([before])
    assert WEIGHTS.probabilities(case, {"another": before}) == pytest.approx(
        WEIGHTS.probabilities(case)
    )
    assert WEIGHTS.probabilities(case, {}) == pytest.approx(WEIGHTS.probabilities(case))


def test_what_failed_before_is_weighed_with_what_is_seen_now():
    """Odds of 3 to 1, of which twice -1.5 for late alarms leave less."""
    (found,) = WEIGHTS.probabilities(case_of([said(one=1, late=2)]), {"c0": 0.75})
    odds = 3 * exp(-3)
    assert found == pytest.approx(odds / (1 + odds))


@given(tied(), WEIGHTED, st.integers(0, 4), st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_the_surer_it_was_before_the_likelier_it_is_and_nobody_else(case, weights, who, one, two):
    who %= len(case.names)
    name, model = case.names[who], unlimited(weights)
    low, high = (model.probabilities(case, {name: p}) for p in sorted((one, two)))
    assert high[who] >= low[who] - 1e-12
    others = np.arange(len(low)) != who
    assert (high[others] <= low[others] + 1e-12).all()


def test_shipped_weights_have_the_signs_that_their_features_may_have():
    tree = json.loads(files("fdi.diagnosis").joinpath(FILE).read_text("utf-8"))
    assert list(tree["weights"]) == NAMES
    for name, feature in FEATURES.items():
        weight = tree["weights"][name]
        low, high = weight["interval"]
        assert low <= weight["value"] <= high
        assert weight["value"] * feature.sign >= 0
        assert weight["says"] == feature.words
    assert tree["weights"]["one"]["value"] < 0  # without evidence it is nobody
    assert 0.9 < tree["most"] < 1
    assert load_fitted() == fitted_of(tree)
