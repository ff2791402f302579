"""What does a terminal say about votes? The page of ``fdi vote``.

In: a `Voting`, and the one with the preset where something was changed. Out: parts for a console:
whom each autopilot votes for and why, who is in charge, how it compares with the record, and how
long detection and take-over took, beside the figures of the thesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from fdi.methods.voting import PRESETS, Reaction, Settings, Voting
from fdi.methods.voting.reaction import THESIS
from fdi.report.text import heading, table, text
from fdi.report.vote_rows import (
    ErrorRow,
    Run,
    grouped_errors,
    reaction_times,
    selected_runs,
    vote_runs,
)
from fdi.report.words import clean, plural, shortened

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST_ERRORS: Final = 30
WORDS: Final = {
    "cycle": "cycle",
    "delay": "delay after take-off",
    "persistence": "persistence",
    "hold": "hold",
    "silence": "silence",
    "transport": "transport",
    "selection_hold": "selection hold",
}
"""The times of the settings, as a person reads them."""


def vote_summary(found: Voting, usual: Voting | None = None) -> Iterator[RenderableType]:
    """Yield what a terminal shows of votes.

    Parameters
    ----------
    found : Voting
    usual : Voting, optional
        The same with the unchanged preset, where ``found`` is a "what if".
    """
    yield text(", ".join(one.name for one in found.logs), "bold")
    yield text(rules_line(found.settings))
    if len(found.logs) > 1:
        shifts = ", ".join(f"{one.name} {one.offset:+.3f} s" for one in found.logs[1:])
        yield text(f"put on the clock of {found.logs[0].name}: {shifts}")
    if usual is not None:
        yield text(f"what if: {changed(found.settings)}", "yellow")
    yield text("")
    yield text(verdict(found), "bold")
    yield from _votes(found)
    yield from _errors(found)
    yield from _record(found)
    yield from _reactions(found, usual)
    if found.notes:
        yield heading("Notes")
        for line in found.notes:
            yield text(f"  {line}")


def rules_line(settings: Settings) -> str:
    """Return the parameters in a line."""
    parts = []
    for name, word in WORDS.items():
        value = getattr(settings, name)
        parts.append(f"{word} {'as recorded' if value is None else f'{value:g} s'}")
    count = plural(len(settings.flags), "flag")
    quorum = "" if settings.quorum is None else f", {settings.quorum} votes are enough"
    return f"rules {settings.name}: {count}, {', '.join(parts)}{quorum}"


def changed(settings: Settings) -> str:
    """Return what differs from the preset that the settings come from."""
    preset, parts = PRESETS[settings.name], []
    for name, word in WORDS.items():
        value = getattr(settings, name)
        if value != getattr(preset, name):
            parts.append(f"{word} {value:g} s")
    if settings.flags != preset.flags:
        less = [name for name in preset.flags if name not in settings.flags]
        more = [name for name in settings.flags if name not in preset.flags]
        parts += [f"with {name}" for name in more] + [f"without {name}" for name in less]
    if settings.quorum != preset.quorum:
        parts.append(f"{settings.quorum} votes are enough")
    if settings.age_from != preset.age_from:
        parts.append("silence from the reception")
    return ", ".join(parts) or "cycles that run freely"


def verdict(found: Voting) -> str:
    """Return in a sentence who was voted out and taken over."""
    if not found.reactions:
        first = vote_runs(found, found.voters[0])[0].value
        return f"Nobody is voted out: every autopilot votes for {first} to the end."
    lines = []
    for one in found.reactions:
        why = {"errors": "errors that lasted", "silence": "its silence"}[one.cause]
        voters = shortened([str(n) for n in sorted(change.voter for change in one.changes)], 8)
        line = f"Autopilot {one.pilot} is voted out for {why}: {voters} "
        line += f"{'vote' if len(one.changes) > 1 else 'votes'} for {one.to} "
        line += f"from {found.seconds(one.detected):.3f} s on"
        if one.takeover is None:
            line += f", which are too few of {len(found.voters)} to put {one.to} in charge."
        else:
            low, high = (found.seconds(at) for at in one.takeover)
            line += f"; {one.to} is in charge between {low:.3f} and {high:.3f} s."
        lines.append(line)
    return " ".join(lines)


def _votes(found: Voting) -> Iterator[RenderableType]:
    numbers = " ".join(str(number) for number in found.numbers)
    yield heading("What each autopilot concludes")
    made = table(
        "autopilot", "from", "votes for", f"errors {numbers}", f"priority {numbers}", "silent"
    )
    for voter in found.voters:
        last = voter.replay
        silent = np.array(found.numbers)[last.silent[-1]].tolist()
        made.add_row(
            text(voter.number),
            text("what others received" if voter.log is None else clean(voter.log)),
            text(_runs_text(vote_runs(found, voter))),
            text(" ".join(map(str, last.counters[-1].tolist()))),
            text(" ".join(map(str, last.priorities[-1].tolist()))),
            text(", ".join(map(str, silent)) or "–"),
        )
    selected = selected_runs(found)
    if selected:
        counts = f"counts every {found.settings.selection_hold:g} s"
        made.add_row(text("in charge"), text(counts), text(_runs_text(selected)))
    yield made
    yield text("  errors, priorities and silence as they are at the end; times in s", "dim")


def _runs_text(found: Sequence[Run]) -> str:
    return ", ".join(
        f"{run.value}" if i == 0 else f"{run.value} from {run.start:.3f}"
        for i, run in enumerate(found)
    )


def _errors(found: Voting) -> Iterator[RenderableType]:
    rows = grouped_errors(found)
    if not rows:
        yield heading("No flag of one autopilot is bad while another's is good")
        return
    yield heading("Flags that were bad while another's was good")
    made = table("autopilot", "flag", "blamed, s", "counts, s", "seen by")
    for row, voters in rows[:MOST_ERRORS]:
        made.add_row(
            text(row.autopilot),
            text(row.flag),
            text(f"{row.blamed_from:.3f} to {row.blamed_until:.3f}"),
            text(_counted_text(row)),
            text(" ".join(map(str, voters))),
        )
    yield made
    if len(rows) > MOST_ERRORS:
        yield text(f"  and {len(rows) - MOST_ERRORS} more, see --json", "dim")


def _counted_text(row: ErrorRow) -> str:
    if row.counted_from is None:
        return "never"
    until = "the end" if row.counted_until is None else f"{row.counted_until:.3f}"
    return f"{row.counted_from:.3f} to {until}"


def _record(found: Voting) -> Iterator[RenderableType]:
    compared = [voter for voter in found.voters if voter.differing is not None]
    if not compared:
        return
    yield heading("Beside what the logs' own voter wrote")
    made = table("autopilot", "cycles", "different", "in what")
    for voter in compared:
        differing = dict(voter.differing or {})
        total = differing.pop("any", 0)
        told = [f"{name} {count}" for name, count in differing.items() if count]
        made.add_row(
            text(voter.number), text(voter.replay.t.size), text(total), text(", ".join(told) or "–")
        )
    yield made


def _reactions(found: Voting, usual: Voting | None) -> Iterator[RenderableType]:
    if not found.reactions and not (usual and usual.reactions):
        return
    since = "the first sign" if found.onset is None else f"the onset at {found.onset:g} s"
    yield heading(f"Reaction, s after {since}")
    made = table("rules", "voted out", "detection", "at any phase", "take-over", "at any phase")
    for label, voting in (
        (("what if", found), (found.settings.name, usual))
        if usual
        else ((found.settings.name, found),)
    ):
        for one in voting.reactions:
            made.add_row(*map(text, reaction_cells(label, one)))
        if not voting.reactions:
            made.add_row(*map(text, (label, "nobody", "–", "–", "–", "–")))
    for cause, (detection, takeover) in THESIS.items():
        made.add_row(
            *(
                text(cell, "dim")
                for cell in ("thesis, table 6.1", cause, f"{detection:g}", "", f"{takeover:g}", "")
            )
        )
    yield made
    yield text(
        "  detection: the first vote that changes; take-over: the count of the votes that follows "
        f"the majority, up to {found.settings.selection_hold:g} s later; earlier: needlessly, "
        "before there was anything to react to",
        "dim",
    )


def reaction_cells(label: str, one: Reaction) -> tuple[str, ...]:
    """Return a reaction as the cells of a row."""
    found = reaction_times(one)
    return (
        label,
        f"{one.pilot}, {one.cause}",
        f"{found.detection:.2f}",
        _span(found.detection_range),
        _span(found.takeover) if found.takeover else "never",
        _span(found.takeover_range),
    )


def _span(found: tuple[float, float] | None) -> str:
    if found is None:
        return "–"
    low, high = (f"{t:.2f}" if t >= 0 else "earlier" for t in found)
    return low if low == high else f"{low} to {high}"
