"""Fitted weights are those that the accusations follow; nobody is judged by his likes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.diagnosis.confidence import FILE, ConfidenceModel
from fdi.diagnosis.values import Grounds
from fdi.errors import UsageError
from fdi.evaluation import Evaluation, Fault, Label, score
from fdi.evaluation.calibration import brier, calibration_error
from fdi.evaluation.fitting import (
    Accusation,
    accusations,
    confidence_document,
    cross_validated,
    fit,
)

ROOT = Path(__file__).parents[2]
TRUTH = ConfidenceModel(-2.0, {"share": 0.5, "strength": 1.0, "exclusive": 2.0, "part": 1.0}, 0.999)


def drawn(count, truth=TRUTH, seed=0, kinds=12):
    """Accusations that follow a model, on flights of which each has one of so many failures."""
    rng = np.random.default_rng(seed)
    made = []
    for i in range(count):
        grounds = Grounds(
            float(rng.uniform(0.05, 0.99)),
            float(np.exp(rng.uniform(0, 3))),
            bool(rng.random() < 0.6),
            bool(rng.random() < 0.7),
        )
        right = bool(rng.random() < truth.confidence(grounds))
        likes = frozenset({f"flight {i}", f"part {i % kinds}"})
        made.append(Accusation(f"flight {i}", likes, 1, grounds, 0.5, right))
    return made


def test_weights_that_the_accusations_follow_are_found():
    found = fit(drawn(6000))
    assert found.intercept == pytest.approx(TRUTH.intercept, abs=0.25)
    for name, weight in TRUTH.weights.items():
        assert found.weights[name] == pytest.approx(weight, abs=0.25)


def test_mean_confidence_is_the_share_right():
    """The intercept is free: a certificate of the optimum."""
    known = drawn(300)
    found = fit(known)
    mean = np.mean([found.confidence(one.grounds) for one in known])
    assert mean == pytest.approx(np.mean([one.right for one in known]), abs=1e-3)


def test_weight_that_the_data_would_turn_round_is_zero():
    turned = replace(TRUTH, weights={**TRUTH.weights, "exclusive": -2.0})
    found = fit(drawn(2000, turned))
    assert found.weights["exclusive"] == 0.0
    assert found.weights["strength"] > 0.5


def test_recording_in_two_formats_counts_once():
    known = drawn(200)
    twice = [replace(one, copies=2) for one in known for _ in range(2)]
    one, two = fit(known), fit(twice)
    assert two.intercept == pytest.approx(one.intercept, abs=1e-3)
    assert two.weights == pytest.approx(one.weights, abs=1e-3)
    assert two.most == pytest.approx(one.most)


def test_no_confidence_beyond_what_the_number_of_accusations_can_teach():
    assert fit(drawn(98)).most == pytest.approx(99 / 100)


def test_nobody_is_judged_by_his_likes():
    """What accusations of one kind turn out to be changes nothing in their own confidence."""
    known = drawn(120)
    other = [replace(one, right=not one.right) if "part 3" in one.likes else one for one in known]
    before, after = cross_validated(known), cross_validated(other)
    same = ["part 3" in one.likes for one in known]
    assert [b for b, is_in in zip(before, same, strict=True) if is_in] == [
        a for a, is_in in zip(after, same, strict=True) if is_in
    ]
    assert any(b != a for b, a, is_in in zip(before, after, same, strict=True) if not is_in)


def test_likes_through_the_recording_are_left_out_as_well():
    """An accusation of another component on the very same flight does not help to judge."""
    known = drawn(60)
    twin = replace(known[0], likes=frozenset({"flight 0", "part 99"}), right=not known[0].right)
    with_twin = cross_validated([*known, twin])
    assert with_twin[0] == pytest.approx(cross_validated(known)[0], abs=1e-12)


def test_cross_validated_confidence_of_lawful_accusations_is_calibrated():
    known = drawn(3000)
    pairs = list(zip(cross_validated(known), (one.right for one in known), strict=True))
    shares = [(one.grounds.share, one.right) for one in known]
    assert calibration_error(pairs) < 0.03
    assert brier(pairs) < brier(shares)


@pytest.mark.parametrize("right", [True, False])
def test_accusations_that_are_all_alike_teach_nothing(right):
    with pytest.raises(UsageError, match="teach no confidence"):
        fit([replace(one, right=right) for one in drawn(20)])


def said(*findings):
    """What an analysis said: components with their onsets."""
    grounds = {"share": 0.9, "strength": 2.0, "exclusive": True, "part": True}
    told = dict.fromkeys(("consequences", "ruled_out", "not_testable"), ())
    return {
        **told,
        "findings": [
            {
                "rank": rank,
                "component": name,
                "onset_s": onset,
                "alarm_s": onset,
                "confidence": 0.9,
                "grounds": grounds,
            }
            for rank, (name, onset) in enumerate(findings, 1)
        ],
        "airborne_s": 60.0,
        "error": None,
    }


def flight(key, *faults):
    return Label(key, Path(key), "quad", "simulated", "diagnosis", faults, frozenset(), 90.0)


def test_accusations_of_an_evaluation_know_their_flight_and_what_failed():
    told = said(("gps", 41.0), ("battery", 95.0))
    gps, motor = Fault("gps", "step", 40.0), Fault("motor_3", "stop", 40.0)
    labels = [flight("x/a.tlog", gps), flight("x/a.BIN", gps), flight("x/b.tlog", motor)]
    found = Evaluation(tuple(score(one, told) for one in labels), (told,) * 3)
    one, copy, other = accusations(found)
    assert (one.recording, one.copies, one.right, one.stated) == ("x/a", 2, True, 0.9)
    assert copy == one
    assert (other.likes, other.copies, other.right) == ({"x/b", "motor"}, 1, False)
    assert one.grounds == Grounds(0.9, 2.0, True, True)


def test_document_of_a_model_holds_what_is_needed_to_use_it():
    tree = confidence_document(TRUTH, {"command": "c"})
    assert ConfidenceModel(tree["intercept"], tree["weights"], tree["most"]) == TRUTH
    assert tree["command"] == "c"


def test_page_shows_the_figures_of_the_shipped_weights():
    tree = json.loads((ROOT / "fdi" / "diagnosis" / FILE).read_text("utf-8"))
    page = (ROOT / "docs" / "evaluation.md").read_text("utf-8")
    _, _, rest = page.partition("<!-- confidence: begin -->")
    block, end, _ = rest.partition("<!-- confidence: end -->")
    assert end
    assert f"`{tree['command']}` printed: {tree['right']} of {tree['accusations']}" in block
    assert f"Brier score {tree['brier_cross_validated']:.3f}" in block
    assert f"Brier score {tree['brier_of_the_share']:.3f}" in block
    for name, weight in tree["weights"].items():
        assert f"| {name} |" in block
        assert f"| {weight:.2f} |" in block
