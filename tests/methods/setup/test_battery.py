"""A battery that is low in flight, by its autopilot's own limits."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.methods.setup.battery import check_battery
from fdi.telemetry import log_from_columns
from fdi.telemetry.events import Flight

T = np.arange(0.0, 120.0, 0.5)


def checked(volts: np.ndarray, **parameters: float):
    log = log_from_columns(
        {"t": T, "SYS_STATUS.voltage_battery": volts}, {"SYS_STATUS.voltage_battery": "V"}
    )
    flown = (Flight(5.0, 115.0, takeoff=5.0, landing=115.0),)
    return list(
        check_battery(
            replace(log, autopilot="ardupilot", parameters=parameters, _cache={"flights": flown})
        )
    )


def low(since: float, until: float = 120.0) -> np.ndarray:
    return np.where((since <= T) & (until > T), 10.2, 11.8)


@pytest.mark.parametrize(
    ("volts", "strikes"), [(low(60.0), True), (low(60.0, 65.0), False), (low(999.0), False)]
)
def test_a_battery_is_low_that_stays_below_for_as_long_as_the_autopilot_waits(volts, strikes):
    (found,) = checked(volts, BATT_LOW_VOLT=10.5)
    assert found.strikes == strikes
    assert "below what the autopilot calls low" in found.text
    assert (found.verdict == "in order") == (not strikes)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 0}, "(BATT_FS_LOW_ACT is 0)"),
        ({"BATT_CRT_VOLT": 10.5, "BATT_FS_CRT_ACT": 0}, "(BATT_FS_CRT_ACT is 0)"),
        ({"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2}, ""),
        ({"BATT_LOW_VOLT": 10.5}, ""),
    ],
)
def test_that_nothing_is_done_then_is_said_where_it_is_so(parameters, said):
    (found,) = checked(low(60.0), **parameters)
    assert ("no action is set for it" in found.text) == bool(said)
    assert said in found.text


def test_without_a_limit_nothing_is_said():
    assert checked(low(60.0)) == []
