"""What does a terminal say about a log? The page of ``fdi info``.

In: a log. Out: parts for a console: what it is, its flights, what happened, what was recorded at
which rate, and what was lost. Instances that came alike share a row; messages that only say again
in MAVLink's words what the log holds under its own names stand apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Final

from fdi.report.log_document import rate
from fdi.report.text import heading, quality_line, table, text
from fdi.report.timeline import Told, is_grave, told_events, told_text
from fdi.report.words import at, flown, number, plural, size, span, used
from fdi.telemetry import Log, Message
from fdi.units import hundredths

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

MOST_EVENTS: Final = 60
MOST_QUALITY: Final = 20
MOST_STRETCHES: Final = 24
MOST_SENDERS: Final = 6
ALIKE: Final = 0.01
"""Share of records by which instances may differ that are told in one row."""
FORMATS: Final = {
    "tlog": "MAVLink telemetry log",
    "dataflash": "DataFlash log",
    "dataflash_text": "DataFlash log in text form",
    "table": "table of columns",
    "ulog": "ULog",
}
UTC_SOURCES: Final = {"vehicle": "the vehicle's", "recorder": "the recorder's"}


def log_summary(log: Log) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a log."""
    yield text(log.name, "bold")
    yield from _head(log)
    yield from _flights(log)
    yield from _stretches(log)
    yield from _inputs(log)
    yield from _events(log)
    yield from _messages(log)
    yield from _quality(log)


def _head(log: Log) -> Iterator[RenderableType]:
    known = [log.vehicle, log.autopilot, log.firmware, f"system {log.system_id}"]
    start = log.clock.utc(0.0)
    clock = UTC_SOURCES.get(log.clock.utc_source, "unknown")
    changes = len(log.parameter_changes)
    formats = " + ".join(FORMATS[one.format] for one in log.recordings) or FORMATS[log.format]
    rows = [
        ("file", f"{formats}, {size(log.bytes)}, sha256 {log.sha256[:16]}…"),
        ("vehicle", ", ".join(item for item in known if item)),
        (
            "start",
            f"{start[:10]} {start[11:-1]} UTC, by {clock} clock" if start else "UTC not known",
        ),
        ("length", span(log.duration) + _since_boot(log.clock.boot(0.0))),
        (
            "parameters",
            f"{len(log.parameters) or 'none'}"
            + (f", {plural(changes, 'change')} later" if changes else "")
            + (f", {len(log.altered)} unlike the firmware's default" if log.defaults else ""),
        ),
    ]
    others = [source for source in log.sources if not source.chosen]
    if others:
        told = ", ".join(
            f"{s.vehicle or 'sender'} {s.system}/{s.component} ({plural(s.frames, 'frame')})"
            for s in others[:MOST_SENDERS]
        )
        rows.append(("also heard", told + (" …" if len(others) > MOST_SENDERS else "")))
    if log.other_vehicles:
        told = ", ".join(f"--system {s.system}" for s in log.other_vehicles[:MOST_SENDERS])
        rows.append(("", f"another vehicle is taken with {told}"))
    yield _pairs(rows)


def _pairs(rows: Sequence[tuple[str, str]]) -> Table:
    """Return names and what is said about each, in two columns without a frame."""
    from rich.table import Table

    made = Table.grid(padding=(0, 2))
    made.add_column(no_wrap=True)
    made.add_column(overflow="fold")
    for name, value in rows:
        made.add_row(text(f"  {name}"), text(value))
    return made


def _since_boot(boot: float | None) -> str:
    if boot is None:
        return ", time since boot not known"
    return f", begins {span(boot)} {'after' if boot >= 0 else 'before'} boot"


def _flights(log: Log) -> Iterator[RenderableType]:
    yield heading(flown(log.flights).capitalize())
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


def _stretches(log: Log) -> Iterator[RenderableType]:
    found = log.stretches
    if not found:
        return
    yield heading("What the vehicle did")
    made = table("from s", "to s", "", "sure")
    for one in found[:MOST_STRETCHES]:
        made.add_row(at(one.start), at(one.end), text(one.what), f"{hundredths(one.sure)} %")
    yield made
    if len(found) > MOST_STRETCHES:
        yield text(
            f"  and {plural(len(found) - MOST_STRETCHES, 'further stretch')}, see --json", "dim"
        )


def _events(log: Log) -> Iterator[RenderableType]:
    told, more = told_events(log, MOST_EVENTS)
    if not told:
        return
    yield heading("What happened")
    yield _event_table(told)
    if more > 0:
        yield text(f"  and {plural(more, 'further event')}, see --json", "dim")


def _event_table(events: Sequence[Told]) -> Table:
    made = table("s", "what", "")
    made.columns[0].justify = "right"
    for event, times, last in events:
        style = "red" if is_grave(event) else ""
        line = told_text(event, times, last)
        made.add_row(text(at(event.t)), text(event.kind), text(line, style))
    return made


def _messages(log: Log) -> Iterator[RenderableType]:
    from rich.padding import Padding

    own = [message for message in log.messages.values() if message.made_from is None]
    yield heading(plural(len(own), "message"))
    made = table("message", "records", "Hz", "fields", "from s", "to s")
    for column in made.columns[1:]:
        column.justify = "right"
    for _, instances in groupby(own, key=lambda message: message.name):
        for alike in _alike(list(instances)):
            first = alike[0]
            ends = [at(float(first.t[i])) for i in (0, -1)] if len(first) else ["–", "–"]
            made.add_row(
                text(_title(alike)),
                text(len(first)),
                text(number(rate(first), 3)),
                text(len(first.fields)),
                *map(text, ends),
            )
    yield made
    again = [message for message in log.messages.values() if message.made_from is not None]
    if again:
        yield heading("The same in MAVLink's words, from which message; models use these names")
        yield Padding(text(", ".join(f"{m.key} ({m.made_from})" for m in again)), (0, 0, 0, 2))


def _alike(instances: list[Message]) -> Iterator[list[Message]]:
    """Yield the instances of one message, those together that have as many fields and records."""
    while instances:
        first = instances[0]
        share = [
            m
            for m in instances
            if len(m.fields) == len(first.fields)
            and abs(len(m) - len(first)) <= ALIKE * len(first) + 1
        ]
        yield share
        instances = [m for m in instances if m not in share]


def _title(alike: Sequence[Message]) -> str:
    """Return the key of a message, or the keys of several of its instances in one.

    Examples
    --------
    ``BARO``, ``BARO[1]``, ``BARO[0-2]``, ``BARO[0,2]``
    """
    if len(alike) == 1:
        return alike[0].key
    numbers = [message.instance or 0 for message in alike]
    is_run = numbers == list(range(numbers[0], numbers[-1] + 1))
    shown = f"{numbers[0]}-{numbers[-1]}" if is_run else ",".join(map(str, numbers))
    return f"{alike[0].name}[{shown}]"


def _inputs(log: Log) -> Iterator[RenderableType]:
    if log.inputs:
        yield heading("What tests read: is it what its name says?")
        yield _pairs([(one.name, used(one)) for one in log.inputs])


def _quality(log: Log) -> Iterator[RenderableType]:
    yield heading("The data")
    if not log.quality:
        yield text("  nothing lost, nothing repaired")
        return
    yield _pairs([(record.kind, quality_line(record)) for record in log.quality[:MOST_QUALITY]])
    if len(log.quality) > MOST_QUALITY:
        yield text(f"  and {len(log.quality) - MOST_QUALITY} more, see --json", "dim")
