"""Units of MAVLink: against pint, an outside authority, and against the dialect itself."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry.dialect import definition_by_name
from fdi.units import Conversion, customary, si, si_as_written, si_units

# how pint writes what MAVLink writes its own way
SPELLED = {
    "m/s/s": "m/s**2",
    "mG": "0.001*standard_gravity",
    "deg/2": "2*deg",
    "cdeg": "0.01*deg",
    "degE5": "1e-5*deg",
    "degE7": "1e-7*deg",
    "ddeg/s": "0.1*deg/s",
    "cdeg/s": "0.01*deg/s",
    "m/s*5": "0.2*m/s",
    "%": "0.01",
    "d%": "0.001",
    "c%": "0.0001",
    "c1": "0.01",
    "dam": "10*m",
    "cs": "0.01*s",
    "ds": "0.1*s",
    "rpm": "revolution/minute",
    "hJ": "100*J",
    "cV": "0.01*V",
    "cA": "0.01*A",
    "mAh": "mA*hour",
    "cm^3/min": "cm**3/minute",
    "l": "liter",
}
PLAIN = ["ns", "us", "ms", "s", "mm", "cm", "dm", "m", "mm/s", "cm/s", "dm/s", "m/s", "rad", "deg"]
PLAIN += ["rad/s", "mrad/s", "deg/s", "Pa", "hPa", "mbar", "kPa", "V", "mV", "A"]
PLAIN += ["mA", "W", "J", "g", "kg", "cm^2", "cm^3", "Hz"]


@pytest.fixture(scope="module")
def pint():
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@pytest.mark.parametrize("unit", [*SPELLED, *PLAIN])
def test_scale_is_what_pint_says(pint, unit):
    expected = pint.parse_expression(SPELLED.get(unit, unit)) * pint.Quantity(1.0, "")
    found = si(unit)
    to = found.unit.replace("^", "**") or "dimensionless"
    assert found.offset == 0.0
    assert found.scale == pytest.approx(expected.to(to).magnitude, rel=1e-12)


@pytest.mark.parametrize(("unit", "zero"), [("degC", 0.0), ("cdegC", 0.0)])
def test_water_freezes_at_273_kelvin(unit, zero):
    found = si(unit)
    assert (found.unit, found.scale * zero + found.offset) == ("K", 273.15)


@given(st.floats(-1e6, 1e6), st.sampled_from(sorted(si_units())))
def test_what_people_read_leads_back_to_the_value(value, unit):
    label, scale, offset = customary(unit)
    shown = value * scale + offset
    assert (shown - offset) / scale == pytest.approx(value, rel=1e-9, abs=1e-3)
    assert label == unit or customary(label) == (label, 1.0, 0.0)  # it is not made customary again


@pytest.mark.parametrize(
    ("channel", "unit", "scale"),
    [
        ("GPS_RAW_INT.lat", "rad", 1.7453292519943295e-9),
        ("GPS_RAW_INT.vel", "m/s", 0.01),
        ("SCALED_PRESSURE.press_abs", "Pa", 100.0),
        ("RAW_IMU.xmag", "T", 1e-7),
        ("BATTERY_STATUS.current_battery", "A", 0.01),
        ("ATTITUDE.roll", "rad", 1.0),
    ],
)
def test_units_that_analyses_rest_on(channel, unit, scale):
    message, _, name = channel.partition(".")
    (field,) = [f for f in definition_by_name(message).fields if f.name == name]
    found = si(field.unit)
    assert (found.unit, found.scale) == (unit, pytest.approx(scale, rel=1e-12))


@pytest.mark.parametrize(
    ("unit", "meant"),
    [("kt", "kn"), ("kts", "kn"), ("knot", "kn"), ("knots", "kn"), ("degrees", "deg"), ("°", "deg"),
     ("celsius", "degC"), ("m/s²", "m/s/s"), ("pct", "%"), ("percent", "%"), ("minutes", "min")],
)  # fmt: skip
def test_units_are_known_as_people_write_them(unit, meant):
    expected = Conversion("s", 60.0) if meant == "min" else si(meant)
    found = si_as_written(unit)
    assert found.unit == expected.unit
    assert found[1:] == pytest.approx(expected[1:], rel=1e-12)


def test_fahrenheit_has_an_offset():
    unit, scale, offset = si_as_written("degF")
    assert (unit, 32 * scale + offset) == ("K", pytest.approx(273.15, abs=1e-9))


@pytest.mark.parametrize("unit", ["bananas", "9**9**9", "", "1/", "deg C", "lbf", "__import__"])
def test_what_is_no_unit_of_a_log_stays_itself(unit):
    assert si_as_written(unit) == Conversion(unit)
