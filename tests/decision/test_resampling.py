"""Noise drawn from a flight's own: as large, as slow and as correlated as that."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.decision.resampling import _fast_size, _filled, fit_noise

from .build import RATE

LENGTH = 2000


def slow(rng, memory, size=LENGTH):
    """Noise of deviation one whose neighbours correlate by ``memory``."""
    column = rng.normal(size=size)
    for i in range(1, size):
        column[i] = memory * column[i - 1] + np.sqrt(1 - memory**2) * column[i]
    return column


def neighbours(drawn):
    flat = drawn - drawn.mean()
    return float((flat[..., 1:] * flat[..., :-1]).mean() / flat.var())


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9, 0.98])
def test_drawn_noise_is_as_large_and_as_slow_as_the_flights(memory):
    own = 3.0 * slow(np.random.default_rng(4), memory)[None] + 0.5
    model = fit_noise(own, np.ones(own.shape, bool), RATE)
    drawn = model.draw(20, np.random.default_rng(0))[0]
    assert drawn.std() == pytest.approx(own.std(), rel=1e-6, abs=0.05)
    assert drawn.mean() == pytest.approx(own.mean(), abs=0.1 * own.std())
    assert neighbours(drawn) == pytest.approx(neighbours(own), abs=0.03)


def test_what_noise_is_drawn_from_is_what_the_past_two_seconds_do_not_tell():
    """A residual that repeats nine tenths of what it was two seconds ago, and nothing nearer."""
    rng, back = np.random.default_rng(9), round(2.0 * RATE)
    own = rng.normal(size=20_000)
    for i in range(back, len(own)):
        own[i] = 0.9 * own[i - back] + np.sqrt(1 - 0.9**2) * own[i]
    calm = np.ones((1, len(own)), bool)
    calm[0, 5000] = False
    model = fit_noise(own[None], calm, RATE)
    assert model.innovations.shape == (1, len(own) - back - (back + 1))
    assert model.innovations.std() == pytest.approx(np.sqrt(1 - 0.9**2), rel=0.05)
    assert model.deviation == pytest.approx(1.0, rel=0.1)
    assert model.whitening[0, [0, back]] == pytest.approx([1.0, -0.9], abs=0.03)


def test_innovations_that_are_rounding_errors_are_not_blown_up():
    own = np.where(np.arange(400) < 200, 0.02, -0.02)[None]
    calm = np.ones(own.shape, bool)
    model = fit_noise(own, calm, RATE)
    # what is left of two levels once the neighbours are told is the error of the fit
    tiny = replace(model, innovations=np.full((1, 50), -8.7e-19))
    assert np.abs(tiny.draw(5, np.random.default_rng(0))).max() <= 0.1


def test_residuals_that_share_a_channel_stay_correlated():
    rng = np.random.default_rng(1)
    shared, a, b = (slow(rng, 0.8) for _ in range(3))
    own = np.array([shared + 0.5 * a, shared + 0.5 * b, a])
    model = fit_noise(own, np.ones(own.shape, bool), RATE)
    drawn = model.draw(20, np.random.default_rng(0)).reshape(3, -1)
    assert np.corrcoef(drawn) == pytest.approx(np.corrcoef(own), abs=0.1)


def test_what_is_not_calm_is_no_noise():
    own = slow(np.random.default_rng(2), 0.7)[None]
    broken, calm = own.copy(), np.ones(own.shape, bool)
    broken[0, 700:900] += 50.0
    calm[0, 700:900] = False
    drawn = fit_noise(broken, calm, RATE).draw(10, np.random.default_rng(0))
    assert drawn.std() == pytest.approx(own[calm].std(), rel=0.1)
    assert np.abs(drawn).max() < 8


def test_unknown_and_constant_residuals_have_no_noise():
    own = np.array(
        [np.zeros(LENGTH), np.full(LENGTH, 2.0), np.random.default_rng(0).normal(size=LENGTH)]
    )
    calm = np.ones(own.shape, bool)
    calm[0] = False
    drawn = fit_noise(own, calm, RATE).draw(3, np.random.default_rng(0))
    assert np.isfinite(drawn).all()
    assert np.ptp(drawn[0]) == 0
    assert np.ptp(drawn[1]) == pytest.approx(0, abs=1e-9)
    assert drawn[2].std() > 0.5


def test_no_known_sample_at_all_draws_nothing():
    drawn = fit_noise(np.zeros((2, 50)), np.zeros((2, 50), bool), RATE).draw(
        2, np.random.default_rng(0)
    )
    assert (drawn == 0).all()


def test_a_part_of_the_residuals_is_drawn_like_the_whole():
    own = np.random.default_rng(3).normal(size=(4, LENGTH))
    model = fit_noise(own, np.ones(own.shape, bool), RATE)
    whole = model.draw(2, np.random.default_rng(7))
    part = model.of(np.array([1, 3])).draw(2, np.random.default_rng(7))
    assert part == pytest.approx(whole[[1, 3]])


@pytest.mark.parametrize("samples", [0, 1, 2, 5, 11, 12])
def test_few_samples_have_no_noise_to_tell(samples):
    values = np.random.default_rng(1).normal(size=(3, samples))
    model = fit_noise(values, np.ones((3, samples), bool), 5.0)
    assert model.samples == samples
    assert not (model.deviation > 0).any()


@given(st.integers(1, 100_000))
def test_a_fast_size_is_a_little_larger_and_of_small_factors(least):
    size = _fast_size(least)
    assert least <= size <= max(5, 4 / 3 * least)
    for factor in (2, 3, 5):
        while size % factor == 0:
            size //= factor
    assert size == 1


def test_innovations_that_are_unknown_are_taken_from_those_that_are_known():
    white = np.array([[1.0, 2.0, 6.0, 0.0, 0.0, 0.0, 0.0], [5.0] * 7])
    usable = np.zeros((2, 7), bool)
    usable[0, :3] = True
    found = _filled(white, usable)
    assert found[0, :3].tolist() == [-2.0, -1.0, 3.0]
    assert set(found[0, 3:]) == {-2.0, -1.0, 3.0}
    assert (found[1] == 0.0).all()
