"""Who loops, rolls and flies by hand is no fault: the same deviation with and without it.

A healthy flight is rewritten: it lies on its back for some seconds, a pilot holds the throttle, its
battery gains voltage. Each is held against the same log without what excuses it.
"""

import math

import pytest
from flights import GROUND, examples, joined, records, shared

from fdi import analyze

pytestmark = pytest.mark.flights

PLANE = shared("sitl/plane/p02_rect_wind_land.tlog")
COPTER = [p for p in examples() if p.id == "copter_gps_loss_landing"]
UPSET_S, AFTER_S = (40.0, 44.0), (44.0, 48.0)
FAR = math.radians(40)
STEEP = math.radians(50)
MANUAL = 0  # of ArduPlane: surfaces and throttle are the pilot's


def triggered(case, edits, tmp_path):
    """Return which statements the violated tests of a rewritten flight end in, and the accused.

    ``edits``: by the name of a message, what changes it, given it and the time in the log, s.
    """
    own = records(case.path)
    changed = []
    for one in own:
        if one.name in edits and one.system != GROUND:
            at = (one.stamp - own[0].stamp) * 1e-6
            one = one.edited(lambda message, at=at, do=edits[one.name]: do(message, at))
        changed.append(one)
    path = tmp_path / "flight.tlog"
    path.write_bytes(joined(changed))
    document = analyze(path).document()
    tests = {name for r in document["residuals"] if r["triggered"] for name in r["equations"]}
    return tests, {finding["component"] for finding in document["findings"]}


def leans_back(message, at):
    if UPSET_S[0] <= at < UPSET_S[1]:
        message.roll = math.pi - 0.1


def is_off(message, at):
    if AFTER_S[0] <= at < AFTER_S[1]:
        message.roll += FAR


def leans_back_and_is_off_afterwards(message, at):
    leans_back(message, at)
    is_off(message, at)


@pytest.mark.parametrize("case", PLANE)
def test_a_second_estimator_may_be_off_for_a_while_after_a_roll(case, tmp_path):
    upright, _ = triggered(case, {"AHRS2": is_off}, tmp_path)
    rolled, accused = triggered(
        case, {"AHRS2": leans_back_and_is_off_afterwards, "ATTITUDE": leans_back}, tmp_path
    )
    assert "att_7" in upright
    assert "att_7" not in rolled, accused


def shows_less(message, at):
    if at >= UPSET_S[0]:
        message.airspeed *= 0.8


def climbs_steeply(message, at):
    if at >= UPSET_S[0]:
        message.pitch = STEEP


@pytest.mark.parametrize("case", PLANE)
def test_a_velocity_through_the_air_is_not_asked_of_a_steep_nose(case, tmp_path):
    """Its heading is nearly none, and what the angle of attack adds turns with it."""
    level, _ = triggered(case, {"VFR_HUD": shows_less}, tmp_path)
    steep, accused = triggered(case, {"VFR_HUD": shows_less, "ATTITUDE": climbs_steeply}, tmp_path)
    assert "airspeed_jumped" in level
    assert steep.isdisjoint({"airspeed_jumped", "airspeed_scaled"}), accused


def by(millivolts):
    """Return the edits by which a battery gains or loses voltage for good."""

    def changes(message, at):
        if at >= 30.0:
            if message.get_type() == "SYS_STATUS":
                message.voltage_battery += millivolts
            else:
                message.voltages = [message.voltages[0] + millivolts, *message.voltages[1:]]

    return {"SYS_STATUS": changes, "BATTERY_STATUS": changes}


@pytest.mark.parametrize("case", COPTER)
def test_a_battery_that_gains_voltage_has_not_failed(case, tmp_path):
    lower, accused = triggered(case, by(-1500), tmp_path)
    assert "bat_3" in lower
    assert "battery" in accused
    higher, accused = triggered(case, by(1500), tmp_path)
    assert "bat_3" not in higher
    assert "battery" not in accused


def by_hand(message, at):
    message.custom_mode = MANUAL


BY_HAND = [
    pytest.param(*case.values, statement, id=statement, marks=case.marks)
    for name, statement in (
        ("alfa/engine_failure.tlog", "engine_at_idle"),
        ("sitl/plane/p37_rudder_hardover.tlog", "side_force_in_straight_flight"),
    )
    for case in shared(name)
]


@pytest.mark.parametrize(("case", "statement"), BY_HAND)
def test_what_a_pilot_may_do_is_asked_of_the_autopilot_alone(case, statement, tmp_path):
    steered, _ = triggered(case, {}, tmp_path)
    held, accused = triggered(case, {"HEARTBEAT": by_hand}, tmp_path)
    assert statement in steered
    assert statement not in held, accused
