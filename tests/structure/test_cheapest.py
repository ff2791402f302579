"""The cheapest set of sensors is the cheapest of all minimal ones; there is always an answer."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.structure import Fault, Model, cheapest_sensors, load_reference, place_sensors
from fdi.structure.additions import reach
from fdi.structure.placement import GOALS, add_sensors

from .models import REFERENCE, models, needs_shared, tried


def grants_all(model, sensors, goal, faulty=(), candidates=None):
    """Whether sensors grant what all of them would, about the faults that there then are."""
    everything = range(len(model.unknowns)) if candidates is None else candidates
    most = [u for u in everything for _ in range(2 if u in faulty else 1)]
    best, have = (reach(add_sensors(model, some, faulty)) for some in (most, sensors))
    place = [best.names.index(name) for name in have.names]
    seen = (have.seen >= best.seen[place]).all()
    return seen and (goal == GOALS[0] or (have.told >= best.told[place][:, place]).all())


@pytest.mark.parametrize("goal", GOALS)
@given(model=models(max_equations=5, max_unknowns=4), data=st.data())
@tried(100)
def test_its_cost_is_that_of_the_cheapest_of_all_minimal_sets(model, goal, data):
    unknowns = range(len(model.unknowns))
    faulty = data.draw(st.sets(st.sampled_from(unknowns))) if model.unknowns else set()
    price = st.sampled_from([0, 0.5, 1, 2.25, 7])
    costs = {u: data.draw(price) for u in unknowns}
    every = place_sensors(model, goal=goal, costs=costs, faulty=faulty)
    found = cheapest_sensors(model, goal=goal, costs=costs, faulty=faulty, seconds=60)
    assert found.proven
    assert set(found.sets) <= set(every)
    least = min(math.fsum(costs[u] for u in some) for some in every)
    assert found.costs[0] == found.bound == pytest.approx(least)


@given(model=models(max_equations=5, max_unknowns=4), data=st.data())
@tried(50)
def test_an_existing_sensor_is_a_free_equation_of_the_model(model, data):
    if not model.unknowns:
        return
    unknown = data.draw(st.sampled_from(range(len(model.unknowns))))
    faulty = {unknown} if data.draw(st.booleans()) else set()
    known = cheapest_sensors(model, existing=[unknown], faulty=faulty, seconds=60)
    longer = add_sensors(model, [unknown], faulty)
    assert known.costs == cheapest_sensors(longer, faulty=faulty, seconds=60).costs


def test_what_cannot_be_granted_has_no_set_and_says_so():
    model = Model.from_matrix([[1]], faults={"f": 0, "g": 0})
    found = cheapest_sensors(model, goal=[("f", "g")])
    assert (found.sets, found.bound, found.proven) == ((), math.inf, True)


def test_when_time_is_up_there_is_a_set_and_an_honest_bound():
    rows = tuple((k, k + 1) for k in range(30))
    faults = tuple(Fault(f"f{k}", (k,)) for k in range(30))
    model = Model(
        tuple(f"e{k}" for k in range(30)), tuple(f"x{k}" for k in range(31)), rows, faults
    )
    hurried = cheapest_sensors(model, seconds=0)
    patient = cheapest_sensors(model, seconds=60)
    assert patient.proven
    assert hurried.bound <= patient.costs[0] <= hurried.costs[0]
    for sensors in hurried.sets:
        assert grants_all(model, sensors, "isolability")


def test_wrong_arguments_are_refused():
    model = Model.from_matrix([[1]], faults={"f": 0})
    for call in (
        lambda: cheapest_sensors(model, [3]),
        lambda: cheapest_sensors(model, existing=["z"]),
        lambda: cheapest_sensors(model, costs={0: -1}),
        lambda: cheapest_sensors(model, [], faulty=[0]),
    ):
        with pytest.raises(UsageError):
            call()


def test_the_message_about_too_many_sets_names_the_way_out():
    wide = Model.from_matrix([[1, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], faults={"f": 0})
    with pytest.raises(UsageError, match="cheapest_sensors finds one"):
        place_sensors(wide, limit=0)


@needs_shared
@pytest.mark.parametrize(
    ("name", "size"),
    [("fixed_wing_beard", 2), ("fuel_cell", 2), ("rand_u_60_2_7_parts", 15), ("engine_282", 14)],
)
def test_models_with_too_many_sets_have_a_proven_answer_in_time(name, size):
    (path,) = (p for p in REFERENCE if p.stem == name)
    model = load_reference(path)
    found = cheapest_sensors(model, seconds=60)  # a second or less on an idle machine
    assert found.proven
    assert len(found.sets[0]) == size == found.bound
    assert all(grants_all(model, sensors, "isolability") for sensors in found.sets)
