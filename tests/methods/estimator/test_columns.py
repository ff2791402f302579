"""What the complaints of the estimator say of whom, on made-up ratios and on labelled flights."""

from functools import partial

import numpy as np
import pytest
from flights import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from report.build import small_log

import fdi
from fdi.methods.columns import Columns
from fdi.methods.estimator.columns import RATIOS, TOGETHER_S, estimator_columns
from fdi.methods.estimator.ratios import GROWN, LEAST_LEVEL, LEVEL_S, MEAN_S, MOST_LEVEL
from fdi.telemetry import Flight, Message, read
from fdi.telemetry.message import Column
from fdi.units import si

T = np.arange(0.0, 120.0, 0.5)
TAKEOFF, LANDING, ONSET = 10.0, 110.0, 60.0


def log_of(ratios):
    """A log whose estimator tells these ratios; it flies from 10 s to 110 s."""
    log = small_log()
    columns = {
        RATIOS[name]: Column(partial(np.array, own, float), si("")) for name, own in ratios.items()
    }
    log = log.with_message(Message("EKF_STATUS_REPORT", None, T, T, np.arange(len(T)), columns))
    flight = Flight(TAKEOFF - 2, LANDING + 2, takeoff=TAKEOFF, landing=LANDING)
    log._cache["flights"] = (flight,)
    return log


def stepped(level, factor, onset=ONSET):
    return np.where(onset > T, level, factor * level)


def columns(**ratios):
    found = estimator_columns(log_of(ratios))
    assert isinstance(found, Columns)
    return found.values


def at(values, t):
    """The factor that stands in dB at a time, s."""
    return 10.0 ** (values[np.searchsorted(T, t)] / 20.0)


def test_growth_is_a_factor_over_the_level_of_the_beginning():
    own = columns(velocity=stepped(0.2, 6.0))["velocity_ratio"]
    assert at(own, ONSET - 1) == pytest.approx(1.0)
    assert at(own, ONSET + MEAN_S + 1) == pytest.approx(6.0)
    assert at(own, ONSET + MEAN_S / 2 - 0.5) == pytest.approx((1 + 6) / 2)


def test_a_level_of_next_to_nothing_counts_as_the_floor():
    own = columns(velocity=stepped(LEAST_LEVEL / 50, 100.0))["velocity_ratio"]
    assert at(own, ONSET + 10) == pytest.approx(2.0)


def test_what_lies_before_take_off_or_after_landing_is_unknown():
    own = columns(velocity=np.full(len(T), 0.2))["velocity_ratio"]
    flying = (T >= TAKEOFF) & (T <= LANDING)
    assert np.isfinite(own[flying]).all()
    assert np.isnan(own[~flying]).all()


def test_one_wild_record_does_not_make_a_level():
    wild = np.where(np.isclose(T, TAKEOFF + 3), 50.0, 0.2)
    own = columns(velocity=wild)["velocity_ratio"]
    assert at(own, TAKEOFF + LEVEL_S + 5) == pytest.approx(1.0)


def test_what_is_rejected_has_grown_however_it_began():
    own = columns(velocity=stepped(0.8, 1.5))["velocity_ratio"]
    assert at(own, ONSET - 1) == pytest.approx(0.8 / MOST_LEVEL)
    assert at(own, ONSET + 10) == pytest.approx(1.2 / MOST_LEVEL)


def test_where_the_beginning_tells_no_level_only_rejection_is_growth():
    late = np.where(T > TAKEOFF + LEVEL_S + 1, 0.2, np.nan)
    own = columns(velocity=np.where(T > ONSET, 1.1, late))["velocity_ratio"]
    assert at(own, ONSET - 1) < 1.0
    assert at(own, ONSET + 10) > GROWN


