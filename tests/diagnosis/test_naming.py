"""Which component is accused, and what only follows: small systems with alarms set by hand.

``pairs`` builds the alarms of a failed component: every comparison of it with another one.
"""

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.diagnosis import diagnose
from fdi.diagnosis.answer import causes_of
from fdi.diagnosis.concerns import Tie, affected
from fdi.diagnosis.features import MOST, SIMULTANEOUS_S
from fdi.diagnosis.hypotheses import inquire
from fdi.diagnosis.likelihood import load_fitted
from fdi.diagnosis.naming import LINKED_S, POSSIBLE, name, possible
from fdi.residuals import Bank
from fdi.telemetry import Flight
from fdi.telemetry.ends import FlightEnd

from .build import CONFIRM_S, WEIGHTS, alarms_of, bank_of, limit_row, model, named, row

SHOWN = {
    "gps": ["x"],
    "baro": ["x"],
    "radar": ["x"],
    "estimator": ["y"],
    "camera": ["y"],
    "compass": ["z"],
    "sun": ["z"],
    "star": ["z"],
}
AFFECTS = {"gps": ["estimator"], "estimator": ["control"], "control": []}
bank_of = cache(bank_of)
BANK = bank_of(model(SHOWN, AFFECTS))
PAIR = bank_of(model({"baro": ["x"], "gps": ["x"]}))


def pairs(component, variable, *intervals, bank=BANK):
    """The alarms of every comparison that a component's channel of a variable takes part in."""
    own = f"{component.upper()}.{variable}"
    return {place: list(intervals) for place, g in enumerate(bank.generators) if own in g.faults}


def answer(raised, *, bank=BANK, **more):
    return diagnose(alarms_of(bank, raised, **more), bank)


ESTIMATOR = row(BANK, "ESTIMATOR.y", "CAMERA.y")


# Who is accused.


def test_component_that_all_alarms_share_is_the_one_accused():
    found = answer(pairs("gps", "x", (40, 60)), peak=20.0)
    (finding,) = found.findings
    assert (finding.component, finding.faults) == ("gps", ("GPS.x",))
    assert (finding.onset, finding.alarm, finding.end) == (40.0, 40.0 + CONFIRM_S, 60.0)
    assert finding.inseparable_from == ()
    assert 0.5 < finding.confidence < 1
    assert found.consequences == ()


LIMITED = model(
    {"monitor": ["ratio", "load"], "gps": ["x"], "baro": ["x"], "radar": ["x"]},
    {"gps": ["estimator"], "estimator": []},
    "limits:\n  rejected: {variable: ratio, max: 1, component: estimator, suspects: [gps, baro]}\n"
    "  overload: {variable: load, max: 2, component: estimator}\n",
)


def test_a_test_that_concerns_one_component_alone_accuses_it():
    """It stands for its component and not for the sensor that shows it."""
    bank = bank_of(LIMITED)
    (finding,) = answer({limit_row(bank, "overload"): [(40, 100)]}, bank=bank).findings
    assert (finding.component, finding.faults) == ("estimator", ("MONITOR.load",))
    assert finding.kind == "limit"
    assert finding.inseparable_from == ()
    assert finding.confidence > 0.95


def test_a_test_of_one_component_accuses_it_though_it_is_seldom_to_blame():
    bank = bank_of(LIMITED.replace("estimator: {affects", "estimator: {computed: true, affects"))
    found = answer({limit_row(bank, "overload"): [(40, 100)]}, bank=bank, peak=20.0)
    assert named(found.findings) == ["estimator"]


@pytest.mark.parametrize(("said", "follows"), [("computed: true, ", True), ("", False)])
def test_what_something_computed_tells_of_others_follows_from_what_disturbs_it(said, follows):
    """An estimator that a receiver has led astray finds fault with the compass."""
    text = model(
        SHOWN | {"estimator": ["y", "ratio"]},
        {"gps": ["estimator"]},
        "limits:\n  off: {variable: ratio, max: 1, component: compass}\n",
    )
    bank = bank_of(text.replace("estimator: {affects", f"estimator: {{{said}affects"))
    raised = pairs("gps", "x", (40, 60), bank=bank) | {limit_row(bank, "off"): [(55, 90)]}
    found = answer(raised, bank=bank, peak=20.0)
    assert named(found.findings) == (["gps"] if follows else ["gps", "compass"])
    assert named(found.consequences) == (["estimator"] if follows else [])


