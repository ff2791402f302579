"""What the shipped models say of motion, air and field, against outside authorities.

A flight is made up from smooth functions of time; scipy's rotations, pymap3d's geodesy and the
table of the standard atmosphere say what sensors would show. Every relation has to hold of that.
"""

from functools import cache
from itertools import product

import numpy as np
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fdi.model import load_airframe
from fdi.model.evaluate import evaluate, holds

G = 9.80665
STEP = 1e-3
T = np.arange(-0.5, 0.5, STEP)
model = cache(load_airframe)
waves = st.tuples(st.floats(-1, 1), st.floats(0.5, 3), st.floats(-3, 3))
three_waves = st.tuples(waves, waves, waves)


def wave(size, of, derivative=0):
    """A sine with its amplitude as a share of ``size``, or its derivative."""
    share, pulse, phase = of
    return size * share * pulse**derivative * np.sin(pulse * T + phase + derivative * np.pi / 2)


def left_and_right(name, known, airframe="fixed_wing"):
    """Both sides of a relation over the known variables and the model's parameters."""
    (equation,) = [e for e in model(airframe).equations if e.name == name]
    columns = {n: np.float64(p.value) for n, p in model(airframe).parameters.items()} | known
    return evaluate(equation.left, columns), evaluate(equation.right, columns)


def assert_holds(name, known, tolerance, *, angle=False):
    left, right = left_and_right(name, known)
    off = left - right
    off = np.angle(np.exp(1j * off)) if angle else off
    assert np.abs(off).max() <= tolerance, name


def attitude(turns):
    """Euler angles 3-2-1, rad, and the rotation from body (FRD) to earth (NED)."""
    angles = {
        "roll": wave(2.5, turns[0]),
        "pitch": wave(1.2, turns[1]),
        "yaw": wave(3.0, turns[2]),
    }
    stacked = np.stack([angles["yaw"], angles["pitch"], angles["roll"]], axis=1)
    return angles, Rotation.from_euler("ZYX", stacked)


@given(three_waves)
@settings(max_examples=30, deadline=None)
def test_body_rates_are_those_of_the_rotation(turns):
    angles, to_earth = attitude(turns)
    rates = (to_earth[:-2].inv() * to_earth[2:]).as_rotvec() / (2 * STEP)
    known = {name: value[1:-1] for name, value in angles.items()}
    for axis, turn, size in zip(("roll", "pitch", "yaw"), turns, (2.5, 1.2, 3.0), strict=True):
        known[f"{axis}_rate"] = wave(size, turn, 1)[1:-1]
    for name, variable, column in zip(("att_4", "att_5", "att_6"), "pqr", rates.T, strict=True):
        assert_holds(name, {**known, variable: column}, 2e-4)


@given(three_waves, three_waves)
@settings(max_examples=30, deadline=None)
def test_accelerometers_feel_everything_but_weight(turns, moves):
    angles, to_earth = attitude(turns)
    acceleration = np.stack([wave(20.0, move) for move in moves], axis=1)
    force = to_earth.inv().apply(acceleration - [0.0, 0.0, G])
    known = {**angles, **dict(zip(("a_n", "a_e", "a_d"), acceleration.T, strict=True))}
    for name, variable, column in zip(
        ("acc_4", "acc_5", "acc_6"), ("f_x", "f_y", "f_z"), force.T, strict=True
    ):
        assert_holds(name, {**known, variable: column}, 1e-9)


def test_at_rest_and_level_the_force_points_up():
    known = dict.fromkeys(("roll", "pitch", "yaw", "a_n", "a_e", "a_d"), np.zeros(1))
    assert left_and_right("acc_6", {**known, "f_z": np.array([-G])})[1] == pytest.approx(-G)


@pytest.mark.parametrize("compass", ["1", "2"])
@given(turns=three_waves, declination=st.floats(-3, 3), inclination=st.floats(-1.4, 1.4))
@settings(max_examples=30, deadline=None)
def test_levelled_compass_shows_the_yaw(compass, turns, declination, inclination):
    angles, to_earth = attitude(turns)
    field = 5e-5 * np.array(
        [
            np.cos(inclination) * np.cos(declination),
            np.cos(inclination) * np.sin(declination),
            np.sin(inclination),
        ]
    )
    names = [f"h_{axis}" if compass == "1" else f"h_2_{axis}" for axis in "xyz"]
    shown = dict(zip(names, to_earth.inv().apply(field).T, strict=True))
    known = {**angles, **shown, "declination": np.float64(declination)}
    assert_holds(f"mag_{compass}", {**known, "heading": angles["yaw"]}, 1e-9, angle=True)


# U.S. Standard Atmosphere 1976, table I (below 11 km that of ISO 2533): geometric altitude, m;
# pressure, Pa; density, kg/m^3
ATMOSPHERE = [
    (0, 101325.0, 1.22500),
    (500, 95461.3, 1.16727),
    (1000, 89876.3, 1.11166),
    (2000, 79501.4, 1.00655),
    (5000, 54048.3, 0.736429),
]


@pytest.mark.parametrize(("altitude", "pressure", "density"), ATMOSPHERE)
def test_air_is_the_standard_atmosphere(altitude, pressure, density):
    """The model is in geopotential altitude, which differs by up to 4 m at 5 km."""
    for name, variable in (("alt_1", "pressure"), ("alt_2", "pressure_2")):
        known = {variable: np.array([pressure]), "altitude": np.zeros(1)}
        _, right = left_and_right(name, known)
        assert right[0] == pytest.approx(altitude, abs=0.5 + 8e-4 * altitude)
    known = {"est_altitude": np.array([float(altitude)]), "eas2tas": np.ones(1)}
    _, ratio = left_and_right("air_1", known)
    assert ratio[0] == pytest.approx(np.sqrt(1.225 / density), rel=1e-3)


