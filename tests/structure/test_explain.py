"""What keeps faults from being detected or told apart, and which single sensor would change it."""

import pytest
from hypothesis import given

from fdi.errors import UsageError
from fdi.structure import Fault, Model, detectable, isolability
from fdi.structure.causality import CAUSALITIES
from fdi.structure.explain import Reason, why
from fdi.structure.placement import add_sensors

from .models import dynamic_models, models, tried


def achieved(model, i, j, causality):
    told = isolability(model, causality)[i, j] if j >= 0 else detectable(model, causality)[i]
    return bool(told)


def pairs(model):
    n = len(model.faults)
    return [(i, j) for i in range(n) for j in range(-1, n) if i != j]


def named(model, i, j):
    return model.faults[i].name, model.faults[j].name if j >= 0 else ""


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models())
@tried(200)
def test_the_sensors_named_are_those_of_which_one_is_enough(model, causality):
    for i, j in pairs(model):
        found = why(model, *named(model, i, j), causality)
        assert (found.reason is Reason.NONE) == achieved(model, i, j, causality)
        if found.reason is Reason.NONE:
            assert found.sensors == ()
            continue
        enough = {
            u
            for u in range(len(model.unknowns))
            if achieved(add_sensors(model, [u]), i, j, causality)
        }
        assert set(found.sensors) == enough


@given(models())
@tried(300)
def test_reasons_exclude_one_another(model):
    for i, j in pairs(model):
        found = why(model, *named(model, i, j))
        shared = j >= 0 and set(model.faults[i].equations) <= set(model.faults[j].equations)
        assert (found.reason is Reason.SHARED_EQUATION) == (
            shared and not achieved(model, i, j, "mixed")
        )
        assert found.reason is not Reason.CAUSALITY
        if found.reason is Reason.NOTHING_TO_SPARE:
            assert found.sensors == found.unknowns != ()
        else:
            assert found.sensors == ()


def test_two_faults_of_a_chain_are_split_by_a_sensor_between_them():
    model = Model.from_matrix(
        [[1, 0, 0], [1, 1, 0], [0, 1, 1], [0, 0, 1]], faults={"f": 0, "g": 2, "h": 3}
    )
    assert why(model, "f", "g").sensors == (0, 1)
    assert why(model, "g", "h").sensors == (2,) == why(model, "h", "g").sensors
    assert why(model, "f", "h").text == (
        "f cannot be told from h: without e3 nothing checks x0, x1, x2, which follow from e0"
    )


def test_a_rate_sensor_alone_leaves_the_state_open():
    model = Model(
        ("dx = d/dt x", "y = dx"),
        ("x", "dx"),
        ((0, 1), (1,)),
        (Fault("f", (1,)),),
        ((0, 0, "i"), (0, 1, "d")),
    )
    found = why(model, "f")
    assert found.reason is Reason.NOTHING_TO_SPARE
    assert set(found.sensors) == {0, 1}
    state_measured = add_sensors(model, [0])
    assert why(state_measured, "f").reason is Reason.NONE


def test_states_that_only_integration_yields_are_a_matter_of_causality():
    model = Model(
        ("dx = d/dt x", "dz = d/dt z", "y1 = dx + x", "y2 = dz + z", "y3 = x + z"),
        ("x", "dx", "z", "dz"),
        ((0, 1), (2, 3), (0, 1), (2, 3), (0, 2)),
        (Fault("f", (2,)),),
        ((0, 0, "i"), (0, 1, "d"), (1, 2, "i"), (1, 3, "d")),
    )
    assert why(model, "f", causality="integral").reason is Reason.NONE
    found = why(model, "f", causality="derivative")
    assert found.reason is Reason.CAUSALITY
    assert "cannot be computed in this causality" in found.text
    assert {model.unknowns[u] for u in found.sensors} == {"x", "dx", "z", "dz"}


def test_wrong_names_are_refused():
    model = Model.from_matrix([[1], [1]], faults={"f": 0})
    with pytest.raises(UsageError, match="has no fault 'z'"):
        why(model, "z")
    with pytest.raises(UsageError, match="'f' is to be told from itself"):
        why(model, "f", "f")
    with pytest.raises(UsageError, match="'int' is none of"):
        why(model, "f", causality="int")
