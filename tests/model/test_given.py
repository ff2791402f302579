"""Tables and Python functions in equations: handed over by Python, never by a file."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fdi
from fdi.errors import ModelError
from fdi.model import Function, load_airframe, table
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.cache import cached_bank
from fdi.telemetry import Sampling

PUMP = """
format: 1
name: pump
components: {pump: {group: sensor}}
variables: {omega: {unit: rad/s}, q: {unit: m^3/s}, head: {unit: m}}
equations:
  k_1: EQUATION
measurements:
  A:
    component: pump
    fields:
      w: {variable: omega, accuracy: 1 rad/s}
      q: {variable: q, accuracy: 0.1 m^3/s}
  B:
    component: pump
    fields:
      w: {variable: omega, accuracy: 1 rad/s}
      h: {variable: head, accuracy: 0.1 m}
"""
CURVE = table([0.0, 100.0, 200.0], [0.0, 1.0, 4.0], ["rad/s"], "m^3/s")
UNITS = {"A.w": "rad/s", "B.w": "rad/s", "A.q": "m^3/s", "B.h": "m"}


def model(tmp_path, equation, functions):
    path = tmp_path / "pump.yaml"
    path.write_text(PUMP.replace("EQUATION", equation), encoding="utf-8")
    return load_airframe(path, functions)


def residuals(airframe, **columns):
    t = np.arange(20.0)
    given = {name: np.broadcast_to(values, 20) for name, values in columns.items()}
    log = fdi.log_from_columns(
        {"t": t, **{k.replace("_", "."): v for k, v in given.items()}}, UNITS
    )
    bank = build_bank(airframe.observe(log))
    signals = log.signals(bank.system.channels, Sampling())
    return bank, bank.evaluate(signals, Differentiation()).values


def test_a_table_in_an_equation_is_evaluated(tmp_path):
    airframe = model(tmp_path, "q = curve(omega)", {"curve": CURVE})
    bank, found = residuals(airframe, A_w=150.0, A_q=3.0, B_w=150.0, B_h=0.0)
    rows = [r for g, r in zip(bank.generators, found, strict=True) if "A.q" in g.faults]
    assert {abs(float(row[5])) for row in rows} == {0.5}


def test_an_equation_is_solved_through_a_table(tmp_path):
    """q - 1 = curve(omega): whichever side is left over, the other is computed."""
    airframe = model(tmp_path, "q - 1 = curve(omega)", {"curve": CURVE})
    (equation,) = (e for e in airframe.observe().equations if e.name == "k_1")
    assert dict(equation.edges) == {"q": "solvable", "omega": "solvable"}


def test_a_function_without_an_inverse_is_solved_numerically_where_the_model_allows(tmp_path):
    cube = Function(lambda w: (w / 100) ** 3, ("rad/s",), "m^3/s")
    text = '{text: "q = cube(omega)", solves: [omega]}'
    airframe = model(tmp_path, text, {"cube": cube})
    _, found = residuals(airframe, A_w=150.0, A_q=1.5**3, B_w=150.0, B_h=0.0)
    assert np.nanmax(np.abs(found)) < 1e-6


def test_a_table_of_two_dimensions(tmp_path):
    surface = table([[0, 100, 200], [0, 10]], [[0, 1], [1, 3], [2, 5]], ["rad/s", "m"], "m^3/s")
    airframe = model(tmp_path, "q = surface(omega, head)", {"surface": surface})
    bank, found = residuals(airframe, A_w=150.0, A_q=2.75, B_w=150.0, B_h=5.0)
    rows = [r for g, r in zip(bank.generators, found, strict=True) if "B.h" in g.faults]
    assert rows
    assert np.abs(rows).max() < 1e-12


@given(st.floats(-0.2, 1.2), st.floats(-0.2, 2.2))
def test_two_dimensions_are_exact_for_what_is_bilinear_and_unknown_outside(x, y):
    f = table(
        [[0, 0.3, 1], [0, 2]], [[a * b + a - b for b in (0, 2)] for a in (0, 0.3, 1)], "ab", "1"
    )
    inside = 0 <= x <= 1 and 0 <= y <= 2
    expected = x * y + x - y if inside else np.nan
    assert f.compute(np.array([x]), np.array([y]))[0] == pytest.approx(expected, nan_ok=True)


def test_beyond_a_table_the_residual_is_unknown(tmp_path):
    airframe = model(tmp_path, "q = curve(omega)", {"curve": CURVE})
    bank, found = residuals(airframe, A_w=250.0, A_q=3.0, B_w=250.0, B_h=0.0)
    rows = [r for g, r in zip(bank.generators, found, strict=True) if "A.q" in g.faults]
    assert np.isnan(rows).all()


@pytest.mark.parametrize(
    ("equation", "functions", "said"),
    [
        ("q = curve(omega)", {}, "unknown function 'curve'"),
        ("q = curve(head)", {"curve": CURVE}, "takes rad/s"),
        ("head = curve(omega)", {"curve": CURVE}, "does not fit"),
        ("q = curve(omega, head)", {"curve": CURVE}, "takes 1 arguments"),
        ("q = curve(omega)", {"sin": CURVE}, "function of the language"),
        ("q = curve(omega)", {"cur ve": CURVE}, "no name"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, equation, functions, said):
    with pytest.raises(ModelError, match=said):
        model(tmp_path, equation, functions)


def test_the_same_file_without_the_function_is_refused_afterwards(tmp_path):
    """Code is kept in no cache: neither the model's nor the bank's."""
    airframe = model(tmp_path, "q = curve(omega)", {"curve": CURVE})
    cached_bank(airframe.observe())
    other = table([0.0, 100.0, 200.0], [0.0, 2.0, 8.0], ["rad/s"], "m^3/s")
    again = load_airframe(tmp_path / "pump.yaml", {"curve": other})
    equation = next(e for e in cached_bank(again.observe()).system.equations if e.name == "k_1")
    assert equation.right.operator.function is other
    with pytest.raises(ModelError, match="unknown function"):
        load_airframe(tmp_path / "pump.yaml")


def test_a_function_of_another_shape_is_refused(tmp_path):
    bad = Function(lambda w: 1.0, ("rad/s",), "m^3/s")
    with pytest.raises(ModelError, match="returned the shape"):
        residuals(model(tmp_path, "q = bad(omega)", {"bad": bad}), A_w=1, A_q=1, B_w=1, B_h=1)


@pytest.mark.parametrize("points", [[0, 0], [1, 0], [0]])
def test_a_table_that_does_not_ascend_is_refused(points):
    with pytest.raises(ModelError, match="ascend"):
        table(points, points, ["1"], "1")


@pytest.mark.parametrize("count", [2, 3])
def test_a_table_takes_as_many_arguments_as_it_has_dimensions_one_or_two(count):
    points = [[0.0, 1.0]] * count
    with pytest.raises(ModelError, match=f"of {count} dimensions takes 3 arguments"):
        table(points, np.zeros((2,) * count), ["1", "1", "1"], "1")


@pytest.mark.parametrize("values", [[4.0, 1.0, 0.0], [0.0, 1.0, 4.0]])
def test_a_table_that_only_falls_or_only_rises_is_undone(values):
    curve = table([0.0, 1.0, 3.0], values, ["1"], "1")
    places = np.array([0.0, 0.25, 1.0, 2.5, 3.0])
    assert curve.undo(curve.compute(places)) == pytest.approx(places)
    assert np.isnan(curve.undo(np.array([-0.1, 4.1]))).all()


@pytest.mark.parametrize("values", [[0.0, 1.0, 0.5], [0.0, 1.0, 1.0], [1.0, 1.0, 0.0]])
def test_a_table_that_gives_a_value_twice_is_not_undone(values):
    assert table([0.0, 1.0, 3.0], values, ["1"], "1").undo is None


@pytest.mark.parametrize("values", [[0.0, 1.0], [0.0, np.nan, 1.0], [[0.0, 1.0, 2.0]]])
def test_a_table_without_a_finite_value_at_every_point_is_refused(values):
    with pytest.raises(ModelError, match=r"finite, of the shape \(3,\)"):
        table([0.0, 1.0, 3.0], values, ["1"], "1")


def test_what_a_function_takes_are_units_and_one_can_be_undone():
    for takes in ("rad/s", ()):
        with pytest.raises(ModelError, match="must be a tuple of units"):
            Function(np.hypot, takes, "m")
    with pytest.raises(ModelError, match="only a function of one argument can be undone"):
        Function(np.hypot, ("m", "m"), "m", np.square)
