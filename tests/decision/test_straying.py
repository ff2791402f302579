"""A test may stray as healthy vehicles do, and no more for straying further at first."""

import json
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from fdi.decision import straying
from fdi.decision.bounds import learn
from fdi.decision.recipes import PredictedSpread
from fdi.decision.straying import Usual, measured, scale_of
from fdi.model.load import load_airframe
from fdi.model.parts import Kind

from .build import RATE, flown, residuals

RECIPE = PredictedSpread()
N = round(100 * RATE)
OWN = Usual("m", strays=2.0, weight=3.0, times=5.0)


@pytest.mark.parametrize(
    ("first", "expected"),
    [(2.0, 10.0), (0.0, 5.0 * np.sqrt(3.0)), (1.0, 5.0 * np.sqrt(3.25)), (40.0, 10.0)],
)
def test_tolerance_lies_between_what_families_and_the_flight_itself_stray(first, expected):
    assert OWN.tolerance(first) == pytest.approx(expected)


def test_a_heavy_weight_leaves_what_families_do_and_a_light_one_what_the_flight_does():
    assert scale_of(2.0, 1e9, 0.7) == pytest.approx(2.0)
    assert scale_of(2.0, 1e-9, 0.7) == pytest.approx(0.7)


def test_what_is_measured_rests_on_several_families_none_of_which_moves_it_much():
    tree = json.loads(files("fdi.decision").joinpath(straying.FILE).read_text("utf-8"))
    assert set(tree) == set(measured())
    for name, own in tree.items():
        low, high = own["range"]
        stated = own["times"] * own["strays"]
        assert own["families"] >= 4, name
        assert stated / 1.5 <= low <= stated * 1.001, name
        assert stated * 0.999 <= high <= stated * 1.5, name


def test_every_statement_that_is_measured_is_one_of_the_models_in_its_unit():
    stated = {
        (straying.pooled(equation.name), equation.unit)
        for model in ("quadcopter", "fixed_wing")
        for equation in load_airframe(model).equations
        if equation.kind is Kind.EQUALITY
    }
    assert {(name, own.unit) for name, own in measured().items()} <= stated


@pytest.fixture
def tolerance(monkeypatch):
    monkeypatch.setattr(straying, "measured", lambda: {"e#": OWN})

    def told(first, *, recipe=RECIPE, kind=Kind.EQUALITY, unit="m", stated=1.0):
        values = np.where(np.arange(N) / RATE < 30.0, first, 0.0) * (-1.0) ** np.arange(N)
        made = residuals(values, tolerance=stated, flights=flown(0.0, 100.0), kind=kind, unit=unit)
        return float(learn(made, recipe).tolerance[0, -1])

    return told


@pytest.mark.parametrize("first", [0.0, 1.0, 3.0, 9.0])
def test_a_flight_may_stray_as_was_measured_whatever_less_the_model_states(tolerance, first):
    assert tolerance(first) == pytest.approx(OWN.tolerance(first))


def test_what_the_model_states_holds_where_it_is_more(tolerance):
    assert tolerance(0.0, stated=20.0) == 20.0


def test_nothing_was_measured_of_another_unit_or_of_a_relation_or_where_it_is_not_asked(tolerance):
    assert tolerance(2.0, unit="s") == 1.0
    assert tolerance(2.0, kind=Kind.RELATION) == 1.0
    assert tolerance(2.0, recipe=replace(RECIPE, usual=False)) == 1.0
