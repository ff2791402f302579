"""What a quantity did over the last seconds: known answers, gaps, and wild values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import ModelError
from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.model.expression import Apply, Number, Symbol, parse, to_text
from fdi.model.records import (
    GAP_S,
    SAME_S,
    change,
    integral,
    kept,
    noise,
    recent,
    sampled,
    span,
    still,
)
from fdi.telemetry.signals import TIME

FUNCTIONS = (change, integral, span, noise, sampled)
EACH = pytest.mark.parametrize("function", FUNCTIONS)
ALL = pytest.mark.parametrize("function", [still, recent, *FUNCTIONS])


def of(function, t, values):
    """What a function of records says, over 2 s where it takes a number of seconds."""
    given_ = (np.asarray(t, float), np.asarray(values, float))
    return function(*given_, 2.0) if function in FUNCTIONS else function(*given_)


# Steps of 0.05 to 0.9 s: no gap among them.
TIMES = st.lists(st.floats(0.05, 0.9), min_size=2, max_size=60).map(np.cumsum)
NUMBERS = st.floats(-100, 100)
SECONDS = st.floats(0.1, 30)


@given(TIMES, NUMBERS, NUMBERS, SECONDS)
def test_a_line_changes_by_its_slope(t, slope, start, seconds):
    found = change(t, start + slope * t, seconds)
    known = t - seconds >= t[0]
    assert np.array_equal(np.isfinite(found), known)
    np.testing.assert_allclose(found[known], slope * seconds, atol=1e-9)


@given(TIMES, NUMBERS, SECONDS)
def test_a_constant_integrates_to_itself_times_the_seconds(t, value, seconds):
    found = integral(t, np.full(len(t), value), seconds)
    known = t - seconds >= t[0]
    assert np.array_equal(np.isfinite(found), known)
    np.testing.assert_allclose(found[known], value * seconds, atol=1e-9)


@given(TIMES, NUMBERS, NUMBERS, SECONDS)
def test_a_speed_that_grows_evenly_integrates_to_the_way(t, start, growth, seconds):
    """Trapezoids are exact for it, whenever the records come."""
    found = integral(t, start + growth * t, seconds)
    known = t - seconds >= t[0]
    begins = t - seconds
    way = start * seconds + growth * (t**2 - begins**2) / 2
    np.testing.assert_allclose(found[known], way[known], atol=1e-7)


@given(TIMES, SECONDS, st.data())
def test_a_span_is_that_of_the_records_in_the_window(t, seconds, data):
    values = np.array(data.draw(st.lists(NUMBERS, min_size=len(t), max_size=len(t))))
    found = span(t, values, seconds)
    known = t - seconds >= t[0] - SAME_S
    assert np.array_equal(np.isfinite(found), known)
    held = [values[(t >= now - seconds - SAME_S) & (t <= now)] for now in t[known]]
    assert found[known].tolist() == [np.ptp(one) for one in held]


@given(TIMES, NUMBERS, NUMBERS, NUMBERS, st.integers(1, 20))
def test_the_integral_of_a_rate_is_the_change_between_two_records(t, a, b, c, back):
    """At whole records nothing is interpolated, so a parabola is met exactly as well."""
    back = min(back, len(t) - 1)
    seconds = t[-1] - t[-1 - back]
    begins = float(t[-1] - seconds)
    t = t.copy()
    t[-1 - back] = begins  # to the last digit
    moved = change(t, a + b * t + c * t**2, seconds)[-1]
    assert integral(t, b + 2 * c * t, seconds)[-1] == pytest.approx(moved, abs=1e-7)


@given(TIMES, SECONDS, st.randoms(use_true_random=False))
def test_integrals_and_changes_are_those_of_the_record_polygon(t, seconds, random):
    """Against a fine sum of the polygon through the records."""
    values = np.array([random.uniform(-10, 10) for _ in t])
    moved, area = change(t, values, seconds), integral(t, values, seconds)
    for place in np.flatnonzero(np.isfinite(moved)):
        low = t[place] - seconds
        inner = t[(t > low) & (t < t[place])]
        corners = np.concatenate([[low], inner, [t[place]]])
        heights = np.interp(corners, t, values)
        assert moved[place] == pytest.approx(values[place] - heights[0], abs=1e-9)
        trapezoids = np.diff(corners) * (heights[1:] + heights[:-1]) / 2
        assert area[place] == pytest.approx(trapezoids.sum(), abs=1e-9)


@given(TIMES, SECONDS, st.floats(-5, 5), st.floats(-3, 3))
def test_records_on_a_line_leave_nothing_to_doubt(t, seconds, start, slope):
    found = sampled(t, start + slope * t, seconds)
    assert np.nan_to_num(found).max() < 1e-6


@pytest.mark.parametrize(("rate", "less"), [(4, 0.07), (10, 0.035), (50, 0.01)])
@pytest.mark.parametrize("sigma", [0.1, 2.0])
def test_the_error_of_a_mean_is_that_of_scattered_records(rate, less, sigma):
    """Against means of many whiles of white noise, without a line in them.

    The middle of three estimates is less than their mean, the more the fewer records there are.
    """
    t = np.arange(4000 * rate) / rate
    values = sigma * np.random.default_rng(7).normal(size=len(t)) + 0.3 * t
    told = sampled(t, values, 1.0)[rate::rate]
    means = np.array([values[i : i + rate].mean() for i in range(0, len(t), rate)])
    means = means - 0.3 * t.reshape(-1, rate).mean(axis=1)
    assert np.sqrt(np.mean(told**2)) == pytest.approx((1 - less) * means.std(), rel=0.05)


def test_a_jump_does_not_widen_what_it_is_held_against():
    """Records that lie still and jump once told of no scatter, before and after."""
    t = np.arange(0.0, 20.0, 0.25)
    found = sampled(t, np.where(t < 10, 0.0, 1.0), 1.0)
    assert np.nan_to_num(found).max() == 0.0


def test_scatter_that_begins_counts_when_it_has_lasted():
    t = np.arange(0.0, 20.0, 0.25)
    swings = np.where(t < 10, 0.0, np.cos(np.pi * t / 0.25))
    found = sampled(t, swings, 1.0)
    assert np.nan_to_num(found[t < 10.5]).max() == 0.0
    assert found[t > 12.5].min() > 0.3


@given(TIMES, SECONDS, st.floats(-5, 5), st.floats(-3, 3))
def test_records_on_a_line_do_not_scatter(t, seconds, start, slope):
    assert np.nan_to_num(noise(t, start + slope * t, seconds)).max() < 1e-6


@pytest.mark.parametrize("uneven", [0.0, 0.4])
@pytest.mark.parametrize("sigma", [0.1, 2.0])
def test_noise_is_the_deviation_of_white_noise(uneven, sigma):
    """Whenever the records come, and whatever slow movement it lies on."""
    random = np.random.default_rng(3)
    t = (np.arange(20000) + random.uniform(-uneven, uneven, 20000)) / 5
    values = sigma * random.normal(size=len(t)) + 300 * np.sin(t / 300)
    told = noise(t, values, 10.0)[50:]
    assert told.mean() == pytest.approx(sigma, rel=0.02)
    # 50 sizes tell their mean to 0.76 / sqrt(50) of it, and less well as neighbours share records
    assert 0.1 * sigma < told.std() < 0.2 * sigma


def test_a_single_jump_is_little_noise():
    t = np.arange(150) / 5
    found = noise(t, np.where(t < 15, 0.0, 1.0), 10.0)
    # of the 50 records of a window two lie half a step off their line
    most = 2 * 0.5 / np.sqrt(1.5) * np.sqrt(np.pi / 2) / 49
    assert np.nanmax(found) == pytest.approx(most, rel=0.02)
    assert np.nanmax(np.where((t < 15) | (t > 25.1), found, np.nan)) == 0.0


@EACH
@given(times=TIMES, lost=st.sets(st.integers(0, 59)))
def test_unknown_records_are_left_out(function, times, lost):
    """As if they had not come, and unknown themselves."""
    values = np.sin(times)
    lost = np.isin(np.arange(len(times)), list(lost))
    found = of(function, times, np.where(lost, np.nan, values))
    assert np.isnan(found[lost]).all()
    np.testing.assert_array_equal(found[~lost], of(function, times[~lost], values[~lost]))


@EACH
def test_it_is_unknown_before_there_are_so_many_seconds(function):
    t = np.arange(20) / 4 + 100.0
    assert np.array_equal(np.isfinite(of(function, t, t)), t >= 102.0)


WHOLE = pytest.mark.parametrize("function", [integral, span, sampled])
"""What needs records all the while."""
STEPS = pytest.mark.parametrize(("period", "step", "is_gap"), [
    (0.2, 0.95, False),  # more than 3 periods, less than 1 s
    (0.2, 1.05, True),
    (0.5, 1.45, False),  # more than 1 s, less than 3 periods
    (0.5, 1.55, True),
])  # fmt: skip


@WHOLE
@STEPS
def test_a_gap_is_longer_than_a_second_and_three_periods(function, period, step, is_gap):
    before = period * np.arange(40)
    t = np.concatenate([before, before[-1] + step + period * np.arange(40)])
    found = of(function, t, np.ones(len(t)))
    spoiled = (t >= t[40]) & (t < t[40] + 2.0 - 1e-9)
    expected = (t >= 2.0 - 1e-9) & ~(spoiled & is_gap)
    assert np.array_equal(np.isfinite(found), expected)


@WHOLE
def test_a_gap_may_be_of_unknown_records(function):
    t = np.arange(60) / 4
    values = np.where((t >= 5) & (t < 5 + GAP_S + 0.25), np.nan, 1.0)
    found = of(function, t, values)
    assert np.array_equal(np.isfinite(found), (t >= 2) & ((t < 5) | (t >= 8.25)))


@STEPS
def test_a_change_is_unknown_where_it_begins_within_a_gap(period, step, is_gap):
    """What came while it lasted does not matter: it is the difference of its two ends."""
    before = period * np.arange(40)
    t = np.concatenate([before, before[-1] + step + period * np.arange(40)])
    found = change(t, 3 * t, 2.0)
    begins = t - 2.0
    spoiled = (begins > before[-1] + 1e-9) & (begins < t[40] - 1e-9) & is_gap
    assert np.array_equal(np.isfinite(found), (begins >= -1e-9) & ~spoiled)
    assert found[np.isfinite(found)] == pytest.approx(6.0)


def test_noise_is_told_by_what_came_between_gaps():
    """Of a radio that loses a second and more now and then: neither more noise nor none."""
    random = np.random.default_rng(5)
    t = np.arange(4000) / 5
    t = t[(t % 5 < 3.5)]  # 1.7 s are lost every 5 s
    told = noise(t, 0.5 * random.normal(size=len(t)) + 40 * np.sin(t), 10.0)
    line = noise(t, np.round(3 * t, 6), 10.0)
    assert np.isfinite(told[t > 10]).all()
    # the sine lies 40 * 0.2**2 / 2 off its line at the most, which is 0.65 of a sigma's 0.8
    assert 0.5 < np.median(told[t > 10]) < 0.8
    assert np.nanmax(line) < 1e-5


def test_noise_is_unknown_where_gaps_leave_less_than_half():
    t = np.arange(1000) / 5
    kept = (t < 100) | (t % 5 < 1.7)
    found = noise(t[kept], np.ones(kept.sum()), 10.0)
    late = t[kept] > 112
    assert np.isnan(found[late]).all()
    assert np.isfinite(found[~late & (t[kept] > 10)]).mean() > 0.9


@EACH
@given(times=TIMES, place=st.integers(0, 59), wild=st.sampled_from([1e30, -1e30, 1e300]))
def test_a_wild_value_spoils_the_windows_alone_that_hold_it(function, times, place, wild):
    values = np.cos(times)
    place = min(place, len(times) - 1)
    spoiled = np.where(np.arange(len(times)) == place, wild, values)
    found, expected = of(function, times, spoiled), of(function, times, values)
    # a window begins between two records, of which it holds both; a neighbour's line holds it too
    last = place + (3 if function in (sampled, noise) else 1)
    after = times[last] if last < len(times) else np.inf
    reach = 6.0 if function is sampled else 2.0  # that one reads two spells more
    holds = (np.arange(len(times)) >= place) & (times - reach < after)
    np.testing.assert_array_equal(found[~holds], expected[~holds])


@ALL
@pytest.mark.parametrize("clock", [0.1, 1e3 + 1 / 3, 1.6e9])
def test_another_clock_changes_nothing(function, clock):
    """Also where a record lies at the very edge of the while: stamps are rounded otherwise."""
    t = np.arange(0.0, 30.0, 0.25)
    values = np.random.default_rng(3).normal(size=t.size)
    found = of(function, t + clock, values)
    np.testing.assert_allclose(found, of(function, t, values), rtol=0, atol=1e-5)


@ALL
@pytest.mark.parametrize("values", [[], [1.0], [np.nan], [np.nan, np.nan], [1.0, np.nan]])
def test_too_few_records_are_unknown(function, values):
    found = of(function, np.arange(len(values)) * 0.5, values)
    assert found.shape == (len(values),)
    assert np.isnan(found).all()


@EACH
def test_nothing_is_written_into_the_records(function):
    t, values = np.arange(50) / 4, np.ones(50)
    values[7] = np.nan
    before = (t.copy(), values.copy())
    of(function, t, values)
    assert np.array_equal(t, before[0])
    assert np.array_equal(values, before[1], equal_nan=True)


@EACH
@given(times=TIMES, random=st.randoms(use_true_random=False))
def test_the_order_of_the_records_does_not_matter(function, times, random):
    """A recorder's stamps may go back; what counts is the time that they tell."""
    order = np.array(random.sample(range(len(times)), len(times)))
    values = np.sin(times)
    found = of(function, times[order], values[order])
    np.testing.assert_array_equal(found, of(function, times, values)[order])


