"""What PX4's topics say of failsafes, stops and who ordered what."""

from types import SimpleNamespace

import numpy as np
import pytest

from fdi.telemetry.formats.ulog.events import log_events

T = np.arange(0.0, 20.0, 0.5)
NEW, OLD = (1, 15), (1, 12)


class Topic(dict):
    """A topic of columns at `T`, or at times of its own; what the events ask of a message."""

    def __init__(self, t=T, **columns):
        super().__init__({name: np.asarray(values) for name, values in columns.items()})
        self.t, self.kept = np.asarray(t, float), np.arange(len(t))
        self.columns = dict.fromkeys(columns, SimpleNamespace(is_text=False))

    def raw(self, name):
        return self[name]

    def __len__(self):
        return self.t.size


def since(t, value=1, before=0):
    return np.where(t <= T, value, before)


def found(kind, release=NEW, **topics):
    return [(e.t, e.text, e.by) for e in log_events(topics, release) if e.kind == kind]


def test_a_failsafe_is_told_with_the_flags_that_rose_before_it():
    status = Topic(failsafe=since(10.0))
    flags = Topic(
        gcs_connection_lost=since(9.0), battery_warning=since(12.0), mission_failure=since(0.0)
    )
    told = found("failsafe", vehicle_status=status, failsafe_flags=flags)
    assert told == [(10.0, "the autopilot is in failsafe: the ground station is lost", "")]
    assert found("failsafe", vehicle_status=status) == [(10.0, "the autopilot is in failsafe", "")]


def test_what_the_failure_detector_finds_is_told_by_either_topic():
    newer = Topic(fd_motor=since(8.0), fd_roll=since(30.0))
    assert found("failsafe", failure_detector_status=newer) == [
        (8.0, "failure detector: motor", "")
    ]
    which = Topic(fd_motor=since(8.0), motor_failure_mask=since(8.0, 0b101))
    assert [text for _, text, _ in found("failsafe", failure_detector_status=which)] == [
        "failure detector: motor 1, 3"
    ]
    older = Topic(failure_detector_status=since(8.0, 1 | 128))
    assert [text for _, text, _ in found("failsafe", vehicle_status=older)] == [
        "failure detector: roll",
        "failure detector: motor",
    ]


def test_a_mode_is_ordered_by_a_failsafe_a_switch_or_a_command():
    modes = np.select([T >= 15.0, T >= 10.0, T >= 5.0], [18, 5, 3], 2)
    status = Topic(nav_state=modes, failsafe=since(15.0))
    actions = Topic([5.0], action=[5], source=[3])
    commands = Topic([9.6], command=[176], from_external=[1])
    told = found("mode", vehicle_status=status, action_request=actions, vehicle_command=commands)
    assert [by for _, _, by in told] == [
        "",
        "the pilot's mode switch",
        "the ground station or a companion",
        "a failsafe",
    ]


def test_a_mode_switch_that_turns_orders_a_mode_where_no_request_is_logged():
    status = Topic(nav_state=since(5.0, 3, 2))
    turned = Topic(mode_slot=since(4.5, 2, 1))
    told = found("mode", vehicle_status=status, manual_control_switches=turned)
    assert told[1] == (5.0, "AUTO_MISSION", "the pilot's switch")
    assert found("mode", vehicle_status=status)[1][2] == ""


@pytest.mark.parametrize("field", ["manual_lockdown", "kill"])
def test_a_kill_switch_is_a_command_of_the_pilots(field):
    armed = Topic(armed=since(0.0), **{field: since(12.0)})
    asked = Topic([12.0], action=[4], source=[1])
    ((t, text, by),) = found("command", actuator_armed=armed, action_request=asked)
    assert (t, text, by) == (12.0, "kill switch: all outputs are stopped", "the pilot's switch")
    assert found("command", actuator_armed=armed)[0][2] == ""


def test_a_simulation_that_is_locked_all_along_orders_nothing():
    assert found("command", actuator_armed=Topic(lockdown=since(0.0))) == []


@pytest.mark.parametrize(
    ("release", "reason", "by"),
    [
        (NEW, 6, "the land detector"),
        (OLD, 7, "the land detector"),
        (NEW, 8, "the pilot's kill switch"),
        (OLD, 9, "the pilot's kill switch"),
        (OLD, 14, ""),
        (NEW, 99, ""),
    ],
)
def test_who_disarmed_is_told_by_the_numbers_of_the_release(release, reason, by):
    armed = Topic(armed=1 - since(12.0))
    status = Topic(latest_disarming_reason=since(12.0, reason))
    told = found("disarm", release, actuator_armed=armed, vehicle_status=status)
    assert told == [(12.0, "", by)]


def test_commands_from_outside_that_act_on_outputs_are_told_once_each():
    sent = Topic(
        [3.0, 3.5, 4.0, 5.0, 6.0],
        command=[187, 187, 185, 185, 176],
        param1=[0.0, 0.0, 1.0, 1.0, 1.0],
        param2=[0.0] * 5,
        from_external=[1, 1, 0, 1, 1],
    )
    assert found("command", vehicle_command=sent) == [
        (3.0, "outputs are to be set by hand", "the ground station or a companion"),
        (5.0, "flight termination is to begin or end (1)", "the ground station or a companion"),
    ]
