"""An autopilot that starts anew: how long it gave nothing, and what says why."""

import numpy as np
import pytest

from fdi.telemetry import log_from_columns
from fdi.telemetry.events import Event
from fdi.telemetry.meaning.restarts import (
    heard_again,
    last_heard,
    program_stopped,
    with_restarts,
)

T = np.concatenate([np.arange(0.0, 40.0, 0.5), np.arange(43.0, 60.0, 0.5)])
ANEW = Event(43.0, "reboot", "the vehicle started anew")


def messages(**columns):
    return dict(log_from_columns({"t": T, "ATTITUDE.roll": T, **columns}).messages)


@pytest.mark.parametrize(
    "text",
    [
        "WDG: T-3 SL0 FL0 FT3 FA200004BC FTP180 FLR0 FICSR4 MM0 MC0 IE67108864 IEC1 TN:main",
        "watchdog reset: the program had stopped in task -3, fault 3",
        "the autopilot's processor crashed: hard fault",
    ],
)
def test_reports_of_a_program_that_stopped_are_known(text):
    assert program_stopped([Event(44.0, "text", text)], 43.0) is not None
    assert program_stopped([Event(20.0, "text", text)], 43.0) is None


@pytest.mark.parametrize("text", ["crash check: the autopilot takes it for crashed", "Frame: QUAD"])
def test_other_texts_are_no_such_report(text):
    assert program_stopped([Event(44.0, "text", text)], 43.0) is None


def test_a_watchdog_tells_that_power_was_there_where_no_voltage_does():
    report = Event(44.0, "text", "WDG: T-3 SL0 FL0")
    assert not with_restarts(messages(), [ANEW])["RESTART"].si("powered").any()
    told = with_restarts(messages(), [ANEW, report])["RESTART"].si("powered")
    assert told.max() == pytest.approx(3.5)


def test_what_a_recorder_writes_as_it_begins_is_no_measurement():
    made = messages()
    written = log_from_columns({"t": np.array([40.0, 40.1]), "PARM.Value": np.ones(2)}).messages
    both = [*made.values(), *written.values()]
    assert last_heard(both, 43.0) == 39.5
    assert heard_again(both, 39.8) == 43.0
