"""Which core flew, when did the selector change it, and did it whip to and fro?

In: a log and its family. Out: `Selection`: changes with the reasons that the autopilot gave in
words, scores of the cores as logged and by the selector's own rule, and whipsaws.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.ratios import combined_ratio
from fdi.methods.estimator.records import Core, Family
from fdi.methods.estimator.spans import Span, largest
from fdi.telemetry import Log

Floats = NDArray[np.float64]

MANY: Final = 3
"""Changes of the selected core ..."""
MANY_S: Final = 30.0
"""... within this long are a whipsaw (choice: PX4's selector alone waits 10 s between changes)."""
RETURN_S: Final = 10.0
"""A selector that comes back to a core sooner broke its own waiting time: the other one failed."""
EXACT: Final = 1e-6
_TEXT: Final = re.compile(
    r"EKF primary changed: ?(\d+)|primary EKF changed (\d+) ?(?:\((.+?)\) )?-> ?(\d+)"
)
_REASON_S: Final = 0.5  # s between a record of the selector and the line that explains it
_FIELDS: Final = ("velocity", "horizontal position", "height")


@dataclass(frozen=True, slots=True)
class Change:
    """The selector took another core; ``before`` None: not in this log; ``reason`` as it said."""

    t: float
    before: int | None
    after: int
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """What the selector compares cores by, as logged, (n,) each, and by its rule from the ratios.

    ``combined``, ``relative``: as logged, NaN where the log has none; ``by_rule``: by the rule of
    the selector from the nearest record of the ratios. ``reproduced``: share of the logged scores
    that it gives within 1e-6 (ratios logged in hundredths: within their rounding), None without
    any: the selector compares at every update, and the log has five or ten a second.
    """

    core: int
    t: Floats
    combined: Floats
    relative: Floats
    by_rule: Floats
    reproduced: float | None

    def largest(self, window: Span) -> float | None:
        """Return the largest score in a window: as logged or, without any, by the rule."""
        known = self.combined if np.isfinite(self.combined).any() else self.by_rule
        return largest(self.t, known, window)


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """Which core flew.

    Attributes
    ----------
    source : str
        The channel or the texts by which it is known; "": not in this log.
    t, number : (n,) float, (n,) int
        The selected core at each record; empty where only texts tell of changes.
    changes : tuple of Change
    whipsaws : tuple of (from, to), s
    """

    source: str
    t: Floats
    number: NDArray[np.int64]
    changes: tuple[Change, ...]
    whipsaws: tuple[Span, ...]


def selection_of(log: Log, family: Family, armed: Span) -> Selection:
    """Return the selected core and its changes from arming to disarming."""
    source, t, number = _selected(log, family)
    said = [
        (e.t, found)
        for e in log.reported
        if e.kind == "text" and (found := _TEXT.search(e.text)) is not None
    ]
    if source:
        rows = np.flatnonzero(np.diff(number)) + 1
        changes = [
            _change(float(t[i]), int(number[i - 1]), int(number[i]), said) for i in rows.tolist()
        ]
    else:
        source = "texts" if said else ""
        changes = []
        for at, found in said:
            after = int(found[1] or found[4])
            before = int(found[2]) if found[2] else changes[-1].after if changes else None
            changes.append(Change(at, before, after, found[3] or ""))
    flown = tuple(change for change in changes if armed[0] <= change.t <= armed[1])
    return Selection(source, t, number, flown, whipsaws(flown))


def _selected(log: Log, family: Family) -> tuple[str, Floats, NDArray[np.int64]]:
    message, _, field = family.selected.partition(".")
    if not field or message not in log or field not in log[message]:
        return "", np.empty(0), np.empty(0, np.int64)
    values = log[message].si(field)
    known = np.isfinite(values)
    return family.selected, log[message].t[known], values[known].astype(np.int64)


def _change(
    t: float, before: int, after: int, said: Sequence[tuple[float, re.Match[str]]]
) -> Change:
    """Return a change with the reason of the line that tells of this very one."""
    pair = str(before), str(after)
    near = [found for at, found in said if abs(at - t) <= _REASON_S]
    reasons = [found[3] for found in near if found[3] and (found[2], found[4]) == pair]
    return Change(t, before, after, reasons[0] if reasons else "")


def whipsaws(changes: Sequence[Change]) -> tuple[Span, ...]:
    """Return where the selector whips: 3 changes in 30 s, or back to a core within 10 s."""
    found: list[Span] = []
    for i, change in enumerate(changes):
        soon = [c for c in changes[i:] if c.t - change.t <= MANY_S]
        if len(soon) >= MANY:
            found.append((change.t, soon[-1].t))
        back = [c for c in soon[1:] if c.after == change.before and c.t - change.t <= RETURN_S]
        if back:
            found.append((change.t, back[-1].t))
    made: list[Span] = []
    for low, high in sorted(found):
        if made and low <= made[-1][1]:
            made[-1] = made[-1][0], max(made[-1][1], high)
        else:
            made.append((low, high))
    return tuple(made)


def scores_of(log: Log, family: Family, cores: Sequence[Core]) -> tuple[Score, ...]:
    """Return the selector's scores of every core whose ratios the log has."""
    made = []
    for core in cores:
        own = log[core.source]
        fields = [family.ratios[q][0] for q in _FIELDS if q in family.ratios]
        if len(fields) == len(_FIELDS) and all(field in own for field in fields):
            ratios = np.array([own.si(field) for field in fields])
            made.append(_score(log, family, core, ratios))
    return tuple(made)


def _score(log: Log, family: Family, core: Core, ratios: Floats) -> Score:
    by_rule = combined_ratio(*ratios, squared=family.is_squared)
    combined = _channel(log, family.combined, core.number)
    relative = _channel(log, family.relative, core.number)
    if combined is None:
        unknown = np.full(core.t.size, np.nan)
        return Score(core.number, core.t, unknown, unknown, by_rule, None)
    t, logged = combined
    near = _nearest(core.t, t)
    # what is logged in hundredths was rounded: any ratio within half a step may have been compared
    half = 0.005 if np.all(np.abs(ratios * 100 - np.rint(ratios * 100)) < EXACT) else 0.0
    low = combined_ratio(*np.maximum(ratios - half, 0.0), squared=family.is_squared)[near]
    high = combined_ratio(*(ratios + half), squared=family.is_squared)[near]
    known = np.isfinite(logged) & np.isfinite(low) & np.isfinite(high)
    fits = (logged >= low - EXACT) & (logged <= high + EXACT)
    share = float(np.mean(fits[known])) if known.any() else None
    other = np.full(t.size, np.nan) if relative is None else relative[1]
    return Score(core.number, t, logged, other, by_rule[near], share)


def _nearest(t: Floats, at: Floats) -> NDArray[np.int64]:
    """Return the record nearest to each time: selector and core are stamped one after the other."""
    right = np.clip(np.searchsorted(t, at), 1, max(t.size - 1, 1))
    left = right - 1
    right = np.minimum(right, t.size - 1)
    return np.where(np.abs(t[right] - at) < np.abs(t[left] - at), right, left)


def _channel(log: Log, text: str, number: int) -> tuple[Floats, Floats] | None:
    if not text:
        return None
    which = f"[{number}]" if number else ""
    key, _, field = text.format(core=number, instance=which).partition(".")
    if key not in log or field not in log[key]:
        return None
    return log[key].t, log[key].si(field)
