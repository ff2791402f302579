"""Compasses, heading, accelerometers, gyroscopes: turned as told, and found so."""

from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from scipy.spatial.transform import Rotation
from telemetry.build import record

from fdi.methods.setup import Check, check_setup
from fdi.methods.setup.rotations import sensor_rotations, to_earth
from fdi.telemetry import read

from .sensors import Ride, write

FLAT = Rotation.from_euler("ZYX", [0, 0, 180], degrees=True).as_matrix()
QUARTER = Rotation.from_euler("ZYX", [90, 0, 0], degrees=True).as_matrix()
TIPPED = Rotation.from_euler("ZYX", [0, 90, 0], degrees=True).as_matrix()


def checks(tmp_path: Path, **how: object) -> dict[str, Check]:
    found = check_setup(read(write(tmp_path / "ride.tlog", Ride(**how))))
    return {check.name: check for check in found}


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Check]:
    return checks(tmp_path_factory.mktemp("healthy"), told={"COMPASS_OFS_X": 100.0,
                  "COMPASS_OFS_Y": 0.0, "COMPASS_OFS_Z": 0.0})  # fmt: skip


@pytest.mark.parametrize("name", ["compass 1", "heading", "accelerometer 1", "gyroscopes",
                                  "offsets of compass 1", "interference at compass 1"])  # fmt: skip
def test_what_is_set_up_well_is_in_order(healthy: dict[str, Check], name: str) -> None:
    assert healthy[name].verdict == "in order", healthy[name].text


def test_nothing_is_wrong_with_a_healthy_vehicle(healthy: dict[str, Check]) -> None:
    assert [check for check in healthy.values() if check.verdict == "wrong"] == []


@pytest.mark.parametrize(
    ("name", "matrix"),
    [("ROLL_180", FLAT), ("PITCH_90", TIPPED)],
)
def test_a_turned_compass_is_named_by_its_orientation(
    tmp_path: Path, name: str, matrix: np.ndarray
) -> None:
    check = checks(tmp_path, compass=matrix)["compass 1"]
    assert check.verdict == "wrong"
    assert f"with {name} beside" in check.text
    assert check.numbers["miss_best_deg"] < 3 < 30 < check.numbers["miss_as_set_deg"]


def test_a_mirrored_compass_is_named_by_its_axis(tmp_path: Path) -> None:
    check = checks(tmp_path, compass=np.diag([1.0, -1.0, 1.0]))["compass 1"]
    assert check.verdict == "wrong"
    assert "the y axis reversed" in check.text


def test_a_turned_compass_is_not_named_where_no_place_is_told(tmp_path: Path) -> None:
    check = checks(tmp_path, compass=QUARTER, has_place=False)["compass 1"]
    assert check.verdict == "not known"
    assert "no place" in check.text


def test_one_direction_of_the_field_names_no_orientation(tmp_path: Path) -> None:
    """A vehicle that keeps its heading sees one direction: many orientations explain it."""
    assert (
        checks(tmp_path, compass=QUARTER, turns=False, length=20.0)["compass 1"].verdict
        != "in order"
    )


@pytest.mark.parametrize("degrees", [-120, 90, 180])
def test_a_heading_that_is_off_is_found_by_where_the_vehicle_goes(
    tmp_path: Path, degrees: int
) -> None:
    """The heading is so much too large: the vehicle goes so much to the left of where it leans."""
    check = checks(tmp_path, heading_off=np.radians(degrees))["heading"]
    assert check.verdict == "wrong"
    off = (check.numbers["off_deg"] + degrees + 180) % 360 - 180
    assert abs(off) < 5


def test_a_receiver_that_contradicts_its_own_places_turns_no_compass(tmp_path: Path) -> None:
    """Its course is off by 90 degrees, and so where the vehicle seems to go; its places are not."""
    check = checks(tmp_path, course_off=np.radians(90))["heading"]
    assert check.numbers["off_deg"] == pytest.approx(90, abs=5)
    assert check.verdict == "not known"
    assert not check.strikes
    assert "not that of its own positions" in check.text


@pytest.mark.parametrize("name", ["accelerometer 1", "compass 1"])
def test_a_spin_after_a_failure_turns_no_sensor(tmp_path: Path, name: str) -> None:
    """80 m/s2 of a spin push the mean force 80 degrees off the top, in two thirds of the flight."""
    check = checks(tmp_path, upset=20.0)[name]
    assert check.verdict == "in order", check.text


def test_a_vehicle_that_lies_on_its_side_has_no_turned_board(tmp_path: Path) -> None:
    """Accelerometer and attitude agree: nothing tells a turned board from a vehicle that lies."""
    side = Rotation.from_euler("ZYX", [0, 0, -90], degrees=True).as_matrix()
    check = checks(tmp_path, accelerometer=side.T, lies=True)["accelerometer 1"]
    assert check.verdict == "not known"
    assert check.strikes
    assert "so says the attitude" in check.text


