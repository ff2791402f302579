"""What passes or is hardly ever right is no failure; what lasts or many tests see may be one."""

from dataclasses import replace

import pytest

from fdi.diagnosis import diagnose, passing
from fdi.telemetry.ends import FlightEnd

from .build import alarms_of, bank_of, limit_row, model, named, row
from .test_ranking import BANK, answer, pairs

PAIR = bank_of(model({"gps": ["x"], "baro": ["x"]}))
(ONLY,) = range(len(PAIR.generators))
MOMENTARY = """
variables:
  v: {unit: m/s}
equations:
  rate: {text: "v = der(x)"}
  steady: {text: "v = 0", fault: gps.steady, component: gps, solves: []}
"""

FAR = """
limits:
  far: {variable: x, max: 9, component: gps}
"""


def accused(*interval, bank=PAIR, rows=(ONLY,), **more):
    return named(answer({place: [interval] for place in rows}, bank=bank, **more).findings)


@pytest.mark.parametrize(
    ("interval", "lasts"),
    [((40, 47), False), ((40, 48), True), ((85, 91), True), ((85, 89), False)],
)
def test_short_alarm_of_one_test_is_passing_if_the_flight_goes_on(interval, lasts):
    assert bool(accused(*interval)) == lasts


def test_short_alarm_of_a_test_that_is_unknown_from_then_on_is_not():
    """Unknown does not exonerate: nothing says that it is over."""
    assert accused(40, 44, unknown={ONLY: [(44, 100)]})
    assert accused(40, 44, unknown={ONLY: [(44, 91)]})
    assert not accused(40, 44, unknown={ONLY: [(44, 89)]})


def test_short_alarm_of_three_tests_is_not():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["x"]}))
    rows = [i for i, g in enumerate(bank.generators) if "GPS.x" in g.faults]
    assert len(rows) == 3
    assert accused(40, 44, bank=bank, rows=rows) == ["gps"]
    two = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")
    assert accused(40, 44, bank=BANK, rows=two) == []


def test_one_long_alarm_among_short_ones_counts():
    found = answer({ONLY: [(20, 23), (30, 39), (45, 48)]}, bank=PAIR).findings
    assert len(found) == 1
    assert found[0].onset == 20.0


def test_step_in_what_only_changes_show_is_not_passing():
    text = model({"gps": ["x"]}).replace("variables:\n", "variables:\n  v: {unit: m/s}\n")
    bank = bank_of(text + MOMENTARY.partition("equations:")[2].join(["equations:", ""]))
    (only,) = range(len(bank.generators))
    assert accused(40, 42, bank=bank, rows=(only,)) == ["gps"]


@pytest.mark.parametrize(
    ("back", "is_accused"), [(None, True), ((42, 44), False), ((45, 47), False), ((70, 72), True)]
)
def test_what_changes_and_comes_back_at_once_is_passing(back, is_accused):
    """One wild record, or a load for a moment, shows as a change and the opposite one."""
    text = model({"gps": ["x"]}).replace("variables:\n", "variables:\n  v: {unit: m/s}\n")
    bank = bank_of(text + MOMENTARY.partition("equations:")[2].join(["equations:", ""]))
    alarms = alarms_of(bank, {0: [(40, 42), *((back,) if back else ())]})
    t, values = alarms.residuals.t, alarms.residuals.values.copy()
    if back:
        values[0, (t >= back[0]) & (t < back[1])] *= -1
    alarms = replace(alarms, residuals=replace(alarms.residuals, values=values))
    assert bool(diagnose(alarms, bank).findings) is is_accused


def test_what_follows_from_a_passing_alarm_is_no_consequence():
    raised = {**pairs("gps", "x", (40, 44)), row(BANK, "ESTIMATOR.y", "CAMERA.y"): [(42, 46)]}
    found = answer(raised)
    assert all(f.component != "gps" for f in found.findings)
    assert alarms_of(BANK, raised).alarm.any()
    assert found.consequences == ()


