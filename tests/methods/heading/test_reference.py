"""The formulas against vectors checked with pyproj and pymap3d; pymap3d once more here."""

import json
from pathlib import Path

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.methods.heading.compute import compass_heading, heading_of_course, image_rotation
from fdi.methods.heading.geodesy import (
    Place,
    geocentric,
    geodetic,
    isometric_latitude,
    loxodrome_course,
    metres_per_radian,
    wrap,
)
from fdi.methods.heading.tilt import accelerometer_tilt, angle_rates, complementary
from fdi.methods.heading.trees import NAMELESS, TREE_A, TREE_B, possible, tree_a, tree_b

FILE = Path(__file__).parents[4] / "shared" / "methods" / "heading_vectors.json"
VECTORS = json.loads(FILE.read_text()) if FILE.is_file() else {}
needs_vectors = pytest.mark.skipif(not VECTORS, reason="the vectors are not beside the repository")
LATITUDES = st.floats(-1.5, 1.5)
LONGITUDES = st.floats(-3.1, 3.1)


def cases(name: str) -> list:
    return VECTORS[name]["cases"] if VECTORS else []


def off(one: float, other_deg: float) -> float:
    """Return how far an angle in rad is from one in deg, deg."""
    return abs(float(np.degrees(wrap(one - np.radians(other_deg)))))


@needs_vectors
@pytest.mark.parametrize("case", cases("tilt_compensation"))
def test_a_compass_is_levelled(case: dict) -> None:
    roll, pitch, declination = (
        np.radians(case[f"{x}_deg"]) for x in ("roll", "pitch", "declination")
    )
    field = np.array(case["mag_body_gauss"])[:, None]
    for extra, name in ((0.0, "magnetic"), (declination, "true")):
        found = compass_heading(field, np.array([roll]), np.array([pitch]), extra)[0]
        assert off(found, case[f"expected_{name}_heading_deg"]) < 1e-9


@needs_vectors
@pytest.mark.parametrize("case", cases("accelerometer_tilt"))
def test_accelerometers_tell_the_tilt(case: dict) -> None:
    roll, pitch = accelerometer_tilt(np.array(case["specific_force_body"])[:, None])
    assert off(roll[0], case["expected_roll_deg"]) < 1e-9
    assert off(pitch[0], case["expected_pitch_deg"]) < 1e-9


@needs_vectors
def test_the_complementary_filter() -> None:
    case = VECTORS["complementary_filter"]
    t = case["dt_s"] * np.arange(len(case["p"]))
    rates = np.array([case[x] for x in "pqr"])
    seen = (np.array(case["accel_roll"]), np.array(case["accel_pitch"]))
    found = complementary(t, rates, *seen, np.full(t.size, case["k"]))
    expected = np.array([[one["roll"], one["pitch"]] for one in case["expected"]]).T
    assert np.abs(found - expected).max() < case["tolerance_rad"]


@needs_vectors
@pytest.mark.parametrize("case", cases("loxodrome"))
def test_loxodromes(case: dict) -> None:
    ends = [np.radians(case[f"{x}{i}_deg"]) for i in (1, 2) for x in ("lat", "lon")]
    for i in (1, 2):
        known = case.get(f"expected_isometric_lat{i}")
        if known is not None:
            assert isometric_latitude(np.radians(case[f"lat{i}_deg"])) == pytest.approx(
                known, 1e-12
            )
    assert off(loxodrome_course(*ends), case["expected_course_deg"]) < 1e-7


@needs_vectors
@pytest.mark.parametrize("case", cases("bowring"))
def test_bowring(case: dict) -> None:
    found = geodetic(np.array(case["ecef_m"]))
    assert off(found.lat, case["expected_lat_deg"]) < 1e-9
    assert off(found.lon, case["expected_lon_deg"]) < 1e-9
    assert abs(found.height - case["expected_height_m"]) < 1e-4


@needs_vectors
@pytest.mark.parametrize("case", cases("topocentric_to_geodetic"))
def test_places_seen_from_an_origin(case: dict) -> None:
    lat, lon = (np.radians(case[f"origin_{x}_deg"]) for x in ("lat", "lon"))
    moved = (case["north_m"], case["east_m"], case["up_m"])
    xyz = geocentric(*moved, Place(lat, lon, case["origin_height_m"]))
    assert np.abs(xyz - case["expected_ecef_m"]).max() < 1e-6
    found = geodetic(xyz)
    assert off(found.lat, case["expected_lat_deg"]) < 1e-9
    assert off(found.lon, case["expected_lon_deg"]) < 1e-9
    assert abs(found.height - case["expected_height_m"]) < 1e-5


