"""Confidence is a probability that grows with the evidence; the package's own weights give it."""

import json
from dataclasses import replace
from importlib.resources import files
from math import exp, log

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.confidence import ConfidenceModel, load_confidence, values
from fdi.diagnosis.values import Grounds

from .build import bank_of, limit_row, model, row
from .test_ranking import answer, pairs

PAIR = bank_of(model({"gps": ["x"], "baro": ["x"]}))
LIMIT = "limits:\n  too_far: {variable: y, max: 100, component: gps}\n"
GROUNDS = st.builds(
    Grounds, st.floats(0, 1), st.floats(1, 20), exclusive=st.booleans(), part=st.booleans()
)


def shipped():
    return json.loads(files("fdi.diagnosis").joinpath("confidence.json").read_text("utf-8"))


def pairs_of(bank, fault):
    return {i: [(40, 60)] for i, g in enumerate(bank.generators) if fault in g.faults}


def only(found):
    (finding,) = found.findings
    return finding


def test_two_that_contradict_each_other_rest_on_a_shared_test():
    grounds = only(answer({0: [(40, 60)]}, bank=PAIR)).grounds
    assert (grounds.strength, grounds.exclusive, grounds.part) == (3.0, False, True)
    assert 0.4 < grounds.share < 0.5  # somebody else, unseen, is never ruled out


def test_limit_on_one_component_is_a_test_of_its_own():
    bank = bank_of(model({"gps": ["x", "y"], "baro": ["x"]}, more=LIMIT))
    grounds = only(answer({limit_row(bank, "too_far"): [(40, 60)]}, bank=bank)).grounds
    assert grounds.exclusive


@pytest.mark.parametrize("said", ["group: autopilot", "computed: true"])
def test_controllers_and_what_is_computed_are_no_parts(said):
    shown = {name: ["x"] for name in ("gps", "baro", "radar", "sonar", "lidar", "camera")}
    text = model(shown).replace("  gps: {", f"  gps: {{{said}, ")
    bank = bank_of(text)
    finding = only(answer(pairs_of(bank, "GPS.x"), bank=bank, peak=20.0))
    assert finding.component == "gps"
    assert not finding.grounds.part


def test_strength_is_that_of_the_first_alarms_and_bounded():
    assert only(answer(pairs("gps", "x", (40, 60)), peak=1e6)).grounds.strength == 20.0


def test_what_alarms_later_than_ten_seconds_gives_no_grounds():
    bank = bank_of(model({"gps": ["x", "y"], "baro": ["x"]}, more=LIMIT))
    late = {row(bank, "GPS.x", "BARO.x"): [(40, 90)], limit_row(bank, "too_far"): [(70, 90)]}
    assert not only(answer(late, bank=bank)).grounds.exclusive


def test_confidence_is_what_the_shipped_file_says():
    tree = shipped()
    finding = only(answer({0: [(40, 60)]}, bank=PAIR))
    g = finding.grounds
    odds = tree["intercept"] + (
        tree["weights"]["share"] * log(g.share / (1 - g.share))
        + tree["weights"]["strength"] * log(g.strength)
        + tree["weights"]["exclusive"] * g.exclusive
        + tree["weights"]["part"] * g.part
    )
    assert finding.confidence == pytest.approx(1 / (1 + exp(-odds)), abs=1e-12)


def test_shipped_weights_are_those_of_the_grounds_and_none_is_negative():
    tree = shipped()
    assert tree["weights"].keys() == values(Grounds(0.5, 1.0, False, True)).keys()
    assert min(tree["weights"].values()) >= 0
    assert 0.5 < tree["most"] < 1
    assert tree["right"] < tree["accusations"]
    assert tree["command"].startswith("benchmarks/confidence.py")


@given(GROUNDS, GROUNDS)
def test_more_evidence_never_makes_an_accusation_less_sure(one, other):
    """With the shipped weights: at least as much of everything is at least as sure."""
    model = load_confidence()
    more = Grounds(
        max(one.share, other.share),
        max(one.strength, other.strength),
        one.exclusive or other.exclusive,
        one.part or other.part,
    )
    assert model.confidence(more) >= max(model.confidence(one), model.confidence(other))


@given(GROUNDS)
def test_nothing_is_certain_and_nothing_impossible(grounds):
    model = load_confidence()
    assert 0 < 1 - model.most <= model.confidence(grounds) <= model.most < 1


def test_bound_holds_for_overwhelming_evidence():
    sure = ConfidenceModel(50.0, {}, 0.9)
    assert sure.confidence(Grounds(1.0, 20.0, True, True)) == 0.9
    assert replace(sure, intercept=-50.0).confidence(
        Grounds(0.0, 1.0, False, False)
    ) == pytest.approx(0.1)


def test_onset_and_not_confidence_decides_the_rank():
    bank = bank_of(model({"gps": ["x", "y"], "baro": ["x"]}, more=LIMIT))
    raised = {row(bank, "GPS.x", "BARO.x"): [(20, 35)], limit_row(bank, "too_far"): [(70, 95)]}
    first, second = answer(raised, bank=bank).findings
    assert (first.rank, second.rank) == (1, 2)
    assert first.onset < second.onset
    assert first.confidence < second.confidence
