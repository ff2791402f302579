"""What do votes look like over time?

In: a `Voting`. Out: a matplotlib figure: for every autopilot a row with whom it votes for and rows
with the priorities that it gives; above them the flags that it blames, below who is in charge.
Every bar carries its number, so that nothing hangs on colour alone; take-off, onset, first sign and
take-over stand as lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from fdi.methods.voting import Voting
from fdi.methods.voting.voting import Voter
from fdi.report.style import (
    ACCENT,
    CURVES,
    FAINT,
    FONT,
    GRID,
    INK,
    label,
    levels,
    new_figure,
    styled,
    tidy,
)
from fdi.report.vote_rows import (
    Run,
    grouped_errors,
    pauses,
    runs,
    selected_runs,
    silent_runs,
    times,
    vote_runs,
)

ROW_HEIGHT: Final = 0.21  # inches
PRIORITY_SHADES: Final = ("#eef2f6", "#b8c2cc", "#52606d")
"""Light for the best; of more than three priorities the last shade stands for all further ones."""
DARK: Final = {"#52606d"}
NARROW: Final = 0.012
"""Share of the width below which a bar has no room for its number."""
LONGEST_NAME: Final = 56
LETTER: Final = 0.0085
"""Width of a letter as a share of the plot's width."""
MOST_LEVELS: Final = 3.4
"""Lines of names above the plot that the title leaves room for."""
PALE: Final = "#f5f7fa"
HATCH: Final = "/////"


class _Bar(NamedTuple):
    start: float
    end: float
    colour: str
    text: str
    hatch: str = ""


class _Row(NamedTuple):
    name: str
    bars: list[_Bar]
    begins_group: bool = False