def test_two_that_cannot_be_told_apart_are_both_named():
    (finding,) = answer({0: [(40, 100)]}, bank=PAIR).findings
    assert (finding.component, finding.inseparable_from) == ("baro", ("gps",))
    assert finding.confidence < 0.5  # together they are more probable than nobody
    assert finding.rivals == (("gps", pytest.approx(finding.confidence)),)


def test_what_is_computed_is_asked_last():
    text = model({"estimator": ["x"], "gps": ["x"]}, {"estimator": [], "gps": []})
    bank = bank_of(text.replace("estimator: {affects", "estimator: {computed: true, affects"))
    (finding,) = answer({0: [(40, 100)]}, bank=bank, peak=10.0).findings
    assert (finding.component, finding.inseparable_from) == ("gps", ())


def test_weak_evidence_that_concerns_several_accuses_nobody():
    assert answer({0: [(40, 90)]}, bank=PAIR, peak=1.2).findings == ()
    assert answer({0: [(40, 90)]}, bank=PAIR, peak=9.0).findings != ()


@pytest.mark.parametrize(("end", "accuses"), [(44, False), (100, True)])
def test_what_is_soon_well_again_while_the_flight_goes_on_accuses_nobody(end, accuses):
    assert bool(answer({0: [(40, end)]}, bank=PAIR).findings) == accuses


def test_what_supports_accuses_nobody_and_is_told_with_who_is_accused():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({**SHOWN, "gps": ["x"]}, AFFECTS, more=more))
    level = row(bank, "GPS.x")
    assert answer({level: [(40, 100)]}, bank=bank, peak=20.0).findings == ()
    raised = {level: [(40, 100)], **pairs("gps", "x", (40, 100), bank=bank)}
    (finding,) = answer(raised, bank=bank).findings
    assert finding.component == "gps"
    assert bank.generators[level].id in finding.evidence.residuals


def test_suspect_with_evidence_of_its_own_is_accused_for_the_limit():
    bank = bank_of(LIMITED)
    raised = {limit_row(bank, "rejected"): [(40, 100)], **pairs("gps", "x", (41, 100), bank=bank)}
    (finding,) = answer(raised, bank=bank).findings
    assert (finding.component, finding.onset) == ("gps", 40.0)
    assert bank.generators[limit_row(bank, "rejected")].id in finding.evidence.residuals


def test_sensor_that_is_no_suspect_is_not_accused_for_the_limit():
    bank = bank_of(LIMITED)
    (finding,) = answer({limit_row(bank, "rejected"): [(40, 100)]}, bank=bank, peak=20.0).findings
    concerned = {finding.component, *(who for who, _ in finding.rivals)}
    assert concerned == {"estimator", "gps", "baro"}


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
    for who in ("gps", "baro"):
        text = text.replace(f"{who}: {{", f"{who}: {{group: {group}, ", 1)
    found = answer({0: [(40, 99)]}, bank=bank_of(text), ends=lost_at(lost), peak=20.0)
    assert bool(found.findings) is is_accused


# What follows, and what is asked anew.

FAR = "limits:\n  far: {variable: load, max: 9, component: gps}\n"


def test_alarm_of_a_disturbed_component_is_a_consequence():
    found = answer({**pairs("gps", "x", (40, 100)), ESTIMATOR: [(45, 100)]})
    assert named(found.findings) == ["gps"]
    (effect,) = found.consequences
    assert (effect.component, effect.faults) == ("estimator", ("ESTIMATOR.y",))
    assert (effect.onset, effect.because_of) == (45.0, 1)
    assert effect.text == "Estimator shows it 5.0 s after the gps"


def test_alarm_of_an_undisturbed_component_is_a_cause_of_its_own():
    found = answer({**pairs("gps", "x", (40, 100)), **pairs("sun", "z", (55, 100))})
    assert named(found.findings) == ["gps", "sun"]
    assert found.consequences == ()


@pytest.mark.parametrize("later", [0.0, 0.25, 1.0, 5.0])
def test_two_that_fail_at_about_the_same_moment_are_both_accused(later):
    raised = {**pairs("gps", "x", (40, 100)), **pairs("sun", "z", (40 + later, 100))}
    assert set(named(answer(raised, peak=20.0).findings)) == {"gps", "sun"}


