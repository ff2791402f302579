"""Who ordered it: the chain of modes, failsafes, switches and commands before an end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import Event, Flight, read
from fdi.telemetry.events import over_words
from fdi.telemetry.formats.tlog.events import with_orders
from fdi.telemetry.ordered import chain_of, order_words, with_setters

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "flights"
FLIGHT = Flight(5.0, 100.0, takeoff=10.0)


class Channels(dict):
    """RC channels that are all at 1500 us but for those given; what `chain_of` asks of them."""

    t = np.arange(0.0, 100.0, 0.2)

    def si(self, name):
        return self[name]


def chain(*events, until=90.0, messages=None, parameters=None):
    return [
        (one.t, one.what, one.by)
        for one in chain_of(until, FLIGHT, events, messages or {}, parameters or {})
    ]


def test_what_a_person_ordered_last_begins_the_chain():
    modes = [Event(0.0, "mode", "STABILIZE"), Event(20.0, "mode", "LOITER", by="the pilot")]
    modes.append(Event(60.0, "mode", "AUTO", by="the ground station or a companion"))
    assert chain(*modes) == [(60.0, "mode", "the ground station or a companion")]


def test_what_a_failsafe_ordered_is_told_with_its_cause_and_what_it_took_the_place_of():
    events = [
        Event(20.0, "mode", "LOITER", by="the pilot"),
        Event(30.0, "failsafe", "fence breached"),
        Event(59.5, "failsafe", "battery failsafe"),
        Event(60.0, "mode", "LAND", by="the battery failsafe"),
    ]
    assert chain(*events) == [
        (20.0, "mode", "the pilot"),
        (30.0, "failsafe", ""),
        (59.5, "failsafe", ""),
        (60.0, "mode", "the battery failsafe"),
    ]


def test_a_failsafe_that_is_over_is_no_longer_in_force():
    said = "radio failsafe: no signal of the remote control"
    events = [
        Event(20.0, "mode", "RTL", by="the pilot"),
        Event(30.0, "failsafe", said),
        Event(30.4, "text", over_words(said)),
        Event(40.0, "failsafe", "fence breached: too high"),
    ]
    assert [at for at, what, _ in chain(*events) if what == "failsafe"] == [40.0]
    again = [*events, Event(50.0, "failsafe", said)]
    assert [at for at, what, _ in chain(*again) if what == "failsafe"] == [30.0, 40.0]


@pytest.mark.parametrize("autopilot", ["landing", "lockdown"])
def test_who_disarms_by_itself_says_so(autopilot):
    events = [
        Event(20.0, "mode", "POSCTL", by="the pilot"),
        Event(88.9, "text", "[commander] Landing detected"),
        Event(89.0, "disarm", ""),
        Event(89.1, "text", f"[commander] Disarmed by {autopilot}"),
    ]
    told = chain_of(90.0, FLIGHT, events, {}, {})
    assert [(one.t, one.by) for one in told if one.what == "disarm"] == [(89.0, autopilot)]
    assert any("Landing detected" in one.said for one in told)


def test_old_copters_have_their_mode_switch_on_channel_5():
    moved = Channels({f"chan{n}_raw": np.full(Channels.t.size, 1500.0) for n in range(1, 9)})
    moved["chan5_raw"] = np.where(Channels.t < 59.5, 1100.0, 1900.0)
    modes = [Event(0.0, "mode", "STABILIZE"), Event(60.0, "mode", "LOITER")]
    for parameters, by in (({"FLTMODE1": 0.0}, "the pilot's mode switch"), ({}, "")):
        told = chain(*modes, messages={"RC_CHANNELS": moved}, parameters=parameters)
        assert told == [(60.0, "mode", by)]


def test_a_failsafe_long_before_the_last_order_of_a_person_is_no_link():
    events = [
        Event(30.0, "failsafe", "radio failsafe"),
        Event(60.0, "mode", "LOITER", by="the pilot"),
    ]
    assert [what for _, what, _ in chain(*events)] == ["mode"]


def test_a_kill_switch_and_a_disarming_in_the_air_are_links_and_an_earlier_one_is_none():
    events = [
        Event(2.0, "disarm", ""),
        Event(5.0, "arm", ""),
        Event(20.0, "mode", "LOITER", by="the pilot"),
        Event(89.0, "command", "kill switch", by="the pilot's switch"),
        Event(91.0, "disarm", "", by="the crash check"),
        Event(99.0, "disarm", ""),
    ]
    assert chain(*events)[1:] == [
        (89.0, "command", "the pilot's switch"),
        (91.0, "disarm", "the crash check"),
    ]


@pytest.mark.parametrize(("moves", "by"), [(59.4, "the pilot's mode switch"), (30.0, "")])
def test_a_mode_switch_that_moves_at_that_moment_is_who_ordered_it(moves, by):
    channels = Channels(chan5_raw=np.where(Channels.t < moves, 1165.0, 1295.0))
    events = [Event(0.0, "mode", "STABILIZE"), Event(60.0, "mode", "RTL")]
    known = {"messages": {"RC_CHANNELS": channels}, "parameters": {"FLTMODE_CH": 5.0}}
    assert chain(*events, **known) == [(60.0, "mode", by)]


def test_what_the_log_does_not_say_is_not_said():
    (order,) = chain_of(90.0, FLIGHT, [Event(0.0, "mode", "ACRO")], {}, {})
    assert order_words(order) == "mode ACRO; the log does not say by whom"


def test_a_chain_is_short_and_keeps_the_mode_in_force():
    events = [Event(20.0 + i, "failsafe", f"failsafe {i}") for i in range(30)]
    told = chain(Event(15.0, "mode", "AUTO", by="the pilot"), *events)
    assert len(told) == 8
    assert (told[0], told[-1]) == ((15.0, "mode", "the pilot"), (49.0, "failsafe", ""))


def test_a_switch_that_jumps_as_the_radio_is_lost_is_nobodys():
    channels = Channels(chan5_raw=np.where(Channels.t < 59.4, 1165.0, 1295.0))
    known = {"messages": {"RC_CHANNELS": channels}, "parameters": {"FLTMODE_CH": 5.0}}
    lost = Event(59.8, "failsafe", "radio failsafe: the remote control's signal was lost")
    events = [Event(0.0, "mode", "STABILIZE"), Event(60.0, "mode", "RTL"), lost]
    assert chain(*events, **known)[-1] == (60.0, "mode", "")


def test_a_reason_stands_before_what_it_ordered_though_it_is_recorded_a_moment_later():
    events = [Event(0.0, "mode", "LOITER"), Event(60.00, "mode", "RTL")]
    told = chain(*events, Event(60.01, "failsafe", "radio failsafe"))
    assert [what for _, what, _ in told] == ["failsafe", "mode"]


@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
@pytest.mark.parametrize(
    ("name", "orders"),
    [
        ("crash/motor2_lost.bin", ["mode AUTO instead of LOITER, ordered by the pilot"]),
        (
            "sitl/copter/c62_gps_loss_30s_wind.BIN",
            ["mode LAND instead of GUIDED, ordered by the estimator's failsafe"],
        ),
        (
            "triplex/gps_fail/instance_0.ulg",
            ["mode DESCEND instead of AUTO_MISSION, ordered by a failsafe"],
        ),
    ],
)
def test_recorded_orders_are_told(name, orders):
    end = read(SHARED / name).ends[-1]
    assert [order_words(one) for one in end.chain if one.what == "mode"][-1:] == orders


class Sent(dict):
    """What another system sent, by field."""

    field = dict.__getitem__


def test_commands_of_another_sender_in_a_telemetry_log_say_who_ordered():
    mode, begun = Event(60.4, "mode", "LAND"), Event(0.0, "mode", "STABILIZE")
    arm, disarm = Event(10.3, "arm", ""), Event(80.0, "disarm", "")
    modes = Sent(target_system=np.array([1, 1, 9]))
    commands = Sent(target_system=np.array([1, 1]), command=np.array([400, 22]))
    commands |= {"param1": np.zeros(2), "param2": np.zeros(2)}
    others = {
        11: [(modes, np.array([0.0, 59.0, 79.0]))],
        76: [(commands, np.array([9.5, 30.0]))],
    }
    told = with_orders([begun, arm, mode, disarm], others, 1)
    outside = "the ground station or a companion"
    assert [one.by for one in told] == ["", outside, outside, ""]


@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
def test_a_set_mode_in_a_recorded_telemetry_log_says_who_ordered():
    end = read(SHARED / "sitl/copter/c02_hover_calm.tlog").ends[-1]
    assert end.chain[-1].by == "the ground station or a companion"


@pytest.mark.parametrize(
    ("mode", "name", "by"),
    [
        ("AUTOTUNE", "ATC_RAT_RLL_P", "the autopilot's autotune"),
        ("QAUTOTUNE", "Q_A_RAT_RLL_P", "the autopilot's autotune"),
        ("LOITER", "ATC_RAT_RLL_P", ""),
        ("AUTOTUNE", "FENCE_ENABLE", ""),
    ],
)
def test_gains_that_are_set_while_it_tunes_itself_are_the_autotunes(mode, name, by):
    events = [Event(1.0, "mode", "LOITER"), Event(20.0, "mode", mode)]
    events.append(Event(30.0, "parameter", name, value=0.2, before=0.135))
    assert with_setters(events, {})[-1].by == by
    asked = [*events[:-1], replace(events[-1], by="the ground station or a companion")]
    assert with_setters(asked, {})[-1].by == "the ground station or a companion"


@pytest.mark.parametrize(
    ("text", "learns", "by"),
    [
        ("CompassLearn: Finished", 0, "the autopilot's learning in flight"),
        ("", 3, "the autopilot's learning in flight"),
        ("", 0, ""),
    ],
)
def test_offsets_that_a_flight_teaches_are_set_by_learning(text, learns, by):
    events = [Event(29.0, "text", text), Event(30.0, "parameter", "COMPASS_OFS_X", value=41.0)]
    assert with_setters(events, {"COMPASS_LEARN": learns})[-1].by == by
