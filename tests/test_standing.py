"""What holds while a vehicle stands, and what no vehicle does: real logs, changed in one thing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fdi
from fdi.telemetry import read

SHARED = Path(__file__).resolve().parents[1].parent / "shared" / "flights"
LOG = SHARED / "real" / "forum_18093_4.bin"
pytestmark = [
    pytest.mark.flights,
    pytest.mark.skipif(not LOG.exists(), reason="needs the labelled logs"),
]


def changed(name, **changes):
    """Return the log with some fields of a message made of what they were."""
    log = read(LOG)
    message = log.messages[name]
    columns = dict(message.columns)
    others = {key: m for key, m in log.messages.items() if key != name}
    for field, change in changes.items():
        column = columns[field]
        made = change(np.asarray(column.load(), np.float64), message)
        columns[field] = column._replace(load=lambda own=made: own)
    own = replace(message, columns=columns, _cache={})
    return replace(log, messages={**others, name: own}, _cache={})


def findings(log):
    chain = fdi.residuals_of(log)
    return fdi.diagnose(fdi.load_policy("default").decide(chain.residuals), chain.bank).findings


def test_this_log_accuses_neither_as_it_is():
    assert not {f.component for f in findings(read(LOG))} & {"accelerometer", "propulsion"}


@pytest.mark.parametrize(("scale", "is_wrong"), [(0.88, True), (1.12, True), (1.02, False)])
def test_an_accelerometer_that_felt_no_weight_is_named(scale, is_wrong):
    log = changed("RAW_IMU", **{f"{a}acc": lambda raw, _: scale * raw for a in "xyz"})
    assert ("accelerometer" in {f.component for f in findings(log)}) is is_wrong


@pytest.mark.parametrize("to", [-1, 1])
def test_a_vehicle_that_spins_has_lost_propulsion(to):
    start, end = read(LOG).flights[0].airborne
    since = (start + end) / 2

    def spin(raw, message):
        spun = np.where(
            message.t > since, to * 15.0 / message.columns["yawspeed"].conversion.scale, 0
        )
        found = raw.copy()
        found[message.kept] += spun
        return found

    assert "propulsion" in {f.component for f in findings(changed("ATTITUDE", yawspeed=spin))}
