from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.model import load_airframe
from fdi.model.hints import Hint, _absent, _tested, recorded_as, setting_of, would_test
from fdi.model.lacking import Fallen, lacking_words
from fdi.model.placement import place
from fdi.telemetry import Channel, read
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.inputs import Input
from tests.flights import EXAMPLES, SHARED

from .test_system import stub_log

SHARED_ONLY = pytest.mark.skipif(not SHARED.is_dir(), reason="no flights beside the repository")


@pytest.fixture(scope="module")
def flight():
    return read(EXAMPLES / "copter_motor_failure_crash.tlog")


def hint_of(component: str, airframe, log) -> Hint | None:
    return would_test([component], airframe, log).get(component)


def without(log, *messages):
    return replace(log, messages={k: m for k, m in log.messages.items() if k not in messages})


def test_a_missing_message_of_the_component_itself_would_test_it(flight):
    log = without(flight, "GPS_RAW_INT")
    words = str(hint_of("gps", load_airframe("quadcopter"), log))
    assert words == "GPS_RAW_INT at 2 Hz or more would test it (SRn_EXT_STAT)"


@pytest.mark.parametrize(
    ("types", "asked"),
    [
        ({}, True),  # nobody knows
        ({"RNGFND1_TYPE": 1.0}, True),
        ({"RNGFND1_TYPE": 0.0, "RNGFND2_TYPE": 4.0}, True),
        ({"RNGFND1_TYPE": 0.0, "RNGFND2_TYPE": 0.0}, False),
        ({"RNGFND_TYPE": 0.0}, False),
    ],
)
def test_a_sensor_that_is_not_on_board_is_not_asked_for(flight, types, asked):
    others = {k: v for k, v in flight.parameters.items() if not k.startswith("RNGFND")}
    log = replace(without(flight, "DISTANCE_SENSOR"), parameters=others | types)
    hint = hint_of("rangefinder", load_airframe("quadcopter"), log)
    assert (hint is not None) == asked


@pytest.mark.parametrize(("profile", "asked"), [(1.0, False), (3.0, False), (2.0, True)])
def test_a_topic_whose_profile_is_logged_is_not_asked_for(flight, profile, asked):
    log = replace(without(flight, "GPS_RAW_INT"), format="ulog", autopilot="px4")
    log = replace(log, parameters={"SDLOG_PROFILE": profile})
    assert (hint_of("gps", load_airframe("quadcopter"), log) is not None) == asked


def test_of_several_missing_messages_all_are_named_that_are_needed(flight):
    """Outputs bring the motors; nothing else that is missing is asked for."""
    log = without(flight, "SERVO_OUTPUT_RAW", "MOTORS", "VIBRATION", "WIND")
    words = str(hint_of("motor_1", load_airframe("quadcopter"), log))
    assert words == "SERVO_OUTPUT_RAW at 2 Hz or more would test it (SRn_RC_CHAN)"


def test_what_could_not_be_made_of_a_message_is_no_lack_of_it(flight):
    """Outputs whose wiring is not known are not known better for being sent again."""
    log = without(flight, "MOTORS")
    words = str(hint_of("motor_1", load_airframe("quadcopter"), log))
    assert words.startswith("ESC_TELEMETRY_1_TO_4 at 2 Hz or more would test it")
    warnings = load_airframe("quadcopter").observe(log).warnings
    (line,) = (x for x in warnings if "motor" in x and "ESC_TELEMETRY" not in x)
    assert line.startswith("SERVO_OUTPUT_RAW in this log shows no motor_1, motor_2: ")


def test_outputs_that_are_lacking_are_told_as_they_are_recorded(flight):
    log = without(flight, "MOTORS", "SERVO_OUTPUT_RAW")
    placement = place(load_airframe("quadcopter"), log)
    assert {g.setting for g in placement.gains if g.name == "SERVO_OUTPUT_RAW"} == {"SRn_RC_CHAN"}
    assert "MOTORS" not in placement.candidates
    lines = load_airframe("quadcopter").observe(log).warnings
    assert any(x.startswith("no SERVO_OUTPUT_RAW in this log (motor_1") for x in lines)


