"""Where a log says that the vehicle was: of the same flight from both recorders, else nowhere."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import read
from fdi.telemetry.together.track import MOST, NOWHERE, are_one_flight, track_of

LOG = Path("examples/crash_logs/copter_motor_failure_crash.tlog").absolute()


@pytest.fixture(scope="module")
def log():
    return read(LOG)


def test_a_track_tells_whole_seconds_since_boot_and_where_the_log_says_it_was(log):
    track = track_of(log)
    assert 10 < len(track.boot_s) <= MOST
    steps = np.diff(track.boot_s)
    assert (steps == steps[0]).all()
    assert bin(steps[0]).count("1") == 1  # a power of two
    message, boot = log["GLOBAL_POSITION_INT"], float(log.clock.boot_offset[0])
    middle = len(track.boot_s) // 2
    row = np.abs(message.t + boot - track.boot_s[middle]).argmin()
    assert abs(message.si("lat")[row] - track.lat[middle]) < 1e-6  # 6 m: a row is near the second
    assert abs(message.si("lon")[row] - track.lon[middle]) < 1e-6
    assert are_one_flight(track, track)


@pytest.mark.parametrize("name", ["lat", "lon"])
def test_a_log_that_does_not_tell_both_coordinates_has_no_track(log, name):
    message = log["GLOBAL_POSITION_INT"]
    columns = {key: column for key, column in message.columns.items() if key != name}
    assert track_of(log.with_message(replace(message, columns=columns))) == NOWHERE
