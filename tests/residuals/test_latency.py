"""The lag between a channel and what is expected of it is found between samples, or not at all."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.residuals import Differentiation, build_bank
from fdi.residuals.latency import (
    SEARCH_S,
    _beginning,
    _blocks,
    block_lag,
    combined,
    estimate_lags,
    with_lags,
)
from fdi.telemetry import Channel

from .build import airframe
from .test_evaluate import RATE, signals

RATES = st.sampled_from([2.0, 4.0, 5.0, 10.0])


def motion(seed, t):
    """A speed as a pilot changes it: turns of some seconds."""
    random = np.random.default_rng(seed)
    pace, phase = random.uniform(0.5, 1.2, 4), random.uniform(0, 7, 4)
    return np.sin(np.multiply.outer(t, pace) + phase).sum(axis=1)


def pieces(seed, rate, late, noise=0.0):
    around = int(np.ceil(SEARCH_S * rate))
    size = round(10.0 * rate)
    t = np.arange(size + 2 * around) / rate
    own = motion(seed, t[around : around + size] - late)
    own = own + noise * np.random.default_rng(seed + 1).normal(size=size)
    return own, motion(seed, t), rate


@given(seed=st.integers(0, 500), rate=RATES, late=st.floats(-0.4, 0.4))
def test_a_lag_is_found_between_samples(seed, rate, late):
    found = block_lag(*pieces(seed, rate, late))
    assert found is not None
    assert found[0] == pytest.approx(late, abs=0.15 / rate)


@given(seed=st.integers(0, 200), late=st.floats(-0.3, 0.3))
def test_the_error_is_what_the_deviation_says(seed, late):
    own, expected, rate = pieces(seed, 5.0, late, noise=0.3)
    found = block_lag(own, expected, rate)
    assert found is not None
    assert abs(found[0] - late) < 5 * found[1]


@given(seed=st.integers(0, 200))
def test_stated_noise_widens_the_deviation(seed):
    block = pieces(seed, 5.0, 0.1)
    plain, stated = block_lag(*block), block_lag(*block, 1.0)
    assert plain is not None
    assert stated is not None
    assert stated[1] > plain[1]


def test_without_noise_a_lag_is_known_to_a_twentieth_of_a_sample():
    assert block_lag(*pieces(3, 5.0, 0.0))[1] == pytest.approx(0.05 / 5.0)


def test_nothing_follows_where_nothing_moves():
    assert block_lag(np.ones(50), np.ones(60), 5.0) is None


def test_nothing_follows_from_a_lag_beyond_the_search():
    own, expected, rate = pieces(3, 5.0, 1.6)
    assert block_lag(own, expected, rate) is None


def test_a_delay_of_the_minority_does_not_move_the_whole():
    healthy = [(0.1 + 0.002 * k, 0.01) for k in range(-3, 4)]
    delayed = [(0.9, 0.01)] * 3
    value, _, _ = combined(healthy + delayed)
    assert value == pytest.approx(0.1, abs=0.01)


def test_lags_that_disagree_are_not_known_well():
    _, sigma, _ = combined([(-0.4, 0.01), (-0.1, 0.01), (0.2, 0.01), (0.5, 0.01)])
    assert sigma > 0.1


def test_one_piece_that_outweighs_all_others_is_one_piece():
    _, _, pieces_ = combined([(0.1, 0.001)] + [(0.2, 0.1)] * 20)
    assert pieces_ < 1.5


def test_of_nothing_nothing_is_known():
    value, sigma, count = combined([])
    assert np.isnan(value)
    assert np.isnan(sigma)
    assert count == 0.0


def cart(tmp_path):
    """A receiver and an estimator that is an input."""
    text = """
format: 1
name: cart
variables:
  v_n: {unit: m/s}
  v_e: {unit: m/s}
  v_ground: {unit: m/s, domain: [0, null]}
equations:
  k_1: {text: "v_ground = sqrt(v_n**2 + v_e**2)", fault: drift, component: estimator}
inputs:
  LOCAL_POSITION_NED:
    fields: {vx: {variable: v_n, accuracy: 0.2 m/s}, vy: {variable: v_e, accuracy: 0.2 m/s}}
measurements:
  GPS_RAW_INT:
    component: gps
    latency: 0.1 s
    fields: {vel: {variable: v_ground, accuracy: 0.3 m/s}}
