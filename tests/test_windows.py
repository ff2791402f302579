"""Moving windows against the plain loop, with values of any size outside of them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fdi.windows import centred_sum, largest_between, sums_between, trailing_sum

COLUMNS = arrays(np.float64, st.integers(1, 40), elements=st.integers(-1000, 1000).map(float))


@given(COLUMNS, st.integers(1, 50))
def test_trailing(values, count):
    wanted = [values[max(0, i - count + 1) : i + 1].sum() for i in range(values.size)]
    assert trailing_sum(values, count).tolist() == wanted
    assert trailing_sum(np.stack([values, -values]), count).tolist() == [
        wanted,
        [-one for one in wanted],
    ]


@given(COLUMNS, st.integers(1, 50))
def test_centred(values, half):
    wanted = [values[max(0, i - half) : i + half + 1].sum() for i in range(values.size)]
    assert centred_sum(values, half).tolist() == wanted


@given(COLUMNS, st.data())
def test_between(values, data):
    window = st.tuples(st.integers(0, values.size - 1), st.integers(1, values.size)).filter(
        lambda ends: ends[0] < ends[1]
    )
    first, last = np.array(data.draw(st.lists(window, min_size=1))).T
    wanted = [values[low:high].sum() for low, high in zip(first, last, strict=True)]
    assert sums_between(values, first, last).tolist() == wanted


@given(COLUMNS, st.data())
def test_the_largest_between(values, data):
    window = st.tuples(*[st.integers(0, values.size - 1)] * 2).map(sorted)
    first, last = np.array(data.draw(st.lists(window, min_size=1))).T
    wanted = [values[low : high + 1].max() for low, high in zip(first, last, strict=True)]
    assert largest_between(values, first, last).tolist() == wanted


@given(COLUMNS, st.integers(1, 20), st.data())
def test_a_wild_value_spoils_its_own_windows_only(values, count, data):
    at = data.draw(st.integers(0, values.size - 1))
    wild = values.copy()
    wild[at] = 1e300
    apart = np.abs(np.arange(values.size) - at) > count
    same = centred_sum(wild, count)[apart] == centred_sum(values, count)[apart]
    assert same.all()
