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

from fdi.decision.accusing import WEIGHING_S
from fdi.diagnosis import diagnose
from fdi.diagnosis.ranking import affected
from fdi.model.parts import Component
from fdi.residuals import Bank
from fdi.telemetry import Flight

from .build import CONFIRM_S, alarms_of, bank_of, limit_row, model, named, row

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


def pairs(component, variable, *intervals, bank=BANK):
    """The alarms of every comparison that a component's channel of a variable takes part in."""
    own = f"{component.upper()}.{variable}"
    return {place: list(intervals) for place, g in enumerate(bank.generators) if own in g.faults}


def answer(raised, *, bank=BANK, **more):
    return diagnose(alarms_of(bank, raised, **more), bank)


ESTIMATOR = row(BANK, "ESTIMATOR.y", "CAMERA.y")


def test_component_that_all_alarms_share_is_the_one_accused():
    found = answer(pairs("gps", "x", (40, 60)))
    (finding,) = found.findings
    assert (finding.component, finding.faults) == ("gps", ("GPS.x",))
    assert (finding.onset, finding.alarm, finding.end) == (40.0, 40.0 + CONFIRM_S, 60.0)
    assert finding.inseparable_from == ()
    assert 0.5 < finding.confidence < 1
    assert found.consequences == ()


def test_alarm_of_a_disturbed_component_is_a_consequence():
    found = answer({**pairs("gps", "x", (40, 60)), ESTIMATOR: [(45, 60)]})
    assert named(found.findings) == ["gps"]
    (effect,) = found.consequences
    assert (effect.component, effect.faults) == ("estimator", ("ESTIMATOR.y",))
    assert (effect.onset, effect.because_of) == (45.0, 1)
    assert effect.text == "estimator shows it 5.0 s after gps"


def test_alarm_of_an_undisturbed_component_is_a_cause_of_its_own():
    found = answer({**pairs("gps", "x", (40, 60)), **pairs("sun", "z", (45, 60))})
    assert named(found.findings) == ["gps", "sun"]
    assert found.consequences == ()


def test_what_lies_upstream_is_preferred_even_when_it_shows_later():
    found = answer({ESTIMATOR: [(40, 60)], **pairs("gps", "x", (44, 60))})
    assert named(found.findings) == ["gps"]
    assert named(found.consequences) == ["estimator"]


def test_of_two_that_disagree_the_one_that_disturbs_the_other_is_accused():
    bank = bank_of(model({"estimator": ["x"], "gps": ["x"]}, {"gps": ["estimator"]}))
    (finding,) = answer({0: [(40, 60)]}, bank=bank).findings
    assert (finding.component, finding.inseparable_from) == ("gps", ())


def test_two_that_cannot_be_told_apart_are_both_named():
    bank = bank_of(model({"baro": ["x"], "gps": ["x"]}))
    (finding,) = answer({0: [(40, 60)]}, bank=bank).findings
    assert (finding.component, finding.inseparable_from) == ("baro", ("gps",))
    assert 0.4 < finding.grounds.share < 0.5  # somebody else, unseen, is never ruled out


def test_component_that_explains_nothing_does_not_win_over_one_that_does():
    """Four failures at once: each explains its own alarms only, and some must be accused."""
    raised = {
        **pairs("gps", "x", (40, 60)),
        **pairs("compass", "z", (40, 60)),
        ESTIMATOR: [(40, 60)],
    }
    assert set(named(answer(raised).findings)) >= {"gps", "compass"}


def test_more_failures_at_once_than_are_searched_together_still_accuse():
    """Six quantities, each with its odd one out: no three components explain all of it."""
    shown = {f"{kind}_{i}": [f"v{i}"] for i in range(6) for kind in ("a", "b", "c")}
    bank = bank_of(model(shown))
    raised = {}
    for i in range(6):
        raised |= pairs(f"a_{i}", f"v{i}", (40, 60), bank=bank)
    found = named(answer(raised, bank=bank).findings)
    assert found
    assert all(name.startswith("a_") for name in found)


def test_two_causes_in_two_episodes_are_two_findings_in_order_of_onset():
    raised = {**pairs("compass", "z", (70, 80)), **pairs("gps", "x", (20, 30))}
    found = answer(raised).findings
    assert [(f.rank, f.component, f.onset, f.end) for f in found] == [
        (1, "gps", 20.0, 30.0),
        (2, "compass", 70.0, 80.0),
    ]


