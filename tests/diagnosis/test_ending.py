"""A flight that ended badly: it leads the verdict, and what was first stands in order."""

import numpy as np
import pytest

from fdi.diagnosis import diagnose
from fdi.diagnosis.values import MOST_LETTERS
from fdi.telemetry import Event, Flight
from fdi.telemetry.ends import FlightEnd

from .build import alarms_of, bank_of, model, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
GPS = [row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")]
SKY = row(BANK, "SUN.y", "STAR.y")
CRASH = (Flight(0, 100, takeoff=5.0, impact=90.0, impact_speed=12.9),)
BLOW = (FlightEnd(0, "impact", 90.0, 12.9),)


def answer(raised, *, ends=BLOW, flights=CRASH, **more):
    return diagnose(alarms_of(BANK, raised, ends=ends, flights=flights, **more), BANK)


def test_a_crash_that_nobody_explains_is_never_health():
    found = answer({})
    assert found.outlook == "ended badly"
    assert found.verdict == (
        "Hit the ground at 12.9 m/s (log 90.0 s); no component explains it. No test left health "
        "in the 10 s before."
    )


def test_a_crash_leads_with_the_end_and_then_names_who_failed():
    found = answer({place: [(80, 90)] for place in GPS})
    assert found.outlook == "accused"
    assert found.verdict.startswith(
        "Hit the ground at 12.9 m/s (log 90.0 s). Gps failed first (93 % sure), 1 min"
    )


def test_what_led_to_the_end_is_named_before_what_healed():
    healed = {SKY: [(20, 65)]}
    both = answer({**healed, **{place: [(80, 90)] for place in GPS}}, peak=20.0)
    assert [finding.component for finding in both.findings] == ["gps", "sun"]
    assert [finding.rank for finding in both.findings] == [1, 2]
    assert "Gps failed (95 % sure)" in both.verdict  # the sun had before: it was not the first
    landed = (Flight(0, 100, takeoff=5.0, landing=90.0),)
    well = answer(
        {**healed, **{place: [(80, 90)] for place in GPS}},
        ends=(FlightEnd(0, "landed", 90.0),),
        flights=landed,
        peak=20.0,
    )
    assert [finding.component for finding in well.findings] == ["sun", "gps"]


@pytest.mark.parametrize(("seconds", "is_told"), [(0.25, False), (0.5, True)])
def test_a_single_sample_beyond_a_threshold_is_noise_and_two_are_told(seconds, is_told):
    (ending,) = answer({SKY: [(83, 83 + seconds)]}).endings
    assert [one.at for one in ending.first] == [83.0] * is_told


def test_what_was_first_stands_in_the_order_of_time():
    events = [
        Event(60.0, "mode", "LOITER"),  # long before
        Event(82.0, "mode", "LAND"),
        Event(84.0, "failsafe", "Battery Failsafe"),
        Event(85.0, "text", "chatter", 6),
        Event(95.0, "failsafe", "after the end"),
    ]
    (ending,) = answer({SKY: [(83, 85)]}, events=events).endings
    assert [(one.at, one.kind, one.component) for one in ending.first] == [
        (82.0, "command", None),
        (83.0, "alarm", "sun"),
        (84.0, "event", None),
    ]


def test_it_is_counted_from_when_control_was_lost():
    lost = (FlightEnd(0, "impact", 90.0, 12.9, 70.0, "lean"),)
    found = answer({SKY: [(65, 67)]}, ends=lost)
    assert "20.0 s after control was lost" in found.verdict
    assert [one.at for one in found.endings[0].first] == [65.0]
    assert answer({SKY: [(83, 84)]}, ends=lost).endings[0].first == ()


def test_commands_stand_among_what_was_first_and_what_is_merely_mentioned_does_not():
    events = [
        Event(81.0, "arm", "whatever"),
        Event(82.0, "disarm", "whatever"),
        Event(83.0, "text", "a warning", 4),
        Event(84.0, "text", "a notice", 5),
        Event(85.0, "sensor", "compass lost", 3),
        Event(86.0, "text", "of unknown weight"),
    ]
    stopped = (FlightEnd(0, "impact", 90.0, 12.9, 88.0, "stop"),)
    (ending,) = answer({}, ends=stopped, events=events).endings
    assert [(one.at, one.kind, one.text) for one in ending.first] == [
        (81.0, "command", "armed"),
        (82.0, "command", "disarmed"),
        (83.0, "event", "a warning"),
        (85.0, "event", "compass lost"),
        (88.0, "command", "all motors are told to stop"),
    ]


@pytest.mark.parametrize(("takeoff", "told"), [(None, []), (82.0, ["armed", "flight mode AUTO"])])
def test_what_a_log_that_begins_in_the_air_says_first_is_a_state_and_no_command(takeoff, told):
    events = [Event(82.4, "arm", ""), Event(82.4, "mode", "AUTO"), Event(84.0, "mode", "LAND")]
    flights = (Flight(82.0, 100, takeoff=takeoff, impact=90.0, impact_speed=12.9),)
    (ending,) = answer({}, events=events, flights=flights).endings
    assert [one.text for one in ending.first] == [*told, "flight mode LAND"]


def test_a_test_that_left_health_before_its_alarm_is_told_once_from_then_on():
    alarms = alarms_of(BANK, {SKY: [(85, 88)]}, ends=BLOW, flights=CRASH)
    state = alarms.state.copy()
    state[SKY, 4 * 82 : 4 * 83] = 1
    (ending,) = answer({SKY: [(85, 88)]}, state=state).endings
    assert [(one.at, one.kind) for one in ending.first] == [(82.0, "alarm")]


def test_a_centred_window_that_feels_a_change_before_it_dates_nothing_earlier():
    delay = np.full(len(BANK.generators), 2.0)
    (ending,) = answer({SKY: [(85, 88)]}, delay_s=delay).endings
    assert [one.at for one in ending.first] == [86.5]  # as the alarm that it becomes


def test_what_a_fall_out_of_control_looks_like_leads_the_verdict():
    for lost_by, said in (
        ("stop", "All motors were told to stop in the air (log 80.0 s), and the flight ends"),
        ("lean", "Control was lost (log 80.0 s), and the flight ends 10.0 s later"),
    ):
        end = (FlightEnd(0, "control_lost", 90.0, None, 80.0, lost_by),)
        assert answer({}, ends=end).verdict.startswith(said)


@pytest.mark.parametrize("how", ["landed", "in_air"])
def test_a_flight_that_ends_well_has_nothing_that_was_first(how):
    found = answer({SKY: [(83, 84)]}, ends=(FlightEnd(0, how, 90.0),))
    assert found.endings[0].first == ()


def test_a_vehicle_whose_propulsion_nothing_tests_is_no_healthy_one():
    """There is no motor in this model: nobody can say that all is well."""
    assert answer({}, ends=(FlightEnd(0, "landed", 90.0),)).outlook == "untested"


def test_a_failsafe_is_told_and_is_no_health():
    said = [Event(50.0, "failsafe", "Battery Failsafe")]
    found = answer({}, ends=(FlightEnd(0, "failsafe", 90.0),), events=said)
    assert found.outlook == "alarms"
    assert found.verdict.startswith(
        'The autopilot reported "Battery Failsafe" 50.0 s into the log.'
    )


FLYING = (Flight(0, 100, takeoff=5.0),)


def test_a_log_that_ends_in_the_air_says_so_whoever_is_accused_of_nothing():
    """A power failure looks like that, and so does a recording that was cut off."""
    found = answer({}, ends=(FlightEnd(0, "in_air", 90.0),), flights=FLYING)
    head = "The recording stops in flight (log 90.0 s). No component is accused"
    assert found.verdict.startswith(head)
    assert found.outlook == "untested"


def test_a_failsafe_does_not_hide_that_the_log_ends_in_the_air():
    said = [Event(50.0, "failsafe", "Battery Failsafe")]
    end = (FlightEnd(0, "failsafe", 90.0),)
    cut = answer({}, ends=end, flights=FLYING, events=said).verdict
    assert 'reported "Battery Failsafe" 50.0 s into the log. The recording stops in flight' in cut
    landed = (Flight(0, 100, takeoff=5.0, landing=90.0),)
    assert "ends in the air" not in answer({}, ends=end, flights=landed, events=said).verdict


def test_a_long_report_of_the_autopilot_cuts_no_sentence_off():
    said = [Event(50.0, "failsafe", "Failsafe " + 60 * "x")]
    end = (FlightEnd(0, "failsafe", 90.0),)
    found = answer({SKY: [(40, 41)]}, ends=end, flights=FLYING, events=said)
    assert len(found.verdict) <= MOST_LETTERS
    assert "The recording stops in flight" in found.verdict
    assert found.verdict.endswith("well enough.")


def test_moments_beyond_a_threshold_are_not_called_health():
    alarms = alarms_of(BANK, {}, ends=(FlightEnd(0, "landed", 90.0),), flights=CRASH)
    state = alarms.state.copy()
    state[SKY, 100:104] = 1  # a second, too short for an alarm
    brief = diagnose(alarms_of(BANK, {}, flights=CRASH, state=state), BANK)
    assert "stayed within" not in brief.verdict
    assert "1 of 4 tests left what health explains" in brief.verdict
    assert "stayed within" in diagnose(alarms, BANK).verdict


def test_what_ends_the_log_is_not_cleared_by_a_log_that_ends_in_the_air():
    bank = bank_of(model(SHOWN).replace("baro: {", "baro: {ends_log: true, "))
    landed = (Flight(0, 100, takeoff=5.0, landing=90.0),)
    air = (Flight(0, 100, takeoff=5.0),)
    for flights, how, cleared in ((landed, "landed", True), (air, "in_air", False)):
        alarms = alarms_of(bank, {}, flights=flights, ends=(FlightEnd(0, how, 90.0),))
        assert ("baro" in [one.component for one in diagnose(alarms, bank).ruled_out]) == cleared


def test_after_a_bad_end_it_is_said_that_the_last_seconds_are_not_cleared():
    for flights, how, late in (
        ((Flight(0, 100, takeoff=5.0, landing=90.0),), "landed", ""),
        ((Flight(0, 100, takeoff=5.0),), "in_air", " until 10 s before the end"),
    ):
        alarms = alarms_of(BANK, {}, flights=flights, ends=(FlightEnd(0, how, 90.0),))
        texts = [one.text for one in diagnose(alarms, BANK).ruled_out]
        assert texts
        assert all(text.endswith(f"would have shown{late}") for text in texts)


def test_a_test_that_is_silent_or_triggered_in_the_last_seconds_clears_nobody():
    whole = answer({}, ends=(FlightEnd(0, "landed", 90.0),))
    assert "sun" in [one.component for one in whole.ruled_out]
    silent = answer({}, ends=(FlightEnd(0, "landed", 90.0),), unknown={SKY: [(86, 90)]})
    assert "sun" not in [one.component for one in silent.ruled_out]
    alarms = alarms_of(BANK, {}, flights=CRASH)
    state = alarms.state.copy()
    state[SKY, 4 * 88] = 1
    brief = diagnose(alarms_of(BANK, {}, flights=CRASH, state=state), BANK)
    assert "sun" not in [one.component for one in brief.ruled_out]


def test_a_test_that_scatters_more_than_at_first_clears_nobody():
    alarms = alarms_of(BANK, {}, flights=CRASH)
    rng = np.random.default_rng(1)
    noise = rng.normal(size=alarms.state.shape)
    for factor, cleared in ((1.0, True), (5.0, False)):
        values = 0.1 * noise
        values[SKY, 240:] *= factor
        residuals = alarms_of(BANK, {}, flights=CRASH).residuals
        made = alarms_of(BANK, {}, flights=CRASH, residuals=_with(residuals, values))
        assert ("sun" in [one.component for one in diagnose(made, BANK).ruled_out]) == cleared


def _with(residuals, values):
    from dataclasses import replace

    return replace(residuals, values=values)


def test_no_verdict_is_longer_than_a_person_reads():
    long = bank_of(model({"a" * 70: ["x"], "b" * 70: ["x"], "c" * 70: ["x"]}))
    alarms = alarms_of(long, {0: [(80, 90)], 1: [(80, 90)]}, flights=CRASH, ends=BLOW)
    assert len(diagnose(alarms, long).verdict) <= MOST_LETTERS


def test_what_begins_on_its_back_is_no_cause():
    """Motors of a vehicle that was rolled over answer as they never do in flight."""
    air = (Flight(0, 100, takeoff=5.0),)
    for raised, accused in ((69.0, True), (71.0, False)):
        end = (FlightEnd(0, "control_lost", 100.0, None, 70.0, "lean", overturned=70.0),)
        found = answer({place: [(raised, 90)] for place in GPS}, ends=end, flights=air)
        assert bool(found.findings) == accused


def test_what_shows_after_control_was_lost_is_not_said_to_have_been_first():
    lost = (FlightEnd(0, "impact", 90.0, 12.9, 70.0, "lean"),)
    raised = {place: [(80, 90)] for place in GPS}
    assert "Gps is accused (93 % sure), " in answer(raised, ends=lost).verdict
    assert (
        "Gps failed first (93 % sure), " in answer({p: [(65, 90)] for p in GPS}, ends=lost).verdict
    )


def test_a_crash_leads_also_where_who_is_accused_failed_in_another_flight_or_healed():
    two = (Flight(0, 45, takeoff=2.0, landing=44.0), Flight(50, 100, takeoff=52.0, impact=90.0))
    ends = (FlightEnd(0, "landed", 44.0), FlightEnd(1, "impact", 90.0, 12.9))
    raised = {place: [(20, 40)] for place in GPS}
    for found in (answer(raised, ends=ends, flights=two), answer(raised, peak=20.0)):
        assert found.verdict.startswith("Hit the ground at 12.9 m/s (log 90.0 s); no component ")
        assert "Before that, gps probably failed first (" in found.verdict
    crash = (FlightEnd(0, "impact", 44.0, 12.9), FlightEnd(1, "landed", 90.0))
    again = {place: [(60, 80)] for place in GPS}
    found = answer(again, ends=crash, flights=two)
    assert found.verdict.startswith("Hit the ground at 12.9 m/s (log 44.0 s); no component ")
    assert "After that, gps" in found.verdict
