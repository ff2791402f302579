"""Of several logs the better one's records stand for a message, and nothing is made up."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.together.messages import shifted, united
from fdi.units import Conversion

FLIGHT = [(0.0, 100.0)]


def made(
    t: Floats, fields: Mapping[str, Any], unit: str = "m", scale: float = 1.0, name: str = "M"
) -> Message:
    """Return a message; a field is an array in SI, or a list of texts."""
    columns = {
        field: Column(lambda v=values: np.array(v, object), Conversion(""), is_text=True)
        if isinstance(values, list)
        else Column(lambda v=values: v / scale, Conversion(unit, scale))
        for field, values in fields.items()
    }
    return Message(name, None, t, t.copy(), np.arange(t.size), columns)


def ramp(t: Floats) -> Floats:
    return 3.0 * t + 1.0


def test_higher_rate_wins_where_both_cover_the_flight() -> None:
    slow, fast = np.arange(0, 100, 0.25), np.arange(0, 100, 0.1)
    pair = [(0, made(slow, {"x": ramp(slow)})), (1, made(fast, {"x": ramp(fast)}))]
    for candidates in (pair, pair[::-1]):
        message, taken = united(candidates, FLIGHT)
        assert taken.chosen == 1
        assert not taken.fields
        assert not taken.records
        np.testing.assert_array_equal(message.t, fast)


def test_coverage_wins_over_rate_and_the_faster_one_adds_nothing() -> None:
    slow, fast = np.arange(0, 100, 0.25), np.arange(0, 60, 0.1)
    pair = [(0, made(slow, {"x": ramp(slow)})), (1, made(fast, {"x": ramp(fast)}))]
    message, taken = united(pair, FLIGHT)
    assert taken.chosen == 0
    assert not taken.records
    np.testing.assert_array_equal(message.t, slow)


def test_of_equals_the_one_with_fewer_gaps_then_with_finer_values_then_the_first_wins() -> None:
    t = np.arange(0, 100, 0.25)
    whole = made(t, {"x": ramp(t)})
    holed = made(t[(t < 50) | (t > 52)], {"x": ramp(t[(t < 50) | (t > 52)])})
    coarse = made(t, {"x": np.round(ramp(t) / 10) * 10})
    assert united([(0, holed), (1, whole)], FLIGHT)[1].chosen == 1
    assert united([(0, coarse), (1, whole)], FLIGHT)[1].chosen == 1
    assert united([(0, whole), (1, made(t, {"x": ramp(t)}))], FLIGHT)[1].chosen == 0


def test_a_field_that_the_better_one_lacks_is_interpolated_and_never_extrapolated() -> None:
    fast = np.arange(0, 100, 0.1)
    slow = np.concatenate((np.arange(10, 40, 0.25), np.arange(60, 90, 0.25)))
    other = made(slow, {"x": ramp(slow), "y": ramp(slow)}, scale=0.01)
    message, taken = united([(0, made(fast, {"x": ramp(fast)})), (1, other)], FLIGHT)
    assert taken.fields == {1: ("y",)}
    y, inside = message.si("y"), np.zeros(fast.size, bool)
    for low, high in ((10, 39.75), (60, 89.75)):
        inside |= (fast >= low - 1e-9) & (fast <= high + 1e-9)
    np.testing.assert_allclose(y[inside], ramp(fast[inside]))
    assert np.isnan(y[~inside]).all()
    np.testing.assert_allclose(
        message.raw("y")[inside], ramp(fast[inside]) / 0.01
    )  # as on the wire


@given(st.lists(st.integers(0, 3), min_size=60, max_size=60))
def test_a_state_is_never_between_two_states(states: list[int]) -> None:
    """It is that of the record before."""
    slow, fast = np.arange(0, 60.0), np.arange(0, 59, 0.1)
    column = Column(lambda: np.array(states, np.uint8), Conversion(""), is_discrete=True)
    other = Message("M", None, slow, slow, np.arange(slow.size), {"state": column})
    message, _ = united([(0, made(fast, {"x": ramp(fast)})), (1, other)], FLIGHT)
    expected = np.array(states, float)[np.floor(fast + 1e-9).astype(int)]
    np.testing.assert_array_equal(message.si("state"), expected)


def test_an_angle_goes_the_short_way_round() -> None:
    slow = np.array([0.0, 0.5, 1.0, 1.5])
    turn = np.array([3.0, -3.0, 3.0, -3.0])
    fast = np.arange(0, 1.5, 0.1)
    message, _ = united(
        [(0, made(fast, {"x": ramp(fast)})), (1, made(slow, {"yaw": turn}, unit="rad"))], FLIGHT
    )
    wrapped = np.abs(np.angle(np.exp(1j * message.si("yaw"))))
    assert (wrapped > 2.99).all()


def test_records_come_from_the_other_where_the_better_one_has_none() -> None:
    fast = np.concatenate((np.arange(20, 60, 0.1), np.arange(70, 100, 0.1)))
    slow = np.arange(0, 110, 0.25)
    pair = [
        (0, made(fast, {"x": ramp(fast), "own": fast}, scale=0.1)),
        (1, made(slow, {"x": ramp(slow), "text": ["t"] * slow.size}, scale=0.001)),
    ]
    message, taken = united(pair, [(15.0, 100.0)])
    assert taken.chosen == 1  # the slow one covers the flight
    message, taken = united(pair, [(20.0, 60.0)])
    assert taken.chosen == 0
    assert (np.diff(message.t) > 0).all()
    assert np.diff(message.t).max() <= 0.5
    np.testing.assert_allclose(message.si("x"), ramp(message.t))
    np.testing.assert_allclose(message.raw("x"), ramp(message.t) / 0.1)
    is_own = np.isin(message.t, fast)
    np.testing.assert_allclose(message.si("own")[is_own], fast)
    assert np.isnan(message.si("own")[~is_own]).all()
    assert taken.records == {1: int((~is_own).sum())}
    assert message.stamp.size == message.kept.size == message.t.size


def test_a_field_that_is_not_the_same_quantity_stays_unknown_in_such_records() -> None:
    fast, slow = np.arange(20, 60, 0.1), np.arange(0, 80, 0.25)
    pair = [
        (0, made(fast, {"x": ramp(fast), "z": np.sin(fast)})),
        (1, made(slow, {"x": ramp(slow) + 400.0, "z": np.sin(slow)})),
    ]
    message, _ = united(pair, [(20.0, 60.0)])
    outside = (message.t < 19.9) | (message.t > 60)
    assert outside.sum() > 100
    assert np.isnan(message.si("x")[outside]).all()
    np.testing.assert_allclose(message.si("z")[outside], np.sin(message.t[outside]))


def test_two_halves_make_the_whole_with_texts() -> None:
    t = np.arange(0, 100, 0.25)
    whole = made(t, {"x": ramp(t), "name": [str(k) for k in range(t.size)]})
    halves = [
        (i, made(part, {"x": ramp(part), "name": [str(round(4 * k)) for k in part]}))
        for i, part in enumerate((t[:150], t[150:]))
    ]
    for order in (halves, halves[::-1]):
        message, _ = united(order, FLIGHT)
        np.testing.assert_array_equal(message.t, t)
        np.testing.assert_allclose(message.si("x"), whole.si("x"))
        assert message.raw("name").tolist() == whole.raw("name").tolist()


@given(
    st.lists(st.floats(0, 100), min_size=0, max_size=40, unique=True),
    st.lists(st.floats(0, 100), min_size=0, max_size=40, unique=True),
)
def test_times_ascend_and_every_record_is_one_of_a_log(a: list[float], b: list[float]) -> None:
    one, other = (np.array(sorted(values)) for values in (a, b))
    message, taken = united(
        [(0, made(one, {"x": ramp(one)})), (1, made(other, {"x": ramp(other)}))], FLIGHT
    )
    assert (np.diff(message.t) > 0).all()
    assert set(message.t) <= set(a) | set(b)
    assert set((one, other)[taken.chosen]) <= set(message.t)
    known = np.isfinite(message.si("x"))
    np.testing.assert_allclose(message.si("x")[known], ramp(message.t[known]))


@pytest.mark.parametrize("offset", [0.0, 12.5])
def test_a_shift_moves_the_times_and_leaves_the_values(offset: float) -> None:
    t = np.arange(0, 10, 0.25)
    moved = shifted(made(t, {"x": ramp(t)}), offset)
    np.testing.assert_array_equal(moved.t, t + offset)
    np.testing.assert_array_equal(moved.stamp, t + offset)
    np.testing.assert_array_equal(moved.si("x"), ramp(t))
