"""Which flags did an autopilot publish, and which did it receive from the others?

In: a log. Out: `FlagSamples`, its own and one per autopilot that it received. Own flags are of the
topics ``vehicle_status_flags`` and ``vehicle_status``, received ones of ``redundancy_firstpilot``
and ``redundancy_secondpilot`` (the others in the order of their numbers). What the voter of the log
concluded (``redundancy_selection``) is not read here.

Times are microseconds of the autopilot's own clock (since boot), on which it also stamps what it
sends. A sender's stamp is usable only where it is of the receiver's clock. In one of the published
programs it was not: there the stamps are ahead of their own reception by seconds, and the time of
reception takes their place.

The trap for a maintainer: a flag that a log lacks, or that is neither 0 nor 1, is unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.methods.voting.rules import Bools, Floats, Ints
from fdi.methods.voting.settings import Settings, known_flags, microseconds
from fdi.telemetry import Log, Message

RECEIVED: Final = ("redundancy_firstpilot", "redundancy_secondpilot")
"""Topics of received flags, for the first and the second of the other autopilots."""
OWN: Final = ("vehicle_status_flags", "vehicle_status")
_NUMBERS: Final = ("MAV_SYS_ID", "SYSID_THISMAV", "MAV_SYSID")
_ONE_CLOCK_S: Final = 0.1
"""A stamp further ahead of its reception is of another clock; a shared one steps 4 ms."""


@dataclass(frozen=True, slots=True, eq=False)
class FlagSamples:
    """Flags of one autopilot, as somebody came to know them.

    Attributes
    ----------
    t : (m,) int, us
        When they were known: own ones published, others received. Ascending.
    sent : (m,) int, us
        When the sender stamped them; t where there is no such stamp on this clock.
    bad : (m, f) float
        1 bad, 0 good, NaN unknown; by the flags of the settings.
    since : (m,) int, us
        When its autopilot took off; before that, and after landing, when it booted.
    is_airborne : (m,) bool
        Whether it had taken off and not landed.
    """

    t: Ints
    sent: Ints
    bad: Floats
    since: Ints
    is_airborne: Bools

    def shifted(self, by: int) -> FlagSamples:
        """Return the same on another clock, us."""
        return replace(self, t=self.t + by, sent=self.sent + by, since=self.since + by)


@dataclass(frozen=True, slots=True, eq=False)
class LogFlags:
    """What one log says of flags.

    Attributes
    ----------
    number : int
        Of the autopilot, from 1.
    own : FlagSamples
    received : mapping of int to FlagSamples
        By the number of the sender.
    booted_at : int, us
        When the autopilot started.
    notes : tuple of str
        What was missing, or could not be used.
    """

    number: int
    own: FlagSamples
    received: Mapping[int, FlagSamples]
    booted_at: int
    notes: tuple[str, ...]

    def shifted(self, by: int) -> LogFlags:
        """Return the same on another clock, us."""
        received = {sender: samples.shifted(by) for sender, samples in self.received.items()}
        return replace(
            self, own=self.own.shifted(by), received=received, booted_at=self.booted_at + by
        )


def nothing(settings: Settings) -> FlagSamples:
    """Return the flags of an autopilot that was never heard of."""
    none = np.empty(0, np.int64)
    flags = np.empty((0, len(settings.flags)))
    return FlagSamples(none, none, flags, none, np.empty(0, np.bool_))


def flags_of(log: Log, settings: Settings) -> LogFlags:
    """Return the flags of a log.

    Raises
    ------
    LogError
        It holds none of those that are compared.
    """
    number, boot = number_of(log), boot_us(log)
    flags = [known_flags()[name] for name in settings.flags]
    lacking = [f.name for f in flags if f.topic not in log or f.name not in log[f.topic]]
    if len(lacking) == len(flags):
        raise LogError(
            f"holds none of the {len(flags)} flags that are compared "
            f"({flags[0].topic}.{flags[0].name}, ...)",
            where=log.name,
            hint="the voter compares flags of PX4 1.12, in the log that it writes itself (.ulg)",
        )
    notes = [f"the log has no flag {name}: not compared" for name in lacking]
    own = _own(log, settings, boot)
    notes += _unknown(own, settings, lacking, "own flags")
    received, unstamped = {}, []
    for sender, topic in zip(_others(number), RECEIVED, strict=False):
        if topic in log and len(log[topic]):
            received[sender], is_stamped = _received(log[topic], settings, boot)
            notes += _unknown(received[sender], settings, lacking, f"flags received from {sender}")
            if not is_stamped:
                unstamped.append(str(sender))
    if unstamped:
        notes.append(
            f"the stamps of what was received from {' and '.join(unstamped)} are of another clock: "
            "silence counts from the reception"
        )
    return LogFlags(number, own, received, 0, tuple(notes))


def number_of(log: Log) -> int:
    """Return which autopilot wrote a log: the number that its parameters give it."""
    stated = next((log.parameters[name] for name in _NUMBERS if name in log.parameters), None)
    return log.system_id if stated is None else int(stated)


def boot_us(log: Log) -> int:
    """Return the time since boot at t = 0 of a log, us; 0 where the log does not know it."""
    boot = log.clock.boot(0.0)
    return 0 if boot is None else microseconds(boot)


def _others(number: int) -> list[int]:
    """Return the numbers of the others: the lowest ones that are not its own."""
    return [k for k in range(1, len(RECEIVED) + 2) if k != number][: len(RECEIVED)]


def _own(log: Log, settings: Settings, boot: int) -> FlagSamples:
    topics = [log[name] for name in OWN if name in log and len(log[name])]
    t = np.unique(np.concatenate([message.t for message in topics]))
    nowhere = np.full(t.size, np.nan)
    columns = []
    for name in settings.flags:
        topic = known_flags()[name].topic
        columns.append(_bad(log[topic], name, t) if topic in log else nowhere)
    since, is_airborne = _takeoff(log, t, boot)
    at = _us(t) + boot
    return FlagSamples(at, at, np.stack(columns, axis=-1), since, is_airborne)


def _received(message: Message, settings: Settings, boot: int) -> tuple[FlagSamples, bool]:
    """Return what was received on a topic, and whether its stamps are of the receiver's clock."""
    at = _us(message.t) + boot
    columns = [_bad(message, name, message.t) for name in settings.flags]
    sent, is_stamped = at, False
    if "timestamp_pilot" in message:
        stamp = message.si("timestamp_pilot")
        is_stamped = bool(np.isfinite(stamp).all())
        if is_stamped:
            age = at - stamp.astype(np.int64)  # the field has no unit in the log: microseconds
            low, high = microseconds(-_ONE_CLOCK_S), microseconds(settings.silence)
            is_stamped = bool(age.min() >= low and np.median(age) <= high)
    if is_stamped:
        sent = stamp.astype(np.int64)
    since, is_airborne = _since(message, message.t, 1.0, boot)
    return FlagSamples(at, sent, np.stack(columns, axis=-1), since, is_airborne), is_stamped


