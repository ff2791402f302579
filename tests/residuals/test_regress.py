"""The slope of one quantity over another, window by window, and how sure it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import ModelError
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.regress import slope

from .build import airframe
from .test_evaluate import signals

STEP = 0.2
PAIRS = st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=1, max_size=3)


def circle(size=300, turns=2.0):
    angle = np.linspace(0, 2 * np.pi * turns, size)
    return 20 * np.cos(angle), 20 * np.sin(angle)


@given(st.floats(-3, 3), PAIRS)
def test_slope_is_exact_whatever_the_constants(factor, constants):
    leaders = [circle()[i % 2] + start for i, (_, start) in enumerate(constants)]
    followers = [factor * x + shift for x, (shift, _) in zip(leaders, constants, strict=True)]
    found, error = slope(followers, leaders, [np.zeros(300)] * len(leaders), STEP, 12.0)
    assert found == pytest.approx(factor, abs=1e-6)
    assert np.nanmax(error) < 1e-4


def test_noise_of_the_leader_takes_from_the_slope_and_the_error_says_so():
    rng = np.random.default_rng(2)
    true = np.sin(np.linspace(0, 60, 6000))
    found, error = slope([true], [true + rng.normal(0, 0.5, 6000)], [np.full(6000, 0.5)], 0.1, 100)
    middle = slice(1000, 5000)
    assert np.median(found[middle]) == pytest.approx(0.5 / (0.5 + 0.25), abs=0.02)
    assert (error[middle] > 0.9 * (1 - found[middle])).all()


def test_error_is_what_repeated_flights_show():
    """The scatter is white here, so the errors are too large by the root of what counts once."""
    rng = np.random.default_rng(3)
    x = circle(300)[0]
    found = [
        slope([x + rng.normal(0, 2, 300)], [x], [np.zeros(300)], 10.0, 2000.0) for _ in range(300)
    ]
    values = [value[150] for value, _ in found]
    errors = [error[150] for _, error in found]
    assert np.std(values) * np.sqrt(200 / (2000 / 10)) == pytest.approx(np.mean(errors), rel=0.25)


def test_scatter_counts_once_in_ten_seconds():
    """Of 1000 s that are 100 samples: the root of what is left over 100 times what leads."""
    rng = np.random.default_rng(5)
    x = circle(3000, turns=30.0)[0]
    _, error = slope([x + rng.normal(0, 2, 3000)], [x], [np.zeros(3000)], 1.0, 1000.0)
    assert error[1500] == pytest.approx(2 / (20 / np.sqrt(2)) / 10, rel=0.1)


@pytest.mark.parametrize("window_s", [4.0, 40.0])
def test_slope_and_error_are_those_of_each_window_by_itself(window_s):
    """By its covariance matrix, for two pairs with noise in what leads."""
    rng = np.random.default_rng(7)
    leaders = rng.normal(3.0, [[2.0], [5.0]], (2, 60))
    followers = 0.7 * leaders + rng.normal(-1.0, 1.0, (2, 60))
    followers[0, 30] = np.nan
    noises = np.array([np.full(60, 0.5), np.linspace(0.1, 1.0, 60)])
    found, error = slope([*followers], [*leaders], [*noises], 1.0, window_s)
    half = round(window_s / 2)
    for place in (12, 31, 47):
        here = [i for i in range(max(0, place - half), min(60, place + half + 1)) if i != 30]
        parts = [np.cov(leaders[i, here], followers[i, here], bias=True) for i in (0, 1)]
        (leading, common), (_, following) = np.sum(parts, axis=0)
        expected = common / leading
        scatter = (following / leading - expected**2) / max(1.0, window_s / 10.0)
        power = (noises[:, here] ** 2).mean(axis=1).sum()
        lost = expected * power / (leading - power)
        assert found[place] == pytest.approx(expected)
        assert error[place] == pytest.approx(np.sqrt(scatter + lost**2))


@pytest.mark.parametrize(("unknown", "is_told"), [(10, True), (11, False)])
def test_half_of_a_window_must_be_known(unknown, is_told):
    x, _ = circle(100)
    y = 2.0 * x
    y[50 : 50 + unknown] = np.nan
    found, _ = slope([y], [x], [np.zeros(100)], STEP, 4.0)  # 21 samples
    assert np.isfinite(found[50 + unknown // 2]) == is_told


def test_a_leader_that_rests_gives_no_slope():
    found, error = slope([np.arange(50.0)], [np.full(50, 3.0)], [np.ones(50)], STEP, 4.0)
    assert np.isnan(found).all()
    assert np.isnan(error).all()


def test_unknown_samples_count_in_no_window():
    x, y = circle()
    ground = 1.1 * x
    ground[100:120] = np.nan
    found, _ = slope([ground], [x], [np.zeros(300)], STEP, 20.0)
    assert found == pytest.approx(1.1)
    ground[50:200] = np.nan
    found, _ = slope([ground, y], [x, y], [np.zeros(300)] * 2, STEP, 20.0)
    assert np.isnan(found[101:149]).all()


def test_a_wild_value_spoils_its_own_windows_only():
    x, _ = circle()
    ground = 1.1 * x
    ground[60] = 1e30
    found, _ = slope([ground], [x], [np.zeros(300)], STEP, 10.0)
    assert found[90:] == pytest.approx(1.1)


@pytest.mark.parametrize("size", [0, 1, 2])
def test_hardly_any_samples_give_nothing_or_the_truth(size):
    x = np.arange(size, dtype=float)
    found, _ = slope([2 * x], [x], [np.zeros(size)], 1.0, 1.0)
    assert len(found) == size
    assert found[np.isfinite(found)] == pytest.approx(2.0)


SCALED = """
format: 1
name: pitot
components:
  airspeed: {group: sensor}
