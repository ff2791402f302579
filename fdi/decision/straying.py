"""How far may a test stray on a vehicle that nobody has seen, by how far it strays at first?

In: what healthy flights that people flew strayed, ``tolerances.json`` beside this file, by
``benchmarks/tolerances.py --write``; of a flight what its tests stray in its first seconds. Out: a
least tolerance for every test whose statement was measured. Only statements are in the file whose
tolerance no family of flights moves by much: of the others nothing is known, and the model's own
holds.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final

import numpy as np

from fdi.model.evaluate import Floats
from fdi.model.parts import Kind
from fdi.model.system import System
from fdi.residuals import Generator, Residuals
from fdi.telemetry.airtime import first_known, when_in_air

FILE: Final = "tolerances.json"


@dataclass(frozen=True, slots=True)
class Usual:
    """What healthy vehicles stray by one statement.

    Attributes
    ----------
    strays : float
        What flights stray at first, root of the mean square over families, in ``unit``.
    weight : float
        Of it, against what the flight itself strays at first.
    times : float
        The tolerance is so many times the scale that follows from both.
    """

    unit: str
    strays: float
    weight: float
    times: float

    def tolerance(self, first: float) -> float:
        """Return the tolerance of a flight that strays so far at first.

        Examples
        --------
        >>> Usual("m", strays=1.0, weight=3.0, times=4.0).tolerance(1.0)
        4.0
        """
        return self.times * float(scale_of(self.strays, self.weight, first))


def scale_of(strays: float, weight: float, first: Floats | float) -> Floats:
    """Return what a flight may be expected to stray, by what families and itself did at first.

    One that strays less at first than they is allowed less; one that strays more is not allowed
    more, for it may have begun with a fault.
    """
    own = np.minimum(first, strays)
    scale: Floats = np.sqrt((weight * strays**2 + own**2) / (weight + 1.0))
    return scale


def at_first(size: Floats, residuals: Residuals, length_s: float) -> Floats:
    """Return how far each test strays in its first seconds in the air, (r,); NaN where it is none.

    The median: a fault that begins in their second half does not widen what it is held against.

    Parameters
    ----------
    size : (r, n) float
        How far the residuals are off.
    residuals : Residuals
    length_s : float
    """
    air = when_in_air(residuals.signals)
    found = np.full(len(size), np.nan)
    for row, own in enumerate(size):
        known = air & np.isfinite(own)
        first = own[known & first_known(known, residuals.signals, length_s)]
        if len(first):
            found[row] = np.median(first)
    return found


def least_tolerances(size: Floats, residuals: Residuals, length_s: float) -> Floats:
    """Return the least tolerance of every test, (r,), in its unit; zero where none was measured.

    Parameters
    ----------
    size : (r, n) float
        How far the residuals are off.
    residuals : Residuals
    length_s : float
        The beginning of a flight.
    """
    bank = residuals.bank
    rows = {
        row: own
        for row, generator in enumerate(bank.generators)
        if (own := _usual_of(bank.system, generator)) is not None
    }
    found = np.zeros(len(bank.generators))
    first = np.nan_to_num(at_first(size[list(rows)], residuals, length_s))
    for (row, own), strays in zip(rows.items(), first.tolist(), strict=True):
        found[row] = own.tolerance(strays)
    return found


def _usual_of(system: System, generator: Generator) -> Usual | None:
    equation = system.equations[generator.residual]
    if equation.kind is not Kind.EQUALITY:
        return None
    found = measured().get(pooled(equation.name))
    return found if found is not None and found.unit == equation.unit else None


@cache
def measured() -> Mapping[str, Usual]:
    """Return what was measured, by statement."""
    tree = json.loads(files("fdi.decision").joinpath(FILE).read_text("utf-8"))
    kept = ("unit", "strays", "weight", "times")
    return {name: Usual(**{key: own[key] for key in kept}) for name, own in tree.items()}


def pooled(name: str) -> str:
    """Return the name of a statement for all motors and units alike.

    Examples
    --------
    >>> pooled("motor_3_given_more")
    'motor_#_given_more'
    """
    return re.sub(r"\d+", "#", name)
