"""A parameter that is set in the air: an order, with who gave it, and no failure."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi import analyze
from fdi.report.timeline import told_events
from tests.flights import EXAMPLES, GROUND, Record, joined, records

FLIGHT = EXAMPLES / "copter_motor_failure_crash.tlog"
NAME = "ATC_RAT_RLL_P"


COMPANION = (1, 191)
"""A computer on board is a component of the vehicle's own system."""


def frame(message, system, component=1):
    return bytes(message.pack(mav.MAVLink(None, system, component)))


def told(name, value):
    return frame(mav.MAVLink_param_value_message(name.encode(), value, 9, 1200, 65535), 1)


def asked(name, value, sender=(GROUND, 1)):
    return frame(mav.MAVLink_param_set_message(1, 1, name.encode(), value, 9), *sender)


@pytest.fixture
def answer(tmp_path):
    def of(*added):
        """Return the analysis with frames added at times, s of the log."""
        flight = list(records(FLIGHT))
        zero = flight[0].stamp
        flight += [Record(zero + round(at * 1e6), one) for at, one in added]
        path = tmp_path / "set.tlog"
        path.write_bytes(joined(sorted(flight, key=lambda one: one.stamp)))
        return analyze(path)

    return of


def before():
    return 1.0, told(NAME, 0.135)


def test_it_stands_in_the_chain_in_what_was_first_and_among_the_facts(answer):
    found = answer(before(), (40.0, told(NAME, 1.5)))
    (end,) = found.log.ends
    assert [(one.what, one.by) for one in end.chain if one.what == "parameter"] == [
        ("parameter", "")
    ]
    (ending,) = found.diagnosis.endings
    words = f"{NAME} set from 0.135 to 1.5"
    assert next(one.text for one in ending.first if one.kind == "command") == words
    (fact,) = (one for one in found.stood_out if one.about == "parameter")
    assert fact.text.startswith(f"{words} in flight (log 40.0 s)")
    assert "s later: motor 1 (front right)" in fact.text
    assert fact.records == (f"parameter {NAME} at log 40.0 s: 1.5, 0.135 until then",)
    events, _ = told_events(found.log, 100)
    assert words in [one.event.text for one in events]


def test_it_is_not_accused_and_changes_nobodys_part(answer):
    plain, changed = answer(), answer(before(), (40.0, told(NAME, 1.5)))
    assert [f.component for f in changed.findings] == [f.component for f in plain.findings]
    assert changed.verdict == plain.verdict


@pytest.mark.parametrize("sender", [(GROUND, 1), COMPANION])
def test_who_asked_for_it_is_told(answer, sender):
    found = answer(before(), (39.9, asked(NAME, 1.5, sender)), (40.0, told(NAME, 1.5)))
    (change,) = found.document()["parameter_changes"]
    assert change["by"] == "the ground station or a companion"
    assert (change["name"], change["old"], change["new"]) == (
        NAME, pytest.approx(0.135), pytest.approx(1.5),
    )  # fmt: skip
    assert change["at"]["log_s"] == pytest.approx(40.0, abs=0.2)


@pytest.mark.parametrize(
    "added",
    [
        (before(), (3.0, told(NAME, 1.5))),  # on the ground
        (before(), (40.0, told(NAME, 0.135))),  # the same value once more
        ((1.0, told("STAT_RUNTIME", 1.0)), (40.0, told("STAT_RUNTIME", 31.0))),  # a counter
        ((1.0, told("SR0_EXTRA1", 4.0)), (40.0, told("SR0_EXTRA1", 10.0))),  # a stream's rate
        ((39.9, asked(NAME, 1.5)),),  # asked for, and never answered
    ],
)
def test_what_orders_nothing_in_flight_is_not_told(added, answer):
    found = answer(*added)
    assert found.document()["parameter_changes"] == []
    assert all(one.about != "parameter" for one in found.stood_out)


def test_a_list_that_is_sent_is_one_order(answer):
    names = [f"ATC_ANG_{axis}_P" for axis in ("RLL", "PIT", "YAW")] + [NAME]
    old = [(1.0 + i / 10, told(name, 1.0)) for i, name in enumerate(names)]
    new = [(38.0 + i / 10, told(name, 2.0)) for i, name in enumerate(names)]
    (fact,) = (one for one in answer(*old, *new).stood_out if one.about == "parameter")
    assert " and 1 more in flight (log 38.0 to 38.3 s)" in fact.text


def commanded(number, first, second, target=1):
    message = mav.MAVLink_command_long_message(target, 1, number, 0, first, second, 0, 0, 0, 0, 0)
    return frame(message, GROUND)


def test_an_output_that_is_set_from_outside_is_an_order_and_told_once(answer):
    sent = [(39.0 + 0.5 * i, commanded(mav.MAV_CMD_DO_SET_SERVO, 1, 1000)) for i in range(3)]
    found = answer(*sent, (39.2, commanded(mav.MAV_CMD_DO_SET_SERVO, 2, 1900, target=7)))
    (told,) = (e for e in found.log.events if e.kind == "command")
    assert (told.t, told.text) == (pytest.approx(39.0, abs=0.2), "output 1 is to give 1000 us")
    assert told.by == "the ground station or a companion"
    (end,) = found.log.ends
    assert told.text in [one.said for one in end.chain if one.what == "command"]


def test_what_the_autopilot_learned_and_writes_down_is_no_order(answer):
    learned = "MOT_THST_HOVER"
    found = answer((1.0, told(learned, 0.28)), (40.0, told(learned, 0.25)))
    assert [one for one in found.stood_out if one.about == "parameter"] == []
    assert found.document()["parameter_changes"] == []
