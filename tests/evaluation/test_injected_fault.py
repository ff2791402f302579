"""What a channel reads with a known fault: by definition of each kind, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.evaluation.injected_fault import KINDS, faulty, lost_records, parse_fault

T = np.arange(0.0, 100.0, 0.5)
HEALTHY = 3.0 + np.sin(T)
INSIDE = (T >= 20) & (T <= 40)
DEGREE = np.pi / 180
SIZED = sorted(set(KINDS) - {"freeze", "dropout"})


def with_fault(spec, values=HEALTHY, t=T, channel="M.x"):
    return faulty(parse_fault(f"{channel}:{spec}"), t, values, channel=channel)


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("bias=2@20:40", HEALTHY + 2),
        ("bias=-2@20:40", HEALTHY - 2),
        ("drift=0.5@20:40", HEALTHY + 0.5 * (T - 20)),
        ("scale=1.5@20:40", HEALTHY * 1.5),
        ("scale=-1@20:40", -HEALTHY),
        ("freeze@20:40", np.full(T.size, HEALTHY[39])),
    ],
)
def test_a_kind_does_what_it_says(spec, expected):
    assert np.allclose(with_fault(spec)[INSIDE], expected[INSIDE], rtol=1e-14)


finite = st.floats(-1e3, 1e3)
specs = st.one_of(
    st.builds("{}={}".format, st.sampled_from(SIZED), st.floats(0.1, 5)), st.just("freeze")
)


@given(specs, st.floats(1, 90), st.floats(0.1, 50), st.lists(st.integers(0, T.size - 1)))
def test_outside_its_time_nothing_changes_and_unknown_stays_unknown(spec, start, lasts, gaps):
    values = HEALTHY.copy()
    values[gaps] = np.nan
    values[0] = 1.0
    before = values.copy()
    made = with_fault(f"{spec}@{start}:{start + lasts}", values)
    outside = (start > T) | (start + lasts < T)
    assert np.array_equal(made[outside], values[outside], equal_nan=True)
    assert np.array_equal(np.isnan(made), np.isnan(values))
    assert np.array_equal(values, before, equal_nan=True)


@given(st.sampled_from(SIZED), st.floats(0.1, 5))
def test_without_an_end_a_fault_lasts(kind, size):
    made = with_fault(f"{kind}={size}@20")
    assert (made[T > 20] != HEALTHY[T > 20]).mean() > 0.95


def test_no_fault_of_size_nought_changes_anything():
    for spec in ("bias=0", "drift=0", "noise=0", "scale=1"):
        assert np.array_equal(with_fault(f"{spec}@20:40"), HEALTHY)


def test_noise_has_its_sigma_no_mean_and_is_the_same_for_a_channel_alone():
    t = np.arange(0.0, 20_000.0)
    zero = np.zeros(t.size)
    made = with_fault("noise=0.3@0", zero, t)
    assert made.std() == pytest.approx(0.3, rel=0.03)
    assert abs(made.mean()) < 0.01
    assert abs(np.corrcoef(made[1:], made[:-1])[0, 1]) < 0.03
    assert np.array_equal(made, with_fault("noise=0.3@0", zero, t))
    other = with_fault("noise=0.3@0", zero, t, channel="M.y")
    assert abs(np.corrcoef(made, other)[0, 1]) < 0.03


def test_records_of_one_moment_have_one_noise():
    """A field that several records of a moment repeat is one measurement."""
    t = np.repeat(np.arange(50.0), 2)
    made = with_fault("noise=1@0", np.zeros(100), t)
    assert np.array_equal(made[::2], made[1::2])


def test_what_freezes_is_the_last_known_value_before_whatever_the_order():
    values = HEALTHY.copy()
    values[36:40] = np.nan
    order = np.random.default_rng(0).permutation(T.size)
    frozen = with_fault("freeze@20:40", values[order], T[order])
    assert set(frozen[INSIDE[order]]) == {HEALTHY[35]}
    with pytest.raises(UsageError, match="reads nothing before 0 s"):
        with_fault("freeze@0")


@pytest.mark.parametrize(("like", "low"), [(-1.0, -np.pi), (1.0, 0.0)])
def test_an_angle_stays_in_the_range_of_its_log(like, low):
    values = np.abs(np.linspace(0.1, 3.0, T.size)) * like
    made = with_fault("bias=3@20:40", values, channel="ATTITUDE.yaw")
    assert ((made >= low) & (made < low + 2 * np.pi)).all()
    turned = np.angle(np.exp(1j * (made - values)))[INSIDE]
    assert np.allclose(turned, 3.0)


@given(st.floats(0.05, 1.0))
def test_a_dropout_loses_its_share_inside_its_time_alone(share):
    t = np.arange(0.0, 20_000.0)
    lost = lost_records(parse_fault(f"M.x:dropout={share}@5000:15000"), t, message="M")
    inside = (t >= 5000) & (t <= 15000)
    assert not lost[~inside].any()
    assert lost[inside].mean() == pytest.approx(share, abs=0.02)


@given(
    st.sampled_from(["GPS_RAW_INT.alt", "gps", "IMU[1].AccX", "a:b.c"]),
    st.sampled_from(SIZED),
    st.floats(0.01, 99),
    st.floats(0, 1e4),
    st.floats(0.1, 1e4),
)
def test_what_is_written_is_what_is_meant(target, kind, size, start, lasts):
    fault = parse_fault(f" {target}:{kind}={size}@{start}:{start + lasts} ")
    assert (fault.target, fault.kind, fault.size) == (target, kind, size)
    assert (fault.start, fault.end) == (start, start + lasts)


@pytest.mark.parametrize(
    ("channel", "expected"), [("GPS_RAW_INT.lon", -0.5), ("GPS_RAW_INT.cog", 359.5)]
)
def test_longitude_goes_below_zero_and_a_course_round(channel, expected):
    moved = with_fault(f"bias={-DEGREE}@20", np.full(T.size, 0.5) * DEGREE, channel=channel)
    assert moved[-1] / DEGREE == pytest.approx(expected)
