"""What is recovered is near what the records held before they were made to fail."""

from pathlib import Path

import numpy as np
import pytest

from fdi.errors import UsageError
from fdi.methods.heading import cross_check, recover
from fdi.methods.heading.recovery import REPLACED, _smoothed
from fdi.telemetry import Log

from .rides import FAILS, METRE, altered, flown, later


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return flown(tmp_path_factory.mktemp("ride") / "healthy.tlog")


@pytest.fixture(scope="module")
def truth(healthy: Log):
    return cross_check(healthy).ride


def test_a_position_goes_on_where_the_receiver_jumps(healthy: Log, truth) -> None:
    log = altered(healthy, "GPS_RAW_INT", lat=later(300 * METRE))
    found = recover(log, cross_check(log))
    assert found.block == "satellite"
    assert FAILS - 6.0 < found.start < FAILS
    gps = healthy["GPS_RAW_INT"]
    lat = np.degrees(np.interp(found.t, gps.t, gps.si("lat")))
    off = np.abs(found.columns["lat_deg"] - lat) * np.pi / 180 / METRE
    soon = found.t < found.start + 10.0
    assert off[soon].max() < 10.0
    assert np.mean(off <= 2 * found.columns["sigma_m"]) > 0.9


def test_a_receiver_that_loses_its_fix_is_replaced_from_then_on(healthy: Log) -> None:
    """Not from a window before: its last fixes are as good as any."""
    lost = altered(healthy, "GPS_RAW_INT", fix_type=lambda t, own: np.where(t >= FAILS, 0.0, own))
    assert recover(lost, cross_check(lost)).start == pytest.approx(FAILS, abs=0.2)


def test_a_single_record_without_a_fix_is_nothing_to_recover(healthy: Log) -> None:
    def once(t, own):
        return np.where(np.arange(t.size) == np.argmax(t >= FAILS), 0.0, own)

    log = altered(healthy, "GPS_RAW_INT", fix_type=once)
    with pytest.raises(UsageError, match="nothing to recover"):
        recover(log, cross_check(log))


@pytest.mark.parametrize("block", ["satellite", "accelerometer"])
def test_nothing_is_carried_over_a_gap_of_the_inertial_records(healthy: Log, block: str) -> None:
    def gap(t, own):
        return np.where((t > FAILS + 3.0) & (t < FAILS + 6.0), np.nan, own)

    log = altered(healthy, "RAW_IMU", xacc=gap, xgyro=gap)
    found = recover(log, cross_check(log), block, FAILS)
    assert found.end == pytest.approx(FAILS + 3.0, abs=0.3)
    assert found.ended == "its records have a gap"


def test_what_is_before_a_gap_is_no_drift_of_a_gyroscope(healthy: Log, truth) -> None:
    """It leans on while nothing is recorded: the angles at both ends tell nothing of a bias."""
    log = altered(
        healthy,
        "RAW_IMU",
        xgyro=lambda t, own: np.where((t > FAILS - 10.0) & (t < FAILS - 7.0), np.nan, own),
    )
    found = recover(log, cross_check(log), "accelerometer", FAILS)
    roll = np.degrees(np.interp(found.t, truth.t, truth.angles[0]))
    assert np.abs(found.columns["roll_deg"] - roll)[found.t < FAILS + 3.0].max() < 1.5


def test_a_position_goes_on_from_the_last_fix_with_what_was_felt_since(healthy: Log, truth) -> None:
    """Fixes a second apart, the last one 0.9 s old: speed and place are those of now."""
    sparse = altered(
        healthy, "GPS_RAW_INT", fix_type=lambda t, own: np.where(t % 1.0 < 0.25, own, 0.0)
    )
    whole = truth.fixes
    north = whole.position()[0]
    for start in (32.9, 36.9, 40.9):
        found = recover(sparse, cross_check(sparse), "satellite", start)
        last = cross_check(sparse).ride.fixes.t
        begun = np.interp(last[last <= start][-1], whole.t, north)
        soon = found.t < start + 2.0
        moved = np.interp(found.t[soon], whole.t, north) - begun
        assert np.abs(found.columns["north_m"][soon] - moved).max() < 1.0


def test_a_last_fix_that_is_off_does_not_move_what_is_recovered(healthy: Log, truth) -> None:
    def spike(t, own):
        return own + np.where(np.arange(t.size) == np.flatnonzero(t <= FAILS)[-1], 50 * METRE, 0.0)

    log = altered(healthy, "GPS_RAW_INT", lat=spike)
    found = recover(log, cross_check(log), "satellite", FAILS)
    whole = truth.fixes
    lat = np.degrees(np.interp(found.t, whole.t, whole.lat))
    off = np.abs(found.columns["lat_deg"] - lat) * np.pi / 180 / METRE
    assert off[found.t < FAILS + 2.0].max() < 2.0


