"""What the tests of a flight did, and who could have made their alarms."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.hypotheses import OUTSIDE, SIMULTANEOUS_S, WINDOW_S, inquire
from fdi.telemetry import Flight
from fdi.telemetry.ends import FlightEnd

from .build import alarms_of, bank_of, model, row

SHOWN = {
    "gps": ["x"],
    "baro": ["x"],
    "radar": ["x"],
    "estimator": ["y"],
    "camera": ["y"],
    "sun": ["z"],
    "star": ["z"],
}
AFFECTS = {"gps": ["estimator"], "estimator": ["control"], "control": []}
BANK = bank_of(model(SHOWN, AFFECTS))
PAIR, OTHER = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")
DISTURBED, SKY = row(BANK, "ESTIMATOR.y", "CAMERA.y"), row(BANK, "SUN.z", "STAR.z")
WHOLE = st.integers(0, 80).map(float)
RAISED = st.dictionaries(
    st.sampled_from(range(len(BANK.generators))),
    st.lists(st.tuples(WHOLE, st.integers(2, 30)).map(lambda p: (p[0], p[0] + p[1])), max_size=2),
)


def inquiry(raised, *, bank=BANK, **more):
    (one,) = inquire(alarms_of(bank, raised, **more))
    return one


def column(case, name):
    return dict(zip(case.names, case.features[:, list(FEATURES).index(name)].tolist(), strict=True))


def test_who_is_held_by_what_alarms_is_a_candidate_and_who_is_disturbed_too_far_is_not():
    one = inquiry({DISTURBED: [(40, 60)]})
    assert one.case(40.0, one.runs).names == ("estimator", "camera")


@given(RAISED)
def test_nobody_is_a_candidate_of_whom_no_alarming_test_speaks(raised):
    one = inquiry(raised)
    for case in one.cases():
        here = [r for r in one.runs if r.end >= case.at and r.onset <= case.at + WINDOW_S]
        concerned = set().union(*(one.whom.of(run.row) for run in here))
        assert set(case.names) == concerned
        assert case.features.shape == (len(case.names), len(FEATURES))
        assert np.isfinite(case.features).all()


@given(RAISED)
def test_every_alarm_is_asked_about_unless_one_began_just_before(raised):
    one = inquiry(raised)
    asked = [case.at for case in one.cases()]
    assert asked == sorted(asked)
    assert all(b - a > SIMULTANEOUS_S for a, b in pairwise(asked))
    for run in one.runs:
        assert any(at <= run.onset <= at + SIMULTANEOUS_S for at in asked)


def test_what_lies_outside_the_model_is_no_candidate():
    bank = bank_of(model(SHOWN).replace("    component: sun\n", ""))
    assert OUTSIDE in bank.system.components
    (place,) = [i for i, g in enumerate(bank.generators) if "STAR.z" in g.faults]
    one = inquiry({place: [(40, 60)]}, bank=bank)
    assert one.case(40.0, one.runs).names == ("star",)


def tied(case):
    return dict(zip(case.names, case.ties.tolist(), strict=True))


def test_those_that_no_alarm_here_tells_apart_have_the_same_ties():
    one = inquiry({PAIR: [(40, 60)]})
    assert tied(one.case(40.0, one.runs)) == {"gps": [Tie.HELD], "baro": [Tie.HELD]}
    both = inquiry({PAIR: [(40, 60)], OTHER: [(40, 60)], SKY: [(80, 90)]})
    ties = tied(both.case(40.0, both.runs))  # to the two that stand here, in their order
    yes, no = Tie.HELD, Tie.NONE
    first = [yes, no] if PAIR < OTHER else [no, yes]
    assert ties == {"gps": [yes, yes], "baro": first, "radar": first[::-1]}


def test_without_an_alarm_there_is_nobody_to_be_tied():
    one = inquiry({})
    assert one.case(40.0, one.runs).ties.shape == (0, 0)


def lost_at(moment):
    return (FlightEnd(0, "impact", 99.0, 9.0, moment, None if moment is None else "lean"),)


def of_group(group, **more):
    bank = bank_of(
        model(SHOWN, AFFECTS).replace("gps: {affects", f"gps: {{group: {group}, affects")
    )
    one = inquiry({PAIR: [(40, 60)]}, bank=bank, **more)
    return one.case(40.0, one.runs).names


@pytest.mark.parametrize(
    ("group", "lost", "is_candidate"),
    [
        ("sensor", 39.0, False),
        ("sensor", 40.0 + SIMULTANEOUS_S, False),  # not clearly before control was lost
        ("sensor", 40.25 + SIMULTANEOUS_S, True),  # before: it may be why
        ("sensor", None, True),
        ("navigation", 39.0, False),
        ("navigation", 50.0, True),
        ("propulsion", 39.0, True),  # how a motor answers in the fall says what it is
    ],
)
def test_what_measures_is_no_candidate_on_what_began_after_control_was_lost(
    group, lost, is_candidate
):
    names = of_group(group, ends=lost_at(lost))
    assert names == (("gps", "baro") if is_candidate else ("baro",))


def test_what_measures_and_disagreed_before_control_was_lost_is_weighed_by_all_that_alarms():
    text = model(SHOWN, AFFECTS).replace("gps: {affects", "gps: {group: sensor, affects")
    raised = {PAIR: [(40, 60)], OTHER: [(48, 60)]}
    one = inquiry(raised, bank=bank_of(text), ends=lost_at(45.0))
    tests = column(one.case(40.0, one.runs), "tests")
    assert tests["gps"] == pytest.approx(np.log(3))
    assert tests["baro"] == pytest.approx(np.log(2))


@pytest.mark.parametrize(("overturned", "counts"), [(None, True), (40.25, True), (40.0, False)])
def test_what_begins_once_it_lies_on_its_back_accuses_nobody(overturned, counts):
    ends = (FlightEnd(0, "impact", 99.0, 9.0, overturned=overturned),)
    one = inquiry({PAIR: [(40, 60)], SKY: [(20, 90)]}, ends=ends)
    assert [run.row for run in one.runs] == [SKY, PAIR][: 1 + counts]


@pytest.mark.parametrize(("start", "counts"), [(50.0, True), (50.25, False), (30.0, True)])
def test_what_stands_or_begins_within_the_window_is_weighed_with_it(start, counts):
    one = inquiry({PAIR: [(40, 90)], SKY: [(start, 90)]})
    case = one.case(40.0, one.runs)
    assert ("sun" in case.names) == counts


@pytest.mark.parametrize(("end", "counts"), [(40.0, True), (39.75, False)])
def test_what_is_over_before_is_not_weighed_with_it(end, counts):
    one = inquiry({PAIR: [(40, 90)], SKY: [(20, end)]})
    assert ("sun" in one.case(40.0, one.runs).names) == counts


def test_an_alarm_that_began_before_counts_and_is_not_late():
    one = inquiry({SKY: [(20, 90)], PAIR: [(40, 90)]})
    late = column(one.case(40.0, one.runs), "late")
    assert (late["sun"], late["gps"]) == (0.0, 0.0)


def test_only_the_alarms_that_are_left_make_candidates():
    one = inquiry({SKY: [(40, 90)], PAIR: [(40, 90)]})
    left = [run for run in one.runs if run.row != PAIR]
    assert one.case(40.0, left).names == ("sun", "star")
    assert one.case(40.0, []).names == ()


def test_an_alarm_that_is_explained_already_is_no_quiet_test():
    """It says nothing for or against whoever is asked about next."""
    agree = row(BANK, "BARO.x", "RADAR.x")
    one = inquiry({PAIR: [(40, 90)], agree: [(60, 90)]}, unknown={OTHER: [(0, 100)]})
    left = [run for run in one.runs if run.row != PAIR]
    case = one.case(60.0, left)
    near, fit = column(case, "near"), column(case, "fit")
    assert near == {"baro": 0.0, "radar": 0.0}
    whole = pytest.approx(np.log(3) / (1 + np.log(3)))
    assert fit["baro"] == fit["radar"] == whole
    # one that is over by then is as quiet as any other
    over = inquiry({PAIR: [(40, 50)], agree: [(60, 90)]}, unknown={OTHER: [(0, 100)]})
    case = over.case(60.0, [run for run in over.runs if run.row != PAIR])
    fit = column(case, "fit")
    assert fit["radar"] == whole
    assert fit["baro"] == pytest.approx(np.log(3) / (1 + np.log(3) + 1))


def test_alarms_accuse_between_take_off_and_landing_only():
    flights = (Flight(0, 100, takeoff=30.0, landing=70.0),)
    one = inquiry({PAIR: [(10, 20)], SKY: [(40, 50)], DISTURBED: [(80, 90)]}, flights=flights)
    assert (one.start, one.end) == (30.0, 70.0)
    assert [run.row for run in one.runs] == [SKY]


def test_every_flight_has_its_own_alarms_and_its_own_end():
    flights = (Flight(0, 45, takeoff=1.0), Flight(50, 100, takeoff=51.0))
    ends = (FlightEnd(0, "landed", 45.0), FlightEnd(1, "impact", 99.0, 9.0))
    first, second = inquire(
        alarms_of(BANK, {PAIR: [(20, 30)], SKY: [(60, 70)]}, flights=flights, ends=ends)
    )
    assert [run.row for run in first.runs] == [PAIR]
    assert [run.row for run in second.runs] == [SKY]
    assert (first.flight, second.flight) == (0, 1)
    assert (first.ending, second.ending) == ends


def test_what_is_unknown_reaches_no_share_of_its_threshold():
    one = inquiry({PAIR: [(40, 60)]}, unknown={OTHER: [(0, 50)]})
    assert np.isnan(one.share[OTHER, :200]).all()
    assert np.isfinite(one.share[OTHER, 200:]).all()
    assert one.share[PAIR, 200] == 3.0


COMMANDED = """
equations:
  told: {text: "y = z", command: true, fault: gps.told, component: gps}
