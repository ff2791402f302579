"""Advice follows from what is said of a flight, and is never surer than that."""

from dataclasses import replace
from typing import Any

import pytest
from report.build import small_log

from fdi.diagnosis import Ending, Evidence, Finding, NotTestable
from fdi.diagnosis.advising import about_check, about_ending, about_finding, about_untested
from fdi.methods.setup import Check, Setting
from fdi.telemetry import Log
from fdi.telemetry.ends import FlightEnd

from .build import bank_of, model

BANK = bank_of(model({"motor_1": ["x"], "gps": ["x"], "compass": ["x"]}))


def log_of(autopilot: str = "ardupilot", **parameters: float) -> Log:
    """Return a log of a quad by an autopilot with these parameters."""
    return replace(small_log(), autopilot=autopilot, vehicle="quad", parameters=parameters)


def finding(component: str = "motor_1", confidence: float = 0.99, **changes: Any) -> Finding:
    """Return an accusation that rests on no test of the bank."""
    made = Finding(
        rank=1,
        flight=0,
        component=component,
        faults=(),
        kind="unknown",
        onset=1.0,
        alarm=2.0,
        end=None,
        confidence=confidence,
        inseparable_from=(),
        evidence=Evidence("", (), ()),
        because=(),
        rivals=(),
    )
    return replace(made, **changes)


def end_of(how: str, **changes: Any) -> Ending:
    made = FlightEnd(flight=0, how=how, at=10.0, speed=None, lost_control=None)  # type: ignore[arg-type]
    return Ending(replace(made, **changes))


def test_a_sure_accusation_begins_with_the_commonest_cause() -> None:
    told = about_finding(finding(), log_of(), BANK)
    assert told[0].do.startswith("Look at the propeller of motor 1")
    assert any(one.do.startswith("Swap the ESC of motor 1") for one in told)


def test_what_to_record_comes_after_what_to_inspect() -> None:
    whens = [one.when for one in about_finding(finding(), log_of(), BANK)]
    first = whens.index("next flight")
    assert set(whens[:first]) == {"now"}
    assert set(whens[first:]) == {"next flight"}


def test_a_doubtful_accusation_begins_with_a_warning_and_how_to_tell() -> None:
    doubted = finding(confidence=0.63, rivals=(("gps", 0.1),))
    told = about_finding(doubted, log_of(), BANK)
    assert told[0].do == "Before you replace anything, make sure: this accusation is 63 % sure"
    assert told[0].why == "The next explanation is no part at all, 27 %"
    assert told[1].do.startswith("Swap the ESC")


def test_below_even_odds_nothing_is_to_be_replaced() -> None:
    doubted = finding(confidence=0.27, rivals=(("gps", 0.6),))
    told = about_finding(doubted, log_of(), BANK)
    assert told[0].do == "Replace nothing on this alone: it is only 27 % sure"
    assert told[0].why == "The next explanation is the gps, 60 %"


def test_equals_are_told_apart_first_however_sure_it_is() -> None:
    """The steps that tell are those of each equal, in the order of the finding."""
    tied = finding("gps", inseparable_from=("compass", "motor_1"))
    told = about_finding(tied, log_of(), BANK)
    assert told[0].do == "Before you replace anything, tell the gps from the compass and motor 1"
    assert [one.do.split()[0] for one in told[1:4]] == ["Let", "Turn", "Swap"]


@pytest.mark.parametrize(
    ("now", "is_told"), [(0.0, True), (1.0, False), (2.0, False), (3.0, False)]
)
def test_nobody_is_told_to_record_less_than_now(now: float, is_told: bool) -> None:
    """LOG_DISARMED 2 and 3 record while disarmed as well."""
    told = about_ending(end_of("impact"), False, log_of(LOG_DISARMED=now))
    settings = [one.parameter for one in told if one.parameter is not None]
    assert settings == ([Setting("LOG_DISARMED", now, 1.0)] if is_told else [])


@pytest.mark.parametrize(("autopilot", "word"), [("ardupilot", "SERVO_BLH"), ("px4", "DSHOT")])
def test_what_to_record_is_in_the_words_of_the_autopilot(autopilot: str, word: str) -> None:
    told = about_finding(finding(), log_of(autopilot), BANK)
    later = [one for one in told if one.when == "next flight"]
    assert len(later) == 1
    assert word in later[0].do