def test_a_second_failure_is_accused_though_its_alarms_stood_beside_those_of_the_first():
    """A test of its own makes the gps the likelier by far at that moment."""
    bank = bank_of(model({**SHOWN, "monitor": ["load"]}, AFFECTS, FAR))
    raised = {limit_row(bank, "far"): [(40, 100)], **pairs("sun", "z", (40, 100), bank=bank)}
    assert set(named(answer(raised, bank=bank).findings)) == {"gps", "sun"}


@pytest.mark.parametrize("later", [0.25, 1.0, SIMULTANEOUS_S])
def test_who_disturbs_goes_before_what_is_disturbed_even_when_it_shows_a_little_later(later):
    found = answer({ESTIMATOR: [(40, 100)], **pairs("gps", "x", (40 + later, 100))})
    assert named(found.findings) == ["gps"]
    assert named(found.consequences) == ["estimator"]


def test_who_is_accused_first_follows_from_another_that_began_before_it_and_disturbs_it():
    """At 20 s the estimator, with more tests, is the likelier; what is left then is of the gps."""
    limits = [f"  {n}: {{variable: {n}, max: 9, component: estimator}}\n" for n in ("load", "heat")]
    bank = bank_of(
        model(
            {**SHOWN, "monitor": ["load", "heat", "lag"]},
            AFFECTS,
            "limits:\n" + ("".join(limits) + "  far: {variable: lag, max: 9, component: gps}\n"),
        )
    )
    raised = {key: [(20.25, 60)] for key in (limit_row(bank, "load"), limit_row(bank, "heat"))}
    raised |= pairs("estimator", "y", (20.25, 60), bank=bank)
    assert named(answer(raised, bank=bank).findings) == ["estimator"]
    found = answer({**raised, limit_row(bank, "far"): [(20, 23)]}, bank=bank)
    assert [(f.component, f.onset) for f in found.findings] == [("gps", 20.0)]
    assert [(c.component, c.because_of) for c in found.consequences] == [("estimator", 1)]


@pytest.mark.parametrize(
    ("later", "one"), [(0.0, True), (20.0, True), (55 + LINKED_S, True), (56 + LINKED_S, False)]
)
def test_a_whole_and_one_of_its_parts_are_one_finding_of_the_part(later, one):
    text = model(
        {"whole": ["x"], "baro": ["x"], "sky": ["x"], "part": ["y"], "sun": ["y"], "star": ["y"]},
        {"part": ["whole"]},
    ).replace("part: {", "part: {part_of: whole, ")
    bank = bank_of(text)
    raised = pairs("whole", "x", (20, 75), bank=bank)
    raised |= pairs("part", "y", (20 + later, 110), bank=bank)
    found = answer(raised, bank=bank, seconds=110, flights=(Flight(0, 110),))
    onsets = [(f.component, f.onset) for f in found.findings]
    assert onsets == ([("part", 20.0)] if one else [("whole", 20.0), ("part", 20.0 + later)])


def test_what_shows_clearly_before_all_that_disturbs_it_failed_by_itself():
    found = answer({ESTIMATOR: [(40, 100)], **pairs("gps", "x", (44, 100))})
    assert [(f.component, f.onset) for f in found.findings] == [("estimator", 40.0), ("gps", 44.0)]
    assert found.consequences == ()


def test_who_shares_no_alarm_with_the_accused_would_not_explain_it_as_well():
    """Nor is it a rival: what speaks for it does not speak against the other."""
    raised = {ESTIMATOR: [(40, 100)], **pairs("gps", "x", (44, 100))}
    first, second = answer(raised).findings
    assert (first.component, first.inseparable_from) == ("estimator", ("camera",))
    assert (second.component, second.inseparable_from) == ("gps", ())
    both = {**pairs("gps", "x", (40, 100)), **pairs("sun", "z", (40, 100))}
    assert [f.inseparable_from for f in answer(both, peak=20.0).findings] == [(), ()]


def test_of_two_that_disagree_the_one_that_disturbs_the_other_is_accused():
    bank = bank_of(model({"estimator": ["x"], "gps": ["x"]}, {"gps": ["estimator"]}))
    (finding,) = answer({0: [(40, 100)]}, bank=bank, peak=20.0).findings
    assert (finding.component, finding.inseparable_from) == ("gps", ())


