"""What a message says over a while: a position against its own velocity, a battery's charge."""

from pathlib import Path

import numpy as np
import pytest
from flights import ROOT, SHARED, joined, records

import fdi
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault
from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.telemetry import Channel, read
from fdi.telemetry.signals import TIME

pytestmark = pytest.mark.flights

HEALTHY = ROOT / "examples" / "healthy_logs"
COPTER = HEALTHY / "copter_gusts.tlog"
LOGS = [HEALTHY / f"{name}.tlog" for name in ("copter_gusts", "plane_turbulence", "px4_quad")]
EVERY = pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
STRAYS, CHARGE = "gps_position_strays", "battery_charge_lost"
SCATTERS, JUMPS = "barometer_scatters", "gps_position_scatters"
RADIUS = 6371000.0
"""Of the sphere that stands for the earth, m."""
TOLERANCE = 3.0


class Told:
    """What one statement did in the analysis of a log."""

    def __init__(self, path: Path, name: str):
        self.analysis = fdi.analyze(path)
        alarms = self.analysis.alarms
        equations = alarms.residuals.bank.system.equations
        generators = alarms.residuals.bank.generators
        (row,) = [i for i, g in enumerate(generators) if equations[g.residual].name == name]
        self.t = alarms.residuals.signals.t
        self.values = alarms.residuals.values[row]
        self.alarmed = self.t[alarms.alarm[row]]

    @property
    def accused(self) -> list[str]:
        return [finding.component for finding in self.analysis.diagnosis.findings]


def with_fault(path: Path, text: str, folder: Path) -> Path:
    other = folder / path.name
    other.write_bytes(injected(read(path), parse_fault(text)))
    return other


def middle(path: Path) -> float:
    low, high = read(path).span
    return round((low + high) / 2, 1)


def edited(path: Path, edit, folder: Path, names=("GPS_RAW_INT",), between=(0.0, np.inf)) -> Path:
    """A log with records of some messages changed, ``between`` two moments of it, s."""
    every = records(path)
    first = every[0].stamp
    low, high = (first + 1e6 * moment for moment in between)
    other = folder / path.name
    other.write_bytes(
        joined(
            one.edited(edit) if one.name in names and low <= one.stamp < high else one
            for one in every
        )
    )
    return other


@EVERY
def test_a_receiver_in_health_goes_as_fast_as_it_says(path):
    told = Told(path, STRAYS)
    assert np.isfinite(told.values).mean() > 0.3
    assert np.nanmax(told.values) < 0.5 * TOLERANCE
    assert len(told.alarmed) == 0
    assert told.accused == []


@EVERY
@pytest.mark.parametrize("axis", ["lat", "lon"])
def test_a_position_that_drifts_by_a_metre_a_second_is_seen_and_the_receiver_named(
    path, axis, tmp_path
):
    """24 m in the 20 s over which it is measured: more than healthy receivers stray."""
    start = middle(path)
    text = f"GPS_RAW_INT.{axis}:drift={1.2 / RADIUS}@{start}"
    told = Told(with_fault(path, text, tmp_path), STRAYS)
    assert start + 1 < told.alarmed[0] < start + 20
    assert told.accused == ["gps"]


@pytest.mark.parametrize("path", LOGS[:2], ids=lambda path: path.stem)
def test_a_barometer_in_health_hardly_scatters(path):
    told = Told(path, SCATTERS)
    assert np.isfinite(told.values).mean() > 0.3
    assert np.ptp(told.values[np.isfinite(told.values)]) < 5.0  # Pa
    assert len(told.alarmed) == 0


@pytest.mark.parametrize("path", LOGS[:2], ids=lambda path: path.stem)
def test_a_barometer_that_jumps_about_by_a_metre_and_a_half_is_named(path, tmp_path):
    """Of zero mean: neither a height nor its mean is far off."""
    start = middle(path)
    told = Told(with_fault(path, f"SCALED_PRESSURE.press_abs:noise=18@{start}", tmp_path), SCATTERS)
    assert start < told.alarmed[0] < start + 8
    told_after = told.values[(told.t > start + 11) & np.isfinite(told.values)]
    assert -told_after == pytest.approx(18, abs=10)  # of 40 numbers that are drawn
    assert told.accused[:1] == ["barometer"]


@EVERY
def test_a_receiver_in_health_hardly_scatters(path):
    told = Told(path, JUMPS)
    assert np.isfinite(told.values).mean() > 0.3
    assert np.nanmax(-told.values) < 0.6  # m
    assert len(told.alarmed) == 0


