"""An estimator that sinks or climbs otherwise than the receiver measures is seen, from boot on."""

import numpy as np
import pytest
from trends.test_trends import message

from fdi.chain import residuals_of
from fdi.decision import Alarms
from fdi.telemetry import Log, read
from fdi.telemetry.message import Message
from tests.flights import EXAMPLES

EVERY_S = 0.2


@pytest.fixture(scope="module")
def flown() -> Log:
    return read(EXAMPLES.parent / "healthy_logs" / "px4_quad.tlog")


def measured(log: Log, off: float, since: float = -np.inf) -> Message:
    """The receiver's vertical velocity, from which the estimate is ``off`` (m/s) since a time."""
    local = log["LOCAL_POSITION_NED"]
    t = np.arange(log.span[0], log.span[1], EVERY_S)
    rng = np.random.default_rng(7)
    true = np.interp(t, local.t, local.si("vz")) - np.where(t >= since, off, 0.0)
    fields = {
        "vd": true + rng.normal(0.0, 0.1, t.size),
        "speed_accuracy": np.full(t.size, 0.3),
        "fix_type": np.full(t.size, 3.0),
    }
    return message("GPS_INPUT", fields, t, "m/s")


def seen(log: Log) -> tuple[list[int], Alarms]:
    """The rows of the tests that hold the two against each other, and all alarms."""
    chain = residuals_of(log)
    rows = [
        row
        for row, generator in enumerate(chain.bank.generators)
        if chain.bank.system.equations[generator.residual].name == "estimator_sinks_otherwise"
    ]
    return rows, chain.policy.decide(chain.residuals)


def test_without_the_receivers_word_there_is_no_such_test(flown):
    assert seen(flown)[0] == []


def test_a_receiver_that_measures_what_is_estimated_raises_no_alarm(flown):
    (row,), alarms = seen(flown.with_message(measured(flown, 0.0)))
    assert np.mean(alarms.state[row] == 0) > 0.5
    assert not alarms.alarm.any()


@pytest.mark.parametrize("off", [8.0, -8.0])
@pytest.mark.parametrize("since", [-np.inf, 40.0])
def test_an_estimate_that_is_off_is_seen_when_it_begins_and_from_boot_on(flown, off, since):
    (row,), alarms = seen(flown.with_message(measured(flown, off, since)))
    first = alarms.residuals.t[np.argmax(alarms.alarm[row])]
    assert alarms.alarm[row].any()
    assert first == pytest.approx(max(flown.flights[0].takeoff, since), abs=1.5)
    assert not np.delete(alarms.alarm, row, axis=0).any()
