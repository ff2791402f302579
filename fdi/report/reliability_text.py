"""What is said about the reliability of several units?

In: `Units`: their numbers, and a mean time to failure and a length of flight where these are known.
Out: parts for a console, plain values for JSON, rows for CSV. Beside the figures stands what they
assume.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fdi.errors import UsageError
from fdi.methods import reliability
from fdi.report.json_text import number
from fdi.report.text import heading, table, text
from fdi.report.vote_document import Cell

if TYPE_CHECKING:
    from rich.console import RenderableType

UNIT_TIMES: Final = (0.1, 1.0)
"""Times in mean times to failure of one unit, where nothing else is asked for."""


@dataclass(frozen=True, slots=True)
class Units:
    """What reliability is asked of.

    Attributes
    ----------
    numbers : tuple of int
        Of autopilots.
    mttf : float or None
        h, of one autopilot; None: times are told in multiples of it.
    flight : float or None
        h, of one flight.
    voter : float
        Reliability of what counts the votes.
    """

    numbers: tuple[int, ...]
    mttf: float | None = None
    flight: float | None = None
    voter: float = 1.0

    def __post_init__(self) -> None:
        for what, hours in (("mean time to failure", self.mttf), ("flight", self.flight)):
            if hours is not None and not 0 < hours < float("inf"):
                raise UsageError(f"a {what} of {hours:g} h is not possible", hint="more than 0 h")
        if not 0 <= self.voter <= 1:
            raise UsageError(f"a reliability of {self.voter:g} is not between 0 and 1")

    @property
    def times(self) -> tuple[float, ...]:
        """The times at which reliability is told, in mean times to failure of one unit."""
        if self.mttf is None or self.flight is None:
            return UNIT_TIMES
        return (self.flight / self.mttf,)


@dataclass(frozen=True, slots=True)
class ReliabilityRow:
    """One structure: R at the times asked for, and its mean time to failure in those of a unit."""

    structure: str
    units: int
    needed: int
    at: tuple[float, ...]
    mttf: float


def reliability_rows(units: Units) -> tuple[ReliabilityRow, ...]:
    """Return one unit, and of each number: series, a majority, parallel."""
    made = []
    for n, k, name in _structures(units.numbers):
        voter = units.voter if 1 < k < n else 1.0
        at = tuple(
            float(reliability.k_of_n(k, [reliability.constant(1.0, t)] * n, voter))
            for t in units.times
        )
        made.append(ReliabilityRow(name, n, k, at, voter * reliability.mttf_k_of_n(k, n, 1.0)))
    return tuple(made)


def _structures(numbers: Sequence[int]) -> Iterator[tuple[int, int, str]]:
    yield 1, 1, "one"
    for n in sorted(set(numbers)):
        yield n, n, f"series of {n}"
        if 1 < n // 2 + 1 < n:
            yield n, n // 2 + 1, f"{n // 2 + 1} of {n}"
        yield n, 1, f"parallel, 1 of {n}"


def reliability_summary(units: Units) -> Iterator[RenderableType]:
    """Yield what a terminal shows of reliability, with what it assumes."""
    yield heading("Reliability of several units")
    is_in_hours = units.mttf is not None
    times = [f"R after {_time(units, t)}" for t in units.times]
    made = table("structure", *times, "MTTF, h" if is_in_hours else "MTTF, of one unit")
    for row in reliability_rows(units):
        mean = row.mttf * (units.mttf or 1.0)
        made.add_row(text(row.structure), *(text(f"{r:.6f}") for r in row.at), text(f"{mean:.6g}"))
    yield made
    yield text("  assumed: " + "; ".join(assumed(units)), "dim")


def _time(units: Units, t: float) -> str:
    return f"{units.flight:g} h" if units.mttf and units.flight else f"{t:g} MTTF of one"


def assumed(units: Units) -> tuple[str, ...]:
    """Return what the figures rest on, a line each."""
    return (
        *reliability.ASSUMPTIONS,
        f"the voter of a majority works with probability {units.voter:g}",
    )


def reliability_document(units: Units) -> dict[str, Any]:
    """Return reliability as plain values."""
    return {
        "assumptions": list(assumed(units)),
        "mttf_of_one_h": number(units.mttf),
        "flight_h": number(units.flight),
        "structures": [
            {
                "name": row.structure,
                "units": row.units,
                "needed": row.needed,
                "rate_times_t": [number(t) for t in units.times],
                "reliability": [number(r) for r in row.at],
                "mttf_of_one": number(row.mttf),
            }
            for row in reliability_rows(units)
        ],
    }


def reliability_table(units: Units) -> Iterator[list[Cell]]:
    """Yield a head and a row per structure; times in mean times to failure of one unit."""
    yield ["structure", "units", "needed", *(f"R at {t:g}" for t in units.times), "mttf"]
    for row in reliability_rows(units):
        yield [row.structure, row.units, row.needed, *row.at, row.mttf]