@EVERY
@pytest.mark.parametrize("axis", ["lat", "lon"])
def test_a_receiver_that_jumps_about_by_two_metres_is_named(path, axis, tmp_path):
    """Of zero mean: neither a position nor its mean is far off."""
    start = middle(path)
    text = f"GPS_RAW_INT.{axis}:noise={2.0 / RADIUS}@{start}"
    told = Told(with_fault(path, text, tmp_path), JUMPS)
    assert start < told.alarmed[0] < start + 9
    assert told.accused[:1] == ["gps"]


CLIMBS = SHARED / "sitl" / "varied" / "v01_hexap_rangefinder_squares.tlog"


@pytest.mark.skipif(not CLIMBS.is_file(), reason="no ../shared")
def test_a_range_finder_is_calibrated_by_every_climb(tmp_path):
    told = Told(CLIMBS, "rangefinder_scaled")
    assert np.isfinite(told.values).mean() > 0.3
    assert len(told.alarmed) == 0
    start = middle(CLIMBS)
    text = f"DISTANCE_SENSOR.current_distance:scale=1.5@{start}"
    told = Told(with_fault(CLIMBS, text, tmp_path), "rangefinder_scaled")
    assert start - 10 < told.alarmed[0] < start + 20  # half of the window on both sides
    assert told.accused == ["rangefinder"]


def test_a_fix_that_is_lost_says_nothing_of_the_way_before_or_after_it(tmp_path):
    """Without a fix a receiver sends zeros; these are not where it comes from later."""

    def lost(message):
        message.fix_type = 1
        message.lat = message.lon = message.vel = message.cog = 0

    start = middle(COPTER)
    span = (start, start + 3)
    told = Told(edited(COPTER, lost, tmp_path, between=span), STRAYS)
    assert np.nanmax(told.values) < 0.5 * TOLERANCE
    after = (told.t > start + 1) & (told.t < start + 20)
    assert np.isnan(told.values[after]).all()
    assert np.isfinite(told.values[told.t > start + 25]).any()
    assert told.accused == ["gps"]  # for the fix