def test_two_causes_with_a_long_pause_between_are_two_findings_in_order_of_onset():
    raised = {**pairs("compass", "z", (75, 90)), **pairs("gps", "x", (20, 55))}
    found = answer(raised, peak=20.0).findings
    assert [(f.rank, f.component, f.onset, f.end) for f in found] == [
        (1, "gps", 20.0, 55.0),
        (2, "compass", 75.0, 90.0),
    ]


@pytest.mark.parametrize("pause", [3, 14, LINKED_S])
def test_alarms_of_one_component_that_merely_pause_are_one_finding(pause):
    (found,) = answer(pairs("gps", "x", (20, 30), (30 + pause, 40 + pause)), peak=20.0).findings
    assert (found.component, found.onset, found.end) == ("gps", 20.0, 40.0 + pause)


@pytest.mark.parametrize(
    ("intervals", "onset", "earlier"),
    [
        (((10, 40), (60, 100)), 10.0, ()),  # a pause shorter than what was before it
        (((10, 20), (60, 100)), 60.0, ((10.0, 20.0),)),  # it had healed for long
        (((10, 50), (70, 100)), 10.0, ()),  # the longest is the first
    ],
)
def test_a_component_is_one_finding_dated_by_the_episode_that_lasts(intervals, onset, earlier):
    (finding,) = answer(pairs("gps", "x", *intervals), peak=20.0).findings
    assert (finding.component, finding.onset, finding.end) == ("gps", onset, None)
    assert finding.earlier == earlier


def test_the_episode_that_led_to_a_crash_dates_the_failure_though_a_longer_one_healed():
    ends = (FlightEnd(0, "impact", 99.0, 9.0),)
    raised = pairs("gps", "x", (10, 30), (90, 99))
    (finding,) = answer(raised, peak=20.0, ends=ends).findings
    assert (finding.onset, finding.earlier) == (90.0, ((10.0, 30.0),))


def test_that_it_shows_again_never_makes_it_less_sure_than_it_was():
    """The second time a single weak comparison shows it, by which it would be nobody's."""
    weak = row(BANK, "GPS.x", "BARO.x")
    raised = {**pairs("gps", "x", (10, 40)), weak: [(10, 40), (60, 95)]}
    (found,) = findings_with_a_weak_end(raised, weak, 41)
    (once,) = findings_with_a_weak_end(pairs("gps", "x", (10, 40)), weak, 41)
    assert (found.component, found.onset) == ("gps", 10.0)
    assert found.confidence >= once.confidence
    assert findings_with_a_weak_end({weak: [(60, 95)]}, weak, 41) == ()


def alarms_with_a_weak_end(raised, weak, since):
    """Alarms where one test only just reaches its threshold from a moment, s, on."""
    alarms = alarms_of(BANK, raised, peak=20.0)
    strength = alarms.strength.copy()
    strength[weak, 4 * since :] = np.minimum(strength[weak, 4 * since :], 1.0)
    return replace(alarms, strength=strength)


def findings_with_a_weak_end(raised, weak, since):
    return diagnose(alarms_with_a_weak_end(raised, weak, since), BANK).findings


def episodes_of(alarms):
    (inquiry,) = inquire(alarms)
    return inquiry, load_fitted()


@pytest.mark.parametrize(("pause", "own"), [(LINKED_S, True), (LINKED_S + 0.25, False)])
def test_what_comes_after_a_long_pause_is_asked_anew(pause, own):
    """A weak alarm of its own belongs to the cause; later it is another episode of it."""
    first = pairs("gps", "x", (20, 55))
    weak = row(BANK, "GPS.x", "BARO.x")
    raised = {**first, weak: [(20, 55), (55 + pause, 95)]}
    found = findings_with_a_weak_end(raised, weak, 56)
    assert named(found) == ["gps"]
    assert (found[0].onset, found[0].end) == (20.0, 95.0)
    assert len(causes_of(alarms_with_a_weak_end(raised, weak, 56))) == 1
    episodes, _ = name(*episodes_of(alarms_with_a_weak_end(raised, weak, 56)))
    assert len(episodes) == (1 if own else 2)


