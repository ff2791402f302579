"""Which SI value does a unit of a log's metadata stand for, and how is an SI value shown to people?

In: the spelling of a unit in a MAVLink dialect, or as people write it, or an SI unit. Out: a
`Conversion`, `SI = raw * scale + offset`. Tables, and pint for what no log writes.

Pulse widths of servo and RC channels stay in microseconds in every format: their rows are spelled
``us (pulse)``, because ``us`` alone is a time. A percentage is a fraction inside. A unit that
nothing knows is passed through: its numbers stay as they are.
"""

from __future__ import annotations

import re
from functools import cache
from math import pi
from typing import Any, Final, NamedTuple

DEG: Final = pi / 180
G0: Final = 9.80665  # m/s^2, standard gravity (CGPM 1901): what MAVLink's mG means


class Conversion(NamedTuple):
    """SI value = raw * scale + offset, in ``unit`` ("" is dimensionless)."""

    unit: str
    scale: float = 1.0
    offset: float = 0.0


_DIALECT: Final[dict[str, Conversion]] = {
    "": Conversion(""),
    "1": Conversion(""),
    "c1": Conversion("", 0.01),  # hundredths of a dimensionless number (dilution of precision)
    "us (pulse)": Conversion("us"),
    "ns": Conversion("s", 1e-9),
    "us": Conversion("s", 1e-6),
    "ms": Conversion("s", 1e-3),
    "cs": Conversion("s", 0.01),
    "ds": Conversion("s", 0.1),
    "s": Conversion("s"),
    "mm": Conversion("m", 1e-3),
    "cm": Conversion("m", 0.01),
    "dm": Conversion("m", 0.1),
    "m": Conversion("m"),
    "km": Conversion("m", 1000.0),
    "ft": Conversion("m", 0.3048),
    "dam": Conversion("m", 10.0),
    "mm/s": Conversion("m/s", 1e-3),
    "cm/s": Conversion("m/s", 0.01),
    "dm/s": Conversion("m/s", 0.1),
    "m/s": Conversion("m/s"),
    "km/h": Conversion("m/s", 1 / 3.6),
    "kn": Conversion("m/s", 1852 / 3600),
    "m/s*5": Conversion("m/s", 0.2),
    "m/s/s": Conversion("m/s^2"),
    "mG": Conversion("m/s^2", 1e-3 * G0),
    "rad": Conversion("rad"),
    "deg": Conversion("rad", DEG),
    "deg/2": Conversion("rad", 2 * DEG),
    "cdeg": Conversion("rad", 0.01 * DEG),
    "degE5": Conversion("rad", 1e-5 * DEG),
    "degE7": Conversion("rad", 1e-7 * DEG),
    "rad/s": Conversion("rad/s"),
    "mrad/s": Conversion("rad/s", 1e-3),
    "deg/s": Conversion("rad/s", DEG),
    "ddeg/s": Conversion("rad/s", 0.1 * DEG),
    "cdeg/s": Conversion("rad/s", 0.01 * DEG),
    "rpm": Conversion("rad/s", 2 * pi / 60),
    "%": Conversion("", 0.01),
    "d%": Conversion("", 1e-3),
    "c%": Conversion("", 1e-4),
    "degC": Conversion("K", 1.0, 273.15),
    "cdegC": Conversion("K", 0.01, 273.15),
    "gauss": Conversion("T", 1e-4),
    "mgauss": Conversion("T", 1e-7),
    "Pa": Conversion("Pa"),
    "hPa": Conversion("Pa", 100.0),
    "mbar": Conversion("Pa", 100.0),
    "kPa": Conversion("Pa", 1000.0),
    "bar": Conversion("Pa", 1e5),
    "V": Conversion("V"),
    "cV": Conversion("V", 0.01),
    "mV": Conversion("V", 1e-3),
    "A": Conversion("A"),
    "cA": Conversion("A", 0.01),
    "mA": Conversion("A", 1e-3),
    "mAh": Conversion("A*s", 3.6),
    "W": Conversion("W"),
    "J": Conversion("J"),
    "hJ": Conversion("J", 100.0),
    "g": Conversion("kg", 1e-3),
    "kg": Conversion("kg"),
    "l": Conversion("m^3", 1e-3),
    "cm^2": Conversion("m^2", 1e-4),
    "cm^3": Conversion("m^3", 1e-6),
    "cm^3/min": Conversion("m^3/s", 1e-6 / 60),
    "Hz": Conversion("Hz"),
    "dB": Conversion("dB"),
}

_ALIKE: Final = {"pct": "%"}  # pint: a pico of a hundredweight
_WORD: Final = r"(?:[^\W\d]|[°%])+(?:(?:\^|\*\*)-?\d)?"
_WORDS: Final = re.compile(rf"(?:1/)?{_WORD}(?:[ */]{_WORD}){{0,5}}\Z")
"""Names alone are handed to pint, which computes powers of numbers."""
_LAST_WORD: Final = re.compile(r"(?:_([A-Za-z]+)|(?<=[a-z])(US|MS))(?:\[\d+\])?$")
_IN_NAMES: Final = {
    "usec": "us",
    "msec": "ms",
    "mah": "mAh",
    "mv": "mV",
    "ma": "mA",
    "celsius": "degC",
    "celcius": "degC",  # as PX4 writes it
    "ga": "gauss",
    "gs": "gauss",
}
"""Units as the ends of field names spell them, where the dialect spells them otherwise."""

