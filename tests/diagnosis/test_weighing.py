"""What speaks for a component, and what against it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fdi.decision.concerns import SUSPECTED, concerns
from fdi.diagnosis import diagnose
from fdi.diagnosis.episodes import find_runs
from fdi.diagnosis.weighing import QUIET, weigh

from .build import FLIGHTS, alarms_of, bank_of, model, row


def answer(bank, raised, **more):
    return diagnose(alarms_of(bank, raised, flights=FLIGHTS, **more), bank)


SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"]}


def test_what_is_computed_is_asked_last():
    text = model({"estimator": ["x"], "gps": ["x"]}, {"estimator": [], "gps": []})
    bank = bank_of(text.replace("estimator: {affects", "estimator: {computed: true, affects"))
    (finding,) = answer(bank, {0: [(40, 60)]}, peak=10.0).findings
    assert finding.component == "gps"


def test_the_one_that_all_alarms_share_is_accused_and_the_agreeing_pair_is_not():
    bank = bank_of(model(SHOWN))
    pair = {row(bank, "GPS.x", name): [(40, 60)] for name in ("BARO.x", "RADAR.x")}
    assert [f.component for f in answer(bank, pair).findings] == ["gps"]


def test_weak_evidence_that_concerns_several_accuses_nobody():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    assert answer(bank, {0: [(40, 60)]}, peak=1.2).findings == ()
    assert answer(bank, {0: [(40, 60)]}, peak=9.0).findings != ()


def test_what_supports_accuses_nobody_alone_and_counts_beside_another():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=more))
    level, pair = row(bank, "GPS.x"), row(bank, "GPS.x", "BARO.x")
    assert answer(bank, {level: [(40, 60)]}, peak=9.0).findings == ()
    assert answer(bank, {pair: [(40, 60)]}, peak=1.2).findings == ()
    (finding,) = answer(bank, {level: [(40, 60)], pair: [(40, 60)]}, peak=1.2).findings
    assert finding.component == "gps"


CHAIN = {"gps": ["estimator"], "estimator": ["control"], "control": []}
SUSPECTING = """equalities:
  level: {text: x = 0, component: baro, suspects: [mast], solves: []}
"""


def concerned():
    """Three that show x, of which gps disturbs the estimator and through it the control."""
    shown = {"gps": ["x"], "baro": ["x"], "estimator": ["y"], "camera": ["y"], "control": ["z"]}
    bank = bank_of(model({**shown, "sun": ["z"], "mast": []}, CHAIN, more=SUSPECTING))
    return bank, concerns(bank)


@pytest.mark.parametrize(
    ("component", "faults", "chosen", "share"),
    [
        ("gps", ("GPS.x", "BARO.x"), {"GPS.x"}, 1.0),
        ("gps", ("GPS.x", "BARO.x"), set(), 0.0),  # the other tests speak against its fault
        ("gps", ("ESTIMATOR.y", "CAMERA.y"), set(), 0.35),
        ("gps", ("CONTROL.z", "SUN.z"), set(), 0.2),
        ("estimator", ("GPS.x", "BARO.x"), set(), 0.0),  # disturbs neither
        ("sun", ("GPS.x", "BARO.x"), set(), 0.0),
    ],
)
def test_an_alarm_counts_by_how_it_is_tied_to_a_component(component, faults, chosen, share):
    bank, whom = concerned()
    assert whom.share(component, row(bank, *faults), frozenset(chosen)) == share


def test_a_statement_stands_for_whom_it_names_and_counts_less_for_whom_it_suspects():
    bank, whom = concerned()
    place = row(bank, "GPS.x")
    assert whom.of(place) == {"baro", "mast"}
    assert whom.share("mast", place, frozenset()) == SUSPECTED
    assert whom.share("baro", place, frozenset({"@level:baro"})) == 1.0
    assert whom.share("sun", place, frozenset()) == 0.0


def weight(raised, component="gps", response=None, **more):
    bank = bank_of(model(SHOWN))
    alarms = alarms_of(bank, raised(bank), **more)
    if response is not None:
        residuals = replace(alarms.residuals, response=response(bank))
        alarms = replace(alarms, residuals=residuals)
    found = find_runs(alarms, 0, 100)
    return weigh(component, found, found, alarms, concerns(bank))


def one_of_two(bank):
    """gps against baro is in alarm, gps against radar is quiet."""
    return {row(bank, "GPS.x", "BARO.x"): [(40, 60)]}


def both(bank):
    return {row(bank, "GPS.x", name): [(40, 60)] for name in ("BARO.x", "RADAR.x")}


def test_an_alarm_weighs_more_the_further_it_is_beyond_but_never_endlessly():
    peaks = [1.0, 3.0, 20.0, 1e6]
    score = [weight(both, peak=peak).score for peak in peaks]
    assert score[0] < score[1] < score[2] == score[3]
    assert score[0] == pytest.approx(2.0)
    assert score[1] == pytest.approx(2 * (1 + math.log(3)))


def test_a_quiet_test_that_could_have_seen_it_speaks_against():
    """Both comparisons answer to gps alike, and one of them is quiet."""

    def alike(bank):
        return np.ones((len(bank.generators), len(bank.system.faults)))

    def blind(bank):
        answer = alike(bank)
        answer[row(bank, "GPS.x", "RADAR.x")] = 1e-3
        return answer

    heard = weight(one_of_two, peak=9.0)  # sensitivities are not known
    saw = weight(one_of_two, peak=9.0, response=alike)
    could_not = weight(one_of_two, peak=9.0, response=blind)
    assert could_not.score > heard.score > saw.score
    assert could_not.score - saw.score == pytest.approx(QUIET)


def test_an_unknown_test_speaks_neither_for_nor_against():
    def unknown(bank):
        return {row(bank, "GPS.x", "RADAR.x"): [(0, 100)]}

    bank = bank_of(model(SHOWN))
    silent = weight(one_of_two, unknown=unknown(bank))
    assert silent.score == pytest.approx(1 + math.log(3))
    assert weight(one_of_two).score < silent.score


def test_evidence_of_its_own_is_what_holds_its_faults():
    found = weight(both)
    assert found.faults == ("GPS.x",)
    assert found.own == pytest.approx(found.score)
    assert not found.alone
    assert weight(both, component="camera_of_nobody").own == 0.0
