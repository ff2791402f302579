"""What several healthy flights tell of a parameter, and whether a later one departs from that."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.model.system import Estimate, ParameterValue
from fdi.residuals.between import (
    as_normal,
    departure,
    expected,
    learned_parameters,
    random_effects,
    share_beyond,
    tells,
)

VALUES = st.floats(-100, 100)
PRIOR = ParameterValue(0.0, "1", "default", 0.5, (-1.0, 1.0), "left")


def told(value, std, source="identified"):
    return replace(PRIOR, value=value, std=std, source=source)


def later(value, std, learned):
    """A flight that tells a value beside what others taught."""
    return replace(PRIOR, learned=learned, flight=Estimate(value, std))


def test_spread_is_what_values_scatter_beyond_their_errors():
    """By hand: variance 4 of 1, 3, 5, of which the errors of 1 explain one."""
    found = random_effects([1.0, 3.0, 5.0], [1.0, 1.0, 1.0])
    assert found.mean == pytest.approx(3.0)
    assert found.spread == pytest.approx(np.sqrt(3.0))
    assert found.error == pytest.approx(np.sqrt(4.0 / 3))


@given(value=VALUES, count=st.integers(2, 12), error=st.floats(1e-6, 10))
def test_equal_values_have_no_spread_and_their_mean(value, count, error):
    found = random_effects([value] * count, [error] * count)
    assert found.mean == pytest.approx(value)
    assert found.spread == 0.0
    # the errors alone tell how well the mean is known
    assert found.error == pytest.approx(error / np.sqrt(count))


@given(values=st.lists(VALUES, min_size=2, max_size=9), shift=VALUES)
def test_a_shift_of_all_flights_shifts_the_mean_alone(values, shift):
    errors = [0.1] * len(values)
    one, other = random_effects(values, errors), random_effects([v + shift for v in values], errors)
    assert other.mean == pytest.approx(one.mean + shift, abs=1e-9)
    assert other.spread == pytest.approx(one.spread, abs=1e-4)


def test_one_flight_tells_no_spread():
    """Two flights of any vehicle differ by the root of two of the model's width."""
    found = expected([0.3], [0.01], 0.5)
    assert found == Estimate(0.3, pytest.approx(np.sqrt(2) * 0.5), 1)


def test_few_flights_are_wider_by_students_t():
    """The tables: 4.303 for two degrees of freedom, 1.960 for ever so many."""
    found = expected([-0.1, 0.0, 0.1], [0.0, 0.0, 0.0], 10.0)
    assert found.std == pytest.approx(0.1 * np.sqrt(1 + 1 / 3) * 4.3027 / 1.95996, rel=1e-4)


def test_no_deviation_is_wider_than_between_any_two_flights():
    found = expected([-5.0, 5.0], [0.1, 0.1], 0.5)
    assert found.std == pytest.approx(0.5 * np.sqrt(1.5))


@pytest.mark.parametrize("flights", [3, 6])
def test_two_deviations_hold_a_later_flight_as_often_as_they_say(flights):
    random, held = np.random.default_rng(flights), []
    for _ in range(600):
        *before, after = random.normal(0.0, 0.05, flights + 1)
        found = expected(before, [0.005] * flights, 10.0)
        held.append(abs(after - found.value) <= 1.95996 * found.std)
    assert 0.92 <= np.mean(held) <= 0.98


def test_as_many_healthy_flights_depart_as_is_said():
    """One in twenty, of three parameters and with three flights to learn from."""
    random, rare = np.random.default_rng(8), []
    for _ in range(600):
        values = random.normal(0.0, 0.02, (3, 4))
        parameters = {
            str(number): later(after, 0.002, expected(before, [0.002] * 3, 0.5))
            for number, (*before, after) in enumerate(values)
        }
        rare.append(departure(parameters).rare)
    assert 0.03 <= np.mean(rare) <= 0.08


def test_tails_are_those_of_few_flights():
    """Three flights: 9.925 standard errors leave out 1 %, as 2.576 do of a normal value."""
    learned = Estimate(0.0, 0.1, 3)
    distance = 9.925 / (4.3027 / 1.95996)
    assert as_normal(distance, learned, 10.0) == pytest.approx(2.576, abs=2e-3)
    assert as_normal(-distance, learned, 10.0) == pytest.approx(-2.576, abs=2e-3)


def test_the_models_width_is_normal():
    assert as_normal(2.5, Estimate(0.0, 0.5 * np.sqrt(4 / 3), 3), 0.5) == 2.5
    assert as_normal(2.5, Estimate(0.0, 0.7, 1), 0.5) == 2.5


def test_share_of_all_parameters_together():
    """Tables of chi-squared: 7.815 leaves out 5 % with three degrees of freedom."""
    assert share_beyond([np.sqrt(7.815), 0.0, 0.0]) == pytest.approx(0.05, abs=1e-4)
    assert share_beyond([1.959964]) == pytest.approx(0.05, abs=1e-6)


def test_a_flight_far_off_departs_and_one_as_the_others_does_not():
    learned = expected([0.0, 0.01, -0.01, 0.02, -0.02], [0.001] * 5, 0.5)
    assert not departure({"a": later(0.015, 0.001, learned)}).rare
    found = departure({"a": later(0.3, 0.001, learned), "b": PRIOR})
    assert found.rare
    assert set(found.distances) == {"a"}


def test_a_flight_that_tells_little_does_not_depart():
    learned = Estimate(0.0, 0.001, 9)
    assert not departure({"a": later(0.3, 0.4, learned)}).rare


def test_without_anything_learned_there_is_nothing_to_depart_from():
    assert departure({"a": replace(PRIOR, flight=Estimate(0.9, 0.01))}) is None


def test_flights_that_tell_nothing_teach_nothing():
    """What keeps the prior and its width would pass for flights that are alike."""
    assert not tells(told(0.0, 0.5))
    assert not tells(told(0.0, 0.01, source="default"))
    flights = [{"a": told(0.0, 0.4)}, {"a": told(0.2, 0.01)}, {}]
    assert learned_parameters(flights) == {"a": Estimate(0.2, pytest.approx(0.7071, abs=1e-4), 1)}
    assert learned_parameters(flights[:1]) == {}


@given(st.permutations([-0.1, 0.05, 0.2, 0.0]))
def test_order_of_flights_does_not_matter(values):
    found = learned_parameters([{"a": told(value, 0.01)} for value in values])["a"]
    assert found.value == pytest.approx(0.0375)
    other = learned_parameters([{"a": told(v, 0.01)} for v in sorted(values)])["a"]
    assert found.std == pytest.approx(other.std)