def test_outputs_that_come_too_seldom_are_told_as_they_are_recorded(flight):
    log = replace(flight, format="dataflash")
    assert setting_of("MOTORS", log) == "LOG_BITMASK, RC output, bit 10"
    assert recorded_as("MOTORS", log) == "RCOU"


def test_what_changes_slowly_may_come_at_any_rate(flight):
    words = str(hint_of("vibration", load_airframe("quadcopter"), without(flight, "VIBRATION")))
    assert words == "VIBRATION would test it (SRn_EXTRA3)"


PAIR = """format: 1
name: pair
components: {one: {group: sensor}, other: {group: sensor}}
variables: {x: {unit: m/s**2}, h: {unit: m}}
measurements:
  VFR_HUD: {component: other, fields: {alt: {variable: h}}}
  VIBRATION: {component: one, fields: {vibration_x: {variable: x}}}
  RAW_IMU: {component: one, fields: {xacc: {variable: x}}}
"""


def test_of_messages_of_which_one_changes_fast_the_rate_is_told(flight, tmp_path):
    """The one that changes slowly alone would test nothing."""
    path = tmp_path / "pair.yaml"
    path.write_text(PAIR, encoding="utf-8")
    words = str(hint_of("one", load_airframe(path), without(flight, "VIBRATION", "RAW_IMU")))
    assert words.startswith("VIBRATION and RAW_IMU at 2 Hz or more would test it")


def test_streams_have_their_new_names_where_the_log_has_them(flight):
    log = without(flight, "GPS_RAW_INT")
    renamed = replace(log, parameters={**log.parameters, "MAV1_EXT_STAT": 2.0})
    assert setting_of("GPS_RAW_INT", renamed) == "MAVn_EXT_STAT"
    assert setting_of("GPS_RAW_INT", log) == "SRn_EXT_STAT"


def test_nothing_is_said_of_a_component_that_the_model_knows_no_test_of(flight):
    assert hint_of("navigation_control", load_airframe("quadcopter"), flight) is None


def test_nothing_is_said_of_a_component_that_is_tested(flight):
    assert hint_of("gps", load_airframe("quadcopter"), flight) is None


@pytest.mark.parametrize(
    ("kind", "message", "expected"),
    [
        (("dataflash", "ardupilot", "quad"), "RAW_IMU", "LOG_BITMASK, IMU, bit 7"),
        (("dataflash_text", "ardupilot", "quad"), "RAW_IMU", "LOG_BITMASK, IMU, bit 7"),
        (("dataflash", "ardupilot", "quad"), "SERVO_OUTPUT_RAW", "LOG_BITMASK, RC output, bit 10"),
        (
            ("dataflash", "ardupilot", "plane"),
            "SERVO_OUTPUT_RAW",
            "LOG_BITMASK, RC Input-Output, bit 13",
        ),
        (("ulog", "px4", "quad"), "GPS_RAW_INT", "SDLOG_PROFILE, bit 0, default set"),
        (("ulog", "px4", "quad"), "SCALED_PRESSURE2", "SDLOG_PROFILE, bit 6, sensor comparison"),
        (("ulog", "px4", "quad"), "AHRS2", ""),
        (("tlog", "px4", "quad"), "SERVO_OUTPUT_RAW", "mavlink stream -s SERVO_OUTPUT_RAW_0 -r 2"),
        (("tlog", "ardupilot", "quad"), "AHRS2", "SRn_EXTRA1"),
        (("tlog", "other", "quad"), "AHRS2", ""),
    ],
)
def test_settings_are_those_of_the_autopilot_and_the_kind_of_log(flight, kind, message, expected):
    """ArduPilot's LOG_BITMASK and stream groups, PX4's SDLOG_PROFILE: sources in logging.json."""
    format_, autopilot, vehicle = kind
    log = replace(flight, format=format_, autopilot=autopilot, vehicle=vehicle)
    assert setting_of(message, log) == expected


def test_a_message_is_in_one_stream_only():
    streams = data_table("logging")["streams"].values()
    messages = [message for own in streams for message in own]
    assert len(messages) == len(set(messages))


