"""What a model calls its parts, and which of these names look like a slip."""

import pytest

from fdi.model import load_airframe
from fdi.model.load import shipped_models

MODEL = """format: 1
name: cart
components:
  gps: {group: sensor, affects: [estimator]}
  estimator: {}
  motor_1: {}
variables:
  v: {unit: m/s}
  w: {unit: m/s}
equations:
  k_1: {text: "v = w", fault: estimator.v, component: estimator, suspects: [gps]}
measurements:
  GPS: {component: gps, fields: {v: {variable: v}}}
  WHEEL: {component: motor_1, fields: {w: {variable: w}}}
"""


def loaded(tmp_path, old="", new="", more=""):
    text = MODEL.replace(old, new, 1) if old else MODEL
    path = tmp_path / "m.yaml"
    path.write_text(text + more, encoding="utf-8")
    return load_airframe(path)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "suspects: [gps]",
            "suspects: [gsp]",
            "m.yaml:11: 'gsp' is no component that anything else is about; did you mean gps?",
        ),
        (
            "suspects: [gps]",
            "suspects: [sun]",
            "m.yaml:11: 'sun' is no component that anything else is about",
        ),
        (
            "component: estimator",
            "component: estimtor",
            "m.yaml:11: the component 'estimtor' is not listed; did you mean estimator?",
        ),
        (
            "GPS: {component: gps",
            "GPS: {component: gbs",
            "m.yaml:13: the component 'gbs' is not listed; did you mean gps?",
        ),
        (
            "{variable: w}",
            "{variable: w, component: motor1}",
            "m.yaml:14: the component 'motor1' is not listed; did you mean motor_1?",
        ),
        (
            "affects: [estimator]",
            "affects: [estimater]",
            "m.yaml:4: the component 'estimater' is not listed; did you mean estimator?",
        ),
        (
            "affects: [estimator]",
            "part_of: estimater",
            "m.yaml:4: the component 'estimater' is not listed; did you mean estimator?",
        ),
    ],
)
def test_a_name_that_looks_like_a_slip_is_told_with_its_line(old, new, told, tmp_path):
    assert loaded(tmp_path, old, new).warnings == (told,)


def test_a_component_that_is_not_listed_and_like_none_is_one_all_the_same(tmp_path):
    found = loaded(tmp_path, "WHEEL: {component: motor_1", "WHEEL: {component: tyre")
    assert found.warnings == ()
    assert (found.components["tyre"].group, found.components["tyre"].affects) == ("other", ())


def test_names_of_one_kind_are_no_slips_of_each_other(tmp_path):
    found = loaded(tmp_path, "WHEEL: {component: motor_1", "WHEEL: {component: motor_2")
    assert found.warnings == ()


def test_a_model_that_lists_no_component_names_them_as_it_likes(tmp_path):
    listed = MODEL[MODEL.index("components:") : MODEL.index("variables:")]
    assert loaded(tmp_path, listed, "").warnings == ()


def test_a_part_disturbs_its_whole_whatever_else(tmp_path):
    gps = loaded(tmp_path, "affects: [estimator]", "part_of: estimator, affects: [motor_1]")
    assert gps.components["gps"].affects == ("estimator", "motor_1")
    assert gps.components["gps"].part_of == "estimator"


def test_what_is_affected_need_not_be_in_every_model(tmp_path):
    assert loaded(tmp_path, "affects: [estimator]", "affects: [sun]").warnings == ()


@pytest.mark.parametrize("name", shipped_models())
def test_the_shipped_models_have_no_slips(name):
    assert load_airframe(name).warnings == ()