@pytest.mark.parametrize(("pause", "follows"), [(LINKED_S, True), (LINKED_S + 0.25, False)])
def test_what_is_disturbed_after_a_long_pause_does_not_follow(pause, follows):
    raised = {**pairs("gps", "x", (20, 55)), ESTIMATOR: [(55 + pause, 100)]}
    found = answer(raised, peak=20.0)
    assert found.findings[0].component == "gps"
    assert (named(found.consequences) == ["estimator"]) == follows
    assert len(found.findings) == (1 if follows else 2)


def test_passing_alarm_does_not_hide_what_fails_after_it():
    shown = {"gps": ["x"], "baro": ["x"], "engine": ["y"], "camera": ["y"]}
    bank = bank_of(model(shown, {"gps": ["engine"]}))
    passing, failing = row(bank, "GPS.x", "BARO.x"), row(bank, "ENGINE.y", "CAMERA.y")
    found = answer({passing: [(40, 44)], failing: [(60, 100)]}, bank=bank)
    assert named(found.findings) == ["engine"]
    assert found.consequences == ()


# When.


FLIGHT = Flight(5, 95, takeoff=30, impact=70)


@pytest.mark.parametrize(
    ("flight", "counts"),
    [
        (Flight(5, 95), [False, True, True]),  # begins in the air: nothing has settled
        (Flight(5, 95, takeoff=30), [False, True, True]),
        (Flight(5, 95, takeoff=30, landing=70), [False, True, False]),
        (Flight(5, 95, takeoff=30, impact=70), [False, True, False]),
    ],
)
def test_only_alarms_that_begin_in_the_air_accuse(flight, counts):
    for start, accuses in zip((10, 50, 80), counts, strict=True):
        found = answer(pairs("gps", "x", (start, start + 4)), flights=(flight,), peak=20.0)
        assert bool(found.findings) == accuses, start


@pytest.mark.parametrize(("start", "accuses"), [(30, True), (69.75, True), (70, False)])
def test_take_off_counts_and_the_moment_of_impact_does_not(start, accuses):
    found = answer(pairs("gps", "x", (start, start + 9)), flights=(FLIGHT,), peak=20.0).findings
    assert bool(found) == accuses


@pytest.mark.parametrize(("end", "accuses"), [(31, False), (39, True)])
def test_alarm_that_stands_at_take_off_counts_from_there_if_enough_of_it_is_left(end, accuses):
    found = answer(pairs("gps", "x", (10, end)), flights=(FLIGHT,), peak=20.0).findings
    assert [finding.onset for finding in found] == [30.0] * accuses


def test_finding_that_lasts_to_the_impact_has_no_end():
    (finding,) = answer(pairs("gps", "x", (60, 90)), flights=(FLIGHT,)).findings
    assert finding.end is None


def test_what_follows_an_impact_is_no_consequence():
    raised = {**pairs("gps", "x", (60, 69)), ESTIMATOR: [(72, 80)]}
    found = answer(raised, flights=(FLIGHT,))
    assert named(found.findings) == ["gps"]
    assert found.consequences == ()


def test_every_flight_is_diagnosed_by_itself():
    flights = (Flight(0, 45, takeoff=1), Flight(50, 100, takeoff=51))
    found = answer(pairs("gps", "x", (36, 44), (90, 99)), flights=flights).findings
    assert [(f.flight, f.onset) for f in found] == [(0, 36.0), (1, 90.0)]


def test_without_known_flights_the_whole_log_counts():
    assert named(answer(pairs("gps", "x", (40, 100)), flights=()).findings) == ["gps"]


def test_fault_of_a_component_that_is_accused_later_keeps_the_first_onset():
    """A test of it that was nobody's at first begins the finding it belongs to."""
    shown = {"gps": ["x", "y"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
    bank = bank_of(model(shown))
    raised = {**pairs("gps", "x", (52, 100), bank=bank), row(bank, "GPS.y", "SUN.y"): [(40, 100)]}
    found = answer(raised, bank=bank, peak=1.2)
    assert named(found.findings) == ["gps"]
    assert found.findings[0].onset == 40.0
    assert found.findings[0].alarm == 52.0 + CONFIRM_S


def test_a_standing_alarm_that_only_supports_begins_the_cause():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "radar": ["x"]}, more=more))
    (level,) = [
        i
        for i, g in enumerate(bank.generators)
        if set(g.faults) == {"GPS.x"} and bank.system.equations[g.residual].name == "level"
    ]
    later = {place: [(60, 100)] for place in pairs("gps", "x", bank=bank) if place != level}
    onsets = []
    for end in (100, 57):
        (finding,) = answer({**later, level: [(40, end)]}, bank=bank, peak=6.0).findings
        assert finding.component == "gps"
        onsets.append(finding.onset)
    assert onsets == [40.0, 60.0]


