"""What does a terminal say about a log? The page of ``fdi info``.

In: a log. Out: parts for a console: what it is, its flights, what happened, what was recorded at
which rate, and what was lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from fdi.report.log_document import rate
from fdi.report.text import heading, quality_line, table, text
from fdi.report.timeline import is_grave, told_events
from fdi.report.words import at, number, plural, size, span
from fdi.telemetry import Event, Log

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

MOST_EVENTS: Final = 60
MOST_QUALITY: Final = 20


def log_summary(log: Log) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a log."""
    yield text(log.name, "bold")
    yield from _head(log)
    yield from _flights(log)
    yield from _events(log)
    yield heading(f"{plural(len(log.messages), 'message')} recorded")
    yield _messages(log)
    yield from _quality(log)


def _head(log: Log) -> Iterator[RenderableType]:
    known = [log.vehicle, log.autopilot, log.firmware]
    start = log.clock.utc(0.0)
    boot = log.clock.boot(0.0)
    rows = [
        ("file", f"{log.format}, {size(log.bytes)}, sha256 {log.sha256[:16]}…"),
        ("vehicle", ", ".join(item for item in known if item) + f" (system {log.system_id})"),
        ("start", f"{start} (clock of the {log.clock.utc_source})" if start else "UTC not known"),
        ("length", f"{log.duration:.1f} s" + _since_boot(boot)),
        ("parameters", str(len(log.parameters)) if log.parameters else "none in the log"),
    ]
    others = [source for source in log.sources if not source.chosen]
    if others:
        told = ", ".join(f"{s.system}/{s.component} ({s.frames} frames)" for s in others[:6])
        rows.append(("also heard", told + (" …" if len(others) > 6 else "")))
    for name, value in rows:
        yield text(f"  {name:<11} {value}")


def _since_boot(boot: float | None) -> str:
    if boot is None:
        return ", time since boot not known"
    return f", begins {span(boot)} {'after' if boot >= 0 else 'before'} boot"


def _flights(log: Log) -> Iterator[RenderableType]:
    yield heading(plural(len(log.flights), "flight"))
    if not log.flights:
        yield text("  the vehicle was never seen to fly or to be armed")
        return
    made = table("#", "from s", "to s", "take-off", "landing", "impact", "in the air")
    for count, flight in enumerate(log.flights, 1):
        low, high = flight.airborne
        times = (flight.start, flight.end, flight.takeoff, flight.landing, flight.impact)
        shown = [at(t) for t in times]
        if flight.impact is not None and flight.impact_speed is not None:
            shown[4] += f" ({flight.impact_speed:.1f} m/s)"
        made.add_row(str(count), *map(text, shown), text(span(high - low) if flight.flew else "–"))
    yield made


def _events(log: Log) -> Iterator[RenderableType]:
    told = told_events(log)
    changed = sum(event.kind == "parameter" for event in log.events)
    if not told:
        return
    yield heading("What happened")
    yield _event_table(told[:MOST_EVENTS])
    more = len(told) - MOST_EVENTS
    if more > 0:
        yield text(f"  and {plural(more, 'further event')}, see --json", "dim")
    if changed:
        yield text(f"  {plural(changed, 'change')} of parameters not shown, see --json", "dim")


def _event_table(events: Sequence[Event]) -> Table:
    made = table("s", "what", "")
    made.columns[0].justify = "right"
    for event in events:
        style = "red" if is_grave(event) else ""
        made.add_row(text(at(event.t)), text(event.kind), text(event.text, style))
    return made


def _messages(log: Log) -> Table:
    made = table("message", "records", "Hz", "fields", "from s", "to s")
    for column in made.columns[1:]:
        column.justify = "right"
    for key, message in log.messages.items():
        ends = [at(float(message.t[i])) for i in (0, -1)] if len(message) else ["–", "–"]
        made.add_row(
            text(key),
            text(len(message)),
            text(number(rate(message), 3)),
            text(len(message.fields)),
            *map(text, ends),
        )
    return made


def _quality(log: Log) -> Iterator[RenderableType]:
    yield heading("The data")
    if not log.quality:
        yield text("  nothing lost, nothing repaired")
    for record in log.quality[:MOST_QUALITY]:
        yield text(f"  {record.kind}: {quality_line(record)}")
    if len(log.quality) > MOST_QUALITY:
        yield text(f"  and {len(log.quality) - MOST_QUALITY} more, see --json", "dim")