def test_placement_tells_the_setting_and_only_what_the_autopilot_has(flight):
    log = without(flight, "GPS_RAW_INT", "AHRS2")
    gains = {gain.name: gain.setting for gain in place(load_airframe("quadcopter"), log).gains}
    assert gains["GPS_RAW_INT"] == "SRn_EXT_STAT"
    px4 = place(load_airframe("quadcopter"), replace(log, autopilot="px4"))
    assert "GPS_RAW_INT" in px4.candidates
    assert "AHRS2" not in px4.candidates


@SHARED_ONLY
def test_messages_that_come_too_seldom_are_told_with_their_rate():
    log = read(SHARED / "healthy" / "mission_1hz.tlog")
    words = str(hint_of("gyroscope", load_airframe("quadcopter"), log))
    assert words.startswith("ATTITUDE, RAW_IMU and SCALED_IMU2 at 2 Hz or more would test it")
    assert words.endswith("the slowest comes at 1.0 Hz")


def test_what_a_log_lacks_is_told_in_messages_and_parts(flight):
    airframe = load_airframe("quadcopter")
    lines = airframe.observe(without(flight, "SCALED_IMU2", "LOCAL_POSITION_NED")).warnings
    second = "no second compass in this log (SCALED_IMU2: xmag)"
    assert f"{second}: 1 test of the compass is left out" in lines
    motors = "12 tests of motor 1, motor 2, motor 3 and 1 more are left out"
    assert f"no ESC_TELEMETRY_1_TO_4 in this log (rpm): {motors}" in lines
    assert "no LOCAL_POSITION_NED in this log (x, y, z): 4 tests are left out" in lines
    names = [name for name in (*airframe.variables, *airframe.parameters) if "_" in name]
    assert not [line for line in lines for name in names if f" {name}" in line]
    assert len(lines) <= 6  # these two, and what the log itself lacks: range finder, controllers


def test_of_two_units_that_are_lacking_none_is_told_as_the_other():
    """A test that either of them would serve: it is not the second one that is not there."""
    airframe = load_airframe("quadcopter")
    either = frozenset(Channel.parse(f"SCALED_IMU{unit}.xmag") for unit in (2, 3))
    statement = next(e for e in airframe.equations if e.component == "compass")
    (line,) = lacking_words([Fallen(either, (statement,))], airframe.components, None)
    assert line.startswith("no SCALED_IMU2 or SCALED_IMU3 in this log (xmag): 1 test")


def test_fields_that_a_message_has_not_are_told_as_its_own():
    log = stub_log({"SYS_STATUS": ["load"]})
    airframe = load_airframe("quadcopter")
    own = [m.channel for m in airframe.measurements if m.variable == "enabled_word"]
    fallen = Fallen(frozenset(own), tuple(e for e in airframe.equations if e.name == "health_4"))
    (line,) = lacking_words([fallen], airframe.components, log)
    assert line.startswith(
        "SYS_STATUS in this log shows no onboard_control_sensors_enabled: 1 test"
    )
    name = "SYS_STATUS.onboard_control_sensors_enabled"
    log.inputs = (Input("a", ("SYS_STATUS.load",), False, "b"), Input("c", (name,), True, "d"))
    assert [line] == [*lacking_words([fallen], airframe.components, log)]
    log.inputs = (*log.inputs, Input("e", (name,), False, "it never changes"))
    (line,) = lacking_words([fallen], airframe.components, log)
    assert line.startswith(
        "onboard_control_sensors_enabled of SYS_STATUS in this log is not believed (it never "
        "changes): 1 test"
    )


@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_more_messages_never_test_less(data, flight):
    """By structure; what asks for the fewest messages goes down from all of them."""
    airframe = load_airframe("quadcopter")
    sources = sorted({m.channel.source for m in airframe.measurements if not m.made_by})
    recorded = [source for source in sources if source in flight]
    log = without(flight, *data.draw(st.sets(st.sampled_from(recorded), min_size=1, max_size=4)))
    absent = sorted({m.channel.source for m in _absent(airframe, log)})
    more = data.draw(st.sets(st.sampled_from(absent), min_size=1))
    fewer = data.draw(st.sets(st.sampled_from(sorted(more))))
    with_more, with_fewer = (
        _tested(airframe.observe(log, also=frozenset(some), repeated=True))
        for some in (more, fewer)
    )
    assert with_fewer <= with_more