@needs_vectors
@pytest.mark.parametrize("case", cases("course_to_heading"))
def test_the_heading_of_a_course(case: dict) -> None:
    moved = [case[x] for x in ("ground_vn", "ground_ve", "wind_to_n", "wind_to_e")]
    found = heading_of_course(*moved, np.radians(case["sideslip_deg"]))
    assert off(found, case["expected_heading_deg"]) < 1e-9


@needs_vectors
@pytest.mark.parametrize("case", cases("optical_rotation"))
def test_a_picture_turns(case: dict) -> None:
    found = image_rotation(np.array(case["frame1"]), np.array(case["frame2"]))
    assert off(found, case["expected_rotation_deg"]) < 1e-9


@needs_vectors
@pytest.mark.parametrize(("name", "tree"), [("tree_a", tree_a), ("tree_b", tree_b)])
def test_the_trees(name: str, tree) -> None:
    table = VECTORS[name]["table"]
    assert len(table) == 8
    for row in table:
        assert tree(tuple(bool(x) for x in row["inp"])) == {row["expected"]}


def test_two_sources_name_nobody() -> None:
    assert tree_a((True, None, None)) == {"inertial", "satellite"}
    assert tree_a((None, True, None)) == {"inertial", "optical"}
    assert tree_a((False, None, None)) == {"none"}
    assert tree_a((None, None, None)) == frozenset()
    assert tree_b((None, True, None)) == {"accelerometer", "angular_rate"}
    assert tree_b((None, False, None)) == {"none", "magnetometer"}


@given(st.sampled_from([TREE_A, TREE_B]), st.tuples(*[st.sampled_from([True, False, None])] * 3))
def test_what_is_not_known_never_rules_out_what_is_true(table, pairs) -> None:
    """Whatever the absent pairs were: the block named with all three is among those possible."""
    seen = possible(table, pairs)
    for whole, verdict in table.items():
        fits = all(p is None or p == q for p, q in zip(pairs, whole, strict=True))
        if fits and any(pairs) and verdict not in NAMELESS:
            assert verdict in seen


@given(
    LATITUDES, LONGITUDES, st.floats(-400, 2e4), *[st.floats(-5e3, 5e3)] * 2, st.floats(-90, 500)
)
def test_there_and_back_as_pymap3d_does(lat, lon, height, north, east, up) -> None:
    found = geodetic(geocentric(north, east, up, Place(lat, lon, height)))
    other = pymap3d.enu2geodetic(east, north, up, lat, lon, height, deg=False)
    assert abs(found.lat - other[0]) < 1e-10
    assert abs(wrap(found.lon - other[1])) < 1e-9
    assert abs(found.height - other[2]) < 1e-4


@given(LATITUDES, LONGITUDES, st.floats(0.0, 6.28), st.floats(1.0, 2e3))
def test_a_short_leg_has_the_course_it_is_made_with(lat, lon, course, length) -> None:
    per = metres_per_radian(lat)
    there = lat + length * np.cos(course) / per[0], lon + length * np.sin(course) / per[1]
    # the longitude's metres change along the leg: half a leg's turn of the meridians
    allowed = 1e-6 + length / 6.3e6 * np.tan(abs(lat))
    assert abs(wrap(loxodrome_course(lat, lon, *there) - course)) < allowed


@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), *[st.floats(-1.0, 1.0)] * 3)
def test_angle_rates_are_those_of_rotations(roll, pitch, p, q, r) -> None:
    from scipy.spatial.transform import Rotation

    step = 1e-6
    before = Rotation.from_euler("ZYX", [0.3, pitch, roll])
    after = before * Rotation.from_rotvec(step * np.array([p, q, r]))
    change = (after.as_euler("ZYX") - before.as_euler("ZYX"))[::-1] / step
    found = angle_rates(np.array([roll]), np.array([pitch]), np.array([[p], [q], [r]]))[:, 0]
    assert np.abs(found - change).max() < 1e-3


def test_a_gyroscope_goes_on_alone_where_the_accelerometer_is_not_known() -> None:
    t = np.arange(0.0, 5.0, 0.02)
    rates = np.zeros((3, t.size))
    rates[0] = 0.1
    roll = np.where(t < 1.0, 0.0, np.nan)
    found = complementary(t, rates, roll, np.zeros(t.size), np.full(t.size, 0.0))
    assert found[0, -1] == pytest.approx(0.1 * (t[-1] - t[t < 1.0][-1]), abs=1e-9)
