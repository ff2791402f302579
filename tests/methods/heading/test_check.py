"""Who is named: a vehicle that moves as it should, and one sensor of it that does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.errors import LogError, UsageError
from fdi.methods.heading import cross_check
from fdi.methods.heading.check import JUMPS, _confirmed, _lately
from fdi.methods.heading.increments import GATE
from fdi.methods.heading.motion import silences
from fdi.methods.heading.trees import UNDECIDED
from fdi.report.heading_text import heading_summary
from fdi.telemetry import Log

from ..setup.sensors import Ride
from .rides import FAILS, METRE, altered, flown, later


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return flown(tmp_path_factory.mktemp("ride") / "healthy.tlog")


def first(log: Log) -> tuple[str, float] | None:
    accused = cross_check(log).accused
    return None if accused is None else (accused.block, accused.start)


def test_nobody_is_named_where_nothing_failed(healthy: Log) -> None:
    check = cross_check(healthy)
    assert check.named == ()
    # one pair alone, once, as it touches down
    assert set(check.verdicts) <= {"none", "undecided"}
    assert check.verdicts.count("none") > 0.98 * len(check.t)
    assert len(check.verdicts) == len(check.t) == len(check.possible)


def test_every_source_is_there_or_says_why_not(healthy: Log) -> None:
    sources = cross_check(healthy).sources
    for one in sources.values():
        assert bool(one.absent) == (not np.isfinite(one.heading).any())
        known = np.isfinite(one.heading)
        assert np.all(one.sigma[known] > 0)
        assert np.all(np.abs(one.heading[known]) <= np.pi)
    assert not sources["compass"].absent
    assert "GPS_RAW_INT.yaw" in sources["receiver_yaw"].absent


def test_a_compass_that_jumps_is_named_within_half_a_second(healthy: Log) -> None:
    check = cross_check(altered(healthy, "RAW_IMU", ymag=later(6e-5)))
    assert check.accused is not None
    assert check.accused.block == "magnetometer"
    assert FAILS - check.ride.cycle <= check.accused.start <= FAILS + 0.5


def test_a_field_that_jumps_along_the_vertical_names_the_compass_at_once(healthy: Log) -> None:
    """No heading shows it while the vehicle is level."""
    check = cross_check(altered(healthy, "RAW_IMU", zmag=later(3e-5)))
    assert check.accused is not None
    assert (check.accused.block, check.accused.by[0]) == ("magnetometer", JUMPS)
    assert FAILS - check.ride.cycle <= check.accused.start <= FAILS + check.ride.cycle


def test_jumps_of_a_field_that_is_not_the_place_s_name_nobody(healthy: Log) -> None:
    """Twice the Earth's field: what is near the compass is most of what it reads."""
    twice = {axis: lambda t, own: 2 * own for axis in ("xmag", "ymag", "zmag")}
    log = altered(altered(healthy, "RAW_IMU", **twice), "RAW_IMU", zmag=later(6e-5))
    assert all(JUMPS not in one.by for one in cross_check(log).named)


def test_a_compass_that_freezes_is_named(healthy: Log) -> None:
    def freeze(t, own):
        return np.where(t >= FAILS, own[np.argmax(t >= FAILS)], own)

    found = first(altered(healthy, "RAW_IMU", xmag=freeze, ymag=freeze, zmag=freeze))
    assert found is not None
    assert found[0] == "magnetometer"
    assert found[1] >= FAILS


@pytest.mark.parametrize("axis", ["xgyro", "ygyro", "zgyro"])
def test_a_gyroscope_that_drifts_is_named(healthy: Log, axis: str) -> None:
    found = first(altered(healthy, "RAW_IMU", **{axis: later(0.2)}))
    assert found is not None
    assert found[0] == "angular_rate"
    assert FAILS <= found[1] <= FAILS + 6.0


@pytest.mark.parametrize("both", [False, True])
def test_a_gyroscope_with_which_another_agrees_is_not_off_alone(healthy: Log, both: bool) -> None:
    drifting = altered(healthy, "RAW_IMU", zgyro=later(0.2))
    second = (drifting if both else healthy)["RAW_IMU"]
    check = cross_check(drifting.with_message(replace(second, name="SCALED_IMU2", instance=None)))
    by_heading = [
        one
        for one in check.named
        if one.block == "angular_rate" and any("heading over" in by for by in one.by)
    ]
    assert (not by_heading) == both


def test_a_compass_is_accused_only_where_the_field_says_so_too() -> None:
    compass, gyro = frozenset({"magnetometer"}), frozenset({"angular_rate"})
    found = _confirmed([compass, compass, gyro], "magnetometer", np.array([True, False, False]))
    assert found == [compass, {"undecided"}, gyro]


def test_a_jump_counts_for_the_window_that_it_is_in() -> None:
    grid = np.arange(0.0, 12.0, 0.5)
    lately = _lately(grid == 3.0, grid, 5.0)
    assert grid[lately] == pytest.approx(np.arange(3.0, 8.0, 0.5))