_CUSTOMARY: Final[dict[str, Conversion]] = {
    "rad": Conversion("deg", 1 / DEG),
    "rad/s": Conversion("deg/s", 1 / DEG),
    "Pa": Conversion("hPa", 0.01),
    "K": Conversion("degC", 1.0, -273.15),
    "T": Conversion("mgauss", 1e7),
    "A*s": Conversion("mAh", 1 / 3.6),
    "fraction": Conversion("%", 100.0),
}


def si(unit: str) -> Conversion:
    """Return the conversion from a dialect's unit to SI; an unknown unit stays itself.

    Examples
    --------
    >>> si("cm/s")
    Conversion(unit='m/s', scale=0.01, offset=0.0)
    >>> si("bananas")
    Conversion(unit='bananas', scale=1.0, offset=0.0)
    """
    return _DIALECT.get(unit, Conversion(unit))


def si_as_written(unit: str) -> Conversion:
    """Return the conversion to SI from a unit as people write it; an unknown one stays itself.

    What no dialect writes is asked of pint (half a second, once), and taken where it is one of the
    quantities that logs have.

    Examples
    --------
    >>> si_as_written("knots") == si("kn"), si_as_written("°").unit, si_as_written("bananas").unit
    (True, 'rad', 'bananas')
    """
    unit = _ALIKE.get(unit, unit)
    if unit in _DIALECT:
        return _DIALECT[unit]
    return _by_pint(unit) if _WORDS.match(unit) else Conversion(unit)


@cache
def _by_pint(unit: str) -> Conversion:
    import pint

    registry = _registry()
    try:
        zero, one = (registry.Quantity(x, unit).to_base_units() for x in (0.0, 1.0))
    except (pint.PintError, AttributeError, ValueError, TypeError, SyntaxError):
        return Conversion(unit)
    label = _labels().get(one.units)
    if label is None:
        return Conversion(unit)
    return Conversion(label, float(one.magnitude - zero.magnitude), float(zero.magnitude))


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@cache
def _labels() -> dict[Any, str]:
    """Return how the quantities of logs are spelled here, by pint's units."""
    known = [unit for unit in si_units() if unit not in ("us", "dB")]
    return {_registry().Quantity(1.0, unit).to_base_units().units: unit for unit in known}


def si_units() -> tuple[str, ...]:
    """Return the SI units that values of a log may have, sorted."""
    return tuple(sorted({conversion.unit for conversion in _DIALECT.values()}))


def unit_in_name(name: str, conversion: Conversion) -> str:
    """Return the unit that a field's name ends with, "" unless its values were recorded in it.

    Examples
    --------
    >>> unit_in_name("time_boot_ms", si("ms")), unit_in_name("TimeUS", si("us"))
    ('ms', 'us')
    >>> unit_in_name("magnetometer_ga[2]", si("gauss")), unit_in_name("alt", si("mm"))
    ('gauss', '')

    A name that is no unit of the recorded values says nothing.

    >>> unit_in_name("state_ms", Conversion("")), unit_in_name("wind_m", si("cm"))
    ('', '')
    """
    found = _LAST_WORD.search(name)
    word = (found[1] or found[2]).lower() if found else ""
    unit = _IN_NAMES.get(word, word)
    is_it = conversion == _DIALECT.get(unit) != Conversion(conversion.unit)
    return unit if is_it else ""


def two_digits(value: float) -> str:
    """Return a number with two significant digits, or all before the point, never as a power.

    Examples
    --------
    >>> two_digits(0.3456), two_digits(3.456), two_digits(34.56), two_digits(134.56)
    ('0.35', '3.5', '35', '135')
    """
    return f"{value:.0f}" if abs(value) >= 9.95 else f"{value:.2g}"


def customary(unit: str) -> Conversion:
    """Return (label, scale, offset) that turn an SI value into what a person expects to read.

    ``fraction`` (0..1) becomes per cent; ask for it by that name, since not everything without a
    unit is a fraction. A unit without a customary one stays itself.

    Examples
    --------
    >>> customary("Pa")
    Conversion(unit='hPa', scale=0.01, offset=0.0)
    """
    return _CUSTOMARY.get(unit, Conversion(unit))


def hundredths(share: float) -> str:
    """Return a probability in per cent, never 100 for what is not certain.

    Examples
    --------
    >>> hundredths(0.534), hundredths(0.9964), hundredths(1.0)
    ('53', '99', '100')
    """
    return f"{share * 100 if share == 1.0 else min(share * 100, 99.0):.0f}"
