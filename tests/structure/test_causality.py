import pytest
from hypothesis import given, settings

from fdi.errors import UsageError
from fdi.structure import Fault, Model, detectable, isolability
from fdi.structure.causality import CAUSALITIES, causally_overdetermined

from .models import models

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


@given(models())
@settings(deadline=None)
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
