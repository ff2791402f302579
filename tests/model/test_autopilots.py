"""What the shipped models ask of a log is there on both autopilots."""

import numpy as np
import pytest

from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.model.expression import symbols
from fdi.model.observe import with_latency
from fdi.model.system import ParameterValue

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


@pytest.mark.parametrize("model", ["quadcopter", "hexacopter", "fixed_wing", "any_vehicle"])
def test_no_shipped_model_names_a_mode_of_one_autopilot(model):
    found = load_airframe(model)
    conditions = [e.when for e in found.equations] + [m.when for m in found.measurements]
    assert not [c for c in conditions if c is not None and "mode" in symbols(c)]


@pytest.mark.parametrize(("told", "latency", "sure"), [(None, 0.15, 0.09), (250.0, 0.25, 0.04)])
def test_the_latency_of_a_receiver_is_the_one_the_autopilot_allows_for(told, latency, sure):
    model = load_airframe("quadcopter")
    source = "default" if told is None else "log"
    values = {"gps_latency": ParameterValue(latency, "s", source)}
    found = [with_latency(m, values) for m in model.measurements if m.late]
    assert {m.channel.field for m in found} >= {"lat", "lon", "vel", "cog", "alt"}
    assert {(m.latency, m.latency_accuracy) for m in found} == {(latency, sure)}


@pytest.mark.parametrize(
    ("outputs", "own"),
    [
        ((0.5, 0.0, 0.28, 0.28), 1.0),  # PX4: motor 1 gives nothing, the controller takes 2 back
        ((0.15, 0.0, 0.6, 0.6), 0.0),  # output 2 was stopped, and its opposite taken back for that
        ((0.5, 0.4, 0.5, 0.4), 0.4),
    ],
)
def test_an_output_that_the_controller_takes_back_is_not_stopped(outputs, own):
    known = {f"u_{n}": u for n, u in enumerate(outputs, start=1)}
    assert value("own_2", alone=0.75, **known) == own
