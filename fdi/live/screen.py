"""What does a terminal show while the vehicle flies?

In: what an engine holds of the last minute. Out: a table that is drawn anew twice a second, with a
sparkline for every residual: how much of its threshold it took, the largest of every two seconds.
Nothing is wrapped: on a narrow terminal a sparkline shows less of the minute, on a low one there
are fewer tests. Where there is no terminal only the lines are written.
"""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import numpy as np

from fdi.live.hearing import Hearing
from fdi.live.observing import SHOWN_S, Observing
from fdi.live.watching import Watching
from fdi.methods.observer.limits import LASTS_S
from fdi.methods.observer.states import RESIDUALS, UNITS
from fdi.report.text import text
from fdi.report.words import clean
from fdi.telemetry.message import Floats
from fdi.units import hundredths

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

REFRESH_S: Final = 0.5
BINS: Final = 30
FEWEST_BINS: Final = 5
LEVELS: Final = "▁▂▃▄▅▆▇█"
MOST_ROWS: Final = 12
_BESIDE_OBSERVER: Final = 42
"""Letters in a row of the observer's view beside the sparkline."""
_BESIDE_BANK: Final = 26
_MEANS: Final = 24
"""Letters that what an alarm means needs at least to say anything."""
_AROUND: Final = 6
"""Lines for headline, heading, and what was told last."""
_STALE_S: Final = 1.0

Tell = Callable[[list[str]], None]


def sparkline(t: Floats, share: Floats, *, now: float) -> str:
    """Return the largest shares of a threshold over the last minute, a letter each; blank unknown.

    Parameters
    ----------
    t, share : (n,) float
        s and 1; a full block is 1 and more.
    now : float
        s, the right end.

    Examples
    --------
    >>> sparkline(np.array([1.0, 59.0]), np.array([0.5, 2.0]), now=60.0)[-1]
    '█'
    """
    place = np.floor((t - now + SHOWN_S) / SHOWN_S * BINS).astype(int)
    known = np.isfinite(share) & (place >= 0)
    largest = np.full(BINS, -1.0)
    np.maximum.at(largest, np.minimum(place[known], BINS - 1), share[known])
    level = np.minimum(np.maximum(largest, 0.0) * (len(LEVELS) - 1), len(LEVELS) - 1).astype(int)
    return "".join(
        LEVELS[n] if seen >= 0 else " " for n, seen in zip(level.tolist(), largest, strict=True)
    )


def observer_view(hearing: Hearing, seen: Observing) -> RenderableType:
    """Return what is drawn of an observer."""
    from rich.console import Group

    now = hearing.boot_s
    bins = _bins(shutil.get_terminal_size().columns - _BESIDE_OBSERVER)
    rows = _table("residual", "off by", "threshold", f"last {_seconds(bins):.0f} s")
    recent = seen.recent
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.abs(recent.off) / recent.threshold
    for row, name in enumerate(RESIDUALS):
        known = np.flatnonzero(np.isfinite(share[row]))
        if not known.size:
            rows.add_row(text(name), "", "", "")
            continue
        last = known[-1]
        active = any(a.residual == name and now - a.end < LASTS_S + _STALE_S for a in seen.alarms)
        style = "bold red" if active else ""
        rows.add_row(
            text(name, style),
            text(f"{recent.off[row, last]:+.3g} {UNITS[name]}", style),
            f"{recent.threshold[row, last]:.3g}",
            text(sparkline(recent.t, share[row], now=now)[-bins:], style),
        )
    return Group(text(headline(hearing, seen), "bold"), rows)