"""


def test_without_commands_drops_the_tests_that_read_them_and_nothing_else():
    bank = bank_of(model({"gps": ["x", "y"], "baro": ["x"], "sun": ["z"]}, more=COMMANDED))
    (told,) = [
        i
        for i, g in enumerate(bank.generators)
        if any(bank.system.equations[e].name == "told" for e in g.equations)
    ]
    plain = row(bank, "GPS.x", "BARO.x")
    one = inquiry({told: [(40, 60)], plain: [(45, 60)]}, bank=bank)
    bare = one.without_commands()
    assert one.command.tolist() == [i == told for i in range(len(bank.generators))]
    assert [run.row for run in one.runs] == [told, plain]
    assert [run.row for run in bare.runs] == [plain]
    assert np.isnan(bare.share[told]).all()
    assert np.array_equal(bare.share[plain], one.share[plain])
    assert [case.names for case in bare.cases()] == [("gps", "baro")]
    # what is not known neither speaks for nor against: it is no quiet test
    fits = column(bare.case(45.0, bare.runs), "fit")
    assert fits["gps"] == pytest.approx(np.log(3) / (1 + np.log(3)))
    assert bare.without_commands().runs == bare.runs


def test_the_ties_of_an_inquiry_are_those_of_its_concerns():
    one = inquiry({})
    assert one.ties["gps"][PAIR] == Tie.HELD
    assert one.ties["gps"][DISTURBED] == Tie.NONE
    assert one.ties["gps"][SKY] == Tie.NONE
    assert one.reach["gps"] == {"estimator", "control"}