def test_the_date_line_is_a_line_like_any_other(tmp_path):
    path = HEALTHY / "plane_turbulence.tlog"
    t, lon, _ = read(path).channel(Channel.parse("GPS_RAW_INT.lon"))
    whole = 3_600_000_000
    away = whole // 2 - round(np.degrees(np.interp(middle(path), t, lon)) * 1e7)

    def move(message):
        for field in ("lon", "lng"):
            if hasattr(message, field):
                moved = getattr(message, field) + away
                setattr(message, field, (moved + whole // 2) % whole - whole // 2)

    names = ("GPS_RAW_INT", "GLOBAL_POSITION_INT", "AHRS2", "AHRS3", "SIMSTATE")
    there = edited(path, move, tmp_path, names)
    _, crossed, _ = read(there).channel(Channel.parse("GPS_RAW_INT.lon"))
    assert crossed.min() < -3
    assert crossed.max() > 3
    told, at_home = Told(there, STRAYS), Told(path, STRAYS)
    np.testing.assert_allclose(told.values, at_home.values, atol=0.1)
    assert told.accused == []


def strayed(t, north, east, v_n, v_e):
    """What the model makes of a receiver's records, m."""
    airframe = load_airframe("quadcopter")
    course = np.arctan2(v_e, v_n)
    course[0] += 1e-3  # a course that has never moved may be of no receiver
    columns = {
        TIME: t,
        "earth_radius": RADIUS,
        "course_speed_min": airframe.parameters["course_speed_min"].value,
        "lat": 0.6 + north / RADIUS,
        "lon": 2.0 + east / RADIUS / np.cos(0.6),
        "vel": np.hypot(v_n, v_e),
        "cog": course % (2 * np.pi),
    }
    known = {"gps_apart": airframe.parameters["gps_apart"].value}
    for one in airframe.measurements:
        if one.channel.field.endswith(":over") and one.channel.message == "GPS_RAW_INT":
            known[one.variable] = evaluate(one.value, columns)
    (equation,) = [e for e in airframe.equations if e.name == "pos_8"]
    return evaluate(equation.right, known)


@pytest.mark.parametrize("period", [0.1, 0.2, 1.0])
@pytest.mark.parametrize(("speed", "radius"), [(25.0, 60.0), (15.0, 30.0), (5.0, 10.0)])
@pytest.mark.parametrize("late", [-0.2, 0.0, 0.2])
def test_in_a_turn_a_position_may_be_of_another_moment_than_the_velocity(
    period, speed, radius, late
):
    t = np.arange(0, 120, period)
    begins = 40.0  # straight on, then in circles
    angle, before = (np.maximum(s - begins, 0) * speed / radius for s in (t, t - late))
    straight = speed * np.minimum(t - late - begins, 0)
    found = strayed(
        t,
        straight + radius * np.sin(before),
        radius * (1 - np.cos(before)),
        speed * np.cos(angle),
        speed * np.sin(angle),
    )
    assert np.isfinite(found[t >= 21]).all()
    assert np.nanmax(found) < 0.7 * TOLERANCE


@pytest.mark.parametrize("drift", [0.25, 1.0])
def test_a_position_that_drifts_strays_by_as_much_as_it_does_in_twenty_seconds(drift):
    t = np.arange(0, 120, 0.2)
    zero = np.zeros(len(t))
    north = 3.0 * t + drift * np.maximum(t - 60, 0)
    found = strayed(t, north, 4.0 * t, zero + 3.0, zero + 4.0)
    expected = drift * np.clip(t - 60, 0, 20)
    np.testing.assert_allclose(found[t >= 20.1], expected[t >= 20.1], atol=0.02)


@pytest.mark.parametrize(("speed", "held", "most"), [(0.4, True, 0.1), (0.4, False, 0.1)])
def test_a_slow_vehicle_on_a_held_course_does_not_stray(speed, held, most):
    """It goes in a circle of 4 m, and its receiver says north all the time."""
    t = np.arange(0, 120, 0.2)
    angle = t * speed / 4.0
    told = np.where(held & (t > 1), 0.0, angle)
    found = strayed(
        t, 4.0 * np.sin(angle), -4.0 * np.cos(angle), speed * np.cos(told), speed * np.sin(told)
    )
    assert np.isfinite(found[t >= 21]).all()
    assert np.nanmax(found) < most


def test_a_position_that_drifts_while_the_course_is_held_strays_by_what_the_speed_leaves_open():
    t = np.arange(0, 120, 0.2)
    zero = np.zeros(len(t))
    found = strayed(t, 1.0 * np.maximum(t - 60, 0), zero, zero + 0.2, zero)
    assert found[-1] == pytest.approx(20 * (1.0 - 0.2), abs=0.1)


def test_a_battery_that_loses_its_charge_at_once_is_named(tmp_path):
    def empty(message):
        message.battery_remaining = 20

    start = middle(COPTER)
    told = Told(edited(COPTER, empty, tmp_path, ("SYS_STATUS",), (start, np.inf)), CHARGE)
    assert start - 1 < told.alarmed[0] < start + 3
    assert told.accused == ["battery"]


def test_a_link_that_loses_seconds_does_not_hide_a_lost_charge(tmp_path):
    """A change is told by its two ends, whatever was lost in between."""
    start = middle(COPTER)

    def empty(message):
        message.battery_remaining = 20

    path = edited(COPTER, empty, tmp_path, ("SYS_STATUS",), (start, np.inf))
    every = records(path)
    first = every[0].stamp
    path.write_bytes(joined(one for one in every if (one.stamp - first) / 1e6 % 5 < 3.4))
    told = Told(path, CHARGE)
    assert start - 1 < told.alarmed[0] < start + 5
    assert told.accused == ["battery"]


@pytest.mark.parametrize("said", [-1, None])
def test_a_battery_in_health_or_one_that_does_not_tell_loses_nothing(said, tmp_path):
    """-1 is MAVLink's word for a charge that is not known."""

    def unknown(message):
        message.battery_remaining = said

    start = middle(COPTER)
    path = COPTER
    if said is not None:
        path = edited(COPTER, unknown, tmp_path, ("SYS_STATUS",), (start, start + 10))
    told = Told(path, CHARGE)
    assert np.nanmax(told.values) == 0
    assert len(told.alarmed) == 0
    assert told.accused == []


@pytest.mark.parametrize(("rise", "is_told"), [(2.0, False), (12.0, True)])
def test_vibration_is_told_by_how_many_times_it_has_grown(rise, is_told, tmp_path):
    """From 0.5 m/s^2: by 4.4 dB, and by 19, where 12 m/s^2 are little for who shook by 10."""
    start = middle(COPTER)
    told = Told(
        with_fault(COPTER, f"VIBRATION.vibration_z:bias={rise}@{start}", tmp_path),
        "vibration_z_grown",
    )
    assert bool(told.alarmed.size) == is_told
    assert ("vibration" in told.accused) == is_told
    level = -np.nanmedian(told.values[told.t > start + 5.0])
    assert level == pytest.approx(20 * np.log10(1.47 + rise), abs=1.0)