def test_a_receiver_that_jumps_is_named(healthy: Log) -> None:
    found = first(altered(healthy, "GPS_RAW_INT", lat=later(30 * METRE)))
    assert found is not None
    assert found[0] == "satellite"
    assert FAILS - 0.2 <= found[1] <= FAILS + 0.4


def test_a_receiver_that_drifts_is_named(healthy: Log) -> None:
    def drift(t, own):
        return own + 2 * METRE * np.maximum(t - FAILS, 0.0)

    found = first(altered(healthy, "GPS_RAW_INT", lat=drift))
    assert found is not None
    assert found[0] == "satellite"


def test_a_receiver_that_loses_its_fix_is_named_by_silence(healthy: Log) -> None:
    lost = altered(healthy, "GPS_RAW_INT", fix_type=lambda t, own: np.where(t >= FAILS, 0.0, own))
    check = cross_check(lost)
    assert check.accused is not None
    assert (check.accused.block, check.accused.by) == ("satellite", ("silence",))
    assert check.ride.lost["satellite"][0][0] == pytest.approx(FAILS, abs=0.2)


@pytest.mark.parametrize("length", [None, 0.8])
def test_what_never_told_and_what_paused_is_not_silent(healthy: Log, length: float | None) -> None:
    def fix(t, own):
        if length is None:
            return np.zeros(t.size)
        return np.where((t >= FAILS) & (t < FAILS + length), 0.0, own)

    assert cross_check(altered(healthy, "GPS_RAW_INT", fix_type=fix)).accused is None


def test_a_compass_that_falls_silent_is_named(healthy: Log) -> None:
    def gone(t, own):
        return np.where(t >= FAILS, np.nan, own)

    check = cross_check(altered(healthy, "RAW_IMU", xmag=gone, ymag=gone, zmag=gone))
    assert check.accused is not None
    assert (check.accused.block, check.accused.by) == ("magnetometer", ("silence",))


def test_a_link_that_stops_makes_no_sensor_silent() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    slow = t[::5]
    stops = (t > 20) & (t < 40)
    assert silences(t[~stops], slow[~stops[::5]]) == ()
    (span,) = silences(t, slow[~stops[::5]])
    assert span == pytest.approx((20.0, 40.0), abs=0.5)
    assert silences(t, slow[slow < 40]) == ((pytest.approx(39.5), pytest.approx(t[-1])),)


def test_one_odd_record_names_nobody(healthy: Log) -> None:
    def spike(t, own):
        return own + np.where(np.arange(t.size) == np.argmax(t >= FAILS), 1e-4, 0.0)

    log = altered(healthy, "RAW_IMU", xmag=spike)
    grid = cross_check(log)
    assert all(one.end - one.start <= 6.0 for one in grid.named)
    assert len(grid.named) <= 1


def test_a_pair_agrees_with_its_own_numbers(healthy: Log) -> None:
    for pair in cross_check(altered(healthy, "RAW_IMU", ymag=later(6e-5))).pairs:
        known = np.isfinite(pair.off) & np.isfinite(pair.sigma)
        assert np.array_equal(np.isfinite(pair.disagrees), known)
        far = np.abs(pair.off[known]) > GATE * pair.sigma[known]
        assert np.array_equal(pair.disagrees[known] == 1.0, far)


def test_a_log_without_a_compass_is_told(healthy: Log) -> None:
    def none(t, own):
        return np.zeros(t.size)

    with pytest.raises(LogError, match="no compass"):
        cross_check(altered(healthy, "RAW_IMU", xmag=none, ymag=none, zmag=none))


def test_records_a_second_apart_are_told(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"1\.0 s apart"):
        cross_check(flown(tmp_path / "slow.tlog", Ride(rate=1.0, length=90.0)))


def test_a_flight_that_is_not_there_is_told(healthy: Log) -> None:
    with pytest.raises(UsageError, match="no flight 9"):
        cross_check(healthy, 8)


def test_a_course_at_walking_speed_is_absent(healthy: Log) -> None:
    slow = altered(
        healthy,
        "GPS_RAW_INT",
        vel=lambda t, own: np.full(t.size, 0.5),
        lat=lambda t, own: np.full(t.size, own[0]) + 0.5 * METRE * t,
        lon=lambda t, own: np.full(t.size, own[0]),
        cog=lambda t, own: np.zeros(t.size),
    )
    course = cross_check(slow).sources["course"]
    assert course.absent == (
        "it is nowhere so fast and straight that its course tells it (0.5 m/s at most)"
    )


def test_that_nobody_is_off_alone_is_said_only_where_a_cycle_was_judged(healthy):
    found = cross_check(healthy)
    blind = replace(found, verdicts=(UNDECIDED,) * len(found.verdicts))
    for check, said in ((found, "nobody is off alone"), (blind, "no cycle could be judged")):
        told = " ".join(str(part) for part in heading_summary(healthy, check, None))
        assert f"No block is named: {said}." in told
