"""Derivatives of sampled columns and their noise gain."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.model.evaluate import wrap
from fdi.residuals import Differentiation
from fdi.residuals.differentiate import differentiate

STEP = 0.1


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 3))
def test_slope_of_a_line_is_exact(offset, slope, window):
    t = np.arange(100) * STEP
    found, _ = differentiate(offset + slope * t, STEP, Differentiation(window_s=window))
    half = Differentiation(window_s=window).half_width(STEP)
    assert found[half:-half] == pytest.approx(slope, abs=1e-9 * (1 + abs(offset)))
    assert np.isnan(found[:half]).all()
    assert np.isnan(found[-half:]).all()


def test_slope_of_a_turning_angle_knows_no_wrap():
    t = np.arange(200) * STEP
    for rate in (-9.0, 0.5, 9.0):  # 9 rad/s passes more than half a turn within the window
        found, _ = differentiate(wrap(rate * t), STEP, Differentiation(), circular=True)
        assert found[10:-10] == pytest.approx(rate)


@pytest.mark.parametrize("rate", [17.0, 31.4, 35.0, -40.0])
def test_a_turn_too_fast_for_its_samples_is_unknown(rate):
    t = np.arange(100) * STEP
    turned = np.concatenate([t, t[-1] + np.cumsum(np.full(100, rate * STEP))])
    found, _ = differentiate(wrap(turned), STEP, Differentiation(), circular=True)
    assert found[10:90] == pytest.approx(1.0)
    assert np.isnan(found[95:]).all()


@pytest.mark.parametrize("circular", [False, True])
def test_an_unknown_sample_makes_its_whole_window_unknown(circular):
    values = np.linspace(0, 1, 50)
    values[20] = np.nan
    recipe = Differentiation(window_s=0.4)
    found, _ = differentiate(values, STEP, recipe, circular=circular)
    assert np.flatnonzero(np.isnan(found[2:-2])).tolist() == [16, 17, 18, 19, 20]


@pytest.mark.parametrize(
    "recipe",
    [Differentiation(), Differentiation(window_s=0.2), Differentiation("backward_from_zero")],
)
def test_noise_gain_is_what_white_noise_shows(recipe):
    noise = np.random.default_rng(1).normal(size=200_000)
    found, gain = differentiate(noise, STEP, recipe)
    assert np.nanstd(found) == pytest.approx(gain, rel=0.02)


def test_published_difference_quotient_starts_from_zero():
    found, _ = differentiate(np.array([5.0, 7.0]), 1.0, Differentiation("backward_from_zero"))
    assert found.tolist() == [5.0, 2.0]


@pytest.mark.parametrize("size", [0, 1, 2, 3])
def test_a_column_shorter_than_the_window_is_unknown(size):
    found, _ = differentiate(np.ones(size), STEP, Differentiation())
    assert np.isnan(found).all()
    assert len(found) == size
