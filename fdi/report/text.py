"""What does a terminal say about an analysis?

In: an analysis. Out: text of a given width, in colour only where a terminal shows it. The answer
comes first, then what speaks for it, what follows from it, what is ruled out, what could not be
tested, and how good the data are.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fdi.diagnosis import Finding, NotTestable, Open, Outlook, RuledOut
from fdi.diagnosis.ending import BEFORE_S, went_wrong
from fdi.diagnosis.worth import worth_of
from fdi.model.naming import component_words, inside
from fdi.report.advice_text import first_steps
from fdi.report.stood_out import TITLE as STOOD_OUT
from fdi.report.stood_out import stood_out_lines
from fdi.report.words import (
    accuracies,
    at,
    budget,
    clean,
    copied,
    flown,
    into_flight,
    latencies,
    log_time,
    per_cent,
    plural,
    shortened,
    size,
    used,
    window,
)
from fdi.residuals.accuracy import reported_accuracies
from fdi.residuals.departed import departed
from fdi.result import Analysis
from fdi.telemetry.ordered import order_words

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

WIDTH: Final = 100
MOST_FINDINGS: Final = 20
PAGE: Final = "report.html"
STYLES: Final[Mapping[Outlook, str]] = {
    "accused": "bold red",
    "ended badly": "bold red",
    "suspected": "bold yellow",
    "alarms": "bold yellow",
    "healthy": "bold green",
    "untested": "bold",
}
MOST_LINES: Final = 8
"""Of a list that the report holds whole."""
FEW: Final = 4
"""Of one that --verbose shows too."""
MOST_SHOWN: Final = 40
"""Lines that a terminal shows of an answer unasked."""


def summary(analysis: Analysis, *, width: int = WIDTH, folder: Path | None = None) -> str:
    """Return the summary as plain text.

    Parameters
    ----------
    analysis : Analysis
    width : int
        Letters on a line.
    folder : Path, optional
        Where the report was written.
    """
    return plain(parts(analysis, folder), width=width)


def plain(shown: Iterable[RenderableType], *, width: int = WIDTH) -> str:
    """Return parts for a console as plain text, so many letters on a line."""
    from rich.console import Console

    out = io.StringIO()
    console = Console(
        file=out,
        width=width,
        color_system=None,
        force_terminal=False,
        force_jupyter=False,
        emoji=False,
    )
    for part in shown:
        console.print(part, highlight=False)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def print_summary(analysis: Analysis, console: Console, *, folder: Path | None = None) -> None:
    """Print the summary on a console of rich, which knows whether it may use colour."""
    for part in parts(analysis, folder):
        console.print(part, highlight=False)


def text(content: object, style: str = "") -> Text:
    """Return foreign text for rich: cleaned, and never read as markup."""
    from rich.text import Text

    return Text(clean(content), style=style)


def heading(title: str) -> Text:
    """Return the heading of a section, with a blank line before it."""
    from rich.text import Text

    return Text("\n" + clean(title), style="bold")


def table(*columns: str) -> Table:
    """Return an empty table in the style of the house."""
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1))
    for name in columns:
        made.add_column(text(name), overflow="fold")
    return made


def parts(
    analysis: Analysis, folder: Path | None = None, *, warned: bool = False
) -> Iterator[RenderableType]:
    """Yield all parts of the summary, for a console of rich: the answer first.

    Parameters
    ----------
    analysis : Analysis
    folder : Path, optional
        Where the report was written: whoever reads on a terminal is told that last.
    warned : bool
        The warnings were told elsewhere.
    """
    yield from _verdict(analysis)
    yield from _list("What to do", first_steps(analysis, analysis.setup))
    yield from _list(STOOD_OUT, stood_out_lines(analysis))
    yield from _first(analysis)
    yield from _ordered(analysis)
    yield from _findings(analysis)
    yield from _departed(analysis)
    yield from _consequences(analysis)
    yield from _methods(analysis)
    yield from _together(analysis)
    yield from _ruled_out(analysis)
    yield from _not_testable(analysis)
    yield from _left_open(analysis)
    yield from _data(analysis)
    if not warned:
        yield from _list("Warnings", analysis.warnings)
    yield text("")
    yield from _origin(analysis)
    yield from _written(folder)


def brief(analysis: Analysis, folder: Path | None = None) -> Iterator[RenderableType]:
    """Yield what a person reads first, in at most `MOST_SHOWN` lines of 100 letters.

    Parameters
    ----------
    analysis : Analysis
    folder : Path, optional
        Where the report was written.
    """
    yield from _verdict(analysis)
    yield from _list("What to do", first_steps(analysis, analysis.setup))
    yield from _list(STOOD_OUT, stood_out_lines(analysis), FEW)
    yield from _first(analysis, FEW)
    yield from _ordered(analysis, FEW)
    yield from _also(analysis)
    yield from _departed(analysis)
    yield text("")
    if analysis.findings:
        yield _indented(worth_of(analysis.airframe), 0, "dim")
    yield from _counted(analysis)
    yield text("")
    yield from _origin(analysis)
    yield from _damage(analysis)
    yield from _written(folder)


def _verdict(analysis: Analysis) -> Iterator[RenderableType]:
    yield text(analysis.verdict, STYLES[analysis.diagnosis.outlook])


def _written(folder: Path | None) -> Iterator[RenderableType]:
    if folder is None:
        return
    yield text(f"Report: {folder}/")
    if (folder / PAGE).is_file():
        yield text(f"open {folder}/{PAGE} in a browser; it needs no network (--open opens it)")


def _also(analysis: Analysis) -> Iterator[RenderableType]:
    """Yield who is accused beside the first, a line each."""
    rest = analysis.findings[1:]
    if not rest:
        return
    components = analysis.system.components
    yield heading("Also accused")
    for finding in rest[:FEW]:
        name = component_words(finding.component, components)
        yield _indented(f"{name} ({per_cent(finding.confidence)} sure), {onset(finding, analysis)}")
    if len(rest) > FEW:
        yield text(f"  and {len(rest) - FEW} more", "dim")


def _counted(analysis: Analysis) -> Iterator[RenderableType]:
    """Yield who is ruled out, by name, and how many are not, in a line each."""
    components = analysis.system.components
    diagnosis = analysis.diagnosis

    def names(items: Iterable[str], most: int) -> str:
        return shortened([inside(component_words(name, components)) for name in items], most)

    if diagnosis.ruled_out:
        yield text(f"Ruled out: {names((o.component for o in diagnosis.ruled_out), MOST_LINES)}.")
    if diagnosis.not_testable:
        untold = names((o.component for o in diagnosis.not_testable), FEW)
        yield text(f"Not testable with this telemetry: {untold}.")
    if diagnosis.open:
        yield text(f"Neither accused nor cleared: {plural(len(diagnosis.open), 'part')}.")
    yield text("Why, and all the rest: --verbose, or the report.", "dim")


def _departed(analysis: Analysis) -> Iterator[RenderableType]:
    found = departed(analysis.residual_values)
    if found is not None:
        yield from _list("Unlike the flights that the policy was learned from", [found.text])


def _origin(analysis: Analysis) -> Iterator[RenderableType]:
    log = analysis.log
    formats = " + ".join(one.format for one in log.recordings) or log.format
    about = [formats, size(log.bytes), log.vehicle, log.autopilot, log.firmware or ""]
    yield text(log.name, "bold")
    yield text(
        f"{', '.join(item for item in about if item)}; {log.duration:.1f} s, {flown(log.flights)}"
    )
    tests = plural(len(analysis.bank.generators), "test")
    yield text(
        f"fdi {analysis.version}, model {analysis.airframe.name}, "
        f"policy {analysis.policy.name}{window(analysis)}, {tests}{budget(analysis)}"
    )


def _damage(analysis: Analysis) -> Iterator[RenderableType]:
    """Yield in one sentence what was lost or repaired, of the whole log first."""
    for one in analysis.log.inputs:
        if one.believed is False:
            yield text(f"The {one.name} of this log, {used(one)}")
    records = sorted(analysis.log.quality, key=lambda record: record.channel is not None)
    if records:
        told = shortened([quality_line(record) for record in records], 1)
        yield text(f"The data are not whole: {told}")


def _findings(analysis: Analysis) -> Iterator[RenderableType]:
    if not analysis.findings:
        return
    yield heading("Accused, what led to a bad end first, then by time (how sure, and since when)")
    for finding in analysis.findings[:MOST_FINDINGS]:
        yield _line(finding, analysis)
        yield _indented(said(finding), 5)
    left = len(analysis.findings) - MOST_FINDINGS
    if left > 0:
        yield text(f"  and {plural(left, 'further finding')}, see the report")
    yield _indented(worth_of(analysis.airframe), style="dim")


def _line(finding: Finding, analysis: Analysis) -> RenderableType:
    """Return who is accused, since when, and how sure that is, with its parts in columns."""
    from rich.table import Table

    names = [len(other.component) for other in analysis.findings[:MOST_FINDINGS]]
    made = Table.grid(padding=(0, 2))
    made.add_column(width=3, justify="right")
    made.add_column(width=min(max(names), 28), overflow="fold")
    made.add_column(width=5, justify="right")
    made.add_column(overflow="fold")
    made.add_row(
        text(finding.rank),
        text(finding.component, "bold"),
        text(per_cent(finding.confidence)),
        text(onset(finding, analysis)),
    )
    return made


def onset(finding: Finding, analysis: Analysis) -> str:
    """Return when a finding began, as a person tells it and on the clocks."""
    when = into_flight(finding.onset, analysis.log, finding.flight)
    clock = log_time(finding.onset, analysis.log)
    return clock if when.endswith("into the log") else f"{when} ({clock})"


def said(finding: Finding) -> str:
    """Return what speaks for a finding, and what explains the same alarms as well."""
    twins = (
        f"; cannot be told from {', '.join(finding.inseparable_from)}"
        if finding.inseparable_from
        else ""
    )
    return finding.evidence.text + twins + earlier_words(finding)


def earlier_words(finding: Finding) -> str:
    """Return when the same had shown before and healed, "" where it had not."""
    if not finding.earlier:
        return ""
    start, end = finding.earlier[0]
    others = len(finding.earlier) - 1
    more = f" and {plural(others, 'more time')}" if others else ""
    return f"; so it did before, from log {at(start)} s to {at(end)} s{more}"


def _consequences(analysis: Analysis) -> Iterator[RenderableType]:
    yield from _list(
        "What follows from it",
        [f"{item.text} (log {at(item.onset)} s)" for item in analysis.diagnosis.consequences],
    )


def _together(analysis: Analysis) -> Iterator[RenderableType]:
    for item in analysis.diagnosis.together:
        lines = [" and ".join(one) for one in item.diagnoses]
        count = len(analysis.log.flights)
        where = f" of flight {item.flight + 1} of {count}" if count > 1 else ""
        yield from _list(
            f"What would explain all {plural(item.tests, 'test')} in alarm{where}, likely or not",
            lines,
        )


def _ruled_out(analysis: Analysis) -> Iterator[RenderableType]:
    yield from _list(
        "Ruled out: what would have shown did not",
        _by_reason(analysis.diagnosis.ruled_out, analysis),
        most=len(analysis.diagnosis.ruled_out),
    )


def _first(analysis: Analysis, most: int = MOST_LINES) -> Iterator[RenderableType]:
    for ending in analysis.diagnosis.endings:
        if ending.first:
            lines = [f"log {at(one.at)} s  {one.kind}: {one.text}" for one in ending.first]
            moment = went_wrong(ending.end)
            title = f"What happened in the last seconds before log {at(moment)} s"
            if ending.first[0].at < moment - BEFORE_S:
                title += ", and what stood since before"
            yield from _list(title, lines, most)


def _ordered(analysis: Analysis, most: int = MOST_LINES) -> Iterator[RenderableType]:
    """Yield who ordered what led to an end, where it is more than the mode that was flown in."""
    count = len(analysis.log.flights)
    for end in (ending.end for ending in analysis.diagnosis.endings):
        if len(end.chain) > 1:
            of = f" (flight {end.flight + 1} of {count})" if count > 1 else ""
            lines = [f"log {at(one.t)} s  {order_words(one)}" for one in end.chain[-most:]]
            yield from _list(f"Who ordered what was in force at the end{of}", lines)


def _not_testable(analysis: Analysis) -> Iterator[RenderableType]:
    found = analysis.diagnosis.not_testable
    yield from _list("Not testable with this telemetry", _by_reason(found, analysis))


def _by_reason(parts: Iterable[Open | NotTestable | RuledOut], analysis: Analysis) -> list[str]:
    """Return one line for all parts of which the same is said."""
    components = analysis.system.components
    reasons: dict[str, list[str]] = {}
    for item in parts:
        name = inside(component_words(item.component, components))
        reasons.setdefault(item.text, []).append(name)
    return [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]


def _methods(analysis: Analysis) -> Iterator[RenderableType]:
    told = list(dict.fromkeys(one.text for one in analysis.diagnosis.methods))
    yield from _list("Methods beside the tests of the model", told, most=len(told))
    if analysis.estimator is None:
        return
    where, found = looked_at(analysis), analysis.estimator.findings
    lines = [f"{at(one.t)} s  {one.text}" for one in found if not one.is_late]
    late = len(found) - len(lines)
    if not lines and (late or where):
        lines = ["nothing before the vehicle was upset" if late else "nothing"]
    yield from _list(
        f"What the autopilot's own estimator noticed{where} (more: fdi estimator)", lines
    )
    if late:
        yield text(f"  and {plural(late, 'consequence')} after the vehicle was upset", "dim")


def looked_at(analysis: Analysis) -> str:
    """Return which flight the estimator's findings are of, where a log has several."""
    health, count = analysis.estimator, len(analysis.log.flights)
    if health is None or health.flight is None or count < 2:
        return ""
    return f" in flight {health.flight + 1} of {count}, the only one looked at"