@EACH
def test_records_of_one_moment_do_no_harm(function):
    t = np.repeat(np.arange(20) / 2, 2)
    found = of(function, t, np.ones(len(t)))
    known = 2.0 if function is integral else 0.0
    assert np.array_equal(found, np.where(t >= 2, known, np.nan), equal_nan=True)


@pytest.mark.parametrize("seconds", [1e-300, 1e-9, 1e300])
def test_a_while_as_short_or_long_as_can_be_is_no_failure(seconds):
    t = np.arange(20) / 2
    for function in FUNCTIONS:
        found = function(t, np.ones(20), seconds)
        assert found[np.isfinite(found)] == pytest.approx(0.0, abs=1e-8)


def test_the_language_hands_on_the_records_and_the_seconds():
    t = np.arange(40) / 4
    columns = {TIME: t, "x": t**2, "c": np.zeros(40)}
    moved = evaluate(parse("2*change(x + 1, 3)"), columns)
    np.testing.assert_array_equal(moved, 2 * change(t, t**2 + 1, 3.0))
    area = evaluate(parse("integral(x*cos(c), 6/4)"), columns)
    np.testing.assert_array_equal(area, integral(t, t**2, 1.5))


@pytest.mark.parametrize("text", ["still(c)", "recent(c)", "change(c, 3)", "integral(c, 3)"])
def test_a_number_is_the_same_at_every_record(text):
    """A parameter of the model is put in as one number."""
    t = np.arange(40) / 4
    found = evaluate(parse(text), {TIME: t, "c": np.float64(2.0)})
    assert found.shape == t.shape
    known = {"still(c)": np.nan, "recent(c)": 2.0, "change(c, 3)": 0.0, "integral(c, 3)": 6.0}
    assert np.array_equal(found[-1], known[text], equal_nan=True)


