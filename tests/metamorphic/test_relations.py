"""A few flights of every relation in each format; all of them: ``python -m metamorphic``."""

import pytest
from flights import EXAMPLES, SHARED, Case, labels

from .asking import ask
from .edits import joined, pieces, until
from .relations import RELATIONS, NotAskedError

pytestmark = pytest.mark.flights

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
LEAST = 10
COPTER, PLANE = "sitl/copter/c20_gps_glitch_11m.BIN", "sitl/plane/p20_engine_stop.BIN"
HEXA, PX4 = "motor_stop/hexa-x_m1.bin", "triplex/gps_fail/instance_0.ulg"
FEW = [
    *((name, flight) for name in ("prefix", "shift of times") for flight in (COPTER, PX4)),
    *(("another place", COPTER), ("another place", PX4), ("duplicates", PLANE)),
    *(("duplicates", PX4), ("garbage behind", PLANE), ("garbage behind", PX4)),
    *(("two formats", "sitl/plane/p20_engine_stop.tlog"), ("swapped motors", HEXA)),
    *(("swapped motors", "triplex/comm_fail/instance_0.ulg"), ("added noise", PLANE)),
    *(("lost records", COPTER), ("lost records", PX4)),
]


@needs_shared
@pytest.mark.parametrize(("relation", "flight"), FEW)
def test_relation_holds(relation, flight):
    assert ask(relation, flight).failure is None


@needs_shared
@pytest.mark.parametrize("relation", RELATIONS)
def test_every_relation_is_asked_of_enough_labelled_flights(relation):
    asked = RELATIONS[relation].flights
    assert len(set(asked)) == len(asked) >= LEAST
    assert set(asked) <= set(labels(SHARED))
    if relation != "two formats":
        assert {name.rpartition(".")[2].lower() for name in asked} == {"tlog", "bin", "ulg"}


@pytest.mark.parametrize(
    "path",
    [
        EXAMPLES / "copter_gps_loss_landing.tlog",
        *(pytest.param(SHARED / name, marks=needs_shared) for name in (COPTER, PX4)),
    ],
    ids=["tlog", "bin", "ulg"],
)
def test_records_joined_are_the_log_and_those_of_a_prefix_are_before_its_end(path):
    data = path.read_bytes()
    assert joined(pieces(data)) == data
    left = [piece.t for piece in pieces(until(30.0, data)) if piece.t is not None]
    assert 29.0 < max(left) < 30.0


@needs_shared
def test_an_answer_that_changes_is_a_failure_with_its_reason(monkeypatch):
    def breaks(case: Case, folder: object) -> None:
        del folder
        assert case.path.is_file()
        raise AssertionError("motor_1 instead of gps")

    monkeypatch.setitem(RELATIONS, "prefix", RELATIONS["prefix"]._replace(relation=breaks))
    assert ask("prefix", COPTER).failure == "motor_1 instead of gps"


@needs_shared
def test_a_relation_that_says_nothing_about_a_flight_is_told():
    with pytest.raises(NotAskedError):
        RELATIONS["swapped motors"].relation(Case(SHARED / PLANE, {}), SHARED)
    assert ask("swapped motors", PLANE).failure == ""
