"""Which SI value does a unit of a log's metadata stand for, and how is an SI value shown to people?

In: the spelling of a unit in a MAVLink dialect, or an SI unit. Out: a `Conversion`, `SI = raw *
scale + offset`. Pure tables. Pulse widths of servo and RC channels stay in microseconds in every
format: their rows are spelled ``us (pulse)``, because ``us`` alone is a time. A percentage is a
fraction inside. A unit that the table does not know is passed through: its numbers stay as they
are.
"""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

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


def si_units() -> tuple[str, ...]:
    """Return the SI units that values of a log may have, sorted."""
    return tuple(sorted({conversion.unit for conversion in _DIALECT.values()}))


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
