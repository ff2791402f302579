"""What does a comparison of flights say? Its values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fdi.shown import Rows, Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Compared(Shown):
    """One flight of a log.

    Attributes
    ----------
    name : str
        The log's; with ``#2`` for its second flight where it holds several.
    log, flight : int
        Which of the logs, and which of its flights, from 0.
    start : float
        s of the log's clock, to which all times of a comparison count: take-off, or the first
        moment at which a flight that begins in the air may be judged.
    has_takeoff : bool
        Whether that is a take-off.
    seconds : float
        In the air, from there on.
    accused : tuple of str
        Components.
    is_healthy : bool
        Whether it is one of those that make the band.
    """

    name: str
    log: int
    flight: int
    start: float
    has_takeoff: bool
    seconds: float
    accused: tuple[str, ...]
    is_healthy: bool


@dataclass(frozen=True, slots=True)
class Test(Shown):
    """A test that all flights have.

    Attributes
    ----------
    statement : str
        The name of the equation that it leaves over.
    text : str
        That equation.
    equations : tuple of str
        All that it uses, by name.
    unit : str
        SI, of its residual.
    ids : tuple of str
        What each flight's analysis calls it.
    way : int
        The sign of its residual that counts as different, 0 where either does: a statement that has
        but one side is not violated on the other one.
    """

    statement: str
    text: str
    equations: tuple[str, ...]
    unit: str
    ids: tuple[str, ...]
    way: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The residuals of one flight while it is in the air.

    Attributes
    ----------
    t : (n,) float
        s after the start.
    values : (k, n) float
        A row per test, less the constant that was taken off, as they were judged; NaN unknown.
    floor : (k, n) float
        How far a residual may be off by the model's own word: predicted spread and tolerance.
    constant : (k,) float
        That was taken off.
    way : (k,) int
        As of `Test`.
    """

    t: Floats
    values: Floats
    floor: Floats
    constant: Floats
    way: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """What healthy flights do: ``middle`` +- ``half`` at times ``t`` (b,), both (k, b).

    Later than the last time, the last one holds. NaN where no healthy flight has the test known.
    """

    t: Floats
    middle: Floats
    half: Floats


@dataclass(frozen=True, slots=True)
class Difference(Shown):
    """How far a flight leaves the band of the healthy others by one test.

    Attributes
    ----------
    test, flight : int
        Which of the comparison's.
    bands : float
        In half widths of the band, held for a second; the band is as wide as to hold each healthy
        flight by the others. Above one no healthy flight came.
    since : float
        s after take-off, from when on it was beyond the band without a break to its largest.
    at : float
        s after take-off of its largest.
    value, middle, half : float
        There, right side less left one, in the test's SI unit: the residual, and the band.
    """

    test: int
    flight: int
    bands: float
    since: float
    at: float
    value: float
    middle: float
    half: float


@dataclass(frozen=True, slots=True)
class Setting(Shown):
    """A parameter of the vehicle that is not the same in all logs; None: a log has none such."""

    name: str
    values: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class Identified(Shown):
    """What the logs tell of a parameter of the model, with one sigma, SI; None: too little."""

    name: str
    unit: str
    values: tuple[float | None, ...]
    stds: tuple[float | None, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Several flights beside each other.

    Attributes
    ----------
    logs : tuple of str
        Their names.
    flights : tuple of Compared
    tests : tuple of Test
    courses : tuple of Course
        Of each flight.
    band : Band
        Of all healthy flights; as wide as ``differences`` count.
    differences : Rows of Difference
        One for each test and flight where it could be told, the largest first.
    settings : Rows of Setting
        Parameters of the logs that differ; first those that are the same in all healthy ones.
    identified : Rows of Identified
        Parameters of the model that it identifies, with each log.
    notes : tuple of str
        What could not be compared, and why.
    """

    vehicle: str
    model: str
    logs: tuple[str, ...]
    flights: tuple[Compared, ...]
    tests: tuple[Test, ...]
    courses: tuple[Course, ...]
    band: Band
    differences: Rows[Difference]
    settings: Rows[Setting]
    identified: Rows[Identified]
    notes: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return what ``fdi compare --json`` prints, as plain values."""
        from fdi.report.compared import comparison_document

        return comparison_document(self)

    def plot(self, *, width_mm: float = 85.0) -> Figure:
        """Return the tests that differ most, with the band, as a matplotlib figure."""
        from fdi.report.compared import comparison_figure

        figure: Figure = comparison_figure(self, width_mm)
        return figure

    def __repr__(self) -> str:
        outside = sum(one.bands > 1 for one in self.differences)
        return (
            f"<Comparison of {len(self.flights)} flights, {self.model}: {len(self.tests)} tests, "
            f"{outside} times one leaves the band of the healthy ones>"
        )

    def _repr_html_(self) -> str:
        return self.differences._repr_html_()