@pytest.mark.parametrize("text", ["change(x, 20)", "integral(a*cos(b), 0.5)"])
def test_what_is_of_a_while_reads_back(text):
    assert to_text(parse(text)) == text
    assert parse("change(x, 3/2)") == Apply("change", (Symbol("x"), Number(1.5)))


TEXT = """format: 1
name: small
parameters: {p: {value: 3, unit: s}}
variables: {v: {unit: m/s}, gained: {unit: m/s}, w: {unit: m/s}}
equations: {e: {text: "v = w", solves: [], fault: changed}, f: {text: "w = v + gained", solves: []}}
inputs:
  VFR_HUD:
    fields:
      airspeed: {variable: v, accuracy: 1 m/s}
      "airspeed:over": {variable: gained, accuracy: 1 m/s, value: "change(airspeed, 20)"}
measurements:
  VFR_HUD: {fields: {groundspeed: {variable: w, accuracy: 1 m/s}}}
"""
VALUE = 'value: "change(airspeed, 20)"'


def airframe(folder, old="", new=""):
    path = folder / "small.yaml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    return load_airframe(path)


def test_how_well_records_stand_for_a_while_is_reported_of_it(tmp_path):
    new = VALUE.replace("change", "integral") + ', reported: "sampled(airspeed, 20)"'
    shown = {str(m.channel): m for m in airframe(tmp_path, VALUE, new).measurements}
    assert shown["VFR_HUD.airspeed:over"].is_sampled
    assert not shown["VFR_HUD.airspeed"].is_sampled


