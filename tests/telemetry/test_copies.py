"""Channels that repeat another one are recognised, sensors that measure the same are not."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry import Channel
from fdi.telemetry.copies import compare
from fdi.telemetry.signals import Records

A, B = Channel("A", "x"), Channel("B", "x")
STEP = 0.01


def wandering(seed, n=300):
    """A quantity that moves by some steps of the resolution from record to record."""
    random = np.random.default_rng(seed)
    return np.cumsum(random.normal(0, 8 * STEP, n))


def rounded(value, step=STEP):
    return np.round(value / step) * step


def copy_of(first, second, dt=0.2, second_t=None):
    t = dt * np.arange(len(first))
    return compare(
        A, Records(t, first, False), B, Records(t if second_t is None else second_t, second, False)
    )


@given(
    seed=st.integers(0, 1000),
    scale=st.sampled_from([1.0, -1.0]),
    offset=st.sampled_from([0.0, 584.0, -20.0]),
    late=st.floats(0.0, 0.3),
)
def test_a_copy_is_recognised_whatever_its_sign_datum_and_delay(seed, scale, offset, late):
    value = rounded(wandering(seed))
    t = 0.2 * np.arange(value.size) + late
    found = copy_of(value, scale * value + offset, second_t=t)
    assert found is not None
    assert found.repeats
    assert found.scale == scale


@given(seed=st.integers(0, 1000))
def test_a_copy_of_coarser_resolution_is_recognised(seed):
    value = wandering(seed)
    found = copy_of(value, rounded(value, 0.05))
    assert found is not None
    assert found.repeats


@given(seed=st.integers(0, 1000))
def test_lost_records_do_not_hide_a_copy(seed):
    value = rounded(wandering(seed))
    t = 0.2 * np.arange(value.size)
    kept = np.random.default_rng(seed).random(value.size) > 0.3
    found = compare(A, Records(t, value, False), B, Records(t[kept], value[kept], False))
    assert found is not None
    assert found.repeats


@given(seed=st.integers(0, 1000), noise=st.sampled_from([1.0, 3.0, 10.0]))
def test_two_sensors_of_one_quantity_are_no_copies(seed, noise):
    """Already noise of one step of the resolution tells two sensors apart."""
    truth = wandering(seed)
    random = np.random.default_rng(seed + 1)
    one, two = (rounded(truth + random.normal(0, noise * STEP, truth.size)) for _ in range(2))
    found = copy_of(one, two)
    assert found is None or not found.repeats


@given(seed=st.integers(0, 1000), at=st.integers(20, 250))
def test_a_fault_of_one_of_two_equal_sensors_makes_them_two(seed, at):
    value = rounded(wandering(seed))
    wrong = value + np.where(np.arange(value.size) >= at, 40 * STEP, 0.0)
    found = copy_of(value, wrong)
    assert found is None or not found.repeats


def test_nothing_follows_from_channels_that_stand_still():
    still = np.full(300, 12.6)
    assert copy_of(still, still) is None


def test_nothing_follows_from_a_few_records():
    value = rounded(wandering(1, n=20))
    assert copy_of(value, value) is None


def test_unknown_values_do_not_hide_a_copy():
    value = rounded(wandering(2))
    known = np.where(np.random.default_rng(0).random(value.size) > 0.4, value, np.nan)
    found = copy_of(value, known)
    assert found is not None
    assert found.repeats


def test_a_channel_that_stood_still_while_the_other_was_recorded_is_compared_with_nothing():
    """It moved before; while both are recorded it has no variance to correlate."""
    t = 0.2 * np.arange(600)
    first = np.where(t < 50.0, rounded(wandering(1, 600)), 3.0)
    later = t > 60.0
    with np.errstate(all="raise"):
        found = compare(
            A,
            Records(t, first, False),
            B,
            Records(t[later], rounded(wandering(2, 600))[later], False),
        )
    assert found is None or not found.repeats
