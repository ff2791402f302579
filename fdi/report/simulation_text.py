"""What is said about simulated voters?

In: rows of outcomes, and of what units reliability is asked (`reliability_text.py`). Out: parts for
a console, plain values for JSON and rows for CSV. Beside the figures stands what they assume.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fdi import __version__
from fdi.methods.voting import Outcome, Settings
from fdi.methods.voting.scenarios import ENOUGH, Row
from fdi.methods.voting.simulate import BEGINS_S, Share, share
from fdi.report.json_text import number
from fdi.report.reliability_text import Units, reliability_document, reliability_summary
from fdi.report.text import heading, table, text
from fdi.report.vote_document import SCHEMA_VERSION, Cell, settings_document
from fdi.report.vote_text import rules_line
from fdi.report.words import plural

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST_WRONG: Final = 0.5


def simulation_summary(
    rows: Sequence[Row], settings: Settings, units: Units
) -> Iterator[RenderableType]:
    """Yield what a terminal shows of simulated voters and of reliability."""
    first = rows[0].outcomes[0]
    yield text("Simulated voters", "bold")
    yield text(rules_line(settings))
    yield text(
        f"{plural(first.runs, 'run')} each, seed {first.seed}; a run ends "
        f"{first.scenario.lasts:g} s after the earliest onset"
    )
    yield from _wrong(rows)
    yield from _reaction(rows)
    yield heading("Assumed")
    for line in assumptions(settings):
        yield text(f"  {line}")
    yield from reliability_summary(units)


def assumptions(settings: Settings) -> tuple[str, ...]:
    """Return what a simulation rests on, a line each."""
    travel = settings.transport or 0.0
    return (
        f"a message is on its way for up to {travel:g} s, then waits for the receiver's next cycle",
        "links lose messages independently of each other",
        "those that fail have the lowest numbers unless stated, whom the voter prefers",
        f"failures begin {BEGINS_S:g} to {BEGINS_S + settings.selection_hold:g} s after the first "
        "comparison, all at once; one flag stands for all of an autopilot's",
        "an autopilot that was silent once stays so: the longer a run with loss, the more are",
    )


def _wrong(rows: Sequence[Row]) -> Iterator[RenderableType]:
    numbers = _numbers(rows)
    yield heading("Runs that end with a failing autopilot in charge, % (95 % interval)")
    made = table("scenario", *(f"{n} autopilots" for n in numbers), "enough")
    for row in rows:
        of = {one.scenario.autopilots: one for one in row.outcomes}
        made.add_row(
            text(row.name),
            *(text(_share(of[n]) if n in of else "–") for n in numbers),
            text("none" if row.enough is None else row.enough),
        )
    yield made
    few = share(np.zeros(rows[0].outcomes[0].runs, np.bool_)).high >= ENOUGH
    yield text(
        f"  enough: the number from which on the upper limit is below {100 * ENOUGH:g} %"
        + (", for which these are too few runs" if few else "")
        + "; s: the count of the votes has stopped in most runs",
        "dim",
    )


def _share(one: Outcome) -> str:
    stopped = " s" if one.stopped.value > MOST_WRONG else ""
    return f"{per_cent(one.wrong)}{stopped}"


def per_cent(found: Share) -> str:
    """Return a share in per cent with its interval, of which only the inner end where it is 0 or 1.

    Examples
    --------
    >>> per_cent(Share(0.25, 0.2245, 0.2775)), per_cent(Share(0.0, 0.0, 0.0038))
    ('25.0 (22.4–27.8)', '0 (<0.4)')
    """
    value, low, high = (100 * part for part in found)
    if found.value in (0.0, 1.0):
        return f"0 (<{high:.1f})" if not found.value else f"100 (>{low:.1f})"
    return f"{value:.1f} ({low:.1f}–{high:.1f})"


def _reaction(rows: Sequence[Row]) -> Iterator[RenderableType]:
    numbers = _numbers(rows)
    yield heading("Onset to take-over, s, median and 95th percentile; needless changes, %")
    made = table("scenario", *(f"{n} autopilots" for n in numbers))
    for row in rows:
        of = {one.scenario.autopilots: one for one in row.outcomes}
        made.add_row(text(row.name), *(text(_times(of.get(n))) for n in numbers))
    yield made


def _times(one: Outcome | None) -> str:
    if one is None:
        return "–"
    took = "–" if one.reaction is None else f"{one.reaction:.1f}, {one.slowest:.1f}"
    return f"{took}; {100 * one.needless.value:.1f}"


def _numbers(rows: Sequence[Row]) -> list[int]:
    return sorted({one.scenario.autopilots for row in rows for one in row.outcomes})


def simulation_document(rows: Sequence[Row], settings: Settings, units: Units) -> dict[str, Any]:
    """Return simulated voters and reliability as plain values."""
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "settings": settings_document(settings),
        "assumptions": list(assumptions(settings)),
        "scenarios": [
            {"name": row.name, "enough": row.enough, **_outcome(one)}
            for row in rows
            for one in row.outcomes
        ],
        "reliability": reliability_document(units),
    }


def _outcome(one: Outcome) -> dict[str, Any]:
    return {
        "autopilots": one.scenario.autopilots,
        "failures": [{"kind": kind, "autopilot": n} for kind, n in one.scenario.failures],
        "outside": one.scenario.outside,
        "loss": one.scenario.loss,
        "quorum": one.settings.quorum,
        "runs": one.runs,
        "seed": one.seed,
        "wrong": [number(value) for value in one.wrong],
        "stopped": [number(value) for value in one.stopped],
        "needless": [number(value) for value in one.needless],
        "takeover_median_s": number(one.reaction),
        "takeover_95_s": number(one.slowest),
    }


def simulation_table(rows: Sequence[Row]) -> Iterator[list[Cell]]:
    """Yield a head and a row per scenario and number of autopilots."""
    names = ("wrong", "stopped", "needless")
    yield [
        "scenario",
        "autopilots",
        "runs",
        *(f"{name}{end}" for name in names for end in ("", "_low", "_high")),
        "takeover_median",
        "takeover_95",
    ]
    for row in rows:
        for one in row.outcomes:
            shares = (*one.wrong, *one.stopped, *one.needless)
            yield [
                row.name,
                one.scenario.autopilots,
                one.runs,
                *shares,
                one.reaction,
                one.slowest,
            ]
