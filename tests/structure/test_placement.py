from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import Model, detectable, isolability, place_sensors
from fdi.structure.placement import GOALS, add_sensors, sensor_gains

from .models import models, tried


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
@given(model=models(max_equations=5, max_unknowns=4))
@tried(300)
def test_sets_equal_brute_force(model, goal):
    assert place_sensors(model, goal=goal) == brute_force(model, goal)


def brute_force_with_faults(model, faulty, goal):
    """All minimal multisets by trying every one: what holds for all sensors holds for those chosen.

    The faults of the model itself get all that all sensors grant, the sensors' faults too.
    """
    most = [2 if u in faulty else 1 for u in range(len(model.unknowns))]

    def granted(counts):
        sensors = [u for u, n in enumerate(counts) for _ in range(n)]
        extended = add_sensors(model, sensors, faulty)
        names = [fault.name for fault in extended.faults]
        seen, told = detectable(extended), isolability(extended)
        pairs = {(names[i], names[j]) for i, j in np.argwhere(told)} if goal != GOALS[0] else set()
        return set(names), {(n, "") for n, s in zip(names, seen, strict=True) if s} | pairs

    wanted = granted(most)[1]
    found = []
    for counts in sorted(product(*(range(n + 1) for n in most)), key=sum):
        names, reached_here = granted(counts)
        needed = {(f, g) for f, g in wanted if f in names and (not g or g in names)}
        smaller = any(all(a <= b for a, b in zip(other, counts, strict=True)) for other in found)
        if not smaller and needed <= reached_here:
            found.append(counts)
    return {tuple(u for u, n in enumerate(c) for _ in range(n)) for c in found}


@pytest.mark.parametrize("goal", GOALS)
@given(model=models(max_equations=4, max_unknowns=3), data=st.data())
@tried(150)
def test_sets_of_sensors_that_may_fail_equal_brute_force(model, goal, data):
    unknowns = range(len(model.unknowns))
    faulty = data.draw(st.sets(st.sampled_from(unknowns))) if model.unknowns else set()
    found = place_sensors(model, goal=goal, faulty=faulty)
    assert set(found) == brute_force_with_faults(model, faulty, goal)
    assert len(set(found)) == len(found)


@given(model=models(max_equations=5, max_unknowns=3), data=st.data())
@tried(150)
def test_sets_for_single_wishes_equal_brute_force(model, data):
    if not model.faults:
        return
    names = st.sampled_from([fault.name for fault in model.faults])
    wishes = data.draw(st.lists(st.one_of(names, st.tuples(names, names)), max_size=3))
    place = {fault.name: i for i, fault in enumerate(model.faults)}

    def grants(sensors):
        extended = add_sensors(model, sensors)
        seen, told = detectable(extended), isolability(extended)
        return all(
            seen[place[w]] if isinstance(w, str) else told[place[w[0]], place[w[1]]] for w in wishes
        )

    expected = []
    for size in range(len(model.unknowns) + 1):
        for some in combinations(range(len(model.unknowns)), size):
            if grants(some) and not any(set(other) <= set(some) for other in expected):
                expected.append(some)
    assert place_sensors(model, goal=wishes) == tuple(expected)


def test_a_model_without_faults_needs_no_sensor():
    assert place_sensors(Model.from_matrix([[1, 1]])) == ((),)


def test_wrong_arguments_are_refused():
    model = Model.from_matrix([[1, 0], [0, 1]], faults={"f": 0, "g": 1})
    with pytest.raises(UsageError, match="unknown 7 of 2 unknowns does not exist"):
        place_sensors(model, [7])
    with pytest.raises(UsageError, match="has no fault 'z'"):
        place_sensors(model, goal=[("f", "z")])
    with pytest.raises(UsageError, match="x1 may fail but is no candidate"):
        place_sensors(model, [0], faulty=[1])
    with pytest.raises(UsageError, match="'speed' is none of detectability, isolability"):
        place_sensors(model, goal="speed")
    for cost in (float("nan"), float("inf"), -1.0):
        with pytest.raises(UsageError, match="x0: cost is"):
            place_sensors(model, costs={0: cost})
    with pytest.raises(UsageError, match="x0: cost is"):
        place_sensors(model, costs={0: "cheap"})
    for wrong in ("x0", 1, ["x9"], [0.5], [None], [True]):
        for place in (
            lambda: place_sensors(model, wrong),  # noqa: B023
            lambda: place_sensors(model, faulty=wrong),  # noqa: B023
            lambda: sensor_gains(model, wrong),  # noqa: B023
            lambda: add_sensors(model, wrong),  # noqa: B023
        ):
            with pytest.raises(UsageError, match=r"no unknown|no list|neither index|does not"):
                place()
    for goal in (3, [("f", "g", "f")], [2.5]):
        with pytest.raises(UsageError):
            place_sensors(model, goal=goal)


def test_names_stand_for_indices():
    model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    assert place_sensors(model, ["x0"]) == place_sensors(model, [0]) != ()
    assert place_sensors(model, costs={"x0": 5}) == place_sensors(model, costs={0: 5})
    assert place_sensors(model, faulty=["x1"]) == place_sensors(model, faulty=[1])
    assert place_sensors(model, goal=[(0, 1)]) == place_sensors(model, goal=[("f", "g")])
    assert sensor_gains(model, ["x1"]) == sensor_gains(model, [1])
    named, numbered = add_sensors(model, ["x1"], ["x1"]), add_sensors(model, [1], [1])
    assert (named.rows, named.faults) == (numbered.rows, numbered.faults)


def test_a_search_beyond_the_limit_is_refused():
    model = Model.from_matrix([[1] * 6], faults={"f": 0})
    wide = Model.from_matrix([[1, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], faults={"f": 0})
    assert place_sensors(model) == ((0, 1, 2, 3, 4, 5),)
    with pytest.raises(UsageError, match="more than 0 choices"):
        place_sensors(wide, limit=0)


def test_sensors_are_named_apart():
    model = add_sensors(Model.from_matrix([[1]]), [0, 0], faulty=[0])
    assert model.equations == ("e0", "sensor of x0", "sensor of x0 2")
    assert [fault.name for fault in model.faults] == [
        "fault of sensor of x0",
        "fault of sensor of x0 2",
    ]


@given(model=models())
@tried(100)
def test_the_gain_of_a_sensor_is_what_it_adds(model):
    before = reaches(model, [], "isolability")
    found = sensor_gains(model)
    for unknown in range(len(model.unknowns)):
        added = reaches(model, [unknown], "isolability") - before
        seen, told = found.get(unknown, ((), ()))
        assert len(seen) + len(told) == len(added)