def test_a_contrast_is_quiet_where_both_complain_and_speaks_where_one_does():
    both = columns(velocity=stepped(0.2, 8.0), position=stepped(0.1, 8.0))
    one = columns(velocity=np.full(len(T), 0.2), position=stepped(0.1, 8.0))
    late = ONSET + 10
    assert at(both["position_ratio"], late) == pytest.approx(8.0)
    assert at(both["position_without_velocity"], late) == pytest.approx(1.0)
    assert at(one["position_without_velocity"], late) == pytest.approx(8.0)


def test_what_velocity_and_compass_begin_together_is_the_smaller():
    own = columns(velocity=stepped(0.2, 8.0), compass=stepped(0.1, 3.0))
    assert at(own["velocity_with_compass"], ONSET + 8) == pytest.approx(3.0)
    assert at(own["compass_without_motion"], ONSET + 8) == pytest.approx(3.0 / 8.0)


def test_a_compass_that_spoils_the_velocity_later_is_nothing_they_begin_together():
    late = ONSET + TOGETHER_S + MEAN_S + 1
    own = columns(velocity=stepped(0.2, 8.0, onset=late), compass=stepped(0.1, 8.0))
    assert np.nanmax(own["velocity_with_compass"]) < 1.0


def test_a_ratio_that_is_zero_throughout_belongs_to_no_sensor_in_use():
    own = columns(velocity=stepped(0.2, 8.0), compass=np.zeros(len(T)))
    assert np.isnan(own["compass_ratio"]).all()
    assert np.isnan(own["velocity_with_compass"]).all()


def test_unknown_records_do_not_spoil_the_rest():
    gap = stepped(0.2, 6.0)
    gap[::3] = np.nan
    own = columns(velocity=gap)["velocity_ratio"]
    assert at(own, ONSET - 1) == pytest.approx(1.0)
    assert at(own, ONSET + 10) == pytest.approx(6.0)


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(1.0, 4.0), factor=st.floats(1.0, 30.0))
def test_the_unit_of_a_ratio_does_not_matter(scale, factor):
    own = columns(velocity=stepped(0.06, factor))["velocity_ratio"]
    scaled = columns(velocity=scale * stepped(0.06, factor))["velocity_ratio"]
    assert np.allclose(own, scaled, equal_nan=True)


def test_a_log_without_ratios_or_with_none_that_moves_says_so():
    log = small_log()
    assert estimator_columns(log) == "the log has no test ratios of the autopilot's estimator"
    still = estimator_columns(log_of({"velocity": np.zeros(len(T))}))
    assert "is known and above 0 in a flight" in still


SITL = ROOT.parent / "shared" / "flights" / "sitl" / "copter"


@pytest.mark.parametrize(
    ("name", "speaks", "quiet"),
    [
        ("c41_compass_offset_first_of_three", "compass_without_motion", "velocity_with_compass"),
        ("c21_gps_step_5m_north", "position_without_velocity", "velocity_with_compass"),
        ("c35_gyro_bias_x_both", "velocity_with_compass", "position_without_velocity"),
        ("c51_baro_glitch_8m", "height_without_velocity", "compass_without_motion"),
    ],
)
def test_each_sensor_has_its_own_signature_on_a_simulated_flight(name, speaks, quiet):
    path = SITL / f"{name}.tlog"
    if not path.is_file():
        pytest.skip("needs ../shared")
    found = estimator_columns(read(path))
    assert np.nanmax(found.values[speaks]) > 12.0 > np.nanmax(found.values[quiet])


def test_without_the_method_the_analysis_has_no_columns_and_no_agreement():
    path = ROOT / "examples" / "healthy_logs" / "copter_gusts.tlog"
    without = fdi.analyze(path, methods=())
    assert without.document()["methods"] == {}
    assert "estimator" not in without.log
    given = fdi.analyze(path)
    assert [one["id"] for one in given.document()["methods"]["estimator"]["columns"]][:2] == [
        "estimator.velocity_ratio",
        "estimator.position_ratio",
    ]
