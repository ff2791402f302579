"""Do the units of a model fit together?

In: unit texts and expressions. Out: a ``Dimension`` for every expression, or a ``ModelError`` that
names the two sides that do not fit. A dimension is a factor to SI and the exponents of the SI base
units, so that degrees beside radians are found as well as metres beside seconds. A bare number that
is added to, compared with or put beside a quantity takes that quantity's unit; as a factor or an
exponent it has none. Texts of units are read by pint, which costs 0.5 s to import: what is written
in the symbols that our own models use is read here (`SYMBOLS_READ`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import isclose
from typing import Any, Final

from fdi.errors import ModelError
from fdi.model.expression import (
    OVER_RECORDS,
    REGRESSED,
    Apply,
    Expression,
    Number,
    Symbol,
    is_logical,
    to_text,
    walk,
)
from fdi.model.given import Given
from fdi.units import DEG

_NAME = r"[A-Za-z_%]+(?:(?:\^|\*\*)-?\d)?"
UNIT: Final = re.compile(rf"(?:1/)?{_NAME}(?:[ */]{_NAME}){{0,5}}\Z")

Exponents = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Dimension:
    """A unit: ``factor`` times SI base units with ``exponents``."""

    factor: float
    exponents: Exponents
    text: str

    def fits(self, other: Dimension) -> bool:
        """Return whether two quantities may be added."""
        return self.exponents == other.exponents and isclose(self.factor, other.factor)


NUMBER = Dimension(1.0, (), "a number")


def _made_of(factor: float = 1.0, **exponents: float) -> Dimension:
    return Dimension(factor, tuple(sorted(exponents.items())), "")


SYMBOLS_READ: Final = {
    "1": NUMBER,
    "rad": NUMBER,
    "deg": _made_of(DEG),
    "m": _made_of(meter=1.0),
    "km": _made_of(1000.0, meter=1.0),
    "s": _made_of(second=1.0),
    "ms": _made_of(1e-3, second=1.0),
    "us": _made_of(1e-6, second=1.0),
    "h": _made_of(3600.0, second=1.0),
    "kg": _made_of(kilogram=1.0),
    "K": _made_of(kelvin=1.0),
    "A": _made_of(ampere=1.0),
    "Hz": _made_of(second=-1.0),
    "N": _made_of(kilogram=1.0, meter=1.0, second=-2.0),
    "Pa": _made_of(kilogram=1.0, meter=-1.0, second=-2.0),
    "J": _made_of(kilogram=1.0, meter=2.0, second=-2.0),
    "W": _made_of(kilogram=1.0, meter=2.0, second=-3.0),
    "V": _made_of(kilogram=1.0, meter=2.0, second=-3.0, ampere=-1.0),
    "ohm": _made_of(kilogram=1.0, meter=2.0, second=-3.0, ampere=-2.0),
    "T": _made_of(kilogram=1.0, second=-2.0, ampere=-1.0),
    "dB": _made_of(10**0.1),
    "bytes": _made_of(8.0, bit=1.0),
}
"""What pint is not needed for: most symbols of the SI, and what else our models are written in."""
_FACTOR: Final = re.compile(r"(1|[A-Za-z_%]+)(?:(?:\^|\*\*)(-?\d))?([ */]?)")


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@lru_cache(maxsize=512)
def dimension(unit: str) -> Dimension:
    """Return the dimension of a unit.

    Raises
    ------
    ModelError
        The text is not a unit.

    Examples
    --------
    >>> dimension("km/h").exponents
    (('meter', 1.0), ('second', -1.0))
    """
    if unit in ("", "1"):
        return Dimension(1.0, (), unit)
    if not UNIT.match(unit):  # pint computes powers of numbers, so it is handed names only
        raise ModelError(f"{unit[:40]!r} is not a unit")
    read = _read(unit)
    if read is not None:
        return read
    try:
        base = _registry().Quantity(1.0, unit.replace("%", "percent")).to_base_units()
    except (AttributeError, ValueError, TypeError, SyntaxError, KeyError) as error:
        raise ModelError(f"{unit!r} is not a unit") from error
    exponents = {str(k): float(v) for k, v in base.unit_items() if str(k) != "radian"}
    return Dimension(float(base.magnitude), tuple(sorted(exponents.items())), unit)


def _read(unit: str) -> Dimension | None:
    """Return the dimension of a unit in symbols that need no library, None for any other."""
    found, sign = NUMBER, 1
    for name, power, after in _FACTOR.findall(unit):
        if name not in SYMBOLS_READ:
            return None
        own = SYMBOLS_READ[name]
        raised = Dimension(
            own.factor ** int(power or 1),
            tuple((base, exponent * int(power or 1)) for base, exponent in own.exponents),
            "",
        )
        found, sign = _product(found, raised, sign), -1 if after == "/" else 1
    return replace(found, text=unit)


def quantity(value: float | str, unit: Dimension) -> float:
    """Return a number, or a number with a unit such as ``3 deg``, in the unit asked for.

    Raises
    ------
    ModelError
        The text is not a quantity, or its unit does not fit.
    """
    if not isinstance(value, str):
        return float(value)
    number, _, text = value.strip().partition(" ")
    try:
        magnitude = float(number)
    except ValueError:
        raise ModelError(f"{value!r} is not a number with a unit, such as '0.3 m/s'") from None
    own = dimension(text.strip()) if text.strip() else unit
    if own.exponents != unit.exponents:
        raise ModelError(f"{value!r} does not fit the unit {unit.text!r}")
    return magnitude * own.factor / unit.factor


def dimension_of(expression: Expression, units: Mapping[str, Dimension | None]) -> Dimension | None:
    """Return the dimension of an expression; None for a bare number, which fits everything.

    Parameters
    ----------
    expression : Expression
    units : mapping of str to Dimension
        Of every name in it; one that is missing (a flight state) or None fits everything.

    Raises
    ------
    ModelError
        Two terms do not fit, or a function's argument has a unit.
    """
    match expression:
        case Number():
            return None
        case Symbol(name):
            return units.get(name)
        case Apply(operator, arguments):
            inner = [dimension_of(argument, units) for argument in arguments]
            return _combine(operator, arguments, inner)
    return None


def _combine(
    operator: str, arguments: tuple[Expression, ...], inner: list[Dimension | None]
) -> Dimension | None:
    first = inner[0]
    if isinstance(operator, Given):
        for unit, argument, own in zip(operator.function.takes, arguments, inner, strict=True):
            if own is not None and not own.fits(dimension(unit)):
                wanted = f"{operator}(...) takes {unit}"
                raise ModelError(f"{wanted}, not {to_text(argument)} ({own.text})")
        return dimension(operator.function.gives)
    if operator in ("+", "-", "min", "max", "<", "<=", ">", ">=", "==", "!="):
        common = _common(arguments, inner)
        return NUMBER if is_logical(Apply(operator, arguments)) else common
    if operator in OVER_RECORDS:
        raise ModelError(f"{operator}(...) is for the value of a measured field")
    if operator in ("abs", "wrap"):
        return first
    if operator in ("and", "or", "not", "sign", "bit"):
        return NUMBER
    if operator in ("*", "/"):
        sign = 1 if operator == "*" else -1
        return _product(first or NUMBER, inner[1] or NUMBER, sign)
    if operator == "**":
        exponent = arguments[1]
        return _power(first, exponent.value) if isinstance(exponent, Number) else first
    if operator == "sqrt":
        return _power(first, 0.5)
    if operator == "der":
        return _product(first or NUMBER, Dimension(1.0, (("second", 1.0),), "s"), -1)
    if operator in REGRESSED:
        followers, leaders = (_common(arguments[i::2], inner[i::2]) for i in (0, 1))
        return _product(followers or NUMBER, leaders or NUMBER, -1)
    if operator == "atan2":
        _common(arguments, inner)
        return NUMBER
    if first is not None and not first.fits(NUMBER):
        raise ModelError(f"{operator}({to_text(arguments[0])}) needs a number, not {first.text}")
    return NUMBER


def _common(arguments: tuple[Expression, ...], inner: list[Dimension | None]) -> Dimension | None:
    found: tuple[Expression, Dimension] | None = None
    for argument, own in zip(arguments, inner, strict=True):
        if own is None:
            continue
        if found and not found[1].fits(own):
            raise ModelError(misfit(*found, argument, own))
        found = found or (argument, own)
    return found[1] if found else None


def misfit(left: Expression, own: Dimension, right: Expression, other: Dimension) -> str:
    """Return that two sides do not fit, with their units, and what may be meant."""
    said = f"{to_text(left)} ({own.text}) does not fit {to_text(right)} ({other.text})"
    if own.exponents == other.exponents:
        common = _spell(own.exponents)
        turned = own.factor / other.factor
        if isclose(turned, DEG) or isclose(turned, 1 / DEG):
            angle = f"rad{common[1:]}" if common.startswith("1/") else "angles in rad"
            angle = angle if own.exponents else "rad"
            return f"{said}; degrees are not converted inside equations: state {angle}"
        return f"{said}; units are not converted inside equations: state both in {common}"
    bare = next(filter(None, map(_bare_factor, (left, right))), None)
    if bare is None:
        return said
    return f"{said}; the factor {bare} has no unit: one with a unit is a parameter of its own"


def _bare_factor(expression: Expression) -> str | None:
    """Return a number that stands in a product or a quotient, None without one."""
    for node in walk(expression):
        if isinstance(node, Apply) and node.operator in ("*", "/"):
            for argument in node.arguments:
                if isinstance(argument, Number):
                    return to_text(argument)
    return None


def _product(left: Dimension, right: Dimension, sign: int) -> Dimension:
    if left.exponents and right.fits(NUMBER):
        return left  # as it is written
    if right.exponents and sign > 0 and left.fits(NUMBER):
        return right
    exponents = dict(left.exponents)
    for name, exponent in right.exponents:
        exponents[name] = exponents.get(name, 0.0) + sign * exponent
    kept = tuple(sorted((name, e) for name, e in exponents.items() if abs(e) > 1e-12))
    return _composed(left.factor * right.factor**sign, kept)


def _power(base: Dimension | None, exponent: float) -> Dimension | None:
    if base is None:
        return None
    exponents = tuple((name, e * exponent) for name, e in base.exponents)
    return _composed(base.factor**exponent, exponents)


def _composed(factor: float, exponents: Exponents) -> Dimension:
    """Return a unit that nobody has written."""
    spelled = _spell(exponents)
    return Dimension(
        factor, exponents, spelled if isclose(factor, 1.0) else f"{factor:.3g}{_TIMES}{spelled}"
    )


_TIMES: Final = " times "
SYMBOLS: Final = {"meter": "m", "second": "s", "kilogram": "kg", "ampere": "A", "kelvin": "K"}


def _spell(exponents: Exponents) -> str:
    """Return SI base units as a person writes them.

    Examples
    --------
    >>> _spell((("meter", 1.0), ("second", -2.0))), _spell((("second", -1.0),)), _spell(())
    ('m/s^2', '1/s', 'a number')
    """
    if not exponents:
        return NUMBER.text
    over = [_symbol(name, e) for name, e in exponents if e > 0]
    under = [_symbol(name, -e) for name, e in exponents if e < 0]
    return (" ".join(over) or "1") + "".join(f"/{part}" for part in under)


def spell(unit: Dimension) -> str:
    """Return a unit to show: as the model has it, or by SI symbols; "" where there is none."""
    return "" if unit.text == NUMBER.text or _TIMES in unit.text else unit.text


def _symbol(name: str, exponent: float) -> str:
    return SYMBOLS.get(name, name) + ("" if exponent == 1 else f"^{exponent:g}")
