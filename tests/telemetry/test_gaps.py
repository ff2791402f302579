"""When a log is silent, and when its recorder only rested."""

import numpy as np
import pytest

from fdi.telemetry import log_from_columns
from fdi.telemetry.events import Event
from fdi.telemetry.formats.gaps import gap_records

T = np.concatenate([np.arange(0.0, 40.0, 0.1), np.arange(230.0, 260.0, 0.1)])
MESSAGES = log_from_columns({"t": T, "ATTITUDE.roll": T, "RAW_IMU.xacc": T}, {}).messages


def told(*arming: tuple[float, str]) -> int:
    return len(list(gap_records(MESSAGES, [Event(t, kind, "") for t, kind in arming])))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arming", "is_gap"),
    [
        ((), True),
        (((5.0, "arm"), (38.0, "disarm"), (230.2, "arm")), False),
        (((5.0, "arm"), (25.0, "disarm"), (229.0, "arm")), False),  # it goes on for a while
        (((5.0, "arm"), (38.0, "disarm")), True),  # nobody knows what ended it
        (((5.0, "arm"), (38.0, "disarm"), (120.0, "arm")), True),  # armed and not recorded
        (((5.0, "arm"), (250.0, "disarm")), True),  # in flight
    ],
)
def test_a_recorder_that_rests_from_disarming_to_arming_loses_nothing(arming, is_gap):
    assert told(*arming) == is_gap
