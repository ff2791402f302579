"""What would not have helped, by parameters, of the vehicles and the firmware they hold for."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis.advice_book import load_book
from fdi.diagnosis.safety_net import mistakes, safety_net
from fdi.telemetry import log_from_columns

T = np.arange(0.0, 10.0, 0.5)


def gaps(values, *, vehicle="quad", autopilot="ardupilot", firmware="ArduCopter V4.6.3", **more):
    log = log_from_columns({"t": T, "A.x": T}, {})
    log = replace(
        log, parameters=values, vehicle=vehicle, autopilot=autopilot, firmware=firmware, **more
    )
    return safety_net(log)


def told(values, **options):
    return [(gap.word, gap.parameter) for gap in gaps(values, **options)]


def test_every_rule_names_a_page_and_says_when_it_applies():
    book = load_book()
    assert len(book.net) > 30
    for rule in book.net.values():
        assert book.sources[rule.source].address.startswith("https://")
        assert (
            bool(rule.is_) + bool(rule.lacks) + bool(rule.bits) + (rule.lacks_bit is not None) == 1
        )


@pytest.mark.parametrize(
    ("values", "vehicle", "right"),
    [
        ({"FS_THR_ENABLE": 0}, "quad", [("risk", "FS_THR_ENABLE")]),
        ({"FS_THR_ENABLE": 1}, "quad", []),
        ({"FS_THR_ENABLE": 0}, "plane", []),  # there it is another parameter
        ({"THR_FAILSAFE": 0}, "plane", [("risk", "THR_FAILSAFE")]),
        ({"THR_FAILSAFE": 2}, "vtol", [("risk", "THR_FAILSAFE")]),
        ({"FS_THR_ENABLE": 0}, "rover", [("risk", "FS_THR_ENABLE")]),
        ({"FS_LEAK_ENABLE": 0}, "sub", [("risk", "FS_LEAK_ENABLE")]),
        ({"ARMING_CHECK": 0}, "plane", [("risk", "ARMING_CHECK")]),
        ({"ARMING_CHECK": 1}, "quad", []),
        ({"ARMING_CHECK": 40}, "quad", [("note", "ARMING_CHECK")]),
        ({"ARMING_CHECK": 41}, "quad", []),  # bit 0 is all of them
        ({"ARMING_SKIPCHK": 0}, "quad", []),
        ({"ARMING_SKIPCHK": 4}, "quad", [("note", "ARMING_SKIPCHK")]),
        ({"ARMING_SKIPCHK": -1}, "quad", [("risk", "ARMING_SKIPCHK")]),
        ({"FS_THR_ENABLE": 0}, "other", [("risk", "FS_THR_ENABLE")]),  # ArduCopter of a tricopter
        ({"BATT_FS_LOW_ACT": 0, "BATT_MONITOR": 4}, "quad", [("risk", "BATT_FS_LOW_ACT")]),
        ({"BATT_FS_LOW_ACT": 0, "BATT_MONITOR": 0}, "quad", [("note", "BATT_MONITOR")]),
        ({"FENCE_ENABLE": 1, "FENCE_ACTION": 0}, "quad", [("risk", "FENCE_ACTION")]),
        ({"FENCE_ENABLE": 0, "FENCE_ACTION": 0}, "quad", [("note", "FENCE_ENABLE")]),
        ({"FENCE_ENABLE": 0, "FENCE_AUTOENABLE": 3}, "quad", []),  # on while it is armed
        ({"BATT_FS_CRT_ACT": 0, "BATT_FS_LOW_ACT": 2}, "quad", []),  # it came down before
        ({"BATT_FS_CRT_ACT": 0}, "quad", [("note", "BATT_FS_CRT_ACT")]),
        (
            {"BATT_FS_CRT_ACT": 1, "BATT_CRT_VOLT": 0, "BATT_CRT_MAH": 0},
            "quad",
            [("risk", "BATT_CRT_VOLT")],
        ),
        ({"BATT_CRT_VOLT": 0, "BATT_CRT_MAH": 500}, "quad", []),
        ({"BATT2_FS_LOW_ACT": 0, "BATT2_MONITOR": 4}, "quad", [("note", "BATT2_FS_LOW_ACT")]),
        ({"BATT_CAPACITY": 0, "BATT_MONITOR": 4}, "quad", [("note", "BATT_CAPACITY")]),
        ({"BATT_CAPACITY": 0, "BATT_MONITOR": 8}, "quad", []),  # the battery tells its charge
        ({"FLIGHT_OPTIONS": 1}, "quad", [("note", "FLIGHT_OPTIONS")]),
        ({"FLIGHT_OPTIONS": 2}, "quad", []),  # the yaw imbalance is only warned of anyway
        ({"FLIGHT_OPTIONS": 1}, "plane", []),  # there it is another option
        ({"FS_DR_ENABLE": 0}, "quad", [("note", "FS_DR_ENABLE")]),
        ({"CRASH_DETECT": 0}, "plane", [("note", "CRASH_DETECT")]),
        ({"ARSPD_USE": 0, "ARSPD_TYPE": 2}, "plane", [("note", "ARSPD_USE")]),
        ({"ARSPD_USE": 0, "ARSPD_TYPE": 0}, "plane", []),
        ({"FS_LONG_ACTN": 0, "THR_FAILSAFE": 1}, "plane", [("note", "FS_LONG_ACTN")]),
        ({"FS_LONG_ACTN": 0, "THR_FAILSAFE": 1, "FS_SHORT_ACTN": 1}, "plane", []),
        ({"ARMING_REQUIRE": 0}, "plane", [("risk", "ARMING_REQUIRE")]),
        ({"ARMING_REQUIRE": 0}, "quad", []),
        ({"FS_EKF_THRESH": 0}, "rover", [("risk", "FS_EKF_THRESH")]),
        ({"FS_LEAK_ENABLE": 1}, "sub", [("risk", "FS_LEAK_ENABLE")]),  # warns only
        ({"FS_LEAK_ENABLE": 2}, "sub", []),
        ({"FS_GCS_ENABLE": 1}, "sub", [("note", "FS_GCS_ENABLE")]),
        ({"FS_GCS_ENABLE": 1}, "quad", []),  # there it comes home
        ({"FS_PILOT_INPUT": 0, "FS_THR_ENABLE": 1}, "sub", []),
        ({"FS_EKF_ACTION": 2}, "rover", [("risk", "FS_EKF_ACTION")]),
        ({"COMPASS_USE": 0, "COMPASS_USE2": 0, "COMPASS_USE3": 0}, "plane", []),
        ({"COMPASS_USE": 0, "COMPASS_USE2": 1, "COMPASS_USE3": 0}, "quad", []),
        (
            {"COMPASS_USE": 0, "COMPASS_USE2": 0, "COMPASS_USE3": 0, "EK3_SRC1_YAW": 1},
            "quad",
            [("risk", "COMPASS_USE")],
        ),
        ({"COMPASS_USE": 0, "COMPASS_USE2": 0, "COMPASS_USE3": 0, "EK3_SRC1_YAW": 2}, "quad", []),
        ({}, "quad", []),
    ],
)
def test_a_setting_counts_for_whom_it_matters(values, vehicle, right):
    program = {"plane": "ArduPlane", "vtol": "ArduPlane", "rover": "ArduRover", "sub": "ArduSub"}
    firmware = f"{program.get(vehicle, 'ArduCopter')} V4.6.3"
    assert told(values, vehicle=vehicle, firmware=firmware) == right
    if vehicle != "other":
        assert told(values, vehicle=vehicle, firmware=None) == right


@pytest.mark.parametrize(
    ("firmware", "right"),
    [
        ("ArduCopter V4.7.0 (8264a9b4)", [("risk", "FS_EKF_ACTION")]),
        ("ArduCopter V4.10.0", [("risk", "FS_EKF_ACTION")]),
        ("ArduCopter V4.6.3", []),  # there 0 lands
        (None, []),
    ],
)
def test_what_holds_for_some_versions_is_said_of_those(firmware, right):
    assert told({"FS_EKF_ACTION": 0}, firmware=firmware) == right


@pytest.mark.parametrize(("value", "on"), [(0, False), (1, True), (2, False), (3, True)])
def test_a_watchdog_is_on_by_its_bit(value, on):
    assert told({"BRD_OPTIONS": value}) == ([] if on else [("note", "BRD_OPTIONS")])


@pytest.mark.parametrize(
    ("options", "right"),
    [(1, [("note", "FS_OPTIONS")]), (6, [("note", "FS_OPTIONS")]), (2, []), (0, [])],
)
def test_a_mask_counts_by_its_bits(options, right):
    assert told({"FS_OPTIONS": options}) == right
    assert told({"FS_OPTIONS": options}, firmware=None) == []


@pytest.mark.parametrize(
    ("firmware", "source", "right"),
    [
        ("PX4 1.12.3", 0, True),
        ("PX4 1.12.3", 1, False),  # flown by a ground station's sticks
        ("PX4 1.15.0", 0, True),
        ("PX4 1.15.0", 1, True),
        ("PX4 1.15.0", 4, False),  # no sticks at all
    ],
)
def test_radio_that_is_lost_counts_where_px4_is_flown_by_it(firmware, source, right):
    values = {"NAV_RCL_ACT": 0, "COM_RC_IN_MODE": source}
    found = told(values, autopilot="px4", firmware=firmware)
    assert found == ([("risk", "NAV_RCL_ACT")] if right else [])


def test_frames_are_those_of_copters():
    values = {"FRAME_CLASS": 2, **outputs(33, 34, 35, 36, 0, 0, 0, 0)}
    assert told(values, vehicle="boat", firmware="ArduRover V4.5.0") == []


def test_px4_has_its_own():
    values = {"COM_LOW_BAT_ACT": 0, "NAV_DLL_ACT": 0, "FS_THR_ENABLE": 0, "NAV_RCL_ACT": 2}
    assert told(values, autopilot="px4", firmware="PX4 1.15.0") == [
        ("risk", "COM_LOW_BAT_ACT"),
        ("note", "NAV_DLL_ACT"),
    ]


def test_a_motor_on_two_outputs_is_a_mistake_and_a_fact():
    values = {f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 5)} | {"SERVO9_FUNCTION": 36.0}
    assert told(values | {"SERVO10_FUNCTION": 36.0})[-1] == ("mistake", "SERVO10_FUNCTION")
    (gap,) = gaps(values)
    assert (gap.word, gap.parameter) == ("mistake", "SERVO9_FUNCTION")
    assert gap.words() == (
        "SERVO9_FUNCTION is 36: a second output of motor 4, as SERVO4_FUNCTION is; rarely meant so"
    )
    log = replace(log_from_columns({"t": T, "A.x": T}, {}), parameters=values)
    (fact,) = mistakes(replace(log, autopilot="ardupilot"))
    assert not fact.is_wrong
    assert told(values, autopilot="px4") == []


def test_the_gravest_stand_first():
    values = {"FENCE_ENABLE": 0, "FS_THR_ENABLE": 0, "SERVO1_FUNCTION": 33, "SERVO2_FUNCTION": 33}
    assert [gap.word for gap in gaps(values)] == ["mistake", "risk", "note"]


def test_a_filter_that_follows_speeds_that_nobody_tells():
    values = {"INS_HNTCH_ENABLE": 1, "INS_HNTCH_MODE": 3}
    assert told(values, format="dataflash") == [("risk", "INS_HNTCH_MODE")]
    assert told(values, format="tlog") == []  # a link leaves out what is there
    assert told(values | {"INS_HNTCH_ENABLE": 0}, format="dataflash") == []


@pytest.mark.parametrize("key", ["ESC", "ESC[8]", "ESC_TELEMETRY_1_TO_4"])
def test_any_controller_that_tells_its_speed_is_enough_for_such_a_filter(key):
    values = {"INS_HNTCH_ENABLE": 1, "INS_HNTCH_MODE": 3}
    log = log_from_columns({"t": T, f"{key}.rpm": T}, {})
    log = replace(log, parameters=values, vehicle="quad", autopilot="ardupilot", format="dataflash")
    assert safety_net(log) == ()


def outputs(*functions):
    return {f"SERVO{n}_FUNCTION": value for n, value in enumerate(functions, 1)}


@pytest.mark.parametrize(
    ("frame", "functions", "right"),
    [
        (1, (33, 34, 35, 36, 0, 0, 0, 0), ""),
        (1, (33, 34, 0, 36, 0, 0, 0, 0), "motor 3 of this frame has no output"),
        (2, (33, 34, 35, 36, 0, 0, 0, 0), "motor 5 and motor 6 of this frame have no output"),
        (1, (33, 34, 0, 36), ""),  # the link lost the rest
        (1, (0, 0, 0, 0, 0, 0, 0, 0), ""),  # another way to drive them
        (7, (33, 34, 0, 36, 0, 0, 0, 0), ""),  # a tricopter has none
    ],
)
def test_a_motor_without_an_output_is_a_mistake(frame, functions, right):
    found = gaps({"FRAME_CLASS": frame, **outputs(*functions)})
    assert [gap.means for gap in found] == ([right] if right else [])
    assert {gap.word for gap in found} <= {"mistake"}


@pytest.mark.parametrize(
    ("spoken", "used", "device", "form", "right"),
    [
        ((1,), 1, 658953, "dataflash", ["COMPASS_USE2"]),
        ((1, 2), 1, 658953, "dataflash", []),
        ((1,), 0, 658953, "dataflash", []),
        ((1,), 1, 0, "dataflash", []),
        ((1,), 1, 658953, "tlog", []),
        ((), 1, 658953, "dataflash", []),  # no compass is recorded at all
    ],
)
def test_a_compass_in_use_that_says_nothing_is_a_risk(spoken, used, device, form, right):
    keys = ("RAW_IMU", "SCALED_IMU2")
    fields = {f"{keys[n - 1]}.{axis}": T for n in spoken for axis in ("xmag", "ymag", "zmag")}
    log = log_from_columns({"t": T, "A.x": T, **fields}, dict.fromkeys(fields, "T"))
    values = {"COMPASS_USE": 1, "COMPASS_PRIO1_ID": 658945, "COMPASS_USE2": used}
    values["COMPASS_PRIO2_ID"] = device
    log = replace(log, parameters=values, vehicle="quad", autopilot="ardupilot", format=form)
    assert [gap.parameter for gap in safety_net(log)] == right