def test_a_receiver_that_had_left_its_own_velocity_is_doubted_from_the_start(
    healthy: Log,
) -> None:
    """0.4 m/s for 25 s, which no window of 5 s shows: 9 m are not known to be right."""

    def drift(t, own):
        return own + 0.4 * METRE * np.maximum(t - 15.0, 0.0)

    log = altered(healthy, "GPS_RAW_INT", lat=drift)
    found, clean = (recover(x, cross_check(x), "satellite", 40.0) for x in (log, healthy))
    assert clean.columns["sigma_m"][0] < 2.0
    assert found.columns["sigma_m"][0] > 8.0 / np.sqrt(2)


def test_places_and_metres_say_the_same(healthy: Log) -> None:
    found = recover(healthy, cross_check(healthy), "satellite", FAILS)
    north = (found.columns["lat_deg"] - found.columns["lat_deg"][0]) * np.pi / 180 / METRE
    moved = found.columns["north_m"] - found.columns["north_m"][0]
    # a mean radius instead of the ellipsoid's: 0.5 %
    assert np.abs(north - moved).max() < 0.01 * np.ptp(moved) + 0.1


@pytest.mark.parametrize("block", REPLACED)
def test_a_recovery_ends_where_it_is_of_no_use(healthy: Log, block: str) -> None:
    found = recover(healthy, cross_check(healthy), block, FAILS)
    assert found.t[0] > FAILS
    assert found.end == found.t[-1]
    assert np.all(np.diff(found.t) > 0)
    for name, values in found.columns.items():
        assert values.shape == found.t.shape, name
        assert np.isfinite(values).all(), name
        if name.startswith("sigma_"):
            assert (values > 0).all(), name
    assert len(found.method) == found.t.size


@pytest.mark.parametrize("block", ["satellite", "magnetometer", "accelerometer"])
def test_what_is_propagated_grows_less_certain(healthy: Log, block: str) -> None:
    found = recover(healthy, cross_check(healthy), block, FAILS)
    sigma = next(x for name, x in found.columns.items() if name.startswith("sigma_"))
    assert sigma[0] < sigma[sigma.size // 2] < sigma[-1]


def test_a_heading_goes_on_without_the_compass(healthy: Log, truth) -> None:
    log = altered(healthy, "RAW_IMU", ymag=later(6e-5))
    found = recover(log, cross_check(log))
    assert found.block == "magnetometer"
    yaw = np.degrees(np.interp(found.t, truth.t, truth.angles[2]))
    off = np.abs((found.columns["heading_deg"] - yaw + 180) % 360 - 180)
    assert off.max() < 10.0
    assert np.mean(off <= 2 * found.columns["sigma_heading_deg"]) > 0.9


def test_a_tilt_goes_on_without_accelerometers_whatever_they_and_the_estimator_say(
    healthy: Log, truth
) -> None:
    """What came after the failure must not be read: neither the force nor the attitude."""
    clean = recover(healthy, cross_check(healthy), "accelerometer", FAILS)
    wrong = altered(healthy, "ATTITUDE", roll=later(0.3), pitch=later(-0.2))
    found = recover(wrong, cross_check(wrong), "accelerometer", FAILS)
    both = min(found.t.size, clean.t.size)
    for name in ("roll_deg", "pitch_deg"):
        assert np.abs(found.columns[name][:both] - clean.columns[name][:both]).max() < 3.0


def test_rates_go_on_without_gyroscopes_whatever_they_say(healthy: Log) -> None:
    clean = recover(healthy, cross_check(healthy), "angular_rate", FAILS)
    wrong = altered(healthy, "RAW_IMU", xgyro=later(0.5), ygyro=later(-0.4), zgyro=later(0.3))
    found = recover(wrong, cross_check(wrong), "angular_rate", FAILS)
    for name in clean.columns:
        assert np.array_equal(found.columns[name], clean.columns[name]), name


def test_where_nothing_failed_there_is_nothing_to_recover(healthy: Log) -> None:
    with pytest.raises(UsageError, match="nothing to recover"):
        recover(healthy, cross_check(healthy))


def test_a_time_on_the_ground_is_told(healthy: Log) -> None:
    with pytest.raises(UsageError, match="is not in the air"):
        recover(healthy, cross_check(healthy), "satellite", 1e4)


def test_the_same_log_recovers_the_same(healthy: Log, tmp_path: Path) -> None:
    from fdi.report.recovered import write_recovered

    for name in ("a.csv", "b.csv", "a.parquet", "b.parquet"):
        found = recover(healthy, cross_check(healthy), "satellite", FAILS)
        write_recovered(found, tmp_path / name)
    for ending in ("csv", "parquet"):
        one, other = ((tmp_path / f"{x}.{ending}").read_bytes() for x in "ab")
        assert one == other


def test_a_mean_is_never_over_more_than_there_is() -> None:
    """Records that a damaged clock sets a nanosecond apart would ask for gigabytes."""
    assert _smoothed(np.ones((3, 10)), 1e-9).shape == (3, 10)
    np.testing.assert_allclose(_smoothed(np.ones((3, 200)), 0.1)[:, -1], 1.0)
