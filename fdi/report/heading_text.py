"""What does a terminal say about a cross-check of headings? The page of ``fdi heading``.

In: a log, its `HeadingCheck` and, where there is one, a `Recovery`. Out: parts for a console: who
is off and since when, all sources with their deviation or why they are absent, the pairs, and what
was recovered.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from fdi.methods.heading import COMPONENTS, HeadingCheck, Recovery
from fdi.methods.heading.increments import GATE
from fdi.methods.heading.trees import UNDECIDED, UNRECOGNISED
from fdi.report.text import heading, table, text
from fdi.report.words import at, number, per_cent, plural
from fdi.telemetry import Log

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST: Final = 12
_SILENT: Final = {
    "satellite": "The receiver has no fix, or tells none,",
    "magnetometer": "The compass tells nothing",
}


def heading_summary(
    log: Log, check: HeadingCheck, recovery: Recovery | None
) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a cross-check of headings."""
    ride = check.ride
    yield text(log.name, "bold")
    yield text(
        f"flight {ride.flight + 1} of {len(log.flights)}, in the air from {at(ride.air[0])} to "
        f"{at(ride.air[1])} s; {plural(len(check.t), 'cycle')} of {ride.cycle:.2g} s"
    )
    yield from _verdict(check)
    yield from _sources(check)
    yield from _pairs(check)
    if recovery is not None:
        yield from _recovered(recovery)


def _verdict(check: HeadingCheck) -> Iterator[RenderableType]:
    accused = check.accused
    if accused is None:
        is_judged = any(one not in (UNDECIDED, UNRECOGNISED) for one in check.verdicts)
        why = "nobody is off alone" if is_judged else "no cycle could be judged"
        yield text(f"No block is named: {why}.", "bold")
    else:
        component = COMPONENTS[accused.block]
        yield text(
            f"{component} ({accused.block}) since {at(accused.start)} s, by "
            f"{', '.join(accused.by)}",
            "bold red",
        )
    for block, spans in check.ride.lost.items():
        for low, high in spans[:MOST]:
            yield text(f"{_SILENT[block]} from {at(low)} to {at(high)} s.")
    if check.named:
        yield heading("Named, cycle by cycle")
        made = table("from s", "to s", "block", "by", "")
        for one in check.named[:MOST]:
            late = "after another one: may follow from it" if one.is_late else ""
            made.add_row(
                text(at(one.start)),
                text(at(one.end)),
                text(one.block),
                text(", ".join(one.by)),
                text(late, "dim"),
            )
        yield made
        if len(check.named) > MOST:
            yield text(f"  and {len(check.named) - MOST} more, see --json", "dim")
    counts = Counter(check.verdicts)
    open_to = sorted(set().union(*check.possible) - {one.block for one in check.named})
    unsure = counts[UNDECIDED] + counts[UNRECOGNISED]
    if unsure and check.t.size:
        whom = f": still possible are {', '.join(open_to)}" if open_to else ""
        yield text(f"Not decided in {per_cent(unsure / check.t.size)} of the cycles{whom}.")


def _sources(check: HeadingCheck) -> Iterator[RenderableType]:
    yield heading("Headings")
    made = table("source", "known", "sigma, deg", "")
    for column in made.columns[1:3]:
        column.justify = "right"
    for one in check.sources.values():
        known = np.isfinite(one.heading)
        if one.absent:
            made.add_row(text(one.name), text("–"), text("–"), text(f"absent: {one.absent}", "dim"))
            continue
        sigma = number(float(np.degrees(np.median(one.sigma[known]))), 2)
        made.add_row(text(one.name), text(per_cent(float(known.mean()))), text(sigma), text(""))
    yield made


def _pairs(check: HeadingCheck) -> Iterator[RenderableType]:
    yield heading(f"Increments, the largest in deviations (limit {GATE:g})")
    made = table("pair", "of", "largest", "beyond")
    for column in made.columns[2:4]:
        column.justify = "right"
    for one in check.pairs:
        apart = np.abs(one.off) / one.sigma
        if not np.isfinite(apart).any():
            made.add_row(text(one.name), text(one.kind), text("–"), text("not in this log"))
            continue
        beyond = per_cent(float(np.nanmean(one.disagrees)))
        largest = number(float(np.nanmax(apart)), 2)
        made.add_row(text(one.name), text(one.kind), text(largest), text(beyond))
    yield made


def _recovered(one: Recovery) -> Iterator[RenderableType]:
    yield heading(f"Recovered: {one.block}")
    yield text(
        f"  from {at(one.start)} to {at(one.end)} s by {', '.join(sorted(set(one.method)))}; "
        f"{one.ended}"
    )
    for name, values in one.columns.items():
        if name.startswith("sigma_"):
            yield text(f"  {name} at the end: {number(float(values[-1]), 3)}")
