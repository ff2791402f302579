"""Resampling: unknown is never bridged, known values never leave their neighbours."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fdi.errors import LogError, UsageError
from fdi.telemetry import Channel, Request, Sampling
from fdi.telemetry.message import Column, Message
from fdi.telemetry.signals import Material, records_of, resample
from fdi.units import Conversion

from .build import Flight

A = Channel("M", "a")


def log_of(t, value, stamp=None, *, is_discrete=False):
    """Return a log's material with one message M and its field a."""
    t, value = np.asarray(t, float), np.asarray(value, float)
    stamp = t if stamp is None else np.asarray(stamp, float)
    column = Column(lambda: value.copy(), Conversion("rad"), is_discrete=is_discrete)
    message = Message("M", None, t, stamp, np.arange(t.size), {"a": column})
    span = (float(t[0]), float(t[-1]))
    return Material({"M": message}, span, (), (), MappingProxyType({}), "log")


def values(log, *, request=None, **sampling):
    options = {"rate_hz": 10.0, **sampling}
    signals = resample(log, (request or Request(A, ("a",)),), Sampling(**options))
    return signals.t, signals.columns[A]


times = st.lists(st.floats(0.05, 1.5), min_size=2, max_size=30).map(np.cumsum)
levels = st.one_of(st.floats(-100, 100), st.just(float("nan")))


@given(t=times, data=st.data())
def test_values_lie_between_known_neighbours_and_gaps_are_unknown(t, data):
    value = np.array(data.draw(st.lists(levels, min_size=t.size, max_size=t.size)))
    grid, got = values(log_of(t, value), window=(t[0] - 3, t[-1] + 3))
    period = np.median(np.diff(t))
    longest = max(1.0, 3 * period)
    for at, found in zip(grid, got, strict=True):
        left = np.searchsorted(t, at, side="right") - 1
        near = np.abs(t - at)
        if near.min() < 1e-9:
            continue
        is_inside = 0 <= left < t.size - 1 and t[left + 1] - t[left] <= longest * (1 - 1e-9)
        around = value[left : left + 2] if 0 <= left < t.size - 1 else np.array([np.nan])
        if is_inside and np.isfinite(around).all():
            assert around.min() - 1e-9 <= found <= around.max() + 1e-9
        elif left < 0 or left >= t.size - 1 or not np.isfinite(around).all():
            assert np.isnan(found)


@given(t=times, data=st.data())
def test_discrete_quantities_take_no_value_that_was_not_recorded(t, data):
    value = np.array(data.draw(st.lists(levels, min_size=t.size, max_size=t.size)))
    window = (t[0] - 3, t[-1] + 3)
    grid, got = values(log_of(t, value, is_discrete=True), window=window)
    _, linear = values(log_of(t, value), window=window)
    np.testing.assert_array_equal(np.isnan(got), np.isnan(linear))
    known = np.isfinite(got)
    before = np.searchsorted(t, grid[known] + 1e-8, side="right") - 1
    np.testing.assert_array_equal(got[known], value[before])


def test_a_word_of_bits_never_is_another_word():
    """Half way between 32768 and 65536 lies a word with a bit that nobody set."""
    log = log_of([0, 0.5, 1.0], [0x8000, 0x10000, 0x10000], is_discrete=True)
    request = Request(A, ("a",), value=lambda f: f["a"] + 1, raw=True)
    for wanted, added in ((Request(A, ("a",), raw=True), 0), (request, 1)):
        _, got = values(log, request=wanted)
        assert (got - added).tolist() == [0x8000] * 5 + [0x10000] * 6