def _left_open(analysis: Analysis) -> Iterator[RenderableType]:
    found = _by_reason(analysis.diagnosis.open, analysis)
    yield from _list("Open: neither accused nor cleared", found, most=len(found))


def _data(analysis: Analysis) -> Iterator[RenderableType]:
    records = analysis.log.quality
    if records:
        kinds: dict[str, int] = {}
        for record in records:
            kinds[record.kind] = kinds.get(record.kind, 0) + 1
        told = ", ".join(f"{kind} {count}" for kind, count in kinds.items())
        yield from _list(f"The data ({told})", [quality_line(record) for record in records])
    else:
        yield heading("The data")
        yield text("  nothing lost, nothing repaired")
    inputs = [f"{one.name}: {used(one)}" for one in analysis.log.inputs]
    yield from _list("What tests read: is it what its name says?", inputs)
    yield from _list("Channels that repeat another, not counted", copied(analysis.system))
    yield from _list("Latencies, by the log", latencies(analysis.lags))
    reported = accuracies(reported_accuracies(analysis.system, analysis.signals))
    yield from _list("Accuracies that the log reports, worse than stated", reported)


def quality_line(record: object) -> str:
    """Return a finding about the data on one line."""
    channel, start = getattr(record, "channel", None), getattr(record, "start", None)
    where = f"{channel}: " if channel else ""
    when = f" (log {at(start)} s)" if start is not None else ""
    return f"{where}{getattr(record, 'text', '')}{when}"


def _indented(line: str, by: int = 2, style: str = "") -> RenderableType:
    from rich.padding import Padding

    return Padding(text(line, style), (0, 0, 0, by), expand=False)


def _list(title: str, lines: Sequence[str], most: int = MOST_LINES) -> Iterator[RenderableType]:
    if not lines:
        return
    yield heading(title)
    for line in lines[:most]:
        yield _indented(line)
    if len(lines) > most:
        yield text(f"  and {len(lines) - most} more", "dim")
