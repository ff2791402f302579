"""What does a terminal say about an observer's residuals? The page of ``fdi observe``.

In: a log and its `Observation`. Out: parts for a console: which motor is weak or that nothing is
beyond, what went beyond its threshold and when, all thirteen residuals, and what was taken for
granted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from fdi.methods.observer import Observation
from fdi.methods.observer.states import UNITS
from fdi.report.observer_document import observer_document
from fdi.report.text import heading, table, text
from fdi.telemetry import Log

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

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
    residuals = observer_document(log, seen)["residuals"]
    yield from _verdict(seen, residuals)
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
    yield _table(residuals)
    if seen.notes:
        yield heading("Taken for granted")
    for note in seen.notes:
        yield text(f"  {note}")


def _verdict(seen: Observation, residuals: Sequence[Mapping[str, Any]]) -> Iterator[Text]:
    """Yield which residuals stayed beyond their thresholds, and which went beyond for a moment."""
    if not seen.alarms:
        yield text("No residual stays beyond what noise and the model explain.", "bold green")
    elif not seen.motors:
        names = ", ".join(dict.fromkeys(one.residual for one in seen.alarms))
        yield text(f"Beyond what noise and the model explain: {names}.", "bold yellow")
    brief = ", ".join(one["name"] for one in residuals if one["state"] == "briefly beyond")
    if brief:
        yield text(f"Only briefly beyond it, which accuses nothing: {brief}.")


def _table(residuals: Sequence[Mapping[str, Any]]) -> RenderableType:
    rows = table("residual", "centre", "deviation", "largest off", "of its threshold", "")
    for one in residuals:
        if one["largest"] is None:
            rows.add_row(text(one["name"]), "", "", "", "", text("no output, or never known"))
            continue
        rows.add_row(
            text(one["name"]),
            f"{one['centre']:.3g}",
            f"{one['deviation']:.2g}",
            f"{one['largest']:.3g} {one['unit']}",
            f"{one['largest_over_threshold']:.2f}",
            text("" if one["state"] == "within" else one["state"]),
        )
    return rows
