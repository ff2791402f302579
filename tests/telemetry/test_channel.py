"""Names of channels: written and read, in the log's words and in the published notation."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.telemetry import Channel
from fdi.telemetry.dialect import definition_by_name

MESSAGES = [
    definition_by_name(name)
    for name in ("ATTITUDE", "BATTERY_STATUS", "GPS_RAW_INT", "RC_CHANNELS", "VFR_HUD")
]
KNOWN = st.sampled_from(MESSAGES).flatmap(
    lambda m: st.tuples(st.just(m), st.sampled_from([f.name for f in m.fields]))
)
INSTANCES = st.one_of(st.none(), st.integers(1, 9))
CASES = st.sampled_from([str, str.upper, str.title])


@given(KNOWN, INSTANCES, CASES)
def test_what_is_written_is_read_again(known, instance, case):
    message, field = known
    channel = Channel(message.name, field, instance)
    assert Channel.parse(str(channel)) == channel
    bracket = "" if instance is None else f"[{instance}]"
    assert Channel.parse(f"{message.name}{bracket}.{case(field)}") == channel
    assert Channel.parse(f"{message.id}{bracket}/{case(field)}") == channel


@pytest.mark.parametrize(
    "text",
    ["XKF3[1].IVN", "RCOU.C1", "estimator_innovations.gps_hvel[0]", "esc_status.esc[0].esc_rpm"],
)
def test_names_of_other_formats_are_taken_as_they_are_written(text):
    assert str(Channel.parse(text)) == text


def test_topic_called_like_a_message_of_mavlink_keeps_its_own_fields():
    assert Channel.parse("battery_status.voltage_v").message == "battery_status"
    with pytest.raises(UsageError, match="has no field voltage_v"):
        Channel.parse("BATTERY_STATUS.voltage_v")


def test_instance_nought_has_no_bracket():
    assert Channel.parse("BATTERY_STATUS[0].temperature") == Channel(
        "BATTERY_STATUS", "temperature"
    )


@given(st.lists(st.tuples(KNOWN, INSTANCES), max_size=8), st.randoms())
def test_order_is_by_message_instance_and_field_whatever_it_was(drawn, random):
    channels = [Channel(message.name, field, number) for (message, field), number in drawn]
    expected = sorted(channels, key=lambda c: (c.message, c.instance or 0, c.field))
    random.shuffle(channels)
    assert sorted(channels) == expected


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("VFR_HUD.airsped", "did you mean airspeed"),
        ("BATTERY_STATUS.voltages[10]", "voltages has 10 entries"),
        ("99999999/x", "no MAVLink message has the number 99999999"),
        ("airspeed", "is no channel"),
        ("VFR_HUD.", "is no channel"),
        ("VFR HUD.airspeed", "is no channel"),
        ("74/air speed", "is no channel"),
        ("../VFR_HUD.airspeed\n", "is no channel"),
    ],
)
def test_what_names_no_channel_is_told_with_what_to_write(text, told):
    with pytest.raises(UsageError, match=told) as raised:
        Channel.parse(text)
    assert "\n" not in str(raised.value)


@given(st.text(max_size=30))
def test_any_text_is_a_channel_or_a_mistake_of_the_user(text):
    try:
        channel = Channel.parse(text)
    except UsageError:
        return
    assert Channel.parse(str(channel)) == channel