@given(start=st.floats(-np.pi, np.pi - 1e-6), turn=st.floats(-3.0, 3.0))
def test_angles_take_the_short_way(start, turn):
    assume(abs(turn) > 1e-6)
    end = (start + turn + np.pi) % (2 * np.pi) - np.pi
    request = Request(A, ("a",), circular=True)
    _, got = values(log_of([0, 1], [start, end]), request=request)
    off = (got - (start + turn * np.linspace(0, 1, 11)) + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < 1e-6


def test_unwrapping_can_be_switched_off():
    request = Request(A, ("a",), circular=True)
    _, got = values(log_of([0, 1], [3.0, -3.0]), request=request, unwrap=False, rate_hz=2)
    assert got.tolist() == [3.0, 0.0, -3.0]


def test_invalid_records_are_unknown_up_to_their_neighbours():
    request = Request(A, ("a",), valid=lambda c: c["a"] < 5)
    _, got = values(log_of([0, 1, 2, 3], [1, 2, 9, 4]), request=request, rate_hz=2)
    assert np.isfinite(got).tolist() == [True, True, True, False, False, False, True]


def test_value_that_is_not_finite_is_unknown():
    request = Request(A, ("a",), value=lambda c: 1 / c["a"])
    _, got = values(log_of([0, 1, 2], [1, 0, 2]), request=request, rate_hz=1)
    np.testing.assert_array_equal(got, [1, np.nan, 0.5])


def test_what_overflows_between_damaged_values_is_unknown():
    """1.7e308 after -1.7e308: the rise is no number, and far outside not even a tenth of it is."""
    log = log_of([0.0, 0.1, 0.2, 0.3], [1.0, 1.7e308, -1.7e308, -1.6e308])
    with np.errstate(all="raise"):
        _, got = values(log, rate_hz=20.0, window=(-20.0, 20.0))
    known = got[np.isfinite(got)]
    np.testing.assert_allclose(known, [1.0, 0.85e308, 1.7e308, -1.7e308, -1.65e308, -1.6e308])


def test_latency_moves_the_records_back():
    request = Request(A, ("a",), latency=0.5)
    _, got = values(log_of([0, 1, 2], [0, 1, 2]), request=request, rate_hz=2)
    np.testing.assert_array_equal(got, [0.5, 1.0, 1.5, 2.0, np.nan])


def test_published_recipe_uses_stamps_drops_earlier_twins_and_extrapolates():
    log = log_of([0, 1, 2], [0, 5, 7], stamp=[0.0, 1.0, 1.0])
    _, got = values(
        log, rate_hz=1, window=(0, 3), clock="record", extrapolate=True, gap_factor=float("inf")
    )
    assert got.tolist() == [0, 7, 14, 21]
    _, mean = values(log, rate_hz=1, window=(0, 1), clock="record", equal_stamps="mean")
    assert mean.tolist() == [0, 6]


@pytest.mark.parametrize(("paces", "rate"), [(True, 2.0), (False, 4.0)])
def test_what_is_made_of_other_records_does_not_pace_unless_nothing_else_is_asked(paces, rate):
    t = np.arange(0.0, 10.0, 0.25)
    fast, slow = log_of(t, t), log_of(t[::4], t[::4])
    both = replace(fast, messages={"M": fast.messages["M"], "N": slow.messages["M"]})
    made = Request(Channel("N", "a"), ("a",), paces=paces)
    assert resample(both, (Request(A, ("a",)), made), Sampling()).rate_hz == rate
    assert resample(both, (made,), Sampling()).rate_hz == 1.0


def test_automatic_rate_is_the_channels_own():
    t = np.arange(0, 30, 0.26)
    signals = resample(log_of(t, t), (Request(A, ("a",)),), Sampling())
    assert signals.rate_hz == 4.0
    assert signals.period[A] == pytest.approx(0.26)


def test_missing_channel_is_unknown_throughout():
    other = Request(Channel("N", "b"), ("b",))
    signals = resample(log_of([0, 1], [1, 2]), (Request(A, ("a",)), other), Sampling(rate_hz=1))
    assert np.isnan(signals.columns[other.channel]).all()
    assert np.isnan(signals.period[other.channel])


@pytest.mark.parametrize("window", [(5.0, 1.0), (0.0, float("inf")), (0.0, 1e12)])
def test_window_that_makes_no_grid_is_refused(window):
    with pytest.raises(UsageError):
        values(log_of([0, 1], [1, 2]), window=window)


def test_window_includes_both_ends(load):
    log = load(Flight().bytes())
    request = Request(Channel.parse("ATTITUDE.roll"), ("roll",))
    signals = log.signals([request], Sampling(rate_hz=1.0, window=(2.0, 20.0)))
    assert (signals.t[0], signals.t[-1], signals.t.size) == (2.0, 20.0, 19)
    assert not signals.columns[request.channel].flags.writeable


def test_grid_covers_the_flights_by_default(load):
    log = load(Flight().bytes())
    signals = log.signals([Request(Channel.parse("ATTITUDE.roll"), ("roll",))])
    assert signals.t[0] == log.flights[0].start
    assert signals.rate_hz == 5.0
    assert signals.frame().shape == (signals.t.size, 1)


def test_validity_sees_the_flight_state(load):
    log = load(Flight().bytes())
    request = Request(
        Channel.parse("VFR_HUD.alt"),
        ("alt",),
        valid=lambda c: np.asarray(c["airborne"]) & (np.asarray(c["mode"]) == "AUTO"),
    )
    signals = log.signals([request], Sampling(rate_hz=2.0, window=log.span))
    known = np.isfinite(signals.columns[request.channel])
    assert known.any()
    assert (signals.state.airborne[known]).all()


@pytest.mark.parametrize(("silent_s", "rate"), [(1000, 10.0), (3000, 5.0), (10_000, 1.0)])
def test_automatic_rate_is_lower_where_records_cannot_fill_its_grid(silent_s, rate):
    tenths = [i / 10 for i in range(50)]
    log = log_of([*tenths, *(silent_s + t for t in tenths)], [1.0] * 100)
    assert resample(log, (Request(A, ("a",)),), Sampling()).rate_hz == rate


def test_silence_of_hours_with_a_few_records_makes_no_grid():
    log = log_of([0.0, 0.1, 0.2, 30_000.0], [1.0] * 4)
    with pytest.raises(LogError, match="its times are nonsense: 30000 s at 1 Hz"):
        resample(log, (Request(A, ("a",)),), Sampling())


def test_log_whose_times_are_nonsense_makes_no_endless_grid():
    log = log_of([0.0, 0.1, 0.2, 1e6], [1.0, 2.0, 3.0, 4.0])
    with pytest.raises(LogError, match="and there are 4 records"):
        resample(log, (Request(A, ("a",)),), Sampling())


def quiet(*keys):
    """Messages at 1 Hz for 60 s by key, with the times that each lacks."""
    made = {}
    for key, (low, high) in keys:
        t = np.array([x for x in np.arange(60.0) if not low <= x < high])
        column = Column(lambda n=t.size: np.zeros(n), Conversion("Pa"))
        made[key] = Message(key, None, t, t, np.arange(t.size), {"press_abs": column})
    return made


def silence(messages):
    material = Material(messages, (0.0, 60.0), (), (), {}, "by hand")
    channel = Channel("SCALED_PRESSURE", "press_abs:silent")
    request = Request(channel, ("press_abs",), lambda c: c["press_abs"], silence=True)
    return records_of(material, request, Sampling(), {})


def test_a_sensor_that_stops_while_its_like_go_on_is_silent():
    found = silence(
        quiet(("SCALED_PRESSURE", (30, 60)), ("HEARTBEAT", (0, 0)), ("SYSTEM_TIME", (0, 0)))
    )
    assert found.value[found.t < 34].max() == 0.0
    assert found.value[-1] == pytest.approx(59 - 29 - 5)


def test_a_link_that_loses_everything_silences_no_sensor():
    gap = (30, 50)
    found = silence(quiet(("SCALED_PRESSURE", gap), ("HEARTBEAT", gap), ("SYSTEM_TIME", gap)))
    assert found.value.max() == 0.0


def test_a_field_that_its_own_message_calls_unknown_is_silent_from_its_last_value_on():
    own = quiet(*((key, (70, 80)) for key in ("SCALED_PRESSURE", "HEARTBEAT", "SYSTEM_TIME")))
    barometer = own["SCALED_PRESSURE"]
    value = np.where(barometer.t < 30, 99_000.0, np.nan)
    column = Column(lambda: value, Conversion("Pa"))
    own["SCALED_PRESSURE"] = replace(barometer, columns={"press_abs": column}, _cache={})
    found = silence(own)
    last = barometer.t[barometer.t < 30][-1]
    gone = found.t > last + 0.5
    assert found.value[~gone].max() == 0.0
    assert found.value[gone] == pytest.approx(found.t[gone] - last)


def test_silence_is_unknown_without_messages_of_its_rate():
    assert not silence(quiet(("SCALED_PRESSURE", (30, 60)))).t.size


@pytest.mark.parametrize(("turned", "known"), [(0.01, False), (0.2, True)])
def test_a_stillness_counts_only_where_the_vehicle_has_moved(turned, known):
    """A noiseless compass of a vehicle that does not turn is not frozen."""
    t = np.arange(0.0, 30.0)
    roll = np.where(t < 20, 0.0, turned)
    column = Column(lambda: roll, Conversion("rad"))
    attitude = Message("ATTITUDE", None, t, t, np.arange(t.size), {"roll": column})
    held = log_of(t, np.where(t < 10, 0.0, t - 10))
    material = Material({**held.messages, "ATTITUDE": attitude}, (0.0, 30.0), (), (), {}, "by hand")
    stirred = ((Channel("ATTITUDE", "roll"), 0.05),)
    found = records_of(material, Request(A, ("a",), stirred=stirred), Sampling(), {})
    assert np.isfinite(found.value[t <= 10]).all()
    assert np.isnan(found.value[(t > 10) & (t < 20)]).all()
    assert np.isfinite(found.value[t >= 20]).all() == known


@pytest.mark.parametrize(
    ("before", "seen", "known"),
    [
        (0.0, 40.0, True),  # its noise has moved it at every record so far
        (6.0, 40.0, False),  # it has stood still for 6 s before
        (0.0, 15.0, False),  # nobody knows it yet
    ],
)
def test_a_field_that_stands_still_longer_than_ever_needs_no_turning_vehicle(before, seen, known):
    t = np.arange(0.0, seen + 10.0)
    rest = np.where((t >= 5) & (t <= 5 + before), t - 5, 0.0)
    held = np.where(t < seen, rest, t - seen)
    level = Column(lambda: np.zeros(t.size), Conversion("rad"))
    attitude = Message("ATTITUDE", None, t, t, np.arange(t.size), {"roll": level})
    own = {**log_of(t, held).messages, "ATTITUDE": attitude}
    material = Material(own, (0.0, seen + 10.0), (), (), {}, "by hand")
    stirred = ((Channel("ATTITUDE", "roll"), 0.05),)
    found = records_of(material, Request(A, ("a",), stirred=stirred), Sampling(), {})
    assert np.isfinite(found.value[t > seen]).all() == known
    assert np.isfinite(found.value[t > seen]).any() == known