variables:
  v_n: {unit: m/s}
  v_e: {unit: m/s}
  yaw: {unit: rad, circular: true}
  v: {unit: m/s}
  a_n: {unit: m/s}
  a_e: {unit: m/s}
  gain: {unit: "1"}
equations:
  k_1: a_n = v*cos(yaw)
  k_2: a_e = v*sin(yaw)
  k_3: {text: "gain = slope(v_n, a_n, v_e, a_e)", window: 20 s, tolerance: 0.05}
limits:
  scaled: {variable: gain, min: 0.9, max: 1.1, component: airspeed}
inputs:
  LOCAL_POSITION_NED:
    fields:
      vx: {variable: v_n}
      vy: {variable: v_e}
  ATTITUDE:
    fields:
      yaw: {variable: yaw}
measurements:
  VFR_HUD:
    component: airspeed
    fields:
      airspeed: {variable: v, accuracy: 0.5 m/s}
"""


def flight(factor, turn):
    """A flight in wind of which the airspeed is shown too small by a factor."""
    yaw = np.cumsum(np.full(300, turn / 5.0))
    return {
        "LOCAL_POSITION_NED.vx": 15 * np.cos(yaw) + 4,
        "LOCAL_POSITION_NED.vy": 15 * np.sin(yaw) - 2,
        "ATTITUDE.yaw": np.angle(np.exp(1j * yaw)),
        "VFR_HUD.airspeed": np.full(300, 15 / factor),
    }


def test_a_turn_shows_the_scale_of_the_airspeed_and_a_straight_line_does_not(tmp_path):
    bank = build_bank(airframe(tmp_path, SCALED).observe(), "mtes")
    (only,) = bank.generators
    assert only.faults == ("VFR_HUD.airspeed",)

    def excess(factor, turn):
        data = signals(bank.system, flight(factor, turn))
        return np.abs(bank.evaluate(data, Differentiation()).values[0])

    assert excess(1.0, 0.3) == pytest.approx(0.0, abs=1e-9)
    assert excess(1.3, 0.3) == pytest.approx(0.2, abs=1e-6)
    assert np.isnan(excess(1.3, 0.0)).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("window: 20 s, ", "", "needs a window"),
        (", tolerance: 0.05", "", "needs a window, and the tolerance"),
        ("slope(v_n, a_n, v_e, a_e)", "slope(v_n, a_n, v_e)", "takes pairs"),
        ("slope(v_n, a_n, v_e, a_e)", "2*slope(v_n, a_n)", "stands alone"),
        ("slope(v_n, a_n, v_e, a_e)", "slope(v_n, 2*a_n)", "stands alone"),
        ("slope(v_n, a_n, v_e, a_e)", "slope(v_n, a_n, yaw, a_e)", "does not fit"),
        ("slope(v_n, a_n, v_e, a_e)", "jump(v_n, a_n)", "jump takes 4"),
        ("slope(v_n, a_n, v_e, a_e)", "jump(v_n, a_n, v_e, a_e, v_n)", "jump takes 4"),
        ("slope(v_n, a_n, v_e, a_e)", "jump(v_n, 2*a_n, v_e, a_e)", "stands alone"),
        ("slope(v_n, a_n, v_e, a_e)", "jump(v_n, a_n, yaw, a_e)", "does not fit"),
        ("slope(v_n, a_n, v_e, a_e)", "slope(yaw, a_n)", "unit mismatch"),
    ],
)
def test_what_a_slope_lacks_is_said(tmp_path, old, new, said):
    with pytest.raises(ModelError, match=said):
        airframe(tmp_path, SCALED.replace(old, new))
