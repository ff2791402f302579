"""What the shipped models ask of a log is there on both autopilots."""

import numpy as np
import pytest

from fdi.model import load_airframe
from fdi.model.evaluate import evaluate

RC = 1 << 16


def value(equation: str, **known: float) -> float:
    """Return what an equation of the quadcopter's model says its left side is."""
    found = next(e for e in load_airframe("quadcopter").equations if e.name == equation)
    return float(evaluate(found.right, {k: np.array([v]) for k, v in known.items()})[0])


@pytest.mark.parametrize(("present", "health"), [(0, 1.0), (RC, 0.0)])
def test_a_receiver_that_was_never_there_is_not_lost(present, health):
    """PX4 enables it and flies without."""
    said = value("health_4", present_word=present, enabled_word=RC, health_word=0)
    assert said == health
