from dataclasses import replace

import pytest
from hypothesis import given

from fdi.errors import UsageError
from fdi.structure import Fault, Model, detectable, isolability
from fdi.structure.causality import CAUSALITIES, causally_overdetermined
from fdi.structure.losses import causal_classes

from . import naive
from .models import dynamic_models, models, tried

#                    x  dx
# dx = d/dt x        i  d
# y1 = dx               x
# y2 = dx               x
TWO_RATES = Model(
    ("dx = d/dt x", "y1 = dx", "y2 = dx"),
    ("x", "dx"),
    ((0, 1), (1,), (1,)),
    (Fault("f1", (1,)), Fault("f2", (2,))),
    ((0, 0, "i"), (0, 1, "d")),
)


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models())
@tried(300)
def test_overdetermined_part_equals_brute_force(model, causality):
    expected = naive.OVERDETERMINED[causality](model, range(len(model.rows)))
    assert set(causally_overdetermined(model, causality)) == expected
    found = [naive.OVERDETERMINED[causality](model, sorted(expected)), expected]
    assert found[0] == found[1]  # idempotent, on which losses.py relies


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models())
@tried(300)
def test_isolability_equals_brute_force(model, causality):
    assert isolability(model, causality).tolist() == naive.isolable_causally(model, causality)


@pytest.mark.parametrize("causality", CAUSALITIES)
@given(model=dynamic_models(max_equations=10, max_states=4, max_others=3))
@tried(300)
def test_what_remains_without_a_class_is_what_remains_without_its_equations(model, causality):
    """On larger models, against one analysis for each class."""
    faulty = replace(model, faults=tuple(Fault(f"f{e}", (e,)) for e in range(len(model.rows))))
    groups, left = causal_classes(faulty, causality)
    whole = {e for group in groups for e in group}
    assert whole == set(causally_overdetermined(model, causality))
    for k, group in enumerate(groups):
        for e in group:
            expected = set(causally_overdetermined(model, causality, without=[e]))
            assert left.get(k, whole.difference(group)) == expected


@given(models())
def test_without_differential_constraints_all_causalities_agree(model):
    for causality in CAUSALITIES:
        assert (detectable(model, causality) == detectable(model)).all()
        assert (isolability(model, causality) == isolability(model)).all()


def test_a_fault_of_a_rate_needs_no_state():
    for causality in CAUSALITIES:
        assert causally_overdetermined(TWO_RATES, causality) == (1, 2)


def test_unknown_causality_is_refused():
    with pytest.raises(UsageError, match="'int' is none of mixed, integral, derivative"):
        isolability(TWO_RATES, "int")