def test_a_mask_keeps_its_other_bits() -> None:
    told = about_finding(finding("compass"), log_of(LOG_BITMASK=5.0), BANK)
    (setting,) = (one.parameter for one in told if one.when == "next flight")
    assert setting == Setting("LOG_BITMASK", 5.0, 5.0 + 2**13)


def test_a_mask_that_nobody_tells_is_not_guessed() -> None:
    told = about_finding(finding("compass"), log_of(), BANK)
    assert [one.parameter for one in told if one.when == "next flight"] == [None]


def test_what_is_recorded_already_is_not_asked_for() -> None:
    told = about_finding(finding("compass"), log_of(LOG_BITMASK=2.0**13), BANK)
    assert all(one.when == "now" for one in told)


def test_a_part_of_an_own_model_has_the_advice_of_its_group() -> None:
    told = about_finding(finding("winch"), log_of(), bank_of(model({"winch": ["x"], "a": ["x"]})))
    assert any("winch" in one.do for one in told)
    assert all("{part}" not in one.do + one.why for one in told)


def test_a_crash_begins_with_leaving_everything_as_it_lies() -> None:
    told = about_ending(end_of("impact"), False, log_of())
    assert told[0].do.startswith("Disarm, keep clear of the propellers")


def test_motors_that_were_told_to_stop_ask_who_did() -> None:
    told = about_ending(end_of("control_lost", lost_control=9.0, lost_by="stop"), False, log_of())
    assert told[0].do.startswith("Read who stopped all motors")
    assert not any("propellers" in one.do for one in told)


def test_only_a_sound_flight_is_kept_as_a_reference() -> None:
    sound, other = (
        about_ending(end_of("landed"), is_sound, log_of()) for is_sound in (True, False)
    )
    assert sound[0].do.startswith("Keep this log as a reference")
    assert not [one for one in other if "reference" in one.do]


def test_who_has_the_radio_s_log_is_asked_for_the_autopilot_s() -> None:
    told = about_ending(end_of("in_air"), False, replace(log_of(), format="tlog"))
    assert any("analyse both together" in one.do for one in told)
    other = about_ending(end_of("in_air"), False, replace(log_of(), format="dataflash"))
    assert not any("analyse both together" in one.do for one in other)


def test_an_untested_part_is_tried_on_the_ground_and_recorded() -> None:
    wanted = "GPS_RAW_INT at 2 Hz or more (SRn_EXT_STAT)"
    told = about_untested(NotTestable("gps", "", wanted), log_of(), BANK.system.components)
    assert told[0].when == "now"
    assert f"Record {wanted}" in [one.do for one in told if one.when == "next flight"]


def test_a_check_in_order_asks_for_nothing() -> None:
    assert about_check(Check("compass 1", "in order", ""), log_of()) == ()


def test_a_wrong_check_names_the_parameter_first() -> None:
    setting = Setting("COMPASS_ORIENT", 0.0, 8.0, "It fits then")
    told = about_check(Check("compass 1", "wrong", "", settings=(setting,)), log_of())
    assert told[0].do.endswith("then set COMPASS_ORIENT from 0 to 8")
    assert told[0].why == "It fits then"
    assert told[0].parameter == setting


def test_a_parameter_that_only_the_vehicle_can_tell_is_shown_as_it_is() -> None:
    told = about_check(Check("motors", "wrong", ""), log_of(FRAME_TYPE=1.0))
    assert Setting("FRAME_TYPE", 1.0) in [one.parameter for one in told]


def test_an_older_parameter_goes_by_its_older_name() -> None:
    told = about_check(Check("motors", "wrong", ""), log_of(FRAME=1.0))
    assert Setting("FRAME", 1.0) in [one.parameter for one in told]


@pytest.mark.parametrize(
    ("parameters", "is_told"),
    [
        ({}, True),
        ({"LOG_BITMASK": 830.0, "LOG_DISARMED": 0.0}, True),
        ({"LOG_BITMASK": 830.0}, False),
    ],
)
def test_a_parameter_that_this_firmware_does_not_have_is_not_advised(
    parameters: dict[str, float], is_told: bool
) -> None:
    """Copter 3.1 records its parameters and knows no LOG_DISARMED; nothing told is not known."""
    told = about_ending(end_of("on_ground"), False, log_of(**parameters))
    names = [one.parameter.name for one in told if one.parameter]
    assert names == ["LOG_DISARMED"] * is_told