"""
    return build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")


def driven(bank, late, n=600, period=0.2):
    t = np.arange(n) / RATE
    columns = {
        "LOCAL_POSITION_NED.vx": 12.0 + motion(1, t),
        "LOCAL_POSITION_NED.vy": np.full(n, 3.0),
        "GPS_RAW_INT.vel": np.hypot(12.0 + motion(1, t - late), 3.0),
    }
    made = signals(bank.system, columns)
    made.period[Channel.parse("GPS_RAW_INT.vel")] = period
    made.state.airborne[:] = True
    return made


@pytest.mark.parametrize(
    ("samples", "unknown", "begins"),
    [
        (60, None, [0]),
        (59, None, []),
        (109, None, [0]),
        (110, None, [0, 50]),
        (110, 10, [50]),
        (110, 49, [50]),
        (110, 59, []),
        (110, 60, [0]),
    ],
)
def test_a_channel_is_cut_into_pieces_of_which_all_is_known(samples, unknown, begins):
    """Of 10 s, 50 samples; of what is expected as much as is searched, 1 s, on both sides."""
    shown, expected = np.arange(2.0 * samples).reshape(2, samples)
    if unknown is not None:
        shown[unknown] = np.nan
    found = list(_blocks(shown, expected, 5.0))
    assert [own[0] - 5 for own, _ in found] == begins
    assert [(own[-1] - own[0], len(around)) for own, around in found] == [(49, 60)] * len(found)
    assert [around[0] - samples for _, around in found] == begins


@pytest.mark.parametrize(("seconds", "told"), [(100.0, 50.0), (600.0, 300.0), (1000.0, 300.0)])
def test_lags_are_learned_from_the_first_half_of_the_flight_and_five_minutes_at_most(seconds, told):
    made = SimpleNamespace(rate_hz=RATE, state=SimpleNamespace(airborne=None))
    made.state.airborne = np.arange(round(1100 * RATE)) < round((seconds + 20) * RATE)
    made.state.airborne[: round(20 * RATE)] = False  # on the ground
    t = np.flatnonzero(_beginning(made)) / RATE
    assert (t[0], t[-1] + 1 / RATE) == pytest.approx((20.0, 20.0 + told))
    assert len(t) == round(told * RATE)


def test_a_receiver_that_comes_late_is_found_and_moved(tmp_path):
    bank = cart(tmp_path)
    (lag,) = estimate_lags(bank, driven(bank, 0.13), Differentiation())
    assert lag.used
    assert (lag.source, lag.component, lag.against) == (
        "GPS_RAW_INT",
        "gps",
        ("LOCAL_POSITION_NED",),
    )
    assert lag.value == pytest.approx(0.13, abs=0.02)
    moved = {r.channel: r.latency for r in with_lags(bank.system.channels, [lag])}
    assert moved[Channel.parse("GPS_RAW_INT.vel")] == pytest.approx(0.23, abs=0.02)
    assert moved[Channel.parse("LOCAL_POSITION_NED.vx")] == 0.0


def test_a_lag_that_no_healthy_receiver_has_is_not_taken_off(tmp_path):
    bank = cart(tmp_path)
    (lag,) = estimate_lags(bank, driven(bank, 0.7), Differentiation())
    assert not lag.used
    assert lag.why == "no latency of health"
    assert lag.value == pytest.approx(0.7, abs=0.05)


def test_in_steady_flight_the_stated_latency_stays(tmp_path):
    bank = cart(tmp_path)
    made = driven(bank, 0.13)
    for column in made.columns.values():
        column[:] = 5.0
    (lag,) = estimate_lags(bank, made, Differentiation())
    assert not lag.used
    assert lag.why == "too little motion"
    kept = with_lags(bank.system.channels, [lag])
    assert [r.latency for r in kept] == [r.latency for r in bank.system.channels]


def test_a_delay_from_the_middle_of_the_flight_on_is_not_learned(tmp_path):
    bank = cart(tmp_path)
    made, delayed = driven(bank, 0.13), driven(bank, 0.9)
    vel = Channel.parse("GPS_RAW_INT.vel")
    made.columns[vel][300:] = delayed.columns[vel][300:]
    (lag,) = estimate_lags(bank, made, Differentiation())
    assert lag.value == pytest.approx(0.13, abs=0.02)