def test_what_is_of_a_while_is_an_input_beside_the_field_itself(tmp_path):
    shown = {str(m.channel): m for m in airframe(tmp_path).measurements}
    made = shown["VFR_HUD.airspeed:over"]
    assert (made.variable, made.trusted) == ("gained", True)
    assert to_text(made.value) == "change(airspeed, 20)"
    assert shown["VFR_HUD.airspeed"].value is None


NO_SECONDS = "change(x, seconds) takes a positive number of seconds, not "
NO_VALUE = "needs a value with change(x, seconds) or integral(x, seconds)"


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ('value: "change(airspeed)"', "change takes 2 arguments, not 1"),
        ('value: "change(airspeed, 2, 3)"', "change takes 2 arguments, not 3"),
        ('value: "change(airspeed, p)"', NO_SECONDS + "p"),
        ('value: "change(airspeed, groundspeed)"', NO_SECONDS + "groundspeed"),
        ('value: "change(airspeed, 10 + 2)"', NO_SECONDS + "10 + 2"),
        ('value: "change(airspeed, 0)"', NO_SECONDS + "0"),
        ('value: "change(airspeed, -5)"', NO_SECONDS + "-5"),
        ('value: "change(airspeed, -1/2)"', NO_SECONDS + "-1/2"),
        ('value: "change(airspeed, 9 s)"', "not an expression"),
        ('value: "change(20, airspeed)"', "change(...) is of a field, not of 20"),
        ('value: "airspeed + still(3)"', "still(...) is of a field, not of 3"),
        ("", NO_VALUE),
        ('value: "5"', NO_VALUE),
        ('value: "airspeed"', NO_VALUE),
        ('value: "still(airspeed)"', NO_VALUE),
        ('value: "change(airspeed, 5) + der(airspeed)"', "der(...) is for equations"),
        (f'{VALUE}, when: "change(airspeed, 9) > 3"', "change(...) cannot stand in a condition"),
        (f'{VALUE}, when: "still(airspeed) > 3"', "still(...) cannot stand in a condition"),
        (f'{VALUE}, reported: "integral(airspeed, 9)"', "integral(...) cannot stand in"),
        (f'{VALUE}, when: "sampled(airspeed, 9) > 3"', "sampled(...) cannot stand in a condition"),
        ('value: "sampled(airspeed, 9)"', "sampled(...) tells an accuracy: it is for what is rep"),
    ],
)
def test_what_is_not_of_a_while_is_one_problem_with_its_line(tmp_path, new, said):
    with pytest.raises(ModelError) as error:
        airframe(tmp_path, VALUE, new)
    where, _, message = str(error.value).partition(": inputs.VFR_HUD.fields.airspeed:over: ")
    assert where.endswith("small.yaml:10")
    assert message.startswith(said)
    assert "\n" not in message