def _bad(message: Message, name: str, t: Floats) -> Floats:
    """Return whether a flag is bad at times t, by the last record up to then."""
    if name not in message or not len(message):
        return np.full(t.size, np.nan)
    value = message.si(name)
    bad = np.where(np.isin(value, (0, 1)), value == known_flags()[name].bad, np.nan)
    row = np.searchsorted(message.t, t, side="right") - 1
    return np.where(row >= 0, bad[np.maximum(row, 0)], np.nan)


def _takeoff(log: Log, t: Floats, boot: int) -> tuple[Ints, Bools]:
    """Return since when the gate's delay counts, and whether the vehicle is in the air.

    By the autopilot's own detection; a log without it is asked for its motion.
    """
    if "vehicle_status" in log and "takeoff_time" in log["vehicle_status"]:
        return _since(log["vehicle_status"], t, 1e6, boot)
    since, is_airborne = np.zeros(t.size, np.int64), np.zeros(t.size, np.bool_)
    for flight in log.flights:
        if flight.takeoff is not None:
            end = flight.end if flight.landing is None else flight.landing
            inside = (t >= flight.takeoff) & (t <= end)
            since[inside], is_airborne[inside] = microseconds(flight.takeoff) + boot, True
    return since, is_airborne


def _since(message: Message, t: Floats, scale: float, boot: int) -> tuple[Ints, Bools]:
    """Return the field ``takeoff_time`` at times t, us, and whether it is set."""
    if "takeoff_time" not in message:
        return np.zeros(t.size, np.int64), np.zeros(t.size, np.bool_)
    stated = np.nan_to_num(message.si("takeoff_time") * scale)
    row = np.maximum(np.searchsorted(message.t, t, side="right") - 1, 0)
    since = np.rint(stated[row]).astype(np.int64)
    return since, since > 0


def _unknown(samples: FlagSamples, settings: Settings, lacking: list[str], whose: str) -> list[str]:
    """Return a line that says where flags are unknown that the log has."""
    is_known = np.isfinite(samples.bad)
    has_begun = np.maximum.accumulate(is_known, axis=0)  # one topic may begin before another
    is_missed = np.any(has_begun & ~is_known, axis=0) | ~is_known.any(axis=0)
    pairs = zip(settings.flags, is_missed, strict=True)
    some = [name for name, missed in pairs if missed and name not in lacking]
    if not some:
        return []
    names = ", ".join(some[:3]) + (", ..." if len(some) > 3 else "")
    return [f"{whose} are unknown in part ({names}): unknown ones blame nobody"]


def _us(t: Floats) -> Ints:
    us: Ints = np.rint(t * 1e6).astype(np.int64)
    return us
