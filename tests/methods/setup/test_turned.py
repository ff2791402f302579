"""A compass that is turned about the vertical, and the heading with it: told by gyroscopes."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fdi import analyze
from fdi.methods.columns import Columns
from fdi.methods.heading.columns import heading_columns
from fdi.methods.setup import Check, check_setup
from fdi.methods.setup.compass import compass_readings, earth_field
from fdi.methods.setup.turned import turned_about_the_vertical
from fdi.report.explained import explained
from fdi.telemetry import Log, read

from ..heading.rides import altered
from .sensors import Ride, write

MOUNT = {"COMPASS_ORIENT": 0.0, "COMPASS_EXTERNAL": 1.0}


def yaw(degrees: float) -> np.ndarray:
    return Rotation.from_euler("ZYX", [degrees, 0, 0], degrees=True).as_matrix()


def ridden(tmp_path: Path, degrees: float, **how: object) -> Path:
    """A heading that comes from a compass is wrong as the compass is."""
    ride = Ride(compass=yaw(degrees), heading_off=-np.radians(degrees), **how)
    return write(tmp_path / "ride.tlog", ride)


def flown(tmp_path: Path, degrees: float, **how: object) -> Log:
    return read(ridden(tmp_path, degrees, **how))


def compass(log: Log) -> Check:
    return next(check for check in check_setup(log) if check.name == "compass 1")


@pytest.mark.parametrize(
    ("degrees", "side", "orientation"), [(-90, "left", 6), (45, "right", 1), (180, "", 4)]
)
@pytest.mark.parametrize("hard_iron", [0.0, 300.0])
def test_the_angle_and_the_parameter_are_told(tmp_path, degrees, side, orientation, hard_iron):
    check = compass(flown(tmp_path, degrees, told=MOUNT, hard_iron=hard_iron))
    assert check.verdict == "wrong"
    assert f"turned by {abs(degrees)}" in check.text
    assert f"to the {side}" in check.text
    apart = (check.numbers["turned_deg"] - degrees + 180) % 360 - 180
    assert abs(apart) < 3
    (setting,) = check.settings
    assert (setting.name, setting.now, setting.suggested) == ("COMPASS_ORIENT", 0, orientation)


def test_a_turn_of_less_than_half_a_step_is_no_other_orientation(tmp_path):
    log = flown(tmp_path, 15.0, told=MOUNT)
    angle = turned(log)
    assert angle is not None
    assert np.degrees(angle.value) == pytest.approx(15, abs=2)
    assert "turned by" not in compass(log).text


def test_leaning_alone_tells_it_unless_noise_is_larger(tmp_path):
    log = flown(tmp_path, 90.0, turns=False, hard_iron=300.0)
    assert "turned by 90" in compass(log).text
    noise = np.random.default_rng(1)

    def stir(t: np.ndarray, own: np.ndarray) -> np.ndarray:
        return own + noise.normal(0.0, 2e-5, own.size)

    assert turned(altered(log, "RAW_IMU", xmag=stir, ymag=stir, zmag=stir)) is None


@pytest.mark.parametrize("spin", [2.5, 20.0])
def test_what_turns_faster_than_records_follow_is_not_asked(tmp_path, spin):
    """Gyroscopes that tell of a spin which the compass does not show: a tenth of a second counts.

    Its readings to 40 s are those of the vehicle without a spin.
    """
    known = turned(flown(tmp_path, 90.0, upset=40.0, spin=spin))
    assert known is not None
    assert np.degrees(known.value) == pytest.approx(90, abs=2)


def test_what_turns_in_flight_is_no_mount(tmp_path):
    """Right for half of the flight, by 90 degrees off for the other."""
    log = flown(tmp_path, 0.0)
    right, forward = (log["RAW_IMU"].si(name) for name in ("ymag", "xmag"))

    def turn(value: np.ndarray, sign: float) -> object:
        return lambda t, own: np.where(t > 30.0, sign * value, own)

    off = altered(log, "RAW_IMU", xmag=turn(right, -1.0), ymag=turn(forward, 1.0))
    assert turned(off) is None


@pytest.mark.parametrize("matrix", [np.diag([1.0, -1.0, -1.0]), np.diag([1.0, -1.0, 1.0])])
def test_a_compass_upside_down_or_mirrored_has_no_such_angle(tmp_path, matrix):
    log = read(write(tmp_path / "ride.tlog", Ride(compass=matrix)))
    assert "turned by" not in compass(log).text


def test_an_analysis_dates_it_by_the_first_record(tmp_path):
    found = analyze(ridden(tmp_path, 90.0, told=MOUNT))
    (first, *_) = found.findings
    assert first.component == "compass"
    assert first.onset == pytest.approx(found.log.span[0], abs=0.5)
    assert found.verdict.startswith("Compass was wrong before take-off")
    told = explained(found, "facts")
    assert re.search(r"^Compass 1: it is turned by 90 .*\n  turned_deg: (89|90)", told, re.M)
    assert "compass" not in [one.component for one in analyze(ridden(tmp_path, 0.0)).findings]


def test_the_column_is_the_least_that_one_in_use_is_turned(tmp_path):
    made = heading_columns(flown(tmp_path, 90.0))
    assert isinstance(made, Columns)
    (size,) = np.unique(made.values["compass_turned"])
    assert np.radians(80) < size < np.radians(90)
    unused = heading_columns(flown(tmp_path, 90.0, told={"COMPASS_USE": 0.0}))
    assert isinstance(unused, Columns)
    assert np.isnan(unused.values["compass_turned"]).all()


def turned(log: Log) -> object:
    readings, model = compass_readings(log, "RAW_IMU"), earth_field(log)
    assert readings is not None
    assert model is not None
    return turned_about_the_vertical(log, readings, model)