@given(waves, waves, waves, st.floats(0.5, 15), st.floats(-3, 3))
@settings(max_examples=50, deadline=None)
def test_speed_through_air_is_that_against_wind_from_where_it_comes(north, east, down, speed, come):
    """WIND tells where the wind comes from; what blows from the north pushes south."""
    air = np.stack([wave(20.0, n) for n in (north, east, down)], axis=1)
    wind = -speed * np.array([np.cos(come), np.sin(come), 0.0])
    ground = air + wind
    known = dict(zip(("est_v_n", "est_v_e", "est_v_d"), ground.T, strict=True))
    known |= {"wind_speed": np.full(T.size, speed), "wind_from": np.full(T.size, come)}
    assert_holds("air_8", {**known, "speed_through_wind": np.linalg.norm(air, axis=1)}, 1e-9)


@given(waves, waves)
@settings(max_examples=50, deadline=None)
def test_energy_is_height_and_speed(height, speed):
    climb, v, rate = wave(30.0, height, 1), 25 + wave(9.0, speed), wave(9.0, speed, 1)
    energy = wave(30.0, height) + v**2 / (2 * G)
    known = {"est_climb": climb, "hud_airspeed": v, "speed_rate": rate}
    for name, variable in (("en_2", "energy_rate"), ("en_5", "energy_gain")):
        expected = np.gradient(energy, STEP, edge_order=2)
        assert_holds(name, {**known, variable: expected}, 1e-2)


PLACES = list(product((-65.0, 0.0, 47.0), (-179.99, 8.0)))


@pytest.mark.parametrize(("lat", "lon"), PLACES)
@given(st.floats(-300, 300), st.floats(-300, 300))
@settings(max_examples=20, deadline=None)
def test_places_are_as_far_apart_as_on_the_ellipsoid(lat, lon, north, east):
    """A sphere stands for the earth: good to 0.7 % of the distance, over the date line as well."""
    lat_2, lon_2, _ = pymap3d.ned2geodetic(north, east, 0.0, lat, lon, 0.0)
    known = {
        "est_latitude": np.radians([lat]),
        "latitude": np.radians([lat_2]),
        "est_longitude": np.radians([lon]),
        "longitude": np.radians([lon_2]),
    }
    left, right = left_and_right("pos_1", known)
    assert right[0] - left[0] == pytest.approx(north, abs=0.02 + 7e-3 * abs(north))
    left, right = left_and_right("pos_2", known)
    assert right - left[0] == pytest.approx(east, abs=0.02 + 7e-3 * abs(east))


@given(st.floats(-30, 30), st.floats(-30, 30), st.sampled_from(PLACES))
@settings(max_examples=50, deadline=None)
def test_ground_speed_and_course_are_those_of_the_path(v_n, v_e, place):
    lat, lon = place
    lat_2, lon_2, _ = pymap3d.ned2geodetic(0.1 * v_n, 0.1 * v_e, 0.0, lat, lon, 0.0)
    known = {
        "latitude": np.radians([lat]),
        "latitude_rate": np.radians([(lat_2 - lat) / 0.1]),
        "longitude_rate": np.array([np.angle(np.exp(1j * np.radians(lon_2 - lon))) / 0.1]),
        "est_v_n": np.array([v_n]),
        "est_v_e": np.array([v_e]),
    }
    speed = np.hypot(v_n, v_e)
    _, moved = left_and_right("pos_7", {**known, "v_ground": np.array([speed])})
    assert moved[0] == pytest.approx(speed, abs=0.01 + 7e-3 * speed)
    left, _ = left_and_right("pos_3", {**known, "v_ground": np.array([speed])})
    assert left[0] == pytest.approx(speed)
    if speed > 0.1:
        _, course = left_and_right("pos_4", {**known, "course": np.zeros(1)})
        assert course[0] % (2 * np.pi) == pytest.approx(np.arctan2(v_e, v_n) % (2 * np.pi))


@pytest.mark.parametrize(
    ("roll", "counts"), [(0.0, True), (50.0, True), (70.0, False), (180.0, False)]
)
def test_a_receiver_moves_at_its_speed_while_its_antenna_sees_the_sky(roll, counts):
    (equation,) = [e for e in model("fixed_wing").equations if e.name == "pos_7"]
    known = {"airborne": np.array([True]), "roll": np.radians([roll]), "pitch": np.zeros(1)}
    assert holds(equation.when, known).tolist() == [counts]


@pytest.mark.parametrize("axis", ["est_v_n", "est_v_e", "est_v_d"])
def test_a_static_port_errs_by_a_fifth_of_the_dynamic_pressure_whichever_way_it_moves(axis):
    (equation,) = [e for e in model("fixed_wing").equations if e.name == "alt_1"]
    columns = {n: np.float64(p.value) for n, p in model("fixed_wing").parameters.items()}
    still = {"est_v_n": 0.0, "est_v_e": 0.0, "est_v_d": 0.0, "altitude": 0.0}
    off = sum(evaluate(e, columns | still | {axis: 30.0}) for e in equation.errors)
    dynamic = 0.5 * 1.225 * 30.0**2
    assert off == pytest.approx(0.2 * dynamic / (1.225 * G), rel=0.03)


@given(waves)
def test_what_climbs_has_a_negative_velocity_down(down):
    v_d = wave(5.0, down)
    assert_holds("est_7", {"est_v_d": v_d, "est_climb": -v_d}, 0.0)