def bank_view(hearing: Hearing, seen: Watching) -> RenderableType:
    """Return what is drawn of a bank: the tests that came nearest to their thresholds."""
    from rich.console import Group

    width, height = shutil.get_terminal_size()
    bins = _bins(width - _BESIDE_BANK - _MEANS)
    most = min(max(height - _AROUND, 1), MOST_ROWS)
    rows = _table("test", "of threshold", f"last {_seconds(bins):.0f} s", "an alarm means")
    if seen.alarms is not None:
        bank, now = seen.alarms.residuals.bank, hearing.boot_s
        t = seen.alarms.residuals.t + seen.offset
        strength = np.where(seen.alarms.unfit[:, None], np.nan, seen.alarms.strength)
        late = strength[:, t >= t[-1] - SHOWN_S]
        largest = np.nan_to_num(late).max(axis=1, initial=0.0)
        for row in np.argsort(-largest, kind="stable")[:most].tolist():
            active = any(a.row == row and t[-1] - a.end < _STALE_S for a in seen.known)
            style = "bold red" if active else ""
            rows.add_row(
                text(bank.generators[row].id, style),
                text(f"{largest[row]:.2f}", style),
                text(sparkline(t, strength[row], now=now)[-bins:], style),
                text(_cut(seen.says[row], width - _BESIDE_BANK - bins), style),
            )
    return Group(text(bank_headline(hearing, seen), "bold"), rows)


def _bins(room: int) -> int:
    return min(max(room, FEWEST_BINS), BINS)


def _cut(words: str, room: int) -> str:
    return words if len(words) <= room else f"{words[: max(room - 1, 0)]}…"


def _seconds(bins: int) -> float:
    return bins * SHOWN_S / BINS


def _table(*titles: str) -> Table:
    from rich.table import Column, Table

    return Table(*(Column(title, no_wrap=True) for title in titles), box=None)


def bank_headline(hearing: Hearing, seen: Watching) -> str:
    """Return whom the bank accuses and since how long ago, or what there is instead."""
    if seen.accused:
        last = seen.accused[-1]
        since = hearing.boot_s - last.onset
        sure = f"{hundredths(last.confidence)} % sure"
        found = f"ACCUSED: {last.words}, {sure}, it began {since:.0f} s ago"
    elif seen.learned is not None:
        found = "nobody accused"
    else:
        found = f"waiting for {seen.waits_for}"
    return f"{found}  {_who(hearing)}"


def _who(hearing: Hearing) -> str:
    own = hearing.speaker
    who = "nobody heard yet" if own is None else f"system {own.system}, {own.vehicle}"
    clock = "" if np.isnan(hearing.boot_s) else f", {hearing.boot_s:.1f} s since boot"
    return f"[{who}{clock}{', THE LINK IS DEAD' if hearing.is_silent else ''}]"


def headline(hearing: Hearing, seen: Observing) -> str:
    """Return the accused component and how long ago, or what there is instead."""
    if seen.motors:
        last = seen.motors[-1]
        since, ended = hearing.boot_s - last.start, hearing.boot_s - last.end
        over = f", it ended {ended:.0f} s ago" if ended > LASTS_S + _STALE_S else ""
        found = f"MOTOR {last.number} is weak, it began {since:.0f} s ago{over}"
    elif seen.alarms:
        since = hearing.boot_s - seen.alarms[-1].start
        found = f"nobody accused; {seen.alarms[-1].residual} beyond its threshold {since:.0f} s ago"
    elif seen.learned is not None:
        found = "nobody accused"
    else:
        found = f"waiting for {seen.waits_for}"
    return f"{found}  {_who(hearing)}"


@contextmanager
def screen(draw: Callable[[], RenderableType]) -> Iterator[Tell]:
    """Give what tells lines: above a view that is drawn anew on a terminal, else by themselves."""
    if not sys.stdout.isatty():
        yield _write
        return
    from rich.console import Console
    from rich.live import Live

    drawn = -np.inf
    with Live(draw(), console=Console(emoji=False), auto_refresh=False) as live:

        def tell(lines: list[str]) -> None:
            nonlocal drawn
            for line in lines:
                live.console.print(text(line), highlight=False)
            if time.monotonic() - drawn >= REFRESH_S or lines:
                drawn = time.monotonic()
                live.update(draw(), refresh=True)

        yield tell


def _write(lines: list[str]) -> None:
    """Write lines at once; a reader that went away ends nothing but the telling."""
    try:
        for line in lines:
            sys.stdout.write(f"{clean(line)}\n")
        if lines:
            sys.stdout.flush()
    except BrokenPipeError:
        return
