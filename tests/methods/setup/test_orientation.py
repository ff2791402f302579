"""A compass should be told the orientation that its readings need after the one set."""

from dataclasses import replace

import pytest
from report.build import small_log

from fdi.methods.setup import Setting
from fdi.methods.setup.orientation import orientation_of, turned_by
from fdi.methods.setup.rotations import sensor_rotations
from fdi.telemetry import Log

ROTATIONS = {rotation.name: rotation for rotation in sensor_rotations()}


def log_of(autopilot: str, **parameters: float) -> Log:
    return replace(small_log(), autopilot=autopilot, parameters=parameters)


@pytest.mark.parametrize(
    ("now", "needs", "suggested"),
    [(0, "ROLL_180", 8), (0, "YAW_180", 4), (4, "YAW_180", 0), (2, "YAW_90", 4), (6, "YAW_90", 0)],
)
def test_the_orientation_is_what_readings_need_after_the_one_set(
    now: int, needs: str, suggested: int
) -> None:
    found = turned_by(ROTATIONS[needs], Setting("COMPASS_ORIENT", now), "why")
    assert found == (Setting("COMPASS_ORIENT", now, suggested, "why"),)


def test_no_orientation_is_suggested_where_no_parameter_tells_the_one_set() -> None:
    assert turned_by(ROTATIONS["YAW_90"], None, "") == ()
    assert turned_by(ROTATIONS["YAW_90"], Setting("COMPASS_ORIENT", 101), "") == ()


def test_the_compass_of_the_board_turns_with_the_board() -> None:
    """ArduPilot does not use COMPASS_ORIENT for one that is not external."""
    assert orientation_of(log_of("ardupilot", COMPASS_ORIENT=0, COMPASS_EXTERNAL=0), 1) is None


def test_readings_by_priority_find_the_parameter_of_their_compass() -> None:
    log = log_of(
        "ardupilot",
        COMPASS_PRIO1_ID=77.0,
        COMPASS_DEV_ID=11.0,
        COMPASS_DEV_ID2=77.0,
        COMPASS_EXTERN2=1.0,
        COMPASS_ORIENT2=6.0,
    )
    assert orientation_of(log, 1) == Setting("COMPASS_ORIENT2", 6.0)


def test_of_several_compasses_px4_does_not_tell_which_is_read() -> None:
    one = log_of("px4", CAL_MAG0_ID=5.0, CAL_MAG0_ROT=2.0)
    assert orientation_of(one, 1) == Setting("CAL_MAG0_ROT", 2.0)
    two = log_of("px4", CAL_MAG0_ID=5.0, CAL_MAG0_ROT=2.0, CAL_MAG1_ID=6.0)
    assert orientation_of(two, 1) is None