@pytest.mark.parametrize(("pause", "findings"), [(3, 1), (10, 1), (14, 1), (16, 2), (30, 2)])
def test_alarms_of_one_component_that_merely_pause_are_one_finding(pause, findings):
    found = answer(pairs("gps", "x", (20, 30), (30 + pause, 40 + pause))).findings
    assert named(found) == ["gps"] * findings
    assert found[0].onset == 20.0
    assert found[-1].end == 40.0 + pause


def test_pause_between_two_components_merges_nothing():
    raised = {**pairs("gps", "x", (20, 30)), **pairs("compass", "z", (40, 50))}
    assert named(answer(raised).findings) == ["gps", "compass"]


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
        found = answer(pairs("gps", "x", (start, start + 9)), flights=(flight,))
        assert bool(found.findings) == accuses, start


@pytest.mark.parametrize(("start", "accuses"), [(30, True), (69.75, True), (70, False)])
def test_take_off_counts_and_the_moment_of_impact_does_not(start, accuses):
    found = answer(pairs("gps", "x", (start, start + 9)), flights=(FLIGHT,)).findings
    assert bool(found) == accuses


@pytest.mark.parametrize(("end", "accuses"), [(31, False), (39, True)])
def test_alarm_that_stands_at_take_off_counts_from_there_if_enough_of_it_is_left(end, accuses):
    found = answer(pairs("gps", "x", (10, end)), flights=(FLIGHT,)).findings
    assert [finding.onset for finding in found] == [30.0] * accuses


def test_finding_that_lasts_to_the_impact_has_no_end():
    (finding,) = answer(pairs("gps", "x", (60, 90)), flights=(FLIGHT,)).findings
    assert finding.end is None


def test_what_follows_an_impact_is_no_consequence():
    raised = {**pairs("gps", "x", (60, 69)), ESTIMATOR: [(72, 80)]}
    assert answer(raised, flights=(FLIGHT,)).consequences == ()


def test_every_flight_is_diagnosed_by_itself():
    flights = (Flight(0, 45, takeoff=1), Flight(50, 100, takeoff=51))
    found = answer(pairs("gps", "x", (36, 44), (52, 60)), flights=flights).findings
    assert [(f.flight, f.onset) for f in found] == [(0, 36.0), (1, 52.0)]


def test_without_known_flights_the_whole_log_counts():
    assert named(answer(pairs("gps", "x", (40, 60)), flights=()).findings) == ["gps"]


LIMITED = model(
    {"monitor": ["ratio", "load"], "gps": ["x"], "baro": ["x"], "radar": ["x"]},
    {"gps": ["estimator"], "estimator": []},
    "limits:\n  rejected: {variable: ratio, max: 1, component: estimator, suspects: [gps, baro]}\n"
    "  overload: {variable: load, max: 2, component: estimator}\n",
)


def test_limit_stands_for_its_component_and_not_for_the_sensor_that_shows_it():
    bank = bank_of(LIMITED)
    (finding,) = answer({limit_row(bank, "overload"): [(40, 60)]}, bank=bank).findings
    assert (finding.component, finding.faults) == ("estimator", ("MONITOR.load",))
    assert finding.kind == "limit"
    assert finding.inseparable_from == ()


def test_suspect_with_evidence_of_its_own_is_accused_for_the_limit():
    bank = bank_of(LIMITED)
    raised = {limit_row(bank, "rejected"): [(40, 60)], **pairs("gps", "x", (41, 60), bank=bank)}
    (finding,) = answer(raised, bank=bank).findings
    assert (finding.component, finding.onset) == ("gps", 40.0)
    assert bank.generators[limit_row(bank, "rejected")].id in finding.evidence.residuals


def test_sensor_that_is_no_suspect_is_not_accused_for_the_limit():
    bank = bank_of(LIMITED)
    raised = {limit_row(bank, "rejected"): [(40, 60)], **pairs("radar", "x", (48, 60), bank=bank)}
    found = answer(raised, bank=bank).findings
    assert "radar" not in {found[0].component, *found[0].inseparable_from}