@pytest.mark.parametrize("key", ["climb", "climb:still", "climb:recent", "climb:silent"])
def test_what_is_of_a_while_stands_under_over_only(tmp_path, key):
    with pytest.raises(ModelError, match=r"change\(\.\.\.\) is for the value of FIELD:over"):
        airframe(tmp_path, "airspeed:over", key)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("change(v, 20) = w", "change"),
        ("v = change(w, 20)", "change"),
        ("w = 2*integral(v, 3)", "integral"),
    ],
)
def test_an_equation_is_of_one_moment(tmp_path, text, name):
    with pytest.raises(ModelError) as error:
        airframe(tmp_path, 'text: "v = w"', f'text: "{text}"')
    assert f"equations.e: {name}(...) is for the value of a measured field" in str(error.value)


def test_one_field_is_one_column_over_a_while(tmp_path):
    """What two variables say of it must be the same."""
    more = '      "airspeed:over": {variable: w, accuracy: 1 m/s, value: "change(airspeed, 5)"}\n'
    old = "measurements:\n  VFR_HUD: {fields: {groundspeed: {variable: w, accuracy: 1 m/s}}}\n"
    with pytest.raises(ModelError, match=r"VFR_HUD.airspeed:over has another value at .*:10"):
        airframe(tmp_path, old, "measurements:\n  VFR_HUD:\n    fields:\n" + more)


def test_what_is_kept_is_known_until_such_records_come_again():
    """Records of 3 s with a mean of 5, nothing for a minute, then 3 s with a mean of 7."""
    t = np.arange(0.0, 80.0, 0.1)
    values = np.select([t < 4.05, t > 70.0], [5.0, 7.0], np.nan)
    found = kept(t, values, 3.0)
    assert np.isnan(found[t < 2.9]).all()
    assert found[(t > 3.1) & (t < 72.9)] == pytest.approx(5.0)
    assert found[t > 73.2] == pytest.approx(7.0)


def test_what_is_kept_is_no_mean_across_a_gap():
    t = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(10.0, 12.0, 0.1)])
    assert np.isnan(kept(t, np.where(t < 5, 1.0, -1.0), 3.0)).all()