def test_passing_alarm_does_not_hide_what_fails_after_it():
    """Alone it would be a cause; after a disturbance in the same episode it seemed its effect."""
    shown = {"gps": ["x"], "baro": ["x"], "engine": ["y"], "camera": ["y"]}
    bank = bank_of(model(shown, {"gps": ["engine"]}))
    passing, failing = row(bank, "GPS.x", "BARO.x"), row(bank, "ENGINE.y", "CAMERA.y")
    assert accused(44, 90, bank=bank, rows=(failing,)) == ["engine"]
    found = answer({passing: [(40, 44)], failing: [(44, 90)]}, bank=bank)
    assert named(found.findings) == ["engine"]
    assert found.consequences == ()


def test_cause_that_shares_its_beginning_with_one_that_is_dropped_gets_no_effect_of_that():
    """Two causes may begin with the same alarm; the effect of the dropped one had no cause then."""
    bank = bank_of(model({name: ["x"] for name in "abcde"}, {"a": ["c"]}))
    pair = {
        first + second: row(bank, f"{first.upper()}.x", f"{second.upper()}.x")
        for first, second in ("ab", "ad", "ae", "cd", "ce", "bd", "be", "bc")
    }
    begins = {"ab": 20, "ad": 32, "ae": 32, "cd": 33, "ce": 33.5, "bd": 46, "be": 46, "bc": 46}
    alarms = alarms_of(bank, {pair[k]: [(t, 90)] for k, t in begins.items()}, peak=1.2)
    strength = alarms.strength.copy()
    strength[[pair["bd"], pair["be"], pair["bc"]]] *= 5
    found = diagnose(replace(alarms, strength=strength), bank)
    assert "b" in named(found.findings)
    assert {c.because_of for c in found.consequences} <= {f.rank for f in found.findings}


@pytest.mark.parametrize(("peak", "counts"), [(1.35, False), (1.45, True)])
def test_what_is_hardly_more_than_noise_accuses_nobody(peak, counts):
    assert bool(answer(pairs("gps", "x", (40, 80)), peak=peak).findings) == counts


def test_what_is_hardly_ever_right_accuses_nobody(monkeypatch):
    (found,) = answer(pairs("gps", "x", (40, 80))).findings
    for least, accused in ((0.99 * found.confidence, ["gps"]), (1.01 * found.confidence, [])):
        monkeypatch.setattr(passing, "LEAST_CONFIDENCE", least)
        assert named(answer(pairs("gps", "x", (40, 80))).findings) == accused


def test_strong_suspicion_does_not_make_up_for_a_marginal_test_of_its_own():
    more = "equations:\n  e: {text: z = w, fault: radar.e, component: radar, suspects: [gps]}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "radar": ["z"], "sun": ["w"]}, more=more))
    own, other = row(bank, "GPS.x", "BARO.x"), row(bank, "RADAR.z", "SUN.w", "radar.e")
    raised = {own: [(40, 80)], other: [(40, 80)]}

    def found(peak):
        alarms = alarms_of(bank, raised)
        strength = alarms.strength.copy()
        strength[own] *= peak / 3.0
        return named(diagnose(replace(alarms, strength=strength), bank).findings)

    assert found(1.45) == ["gps"]
    assert "gps" not in found(1.35)


def test_what_the_model_states_itself_is_held_to_the_letter():
    bank = bank_of(model({"gps": ["x"]}) + FAR)
    assert accused(40, 80, bank=bank, rows=[limit_row(bank, "far")], peak=1.01) == ["gps"]


def lost_at(moment):
    return (FlightEnd(0, "impact", 99.0, 9.0, moment, None if moment is None else "lean"),)


@pytest.mark.parametrize(
    ("group", "lost", "is_accused"),
    [
        ("sensor", 50.0, True),  # before control was lost: it may be why
        ("sensor", 39.0, False),
        ("navigation", 39.0, False),
        ("sensor", None, True),
        ("propulsion", 39.0, True),  # how a motor answers in the fall says what it is
    ],
)
def test_a_sensor_that_disagrees_only_after_control_was_lost_is_no_failure(group, lost, is_accused):
    text = model({"gps": ["x"], "baro": ["x"]})
    bank = bank_of(
        text.replace("gps: {", f"gps: {{group: {group}, ").replace(
            "baro: {", f"baro: {{group: {group}, "
        )
    )
    assert bool(accused(40, 90, bank=bank, ends=lost_at(lost))) is is_accused
