import re

import pytest

from fdi.errors import ModelError
from fdi.model import Airframe, load_airframe, shipped_models
from fdi.model.parts import Kind
from fdi.residuals.build import build_bank

TEXT = """\
format: 1
name: own
variables:
  v: {unit: m/s}
parameters:
  v_max: {value: 9, unit: m/s}
components:
  gps: {name: GPS receiver, group: sensor}
limits:
  too_fast: {variable: v, max: v_max, component: gps, command: true, says: "SAYS"}
measurements:
  GPS_RAW_INT:
    component: gps
    fields:
      vel: {variable: v, accuracy: 0.5 m/s}
"""


@pytest.fixture
def own(tmp_path):
    def load(says: str) -> Airframe:
        path = tmp_path / "own.yaml"
        path.write_text(TEXT.replace("SAYS", says), encoding="utf-8")
        return load_airframe(path)

    return load


@pytest.mark.parametrize("name", shipped_models())
def test_every_statement_that_can_be_left_over_has_words(name):
    system = load_airframe(name).observe()
    for tests in ("mtes+cross_checks", "selected"):
        bank = build_bank(system, tests)
        left_over = [system.equations[generator.residual] for generator in bank.generators]
        silent = {e.name for e in left_over if e.kind is not Kind.MEASUREMENT and not e.says}
        assert silent == set()


@pytest.mark.parametrize("name", shipped_models())
def test_every_limit_and_equality_has_words(name):
    equations = load_airframe(name).equations
    stated = [e for e in equations if e.kind in (Kind.LIMIT, Kind.EQUALITY)]
    assert [e.name for e in stated if not e.says] == []


@pytest.mark.parametrize("name", shipped_models())
def test_words_name_neither_variables_nor_bare_numbers(name):
    airframe = load_airframe(name)
    strange = {n for n in (*airframe.variables, *airframe.parameters) if "_" in n}
    for equation in airframe.equations:
        assert not strange & set(re.findall(r"\w+", equation.says)), equation.says
        assert not re.search(r"\d", equation.says), equation.says


@pytest.mark.parametrize("name", shipped_models())
def test_words_begin_with_a_verb_where_a_component_is_concerned(name):
    """They stand behind its name: "GPS receiver gives no position fix"."""
    for equation in load_airframe(name).equations:
        if equation.says and equation.component not in (None, "vibration"):
            assert re.match(r"(is|[a-z]+s) ", equation.says), equation.says
        elif equation.says and equation.component is None:
            assert equation.says.startswith("the "), equation.says


@pytest.mark.parametrize("name", shipped_models())
def test_every_measured_variable_is_described(name):
    airframe = load_airframe(name)
    shown = {m.variable for m in airframe.measurements if not m.trusted}
    assert [v for v in sorted(shown) if not airframe.variables[v].description] == []


def test_outputs_held_and_stopped_and_throttles_cut_are_commands():
    marked = {
        equation.name
        for name in shipped_models()
        for equation in load_airframe(name).equations
        if equation.command
    }
    assert {re.sub(r"_\d", "", name) for name in marked} == {
        "throttle_cut",
        "throttle_taken_away",
        "engine_at_idle",
        "aileron_output_held",
        "elevator_output_held",
        "rudder_output_held",
        "motor_output_held",
        "motor_output_stopped",
    }


def test_words_and_marks_of_an_own_model_reach_the_system(own):
    system = own("flies faster than it may").observe()
    equation = next(e for e in system.equations if e.name == "too_fast")
    assert (equation.says, equation.command) == ("flies faster than it may", True)
    assert system.components["gps"].title == "GPS receiver"


@pytest.mark.parametrize("says", ["is at v_max", "is fast.", "v <= 9 m/s", "x" * 71, ""], ids=len)
def test_words_that_no_pilot_would_say_are_refused(own, says):
    with pytest.raises(ModelError, match="says"):
        own(says)


@pytest.mark.parametrize("method", ["heading", "observer"])
def test_a_column_of_a_method_without_unit_says_in_what_it_is_counted(method: str) -> None:
    """ "off by up to 5.68, 3.66 is within health" leaves a pilot asking: of what?"""
    without_unit = set()
    for model in shipped_models():
        airframe = load_airframe(model)
        for measurement in airframe.measurements:
            variable = airframe.variables[measurement.variable]
            if measurement.made_by == method and variable.unit == "1":
                without_unit.add(variable.description)
    assert without_unit
    for said in without_unit:
        counted = said.endswith((", in times the usual scatter", ", as a share of its threshold"))
        assert counted or said.startswith("whether ")
