"""What does a terminal say about an observer's residuals? The page of ``fdi observe``.

In: a log and its `Observation`. Out: parts for a console: which motor is weak or that nothing is
beyond, what went beyond its threshold and when, all thirteen residuals, and what was taken for
granted.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from fdi.methods.observer import Observation
from fdi.methods.observer.states import UNITS
from fdi.report.observer_document import observer_document
from fdi.report.text import heading, table, text
from fdi.telemetry import Log

if TYPE_CHECKING:
    from rich.console import RenderableType

SAYS: Final = {
    **dict.fromkeys("xyz", "the position moves otherwise than the velocity says"),
    **dict.fromkeys(("vx", "vy", "vh"), "it speeds up otherwise than it leans"),
    "vz": "it climbs otherwise than its motors push",
    **dict.fromkeys("pqr", "it turns otherwise than its motors push"),
    **dict.fromkeys(("phi", "theta", "psi"), "the angle moves otherwise than the rates say"),
}
"""What a residual beyond its threshold means, by its equation."""


def observer_summary(log: Log, seen: Observation) -> Iterator[RenderableType]:
    """Yield what a terminal shows of an observer's residuals."""
    yield text(log.name, "bold")
    for one in seen.motors:
        yield text(
            f"Motor {one.number} gives less than it is asked for, {one.start:.1f} to "
            f"{one.end:.1f} s.",
            "bold red",
        )
    if not seen.alarms:
        yield text("No residual is beyond what noise and the model explain.", "bold green")
    elif not seen.motors:
        names = ", ".join(dict.fromkeys(one.residual for one in seen.alarms))
        yield text(f"Beyond what noise and the model explain: {names}.", "bold yellow")
    if seen.alarms:
        yield heading("Beyond their thresholds")
        rows = table("residual", "from s", "to s", "off by", "threshold", "that is")
        for alarm in seen.alarms:
            rows.add_row(
                text(alarm.residual),
                f"{alarm.start:.1f}",
                f"{alarm.end:.1f}",
                text(f"{alarm.peak:+.3g} {UNITS[alarm.residual]}"),
                f"{alarm.threshold:.3g}",
                text(SAYS[alarm.residual]),
            )
        yield rows
    yield heading(
        f"Thirteen residuals of flight {seen.flight + 1}, outputs of the {seen.rows.source}"
    )
    yield _table(log, seen)
    if seen.notes:
        yield heading("Taken for granted")
    for note in seen.notes:
        yield text(f"  {note}")


def _table(log: Log, seen: Observation) -> RenderableType:
    rows = table("residual", "centre", "deviation", "largest off", "of its threshold", "")
    for one in observer_document(log, seen)["residuals"]:
        if one["largest"] is None:
            rows.add_row(text(one["name"]), "", "", "", "", text("no output, or never known"))
            continue
        rows.add_row(
            text(one["name"]),
            f"{one['centre']:.3g}",
            f"{one['deviation']:.2g}",
            f"{one['largest']:.3g} {one['unit']}",
            f"{one['largest_over_threshold']:.2f}",
            "",
        )
    return rows
