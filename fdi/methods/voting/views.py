"""What could each autopilot know of itself and of the others?

In: the flags of one to n logs, on one clock. Out: a `Witness` for every autopilot: its view, and
whether a log of its own stands behind it.

An autopilot without a log is inferred, so that all votes can be counted: its own flags are those
that others received from it, and of a third one it knows what another one received from that. What
nobody recorded as received is taken from the sender's own log, sent once a cycle. So an inferred
autopilot shares the losses of the one whose reception it borrows; it is marked as inferred wherever
it is told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fdi.errors import LogError
from fdi.grid import checked
from fdi.methods.voting.flags import RECEIVED, FlagSamples, LogFlags, nothing
from fdi.methods.voting.replay import View
from fdi.methods.voting.settings import Settings, microseconds


@dataclass(frozen=True, slots=True, eq=False)
class Witness:
    """One autopilot as far as the logs tell of it.

    Attributes
    ----------
    number : int
    view : View
    is_inferred : bool
        Whether it has no log of its own.
    """

    number: int
    view: View
    is_inferred: bool


def witnesses(
    logs: Mapping[int, LogFlags], names: Mapping[int, str], settings: Settings
) -> tuple[Witness, ...]:
    """Return every autopilot that the logs tell of, by number.

    Parameters
    ----------
    logs : mapping of int to LogFlags
        By the number of the autopilot, all on the clock of the first.
    names : mapping of int to str
        What the logs are called.
    settings : Settings

    Raises
    ------
    LogError
        There is a single log that holds nothing received from others.
    """
    numbers = sorted({*logs, *(sender for log in logs.values() for sender in log.received)})
    if len(numbers) < 2:
        raise LogError(
            f"holds no flags received from other autopilots ({' and '.join(RECEIVED)}), so there "
            "is nothing to compare its own with",
            where=names[numbers[0]],
            hint="give the logs of the other autopilots too",
        )
    made = []
    for own, number in enumerate(numbers):
        samples = tuple(
            _own(logs, number) if sender == number else _as_received(logs, number, sender, settings)
            for sender in numbers
        )
        booted_at = logs[number].booted_at if number in logs else 0
        made.append(Witness(number, View(own, samples, booted_at), number not in logs))
    return tuple(made)


def _own(logs: Mapping[int, LogFlags], number: int) -> FlagSamples:
    """Return an autopilot's own flags: of its log, else as somebody received them."""
    if number in logs:
        return logs[number].own
    return next(log.received[number] for log in logs.values() if number in log.received)


def _as_received(
    logs: Mapping[int, LogFlags], receiver: int, sender: int, settings: Settings
) -> FlagSamples:
    """Return the flags of one autopilot as another one came to know them."""
    found: FlagSamples | None
    if receiver in logs and logs[receiver].received:
        found = logs[receiver].received.get(sender, nothing(settings))
    else:
        others = (log.received[sender] for log in logs.values() if sender in log.received)
        found = next(others, None)
    if found is None:
        return _sent_each_cycle(logs[sender].own, settings)
    return _delayed(found, settings)


def _delayed(received: FlagSamples, settings: Settings) -> FlagSamples:
    """Return what was received, arriving when the settings say."""
    if settings.transport is None:
        return received
    return replace(received, t=received.sent + microseconds(settings.transport))


def _sent_each_cycle(own: FlagSamples, settings: Settings) -> FlagSamples:
    """Return flags as they arrive when they are sent once a cycle."""
    period = microseconds(settings.cycle)
    count = checked((int(own.t[-1]) - int(own.t[0])) // period + 1, own.t.size, "cycles")
    sent = own.t[0] + period * np.arange(count)
    at = np.searchsorted(own.t, sent, side="right") - 1
    arrives = sent + microseconds(settings.transport or 0.0)
    return FlagSamples(arrives, sent, own.bad[at], own.since[at], own.is_airborne[at])
