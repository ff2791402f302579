"""What a person can check of a statement is computed as a residual is, with its uncertainty."""

from dataclasses import replace

import numpy as np
import pytest
from flights import shared

import fdi
from fdi.errors import ModelError
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.amount import amounts

from .build import airframe
from .test_evaluate import signals

TEXT = """
format: 1
name: scale
components:
  gauge: {group: sensor}
variables:
  force: {unit: N}
  load: {unit: N}
  left: {unit: N}
  elsewhere: {unit: N}
parameters:
  gain: {value: 2, unit: "1"}
equations:
  e_1: {text: "left = force - gain*load", solves: [left]}
  e_2: {text: "elsewhere = 3*load", solves: [elsewhere]}
equalities:
  balanced:
    text: "left = 0"
    solves: []
    component: gauge
    amounts:
      "it shows # of the load": "force/(gain*load)"
      "# too much": "left"
      "of # elsewhere": elsewhere
      "# is assumed": gain
      "# when strong": {value: left, when: "force > 11.5"}
measurements:
  VFR_HUD:
    component: gauge
    fields:
      alt: {variable: load, accuracy: 0.1 N, raw: true}
      climb: {variable: force, accuracy: 0.3 N, raw: true}
"""


def told(folder, gain_std=None):
    bank = build_bank(airframe(folder, TEXT).observe(), "mtes+cross_checks")
    gain = replace(bank.system.parameters["gain"], std=gain_std)
    bank = replace(bank, system=replace(bank.system, parameters={"gain": gain}))
    force = np.where(np.arange(50) < 40, 12.0, 11.0)
    columns = {"VFR_HUD.alt": np.full(50, 5.0), "VFR_HUD.climb": force}
    residuals = bank.evaluate(signals(bank.system, columns), Differentiation())
    (generator,) = bank.generators
    return {amount.words: amount for amount in amounts(residuals, generator)}


def test_amounts_are_told_with_unit_and_uncertainty(tmp_path):
    found = told(tmp_path)
    share, much = found["it shows # of the load"], found["# too much"]
    assert share.value[:40] == pytest.approx(1.2)
    assert much.value[:40] == pytest.approx(2.0)
    assert (share.unit in ("", "1"), much.unit) == (True, "N")
    # a difference: errors of the force and twice those of the load
    assert much.sigma == pytest.approx(np.hypot(0.3, 2 * 0.1))
    # a ratio: relative errors
    assert share.sigma[:38] == pytest.approx(1.2 * np.hypot(0.3 / 12, 0.1 / 5), rel=0.05)


def test_a_parameter_that_is_not_exact_makes_them_less_sure(tmp_path):
    found = told(tmp_path, gain_std=0.2)["# too much"]
    assert found.sigma == pytest.approx(np.sqrt(0.3**2 + 0.2**2 + (5 * 0.2) ** 2))


def test_a_constant_is_as_long_as_the_flight(tmp_path):
    value = told(tmp_path)["# is assumed"].value
    assert value.tolist() == [2.0] * 50


def test_where_it_is_no_amount_it_is_unknown(tmp_path):
    value = told(tmp_path)["# when strong"].value
    assert value[:40] == pytest.approx(2.0)
    assert np.isnan(value[40:]).all()


def test_what_this_test_does_not_compute_is_left_out(tmp_path):
    assert "of # elsewhere" not in told(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("# too much", "too much", "amounts"),
        ('much": "left"', 'much": "lost"', "unknown symbol 'lost'"),
        ('much": "left"', 'much": "left + gain"', "left (N) does not fit gain (1)"),
    ],
)
def test_what_is_no_amount_is_one_problem(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(ModelError) as error:
        airframe(tmp_path, TEXT.replace(old, new))
    assert said in str(error.value)
    assert "m.yaml" in str(error.value)


@pytest.mark.parametrize("case", shared("sitl/copter/c11_motor2_x0.85.tlog"))
def test_how_much_a_motor_gives_is_told_as_it_was_weakened(case):
    """Its output was scaled by 0.85, which leaves 0.72 of the thrust at hover (labels.json)."""
    found = fdi.analyze(case.path)
    text = found.findings[0].evidence.text
    value, sigma = text.partition("gives ")[2].partition(" %")[0].split(" +- ")
    assert abs(float(value) - 72) < 3 * max(float(sigma), 1.0)
    assert "of what it is asked for, from" in text