def test_fault_of_a_component_that_was_chosen_later_keeps_the_first_onset():
    """Two faults of one component; the stronger is found first, the earlier one began it."""
    shown = {"gps": ["x", "y"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
    bank = bank_of(model(shown, {"gps": ["control"], "control": []}))
    raised = {
        **pairs("gps", "x", (41, 60), bank=bank),
        row(bank, "GPS.y", "SUN.y"): [(40, 60)],
    }
    found = answer(raised, bank=bank)
    assert named(found.findings) == ["gps"]
    assert found.findings[0].onset == 40.0


def test_policy_that_does_not_accuse_gives_the_grid_alone():
    alarms = alarms_of(BANK, pairs("gps", "x", (40, 60)))
    found = diagnose(replace(alarms, use=replace(alarms.use, accuse=False)), BANK)
    assert (found.findings, found.consequences, found.ruled_out) == ((), (), ())
    assert (found.grid.marks == 1).any()


def test_affected_reaches_through_others_and_ends_in_a_circle():
    chain = {"a": ["b"], "b": ["c"], "c": ["a", "ghost"], "d": []}
    components = {name: Component(name, affects=tuple(to)) for name, to in chain.items()}
    assert affected("a", components) == {"b", "c", "ghost"}
    assert affected("d", components) == set()


# Over any alarms.

MOMENTS = st.integers(0, 60).map(lambda k: k * 1.5)
RAISED = st.dictionaries(
    st.integers(0, len(BANK.generators) - 1),
    st.tuples(MOMENTS, st.integers(2, 20)).map(lambda x: [(x[0], x[0] + x[1])]),
    max_size=6,
)
FEW = settings(max_examples=40, deadline=None)


@given(RAISED, st.randoms())
@FEW
def test_order_of_the_tests_does_not_change_the_answer(raised, random):
    order = list(range(len(BANK.generators)))
    random.shuffle(order)
    shuffled = Bank(BANK.system, BANK.nodes, tuple(BANK.generators[i] for i in order), ())
    found = answer(raised)
    other = answer({order.index(place): own for place, own in raised.items()}, bank=shuffled)
    for part in ("findings", "consequences"):
        said = [(x.component, set(x.faults), x.onset) for x in getattr(found, part)]
        assert [(x.component, set(x.faults), x.onset) for x in getattr(other, part)] == said
    assert named(other.ruled_out) == named(found.ruled_out)
    assert np.array_equal(other.grid.marks, found.grid.marks)


@given(RAISED)
@FEW
def test_findings_are_ordered_and_within_their_flight(raised):
    found = answer(raised, flights=(FLIGHT,))
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
        assert effect.onset >= cause.onset - WEIGHING_S


@given(RAISED)
@FEW
def test_nobody_is_ruled_out_who_is_named_or_marked(raised):
    found = answer(raised)
    marked = {
        component
        for component, marks in zip(found.grid.components, found.grid.marks, strict=True)
        if (marks == 1).any()
    }
    suspected = {name for f in found.findings for name in f.inseparable_from}
    out = set(named(found.ruled_out))
    assert not out & (marked | suspected | set(named(found.findings + found.consequences)))


@given(RAISED)
@FEW
def test_first_alarm_of_a_flight_is_never_left_unexplained_when_one_test_is_all_a_pair_has(raised):
    """A test whose faults have no other test cannot be outvoted by quiet ones."""
    found = answer({ESTIMATOR: [(10, 20)]} | {k: v for k, v in raised.items() if k != ESTIMATOR})
    assert found.findings


@pytest.mark.parametrize(("one", "other"), [*combinations(["gps", "baro", "sun", "camera"], 2)])
def test_swapped_names_of_components_swap_in_the_answer(one, other):
    swap = {one: other, other: one}
    turned = bank_of(
        model(
            {swap.get(name, name): names for name, names in SHOWN.items()},
            {swap.get(n, n): [swap.get(m, m) for m in to] for n, to in AFFECTS.items()},
        )
    )
    for start in (20, 40, 41):
        raised = {**pairs("gps", "x", (40, 60)), **pairs("sun", "z", (start, 70))}
        found, again = answer(raised), answer(raised, bank=turned)
        for part in ("findings", "consequences"):
            said = [(swap.get(n, n)) for n in named(getattr(found, part))]
            assert sorted(named(getattr(again, part))) == sorted(said)
        assert {swap.get(n, n) for n in named(found.ruled_out)} == set(named(again.ruled_out))
        assert [f.confidence for f in again.findings] == pytest.approx(
            [f.confidence for f in found.findings]
        )


def test_a_cause_began_with_the_alarm_that_only_supports_it():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    shown = {"gps": ["x"], "baro": ["x"], "radar": ["x"]}
    bank = bank_of(model(shown, more=more))
    (level,) = [
        i
        for i, g in enumerate(bank.generators)
        if set(g.faults) == {"GPS.x"} and bank.system.equations[g.residual].name == "level"
    ]
    later = pairs("gps", "x", (60, 90), bank=bank)
    (finding,) = answer({**later, level: [(40, 90)]}, bank=bank).findings
    assert (finding.component, finding.onset) == ("gps", 40.0)
    (finding,) = answer({**later, level: [(40, 57)]}, bank=bank).findings
    assert finding.onset == 60.0
