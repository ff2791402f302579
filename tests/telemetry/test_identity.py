"""Which vehicle recorded a log: by its board, by its sensors, or nobody knows."""

from dataclasses import replace

import pytest
from report.build import small_log

from fdi.telemetry import Event
from fdi.telemetry.identity import identity_of


@pytest.mark.parametrize(
    ("text", "hardware"),
    [
        ("fmuv3 002F001F 33375111 37353832", "fmuv3 002F001F 33375111 37353832"),
        ("CUAVv5Nano 001A002F 30395113 33333539", "CUAVv5Nano 001A002F 30395113 33333539"),
        ("EKF2 IMU0 is using GPS", ""),
        ("002F001F 33375111 37353832", ""),
        ("fmuv3 002F001F 33375111", ""),
    ],
)
def test_ardupilots_greeting_holds_the_boards_number(text, hardware):
    log = replace(small_log(), reported=(Event(1.0, "text", text),))
    assert identity_of(log).hardware == hardware
    assert identity_of(log).kind == ("board" if hardware else "none")


def test_a_number_that_the_format_has_a_place_for_comes_first():
    told = (Event(1.0, "text", "fmuv3 002F001F 33375111 37353832"),)
    log = replace(small_log(), board="PX4_FMU_V6C 0006000000003736", reported=told)
    assert identity_of(log).hardware == "PX4_FMU_V6C 0006000000003736"


def test_sensors_are_a_weaker_witness_and_absent_ones_none():
    ids = {"COMPASS_DEV_ID": 97539.0, "COMPASS_DEV_ID2": 0.0, "INS_ACC_ID": 2753028.0, "GAIN": 2.0}
    found = identity_of(replace(small_log(), parameters=ids))
    assert (found.kind, found.hardware) == (
        "sensors",
        "COMPASS_DEV_ID=97539 INS_ACC_ID=2753028",
    )
