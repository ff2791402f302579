"""When are most messages of a log silent together?

In: the messages. Out: quality records, many told as one. A message that is alone in its silence is
a sensor's, or sent seldom; most of the regular ones together are the link or the recorder.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.events import Event
from fdi.telemetry.formats.bounds import SINGLE
from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord

GAP_S: Final = 2.0
_GAP_PERIODS: Final = 3.0
_LINK_SHARE: Final = 0.8  # of the regular messages silent at once: the link, not a sensor
_ARMING_S: Final = 3.0
"""Between arming and the first records then, or the last ones and disarming."""


def gap_records(
    messages: Mapping[str, Message], events: Sequence[Event] = ()
) -> Iterator[QualityRecord]:
    """Yield the times in which most of the regular messages are missing together.

    But those from disarming to arming, by ``events``: recorders on board rest then if they are so
    set, and nothing is lost.
    """
    gaps: list[tuple[float, float]] = []
    regular: list[tuple[float, float]] = []
    for message in messages.values():
        if len(message) < 5:
            continue
        step = np.diff(message.t)
        limit = _longest_step(step)
        if limit is None:
            continue
        regular.append((float(message.t[0]), float(message.t[-1])))
        for row in np.flatnonzero(step > limit):
            gaps.append((float(message.t[row]), float(message.t[row + 1])))
    if not gaps:
        return
    edges = np.array(sorted({edge for gap in gaps for edge in gap}))
    middle = (edges[:-1] + edges[1:]) / 2
    # what has not begun yet, or has ended, is neither silent nor heard; where few are under way
    # (headers, a unit that is recorded last) their silence is not the link's
    silent, of = _under_way(gaps, middle), _under_way(regular, middle)
    is_silent = (silent >= _LINK_SHARE * of) & (2 * silent >= len(regular))
    is_gap = np.concatenate(([False], is_silent, [False])).astype(np.int8)
    found = list(
        zip(
            np.flatnonzero(np.diff(is_gap) == 1), np.flatnonzero(np.diff(is_gap) == -1), strict=True
        )
    )
    spans = [(float(edges[a]), float(edges[b])) for a, b in found]
    spans = [span for span in spans if not _rests(*span, events)]
    if len(spans) > SINGLE:
        total = sum(b - a for a, b in spans)
        text = f"telemetry gap: {len(spans)} times, {total:.1f} s in all"
        yield QualityRecord("gap", None, spans[0][0], spans[-1][1], len(spans), text)
        return
    for start, end in spans:
        yield QualityRecord("gap", None, start, end, 1, f"telemetry gap of {end - start:.1f} s")


def _rests(start: float, end: float, events: Sequence[Event]) -> bool:
    """Return whether a vehicle is disarmed all that time, and armed at its end."""
    arming = sorted((e.t, e.kind) for e in events if e.kind in ("arm", "disarm"))
    before = [kind for t, kind in arming if t <= start + _ARMING_S and t < end - _ARMING_S]
    after = [(t, kind) for t, kind in arming if t > start + _ARMING_S]
    is_disarmed = bool(before) and before[-1] == "disarm"
    return is_disarmed and bool(after) and after[0][1] == "arm" and after[0][0] > end - _ARMING_S


def _under_way(spans: Sequence[tuple[float, float]], t: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return how many of the spans hold each of the times."""
    starts, ends = (np.sort([span[side] for span in spans]) for side in (0, 1))
    return np.searchsorted(starts, t) - np.searchsorted(ends, t)


def _longest_step(step: NDArray[np.float64]) -> float | None:
    """Return the longest step (s) of a regular message that is no gap, None if it is irregular."""
    quick = GAP_S / _GAP_PERIODS
    if 2 * np.count_nonzero(step <= quick) > step.size + 1:
        return GAP_S  # the median is below, too: no need to look for it
    period = float(np.median(step))
    return max(GAP_S, _GAP_PERIODS * period) if period <= GAP_S else None
