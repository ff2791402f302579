"""No flight is judged by weights that its likes helped to fit."""

from pathlib import Path

import pytest

from fdi.diagnosis import diagnose
from fdi.diagnosis.answer import clearable
from fdi.diagnosis.hypotheses import inquire
from fdi.errors import UsageError
from fdi.evaluation import Fault, Label, fitting, unseen
from fdi.evaluation.fitting import Flown, lessons_of
from tests.diagnosis.build import WEIGHTS, alarms_of, bank_of, model, named, row

SHOWN = {name: ["x"] for name in ("gps", "baro", "radar")} | {"motor_1": ["y"], "motor_2": ["y"]}
BANK = bank_of(model(SHOWN, {"gps": ["estimator"], "estimator": []}))
GPS = {row(BANK, "GPS.x", f"{other}.x"): [(40, 100)] for other in ("BARO", "RADAR")}
MOTORS = row(BANK, "MOTOR_1.y", "MOTOR_2.y")
WAYS = {
    "recording": lambda one: {one.recording},
    "component": lambda one: {fault.component.partition("_")[0] for fault in one.label.faults},
    "origin": lambda one: {one.origin},
}


def alarms(raised, key="a"):
    return alarms_of(BANK, raised, peak=5.0 + "abcdefgh".index(key[0]))


def flown(key, raised, origin, *faults):
    label = Label(key, Path(key), "quad", "simulated", "diagnosis", faults, frozenset(), None)
    made = alarms(raised, key)
    return Flown(label, inquire(made), origin, tuple(named(clearable(made))))


def fleet():
    gps = Fault("gps", "step", 40.0)
    brief = {MOTORS: [(30, 33)]}
    return [
        flown("a.BIN", GPS, "here", gps),
        flown("a.tlog", GPS, "there", gps),  # the same flight, though it comes from elsewhere
        flown("b.BIN", GPS, "there", gps),
        flown("c.BIN", {MOTORS: [(40, 100)]}, "here", Fault("motor_1", "stop", 40.0)),
        flown("d.BIN", {MOTORS: [(40, 100)]}, "there", Fault("motor_2", "stop", 40.0)),
        flown("e.BIN", brief, "here"),
        flown("f.BIN", brief, "there"),
        flown("g.BIN", {}, "there"),
    ]


@pytest.fixture
def asked(monkeypatch):
    """By what every flight was judged: the lessons that the weights were fitted to."""
    fitted_to, judged = {}, []

    def fit(taught):
        found = fitting.fit(taught)
        fitted_to[id(found.fitted)] = (found, taught)
        return found

    def row_of(one, fitted, *, told=unseen.row_of):
        judged.append((one.label.key, fitted_to[id(fitted)][1]))
        return told(one, fitted)

    monkeypatch.setattr(unseen, "fit", fit)
    monkeypatch.setattr(unseen, "row_of", row_of)
    return judged


@pytest.mark.parametrize("way", WAYS)
def test_no_flight_helps_to_fit_the_weights_that_judge_it(way, asked, monkeypatch):
    flights = fleet()
    taught = lessons_of(flights)
    owner = {id(lesson): one for own, one in zip(taught, flights, strict=True) for lesson in own}
    monkeypatch.setattr(unseen, "lessons_of", lambda _: taught)
    found = unseen.unseen(flights, way)
    assert len(found.scores) == len(found.rows) == len(flights)
    assert len(asked) == 2 * len(flights)  # with and without the tests that read a command
    for key, used in asked:
        (judged,) = [one for one in flights if one.label.key == key]
        helped = {owner[id(lesson)].label.key for own in used for lesson in own}
        likes = {
            one.label.key
            for one in flights
            if WAYS[way](one) & WAYS[way](judged) or one.recording == judged.recording
        }
        assert key in likes
        teaching = {one.label.key for one in owner.values()}
        assert helped == teaching - likes


def test_every_way_of_leaving_out_is_asked_here():
    assert set(unseen.LEFT_OUT) == set(WAYS)


@pytest.mark.parametrize("way", WAYS)
def test_scores_and_rows_are_in_the_order_of_the_flights(way):
    flights = fleet()
    found = unseen.unseen(flights, way)
    assert [one.label for one in found.scores] == [one.label for one in flights]
    assert all(one.bare is not None for one in found.scores)


def test_flights_that_teach_nothing_without_their_likes_are_refused():
    """All faults are of one kind: without them nothing is known of faults."""
    flights = [one for one in fleet() if "motor" not in one.components]
    unseen.unseen(flights, "recording")
    with pytest.raises(UsageError, match="teach nothing"):
        unseen.unseen(flights, "component")


@pytest.mark.parametrize("raised", [GPS, {MOTORS: [(40, 100)]}, {**GPS, MOTORS: [(70, 100)]}, {}])
def test_a_row_says_what_the_diagnosis_says(raised, monkeypatch):
    from fdi.diagnosis import answer

    monkeypatch.setattr(answer, "load_fitted", lambda: WEIGHTS)
    found = diagnose(alarms(raised), BANK)
    row = unseen.row_of(flown("a.BIN", raised, "here"), WEIGHTS)
    assert [
        (one["rank"], one["component"], one["onset_s"], one["alarm_s"], one["confidence"])
        for one in row["findings"]
    ] == [(one.rank, one.component, one.onset, one.alarm, one.confidence) for one in found.findings]
    assert set(row["consequences"]) == set(named(found.consequences))
    assert row["ruled_out"] == named(found.ruled_out)
    assert row["airborne_s"] == 90.0
    assert row["error"] is None
