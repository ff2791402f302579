"""What faultdiagnosistoolbox 0.12.5 was seen to get wrong, and the right answer here.

Source: shared/structural/README.md, section 7. Each test names the defect in its docstring.
"""

import itertools

import numpy as np
import pytest
from counting import calls

from fdi.errors import UsageError
from fdi.structure import (
    Fault,
    Model,
    decompose,
    detectable,
    graph_components,
    isolability,
    load_reference,
    members,
    mso_sets,
    mtes_sets,
    place_sensors,
    select_tests,
    submodel,
)
from fdi.structure.causality import CAUSALITIES
from fdi.structure.frames import isolability_frame, signature_frame
from fdi.structure.index import is_observable, residual_causality
from fdi.structure.isolability import isolability_of_signatures

from .models import SHARED, dense, needs_shared

STATE = Model(
    ("dx = d/dt x", "y1 = dx", "y2 = x"),
    ("x", "dx"),
    ((0, 1), (1,), (0,)),
    (Fault("f", (1,)),),
    ((0, 0, "i"), (0, 1, "d")),
)


def reference(name):
    return load_reference(SHARED / "structural" / "models" / f"{name}.json")


@pytest.mark.parametrize("causality", CAUSALITIES)
def test_a_fault_of_known_variables_alone_is_detectable(causality):
    """An overdetermined part without unknowns is taken as empty."""
    model = Model(("e", "g"), ("x",), ((), (0,)), (Fault("f", (0,)), Fault("g", (1,))))
    assert detectable(model, causality).tolist() == [True, False]
    assert isolability(model, causality).tolist() == [[False, True], [False, False]]


@needs_shared
def test_fault_12_of_damadics_is_detectable():
    """The same, on a published model."""
    model = reference("damadics")
    names = [fault.name for fault in model.faults]
    assert [n for n, seen in zip(names, detectable(model), strict=True) if seen] == ["f12"]


def test_a_fault_in_two_equations_is_detectable_by_either():
    """Detectability raises ValueError for a fault in two equations; Lint calls it an error."""
    model = Model.from_matrix([[1, 0], [0, 1], [0, 1]], faults={"f": (0, 1)})
    assert detectable(model).tolist() == [True]


def test_the_whole_model_can_be_asked_for_observability():
    """IsObservable() without a set always raises IndexError."""
    assert is_observable(STATE)
    assert not is_observable(submodel(STATE, (0, 1)))


@needs_shared
def test_the_redundancy_of_mtes_counts_the_equations_without_faults():
    """MTESRedundancy counts those with faults: 24 instead of 2 on this model."""
    model = reference("mavlink_arduplane")
    faulty = {e for fault in model.faults for e in fault.equations}
    free = submodel(model, set(range(len(model.equations))) - faulty)
    assert decompose(free).redundancy + 1 == 2
    for bits in mtes_sets(model):
        assert decompose(submodel(model, members(bits))).redundancy == 2


@needs_shared
def test_a_small_bank_has_the_isolability_of_all_tests():
    """TestSelection(method="full") raises ValueError with numpy 2.4 (ragged array)."""
    model = reference("three_tank")
    bank = select_tests(model)
    assert (bank.isolable == isolability(model)).all()
    sets = [test.equations for test in bank.tests]
    assert set(sets) <= set(mso_sets(model))
    reacts = signature_frame(model, sets).to_numpy()
    for left_out in range(len(sets)):  # none is superfluous
        rest = np.delete(reacts, left_out, axis=0)
        assert (isolability_of_signatures(rest) < bank.isolable).any()


def test_underdetermined_models_get_sensors():
    """SensorPlacementIsolability raises TypeError for them after printing a message."""
    model = Model.from_matrix([[1, 1, 0], [0, 1, 1]], faults={"f": 0, "g": 1})
    assert place_sensors(model, goal="detectability") == ((0, 2),)


def test_wishes_need_not_be_symmetric():
    """An asymmetric specification raises TypeError."""
    model = Model.from_matrix([[1, 1], [0, 1]], faults={"f": 0, "g": (0, 1)})
    assert place_sensors(model, goal=[("g", "f")]) == ((1,),)
    assert place_sensors(model, goal=[("f", "g")]) == ()


@needs_shared
def test_every_set_of_sensors_is_minimal():
    """One of the four sets that it returns for this model holds a smaller one."""
    model = reference("raghuraj_cstr")
    found = [set(sensors) for sensors in place_sensors(model)]
    assert len(found) > 1
    assert not any(a < b for a, b in itertools.permutations(found, 2))


def test_nothing_to_add_is_one_empty_set_and_the_impossible_is_no_set():
    """An empty list is returned when nothing needs to be added, which reads like impossible."""
    model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1, "h": 0})
    assert place_sensors(model) == ((),)
    assert place_sensors(model, goal=[("f", "h")]) == ()


def test_a_set_that_is_not_just_determined_has_no_causality():
    """Matching prints an error and returns an object of type "algebraic"."""
    with pytest.raises(UsageError, match="no MSO set"):
        residual_causality(Model.from_matrix([[1], [1], [1]]), 0b111)


def test_an_mso_set_of_one_equation_has_an_algebraic_residual():
    """MSOCausalitySweep raises IndexError."""
    assert residual_causality(Model(("e",), (), ((),)), 1) == "a"


def test_true_means_isolable():
    """The documentation of IsolabilityAnalysis says that 1 does; it returns the complement."""
    model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    assert isolability_frame(model).loc["f", "g"]
    assert not isolability_frame(model).loc["f", "f"]


def test_enumeration_has_limits_and_can_be_stopped():
    """MSO ends with std::bad_alloc at 6 GB on a model of 119 equations."""
    endless = dense(119, 60)
    assert len(list(itertools.islice(mso_sets(endless), 100))) == 100
    with pytest.raises(UsageError, match="more than 1000"):
        list(mso_sets(endless, limit=1000))


@needs_shared
@pytest.mark.parametrize(
    ("name", "count"), [("rand_u_60_2_7_parts", 33), ("mavlink_arduplane", 292)]
)
def test_redundancy_that_is_spread_over_components_costs_nothing(name, count):
    """Components are not split: 17 s on the first model, no end on the second one."""
    model = reference(name)
    assert len(graph_components(model)) > 4
    found = []
    assert calls(lambda: found.extend(mso_sets(model, compiled=False))) < 10_000 * count
    assert len(found) == count


def test_sets_come_in_an_order_that_depends_on_the_model_alone():
    """MSO sets come unsorted, in an order that depends on the search."""
    model = dense(16, 11)
    expected = list(mso_sets(model))
    assert list(mso_sets(model, compiled=True)) == expected
    assert all(list(members(bits)) == sorted(members(bits)) for bits in expected)