def test_policy_that_does_not_accuse_gives_the_grid_alone():
    alarms = alarms_of(BANK, pairs("gps", "x", (40, 100)))
    found = diagnose(replace(alarms, use=replace(alarms.use, accuse=False)), BANK)
    assert (found.findings, found.consequences, found.ruled_out) == ((), (), ())
    assert (found.grid.marks == 1).any()


# What is told.


def test_what_weighed_most_is_told_with_its_sign_the_strongest_first():
    (finding,) = answer(pairs("gps", "x", (40, 100)), peak=20.0).findings
    parts = [term.weight for term in finding.because]
    assert [term.feature for term in finding.because] == ["fit", "tests"]
    fit = 5.5 * 2 * np.log(MOST) / (1 + 2 * np.log(MOST))
    assert parts == pytest.approx([fit, 3.5 * np.log(3)])
    healed = answer(pairs("gps", "x", (20, 50)), peak=20.0).findings[0]
    against = min(term.weight for term in healed.because)
    assert against == pytest.approx(-0.75 * np.log(51), abs=0.01)
    assert [term.feature for term in healed.because if term.weight < 0] == ["healed"]


def test_rivals_are_all_others_that_could_have_made_it_the_likeliest_first():
    (finding,) = answer(pairs("gps", "x", (40, 100))).findings
    assert {who for who, _ in finding.rivals} == {"baro", "radar"}
    shares = [share for _, share in finding.rivals]
    assert shares == sorted(shares, reverse=True)
    assert finding.confidence + sum(shares) < 1


def test_whose_failure_is_improbable_at_every_moment_is_not_possible():
    bank = bank_of(model({**SHOWN, "lidar": ["x"]}, AFFECTS))
    (one,) = inquire(alarms_of(bank, pairs("gps", "x", (40, 100), bank=bank), peak=20.0))
    assert possible(one, WEIGHTS) == {"gps"}  # each other is in one of three tests
    (one,) = inquire(alarms_of(PAIR, {0: [(40, 100)]}, peak=1.0))
    assert possible(one, WEIGHTS) == {"gps", "baro"}  # nobody is accused, and each might be
    assert POSSIBLE < 0.5


# Over any alarms.

MOMENTS = st.integers(0, 60).map(lambda k: k * 1.5)
RAISED = st.dictionaries(
    st.integers(0, len(BANK.generators) - 1),
    st.tuples(MOMENTS, st.integers(2, 40)).map(lambda x: [(x[0], x[0] + x[1])]),
    max_size=6,
)
PEAK = st.sampled_from([1.0, 3.0, 20.0])
FEW = settings(max_examples=40, deadline=None)


@given(RAISED, PEAK)
@FEW
def test_every_alarm_is_of_one_cause_at_most_and_no_consequence_holds_runs_of_its_cause(
    raised, peak
):
    (one,) = inquire(alarms_of(BANK, raised, peak=peak))
    causes, effects = name(one, WEIGHTS)
    for before, cause in combinations(causes, 2):
        if cause.component == before.component:  # it paused for long
            assert cause.onset > before.end + LINKED_S
    own = [run for cause in causes for run in cause.runs]
    assert len(own) == len(set(own))
    following = [run for effect in effects for run in effect.runs]
    assert len(following) == len(set(following))
    assert not set(own) & set(following)
    for cause in causes:
        assert all(one.ties[cause.component][run.row] >= Tie.SUSPECTED for run in cause.runs)
        assert list(cause.runs) == sorted(cause.runs, key=lambda run: (run.onset, run.row))
        assert 0 < cause.probability <= WEIGHTS.most
    for effect in effects:
        assert effect.component in one.reach[effect.cause.component]
        assert all(effect.component in one.whom.of(run.row) for run in effect.runs)


