import base64

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fdi.report.page.columns import gaps, packed, thinned

VALUES = arrays(
    np.float64,
    st.tuples(st.integers(1, 3), st.integers(1, 200)),
    elements=st.one_of(st.floats(-1e6, 1e6), st.just(float("nan"))),
)


@given(VALUES, st.integers(2, 50))
def test_thinning_keeps_the_extremes_of_every_column(values: np.ndarray, most: int) -> None:
    t = np.arange(values.shape[1], dtype=float)
    times, columns = thinned(t, values, most)
    assert len(times) <= most + 2
    assert columns.shape == (len(values), len(times))
    assert (np.diff(times) > 0).all()
    assert times[0] == t[0]
    assert times[-1] == t[-1]
    for before, after in zip(values, columns, strict=True):
        known = before[np.isfinite(before)]
        assert np.isnan(after).all() == (not known.size)
        if known.size:
            assert np.nanmin(after) == known.min()
            assert np.nanmax(after) == known.max()


@given(VALUES, st.integers(4, 40), st.integers(0, 200), st.integers(0, 200))
def test_what_matters_is_whole_where_half_of_the_room_suffices(
    values: np.ndarray, most: int, low: int, high: int
) -> None:
    t = np.arange(values.shape[1], dtype=float)
    times, columns = thinned(t, values, most, [(low, high)])
    inside = (t >= low) & (t <= high)
    assert len(times) <= most + 6  # three stretches, each with a bucket of its own at its end
    assert (np.diff(times) > 0).all()
    if len(t) > most and inside.sum() <= most // 2:
        kept = np.isin(times, t[inside])
        np.testing.assert_array_equal(columns[:, kept], values[:, inside])


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_a_latitude_keeps_a_centimetre() -> None:
    """Seven digits of 50 degrees are 5 m; what it varies by has them all."""
    latitude = 50.0 + np.linspace(0, 1e-3, 100)
    found = packed(latitude)
    assert np.abs(unpacked(found["f"], "<f4").astype(float) + found["b"] - latitude).max() < 1e-9


def test_unknown_survives_packing() -> None:
    found = packed(np.array([1.0, np.nan, 2.0]))
    assert np.isnan(unpacked(found["f"], "<f4")).tolist() == [False, True, False]


def test_counts_are_packed_as_they_are() -> None:
    values = np.array([0.0, 1500.0, -3.0])
    assert unpacked(packed(values)["i"], "<i2").tolist() == values.tolist()


def test_a_line_is_broken_where_records_are_missing() -> None:
    t = np.array([0.0, 0.1, 0.2, 5.0, 5.1])
    assert gaps(t).tolist() == [False, False, True, False]
