"""Reliability of several units: the check values of the literature, and limits."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.methods import reliability as rel

SHARES = st.lists(st.floats(0, 1), min_size=1, max_size=6)


@pytest.mark.parametrize(
    ("t", "one", "two_of_three", "parallel"),
    [(0.1, 0.904837, 0.974556, 0.999138), (1.0, 0.367879, 0.306432, 0.747420)],
)
def test_check_values_of_three_equal_units(t, one, two_of_three, parallel):
    unit = rel.constant(1.0, t)
    assert float(unit) == pytest.approx(one, abs=5e-7)
    assert float(rel.k_of_n(2, [unit] * 3)) == pytest.approx(two_of_three, abs=5e-7)
    assert float(rel.parallel([unit] * 3)) == pytest.approx(parallel, abs=5e-7)


@pytest.mark.parametrize(
    ("k", "n", "of_one"),
    [(1, 1, 1), (2, 2, 1 / 2), (1, 2, 1.5), (1, 3, 11 / 6), (2, 3, 5 / 6), (3, 5, 47 / 60)],
)
def test_closed_mttf_is_the_integral_of_r(k, n, of_one):
    rate = 0.25
    assert rel.mttf_k_of_n(k, n, rate) == pytest.approx(of_one / rate)
    found = rel.mttf(lambda t: float(rel.k_of_n(k, [rel.constant(rate, t)] * n)))
    assert found == pytest.approx(of_one / rate, rel=1e-8)


def test_mttf_of_a_series_is_one_over_the_sum_of_the_rates():
    rates = [0.1, 0.3, 0.6]
    found = rel.mttf(lambda t: float(rel.series([rel.constant(r, t) for r in rates])))
    assert rel.mttf_series(rates) == pytest.approx(1.0)
    assert found == pytest.approx(1.0, rel=1e-8)


@given(SHARES, st.data())
def test_k_of_n_is_the_sum_over_all_ways_to_work(shares, data):
    n = len(shares)
    k = data.draw(st.integers(1, n))
    expected = 0.0
    for count in range(k, n + 1):
        for works in combinations(range(n), count):
            expected += math.prod(r if i in works else 1 - r for i, r in enumerate(shares))
    assert float(rel.k_of_n(k, shares)) == pytest.approx(expected, abs=1e-12)


@given(SHARES)
def test_one_of_n_is_parallel_and_n_of_n_series(shares):
    assert float(rel.k_of_n(1, shares)) == pytest.approx(float(rel.parallel(shares)), abs=1e-12)
    assert float(rel.k_of_n(len(shares), shares)) == pytest.approx(
        float(rel.series(shares)), abs=1e-12
    )


def test_a_voter_stands_in_series():
    assert float(rel.k_of_n(2, [0.9] * 3, voter=0.99)) == pytest.approx(0.99 * 0.972)


def test_two_of_three_is_better_than_one_only_above_one_half():
    assert rel.break_even(2, 3) == pytest.approx(0.5)
    t = math.log(2)
    assert float(rel.k_of_n(2, [rel.constant(1.0, t)] * 3)) == pytest.approx(0.5)
    assert rel.break_even(1, 3) == 0.0
    assert rel.break_even(3, 3) == 1.0
    r = rel.break_even(3, 4)
    assert float(rel.k_of_n(3, [r] * 4)) == pytest.approx(r, abs=1e-9)


def test_a_rate_that_changes_is_integrated():
    assert rel.from_rate(lambda t: 3 * t**2, 2.0) == pytest.approx(math.exp(-8), rel=1e-9)


def test_reliability_over_time_is_an_array():
    t = np.linspace(0, 3, 7)
    found = rel.k_of_n(2, [rel.constant(1.0, t)] * 3)
    np.testing.assert_allclose(found, 3 * np.exp(-2 * t) - 2 * np.exp(-3 * t), atol=1e-12)


@pytest.mark.parametrize(
    "call",
    [
        lambda: rel.k_of_n(0, [0.5]),
        lambda: rel.k_of_n(3, [0.5, 0.5]),
        lambda: rel.series([1.2]),
        lambda: rel.parallel([math.nan]),
        lambda: rel.constant(-1.0, 1.0),
        lambda: rel.constant(math.nan, 1.0),
    ],
)
def test_what_is_no_share_rate_or_number_is_refused(call):
    with pytest.raises(UsageError):
        call()