def vote_figure(found: Voting) -> Any:
    """Return votes, priorities and blamed flags over time as a figure."""
    rows = _rows(found)
    with styled():
        figure = new_figure(11.0, 1.5 + ROW_HEIGHT * len(rows))
        axes = figure.subplots()
        low, high = _extent(found)
        for place, row in enumerate(rows):
            if row.begins_group:
                axes.axhline(place - 0.5, color=FAINT, linewidth=0.8, zorder=0)
            _draw(axes, place, row.bars, high - low)
        axes.set_yticks(range(len(rows)), [label(row.name, LONGEST_NAME) for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlim(low, high)
        axes.set_xlabel("s of the log's clock")
        tidy(axes)
        _lines(axes, found, low, high)
        axes.set_title(
            f"Votes of {label(', '.join(one.name for one in found.logs), 60)}", pad=18 + FONT
        )
        _legend(axes, found)
    return figure


def _rows(found: Voting) -> list[_Row]:
    rows = [*_error_rows(found), *_silent_rows(found)]
    for voter in found.voters:
        who = f"autopilot {voter.number}" + (" (inferred)" if voter.witness.is_inferred else "")
        votes = [_coloured(run, found) for run in vote_runs(found, voter)]
        votes += [_Bar(start, end, PALE, "", HATCH) for start, end in pauses(found, voter)]
        rows.append(_Row(f"{who} votes for", votes, True))
        rows += [
            _Row(f"priority of {number}", _priorities(found, voter, place))
            for place, number in enumerate(found.numbers)
        ]
    rows.append(_Row("in charge", [_coloured(run, found) for run in selected_runs(found)], True))
    return rows


def _error_rows(found: Voting) -> list[_Row]:
    """Return a row per flag and who saw it bad; bars of one name stand in one row."""
    made: dict[str, _Row] = {}
    for row, voters in grouped_errors(found):
        bars = [_Bar(row.blamed_from, row.blamed_until, PALE, "", HATCH)]
        if row.counted_from is not None:
            end = _extent(found)[1] if row.counted_until is None else row.counted_until
            bars.append(_Bar(row.counted_from, end, ACCENT, ""))
        name = f"{row.flag.removeprefix('condition_')} of {row.autopilot}, {_seen_by(voters)}"
        made.setdefault(name, _Row(name, [])).bars.extend(bars)
    return list(made.values())


def _silent_rows(found: Voting) -> list[_Row]:
    seen: dict[tuple[int, tuple[Run, ...]], list[int]] = {}
    for voter in found.voters:
        for place, number in enumerate(found.numbers):
            silent = tuple(silent_runs(found, voter, place))
            if silent:
                seen.setdefault((number, silent), []).append(voter.number)
    return [
        _Row(
            f"{number} silent, {_seen_by(voters)}", [_Bar(r.start, r.end, INK, "") for r in silent]
        )
        for (number, silent), voters in seen.items()
    ]


def _seen_by(voters: Sequence[int]) -> str:
    return f"seen by {' '.join(map(str, voters))}"


def _coloured(run: Run, found: Voting) -> _Bar:
    place = found.numbers.index(run.value)
    return _Bar(run.start, run.end, CURVES[place % len(CURVES)], str(run.value))


def _priorities(found: Voting, voter: Voter, place: int) -> list[_Bar]:
    bars = []
    ranked = voter.replay.priorities[:, place]
    for run in runs(times(found, voter), ranked):
        shade = PRIORITY_SHADES[min(run.value, len(PRIORITY_SHADES)) - 1]
        bars.append(_Bar(run.start, run.end, shade, str(run.value)))
    return bars


def _draw(axes: Any, place: int, bars: Sequence[_Bar], width: float) -> None:
    axes.axhline(place + 0.5, color=GRID, linewidth=0.5, zorder=0)
    for bar in bars:
        axes.broken_barh(
            [(bar.start, bar.end - bar.start)],
            (place - 0.38, 0.76),
            facecolor=bar.colour,
            hatch=bar.hatch,
            linewidth=0,
            zorder=2,
        )
        if bar.text and bar.end - bar.start > NARROW * width:
            is_dark = bar.colour in CURVES or bar.colour in DARK
            axes.text(
                (bar.start + bar.end) / 2,
                place,
                bar.text,
                ha="center",
                va="center_baseline",
                fontsize=FONT - 1,
                color="white" if is_dark else INK,
                zorder=3,
            )


def _extent(found: Voting) -> tuple[float, float]:
    ends = [times(found, voter)[[0, -1]] for voter in found.voters]
    low, high = min(float(t[0]) for t in ends), max(float(t[1]) for t in ends)
    return low, max(high, low + found.settings.cycle)


def _lines(axes: Any, found: Voting, low: float, high: float) -> None:
    """Draw the times of the reactions as lines, with their names above the plot."""
    marks: list[tuple[float, str, str]] = []
    if found.onset is not None:
        marks.append((found.onset, "onset", ACCENT))
    for one in found.reactions:
        if one.sign is not None:
            marks.append((found.seconds(one.sign), "first sign", INK))
        marks.append((found.seconds(one.detected), "first vote", INK))
        if one.takeover is not None:
            start, end = (found.seconds(at) for at in one.takeover)
            axes.axvspan(start, end, color="#fde68a", alpha=0.45, linewidth=0, zorder=1)
            marks.append((end, "taken over by here", "#92400e"))
    marks = sorted(mark for mark in marks if low <= mark[0] <= high)
    names = [f"{name} {t:.2f}" for t, name, _ in marks]
    places = [(t - low) / (high - low) for t, _, _ in marks]
    for mark, name, level in zip(marks, names, _levels(places, names), strict=True):
        axes.axvline(mark[0], color=mark[2], linestyle="--", linewidth=0.9, zorder=4)
        axes.annotate(
            name,
            (mark[0], 1.0),
            (2, 3 + level * (FONT + 1.5)),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=mark[2],
            fontsize=FONT - 0.5,
            annotation_clip=False,
        )


def _levels(places: Sequence[float], names: Sequence[str]) -> list[int]:
    """Return on which level above the plot each name stands, so that none overlaps another."""
    return levels(places, [LETTER * len(name) for name in names], 0.005)


def _legend(axes: Any, found: Voting) -> None:
    from matplotlib.patches import Patch

    handles = []
    if any(pauses(found, voter) for voter in found.voters):
        handles.append(Patch(facecolor=PALE, hatch=HATCH, label="no comparison"))
    if any(np.any(voter.replay.blamed) for voter in found.voters):
        handles.append(Patch(facecolor=PALE, hatch=HATCH, label="flag blamed"))
    if any(np.any(voter.replay.counted) for voter in found.voters):
        handles.append(Patch(color=ACCENT, label="counts as an error"))
    if any(np.any(voter.replay.silent) for voter in found.voters):
        handles.append(Patch(color=INK, label="silent"))
    if any(one.takeover is not None for one in found.reactions):
        handles.append(Patch(color="#fde68a", alpha=0.45, label="take-over falls in here"))
    if handles:
        axes.figure.legend(
            handles=handles,
            loc="outside lower right",
            ncols=len(handles),
            frameon=False,
            fontsize=FONT,
        )