@given(RAISED, PEAK)
@FEW
def test_nobody_is_accused_whom_no_alarm_concerns(raised, peak):
    found = answer(raised, peak=peak)
    concerned = {
        fault.split(".")[0].lower()
        for place, intervals in raised.items()
        for fault in BANK.generators[place].faults
        if intervals
    }
    told = found.findings
    assert {f.component for f in told} <= concerned
    assert {who for f in told for who, _ in f.rivals} <= concerned


@given(RAISED, PEAK, st.randoms())
@FEW
def test_order_of_the_tests_does_not_change_the_answer(raised, peak, random):
    order = list(range(len(BANK.generators)))
    random.shuffle(order)
    shuffled = Bank(BANK.system, BANK.nodes, tuple(BANK.generators[i] for i in order), ())
    found = answer(raised, peak=peak)
    turned = {order.index(place): own for place, own in raised.items()}
    other = answer(turned, bank=shuffled, peak=peak)
    for part in ("findings", "consequences"):
        said = [(x.component, set(x.faults), x.onset) for x in getattr(found, part)]
        assert [(x.component, set(x.faults), x.onset) for x in getattr(other, part)] == said
    assert named(other.ruled_out) == named(found.ruled_out)


@given(RAISED, PEAK)
@FEW
def test_findings_are_ordered_and_within_their_flight(raised, peak):
    found = answer(raised, flights=(FLIGHT,), peak=peak)
    assert [f.rank for f in found.findings] == list(range(1, len(found.findings) + 1))
    onsets = [f.onset for f in found.findings]
    assert onsets == sorted(onsets)
    for finding in found.findings:
        assert FLIGHT.takeoff <= finding.onset < FLIGHT.impact
        assert finding.onset <= finding.alarm
        assert finding.end is None or finding.onset < finding.end < FLIGHT.impact
        assert 0 < finding.confidence < 1
        assert finding.faults
        assert finding.component not in finding.inseparable_from
    for effect in found.consequences:
        cause = found.findings[effect.because_of - 1]
        assert effect.component in affected(cause.component, BANK.system.components)
        assert effect.onset >= cause.onset - SIMULTANEOUS_S


@given(RAISED, PEAK)
@FEW
def test_nobody_is_ruled_out_who_is_named_marked_or_possible(raised, peak):
    found = answer(raised, peak=peak)
    marks = zip(found.grid.components, found.grid.marks, strict=True)
    doubted = {component for component, own in marks if (own == 1).any()}
    doubted |= {who for f in found.findings for who in f.inseparable_from}
    doubted |= {who for f in found.findings for who, share in f.rivals if share >= POSSIBLE}
    assert not set(named(found.ruled_out)) & (
        doubted | set(named(found.findings + found.consequences))
    )


@pytest.mark.parametrize(("one", "other"), [*combinations(["gps", "baro", "sun", "camera"], 2)])
def test_swapped_names_of_components_swap_in_the_answer(one, other):
    swap = {one: other, other: one}
    turned = bank_of(
        model(
            {swap.get(who, who): names for who, names in SHOWN.items()},
            {swap.get(n, n): [swap.get(m, m) for m in to] for n, to in AFFECTS.items()},
        )
    )
    for start in (20, 40, 70):
        raised = {**pairs("gps", "x", (40, 60)), **pairs("sun", "z", (start, 100))}
        found = answer(raised, peak=20.0)
        # the place of a test among the others changes with the names: it goes by whom it holds
        again = answer(
            {_place(turned, place, swap): own for place, own in raised.items()},
            bank=turned,
            peak=20.0,
        )
        for part in ("findings", "consequences"):
            said = [(swap.get(n, n)) for n in named(getattr(found, part))]
            assert sorted(named(getattr(again, part))) == sorted(said)
        assert {swap.get(n, n) for n in named(found.ruled_out)} == set(named(again.ruled_out))
        assert [f.confidence for f in again.findings] == pytest.approx(
            [f.confidence for f in found.findings]
        )


def _place(bank, place, swap):
    faults = []
    for fault in BANK.generators[place].faults:
        who, _, shown = fault.partition(".")
        faults.append(f"{swap.get(who.lower(), who.lower()).upper()}.{shown}")
    return row(bank, *faults)