def test_a_compass_that_is_not_used_strikes_nobody(tmp_path: Path) -> None:
    check = checks(tmp_path, compass=QUARTER, told={"COMPASS_USE": 0.0})["compass 1"]
    assert check.verdict == "not known"
    assert not check.stands_out
    assert "does not use it" in check.text


def test_a_board_upside_down_shows_in_flight(tmp_path: Path) -> None:
    check = checks(tmp_path, accelerometer=FLAT)["accelerometer 1"]
    assert check.verdict == "wrong"
    assert check.numbers["off_deg"] == pytest.approx(180, abs=5)


def test_turned_gyroscopes_do_not_explain_the_attitude(tmp_path: Path) -> None:
    check = checks(tmp_path, gyroscope=QUARTER)["gyroscopes"]
    assert check.verdict == "wrong"
    assert check.numbers["explained_best"] > 0.9


def test_current_that_moves_the_compass_is_told_by_ampere(tmp_path: Path) -> None:
    """20 mgauss on each axis make 34.6 per ampere."""
    check = checks(tmp_path, per_ampere=20.0)["interference at compass 1"]
    assert check.verdict == "wrong"
    assert check.numbers["mgauss_per_ampere"] == pytest.approx(20 * 3**0.5, rel=0.05)


def test_large_offsets_are_told(tmp_path: Path) -> None:
    told = {"COMPASS_OFS_X": 1500.0, "COMPASS_OFS_Y": 1200.0, "COMPASS_OFS_Z": 0.0}
    check = checks(tmp_path, told=told, length=15.0)["offsets of compass 1"]
    assert check.verdict == "wrong"
    assert "1921 mgauss" in check.text


def test_a_declination_of_another_country_is_told(tmp_path: Path) -> None:
    told = {"COMPASS_AUTODEC": 0.0, "COMPASS_DEC": float(np.radians(-15.0))}
    check = checks(tmp_path, told=told, length=15.0)["declination"]
    assert check.verdict == "wrong"
    assert check.settings[0].suggested == 1.0
    assert check.numbers["place_deg"] == pytest.approx(3.2, abs=0.5)


def test_a_declination_that_may_stand_in_for_an_orientation_is_not_to_be_changed_alone(tmp_path):
    """A recorded compass was mounted backwards, and 180 degrees of declination made it good."""
    told = {"COMPASS_AUTODEC": 0.0, "COMPASS_DEC": float(np.radians(-177.0))}
    check = checks(tmp_path, told=told, length=15.0)["declination"]
    assert (check.verdict, check.strikes, check.settings) == ("not known", True, ())
    assert "mounted turned" in check.text


def test_thrust_to_weight_follows_the_curve(tmp_path: Path) -> None:
    """Half of the spin range at an expo of 0.65: 0.35 / 2 + 0.65 / 4 of the thrust."""
    told = {"MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0, "MOT_THST_EXPO": 0.65,
            "MOT_SPIN_MIN": 0.15, "MOT_SPIN_MAX": 0.95}  # fmt: skip
    check = checks(tmp_path, told=told, output=1550)["thrust to weight"]
    assert check.verdict == "in order"
    assert check.numbers["ratio_least"] == pytest.approx(1 / (0.35 / 2 + 0.65 / 4), rel=1e-3)


def test_too_little_thrust_is_told(tmp_path: Path) -> None:
    told = {"MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0}
    assert checks(tmp_path, told=told, output=1850)["thrust to weight"].verdict == "wrong"
    full = checks(tmp_path, told=told, output=1950)
    assert full["motor limits"].verdict == "wrong"


def test_a_rover_gets_no_check_of_motors(tmp_path: Path) -> None:
    found = checks(tmp_path, kind=mav.MAV_TYPE_GROUND_ROVER)
    assert "thrust to weight" not in found
    assert "motors" not in found


def test_orientations_are_rotations_and_each_is_there_once() -> None:
    found = sensor_rotations()
    assert len(found) >= 38
    assert np.array_equal(found[0].matrix, np.eye(3))
    for one in found:
        assert one.matrix @ one.matrix.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(one.matrix) == pytest.approx(1.0)


def test_attitudes_are_those_of_scipy() -> None:
    angles = np.random.default_rng(1).uniform(-3, 3, (50, 3))
    expected = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix()
    assert to_earth(*angles.T) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("scale", "verdict"), [(1.0, "in order"), (1.06, "in order"), (0.85, "wrong"), (1.1, "wrong")]
)
def test_an_accelerometer_that_reads_another_weight_at_rest_is_wrong(tmp_path, scale, verdict):
    """Beyond the 80 mg that its maker grants one that nobody has calibrated."""
    name = "accelerometer 1" if verdict == "in order" else "weight on accelerometer 1"
    check = checks(tmp_path, accelerometer=scale * np.eye(3))[name]
    assert check.verdict == verdict
    assert ("its weight is 9.81" in check.text) == (verdict == "wrong")
    assert check.numbers["force_m_s2"] == pytest.approx(9.81 * scale, abs=0.3)


