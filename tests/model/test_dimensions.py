"""Units of models: texts, quantities, expressions."""

import os
import subprocess
import sys

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fdi.errors import ModelError
from fdi.model.dimensions import SYMBOLS_READ, _registry, dimension, dimension_of, quantity
from fdi.model.expression import parse
from fdi.units import si_units

UNITS = {
    name: dimension(unit)
    for name, unit in {
        "v": "m/s",
        "u": "m/s",
        "h": "m",
        "t": "s",
        "angle": "rad",
        "heading": "deg",
        "rho": "kg/m^3",
        "q": "Pa",
        "n": "1",
        "share": "%",
    }.items()
}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("m/s^2", "m/s**2"),
        ("Pa", "N/m^2"),
        ("1", "rad"),
        ("J", "kg m^2/s^2"),
        ("V*A", "W"),
        ("Hz", "1/s"),
    ],
)
def test_units_of_the_same_dimension_fit(one, other):
    assert dimension(one).fits(dimension(other))


@pytest.mark.parametrize(
    ("one", "other"), [("m", "s"), ("deg", "rad"), ("km/h", "m/s"), ("%", "1"), ("hPa", "Pa")]
)
def test_units_that_differ_by_a_factor_do_not_fit(one, other):
    assert not dimension(one).fits(dimension(other))


@pytest.mark.parametrize("text", sorted(si_units()))
def test_every_unit_of_a_log_is_a_unit(text):
    assert dimension(text).factor > 0


@pytest.mark.parametrize(
    "text",
    ["bananas", "m/", "9**9**9", "m^99", "3 m", "__import__", "m;s", "m" * 10_000, "m-s", "()"],
)
def test_what_is_no_unit_is_refused(text):
    with pytest.raises(ModelError, match="is not a unit"):
        dimension(text)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("3 deg", "rad", 0.0523598775),
        ("0.3 m/s", "m/s", 0.3),
        (5, "m", 5.0),
        ("7", "m", 7.0),
        ("36 km/h", "m/s", 10.0),
    ],
)
def test_a_quantity_is_turned_into_the_unit_asked_for(text, unit, value):
    assert quantity(text, dimension(unit)) == pytest.approx(value)


@pytest.mark.parametrize("text", ["3 s", "much", "3 4 m", "", "nan m/s/s/s/s"])
def test_a_quantity_of_another_kind_is_refused(text):
    with pytest.raises(ModelError, match=r"does not fit|not a number|not a unit"):
        quantity(text, dimension("m"))


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("0.5*rho*v**2", "Pa"),
        ("v*t + h", "m"),
        ("sqrt(v**2 + u**2)", "m/s"),
        ("max(v, 0)", "m/s"),
        ("atan2(v, u)", "rad"),
        ("v/u", "1"),
        ("abs(-h)", "m"),
        ("der(h)", "m/s"),
        ("sin(angle)*h", "m"),
        ("h > 3", "1"),
        ("sqrt(2*q/rho)", "m/s"),
    ],
)
def test_an_expression_has_the_unit_of_physics(text, unit):
    condition = ">" in text
    found = dimension_of(parse(text, condition=condition), UNITS)
    assert found.fits(dimension(unit))


@pytest.mark.parametrize(
    "text",
    [
        "v + h",
        "max(v, h)",
        "atan2(v, h)",
        "sin(v)",
        "sin(heading)",
        "exp(h)",
        "angle + heading",
        "share + n",
    ],
)
def test_terms_that_do_not_fit_are_named(text):
    with pytest.raises(ModelError, match=r"does not fit|needs a number"):
        dimension_of(parse(text), UNITS)


@pytest.mark.parametrize("text", ["3", "3 + 4", "-2", "max(1, 2)", "3**2"])
def test_a_bare_number_fits_everything(text):
    assert dimension_of(parse(text), UNITS) is None


def test_a_number_needs_no_pint():
    code = (
        "import sys, fdi.model.dimensions as d; d.dimension('1'); assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=600)


SYMBOL = st.tuples(
    st.sampled_from(sorted(set(SYMBOLS_READ) - {"1"})), st.sampled_from(["", "^2", "**3", "^-1"])
)


@given(
    st.lists(SYMBOL, min_size=1, max_size=5),
    st.lists(st.sampled_from(" */"), min_size=4, max_size=4),
)
def test_what_is_read_without_pint_is_what_pint_says(names, between):
    assume(not any(name == "dB" for name, _ in names) or (len(names) == 1 and not names[0][1]))
    text = names[0][0] + names[0][1]
    text += "".join(a + name + power for a, (name, power) in zip(between, names[1:], strict=False))
    own = dimension(text)
    base = _registry().Quantity(1.0, text).to_base_units()
    assert own.factor == pytest.approx(base.magnitude, rel=1e-12)
    assert dict(own.exponents) == {str(k): v for k, v in base.unit_items() if str(k) != "radian"}


def test_the_shipped_models_need_no_pint(tmp_path):
    code = (
        "import sys\n"
        "from fdi.model import load_airframe\n"
        "from fdi.model.load import shipped_models\n"
        "for name in shipped_models(): load_airframe(name)\n"
        "assert 'pint' not in sys.modules"
    )
    environment = {**os.environ, "FDI_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "h + v**2/19.6",
            "h (m) does not fit v**2/19.6 (m^2/s^2); the factor 19.6 has no unit: "
            "one with a unit is a parameter of its own",
        ),
        ("h + v*u", "h (m) does not fit v*u (m^2/s^2)"),
        (
            "yaw_rate + per_tail*n",
            "yaw_rate (deg/s) does not fit per_tail*n (rad/s); "
            "degrees are not converted inside equations: state rad/s",
        ),
        (
            "heading + angle",
            "heading (deg) does not fit angle (rad); "
            "degrees are not converted inside equations: state rad",
        ),
        (
            "wind + 2*v",
            "wind (km/h) does not fit 2*v (m/s); "
            "units are not converted inside equations: state both in m/s",
        ),
        (
            "h + heading*h",
            "h (m) does not fit heading*h (0.0175 times m); "
            "degrees are not converted inside equations: state angles in rad",
        ),
    ],
)
def test_what_does_not_fit_is_told_in_units_as_people_write_them(text, said):
    units = UNITS | {
        "yaw_rate": dimension("deg/s"),
        "per_tail": dimension("rad/s"),
        "wind": dimension("km/h"),
    }
    with pytest.raises(ModelError) as told:
        dimension_of(parse(text), units)
    assert told.value.message == said
