from itertools import combinations

import pytest
from hypothesis import given, settings

from fdi.errors import UsageError
from fdi.structure import Model, detectable, isolability, place_sensors
from fdi.structure.placement import GOALS, add_sensors

from .models import models


def reaches(model, sensors, goal):
    extended = add_sensors(model, sensors)
    pairs = isolability(extended).ravel().tolist() if goal == "isolability" else []
    return {i for i, x in enumerate([*detectable(extended).tolist(), *pairs]) if x}


def brute_force(model, goal):
    n = range(len(model.unknowns))
    wanted, found = reaches(model, n, goal), []
    for size in range(len(n) + 1):
        for some in combinations(n, size):
            if not any(set(s) <= set(some) for s in found) and reaches(model, some, goal) >= wanted:
                found.append(some)
    return tuple(found)


@pytest.mark.parametrize("goal", GOALS)
@given(model=models())
@settings(deadline=None, max_examples=200)
def test_sets_equal_brute_force(model, goal):
    assert place_sensors(model, goal=goal) == brute_force(model, goal)


def test_a_model_without_faults_needs_no_sensor():
    assert place_sensors(Model.from_matrix([[1, 1]])) == ((),)


def test_wrong_arguments_are_refused():
    model = Model.from_matrix([[1, 0], [0, 1]], faults={"f": 0, "g": 1})
    with pytest.raises(UsageError, match="unknown 7 of 2 unknowns does not exist"):
        place_sensors(model, [7])
    with pytest.raises(UsageError, match="'speed' is none of detectability, isolability"):
        place_sensors(model, goal="speed")
    for cost in (float("nan"), float("inf"), -1.0):
        with pytest.raises(UsageError, match="x0: cost is"):
            place_sensors(model, costs={0: cost})


def test_a_search_beyond_the_limit_is_refused():
    model = Model.from_matrix([[1] * 6], faults={"f": 0})
    wide = Model.from_matrix([[1, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], faults={"f": 0})
    assert place_sensors(model) == ((0, 1, 2, 3, 4, 5),)
    with pytest.raises(UsageError, match="more than 0 sets"):
        place_sensors(wide, limit=0)


def test_sensors_are_named_apart():
    model = add_sensors(Model.from_matrix([[1]]), [0, 0])
    assert model.equations == ("e0", "sensor of x0", "sensor of x0 2")