def test_a_weight_has_its_size_on_the_legs_and_on_the_back(tmp_path: Path) -> None:
    """The mean of both is three quarters of it."""
    parts = []
    for k in range(8 * 25):
        stamp, down = 40 * k, -1000 if k < 7 * 25 else 1000
        parts += [
            record(k / 25, mav.MAVLink_attitude_message(stamp, *(6 * [0.0]))),
            record(k / 25, mav.MAVLink_raw_imu_message(1000 * stamp, 0, 0, down, *(6 * [0]))),
        ]
    path = tmp_path / "turned over.tlog"
    path.write_bytes(b"".join(parts))
    found = {check.name: check for check in check_setup(read(path))}
    assert found["accelerometer 1"].verdict != "wrong"
    assert "no weight" not in found["accelerometer 1"].text


@pytest.mark.parametrize("stands_s", [0.0, 4.0])
def test_a_plane_that_rolls_is_not_at_rest(tmp_path: Path, stands_s: float) -> None:
    """Its engine pushes it with 5 m/s2 for 4 s: it feels 11 until it climbs at 20 m/s."""
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    beat = mav.MAVLink_heartbeat_message(1, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, 0, 4, 3)
    parts = []
    for k in range(25 * 40):
        t = k / 25
        speed = 5.0 * min(max(t - stands_s, 0.0), 4.0)
        climbs = 3.0 * max(t - stands_s - 4.0, 0.0)
        rolls = 510 if 0 < speed < 20 else 0
        stamp, way = 40 * k, round(1e7 * (8 + 20 * t / 76e3))
        position = (470000000, way, round(1000 * (400 + climbs)), round(1000 * climbs))
        fix = (1000 * stamp, 3, *position[:3], 80, 80, round(100 * speed), 9000, 12)
        said = [
            *([beat] if k % 25 == 0 else []),
            mav.MAVLink_attitude_message(stamp, *(6 * [0.0])),
            mav.MAVLink_raw_imu_message(1000 * stamp, rolls, 0, -1000, *(6 * [0])),
            mav.MAVLink_global_position_int_message(stamp, *position, 0, 0, 0, 0),
            mav.MAVLink_gps_raw_int_message(*fix),
            mav.MAVLink_vfr_hud_message(speed, speed, 0, 80, 400 + climbs, 0.0),
        ]
        parts += [record(t, one) for one in said]
    path = tmp_path / "rolls.tlog"
    path.write_bytes(b"".join(parts))
    found = {check.name: check for check in check_setup(read(path))}["accelerometer 1"]
    assert found.verdict == "in order"
    assert found.numbers["force_m_s2"] == pytest.approx(9.81, abs=0.2)


@pytest.mark.parametrize(
    ("turned", "used", "verdict"),
    [(0.0, 1.0, "in order"), (40.0, 1.0, "not known"), (-90.0, 1.0, "wrong"),
     (180.0, 1.0, "wrong"), (90.0, 0.0, "not known")],
)  # fmt: skip
def test_compasses_that_point_elsewhere_on_the_ground_do_not_agree(tmp_path, turned, used, verdict):
    """A vehicle that stands askew in a field that dips by 60 degrees, and never flies."""
    roll, pitch = 0.2, -0.1
    lean = Rotation.from_euler("ZYX", [0.7, pitch, roll])
    field = lean.inv().apply(500 * np.array([0.5, 0.0, 0.87]))
    other = Rotation.from_euler("Z", turned, degrees=True).apply(lean.apply(field))
    readings = (np.round(x).astype(int).tolist() for x in (field, lean.inv().apply(other)))
    first, second = readings
    parts = [record(0.0, mav.MAVLink_param_value_message(b"COMPASS_USE2", used, 9, 1, 0))]
    noise = np.random.default_rng(1).integers(-5, 6, (100, 3))
    for k in range(100):
        stamp, own = 100 * k, [x + int(n) for x, n in zip(first, noise[k], strict=True)]
        parts += [
            record(k / 10, mav.MAVLink_attitude_message(stamp, roll, pitch, 0.7, 0, 0, 0)),
            record(k / 10, mav.MAVLink_raw_imu_message(1000 * stamp, *(6 * [0]), *own)),
            record(k / 10, mav.MAVLink_scaled_imu2_message(stamp, *(6 * [0]), *second[:2],
                                                           second[2] + k % 2)),
        ]  # fmt: skip
    path = tmp_path / "stands.tlog"
    path.write_bytes(b"".join(parts))
    found = {check.name: check for check in check_setup(read(path))}["agreement of compass 2"]
    assert found.verdict == verdict
    assert found.numbers["apart_deg"] == pytest.approx(abs(turned), abs=2.0)
