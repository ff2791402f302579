"""What does one log hold?

`Log` is the value that every format's reader returns: messages as columns, one clock, parameters,
events, flights, and what was lost. It is frozen; columns are decoded when they are asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from html import escape
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import UsageError
from fdi.shown import clean
from fdi.telemetry.channel import Channel
from fdi.telemetry.clock import Clock
from fdi.telemetry.copies import Copy, compare_channels
from fdi.telemetry.ends import FlightEnd, find_ends
from fdi.telemetry.events import Event, Flight, FlightState, flight_state
from fdi.telemetry.flights import find_flights, flight_events
from fdi.telemetry.lift import lift_events
from fdi.telemetry.message import Floats, Message
from fdi.telemetry.motors import ROTORS
from fdi.telemetry.quality import QualityRecord
from fdi.telemetry.sensors import sensor_events
from fdi.telemetry.signals import Material, Request, Sampling, Signals, resample

_BLOCK: Final = 1 << 20  # bytes hashed at once: a mapped file is not held in memory
_WINGED: Final = ("plane", "vtol", "other")  # can rise without thrust, or nobody knows


class ChannelData(NamedTuple):
    """One channel of a log: t (n,) s, value (n,) SI with NaN for unknown, and the SI unit."""

    t: Floats
    value: Floats
    unit: str


class ParameterChange(NamedTuple):
    """A parameter that took another value while the log was recorded."""

    t: float
    name: str
    old: float
    new: float


@dataclass(frozen=True, slots=True)
class Source:
    """One sender in the log. ``lost``: frames missing by their sequence numbers."""

    system: int
    component: int
    frames: int
    lost: int
    vehicle: str | None
    autopilot: str | None
    chosen: bool


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One of the files of a log that several files make up.

    Attributes
    ----------
    name, format : str
    bytes : int
    sha256 : str
    offset : float
        s, what was added to the file's own times.
    uncertainty : float
        s, 95 %.
    placed_by : str
        What tells the offset: ``first`` (its clock is the log's), ``boot``, ``signals``.
    messages : tuple of str
        Keys of the messages that are its.
    added : Mapping[str, tuple of str]
        Messages of another file to which it adds records, or these fields.
    """

    name: str
    format: str
    bytes: int
    sha256: str
    offset: float
    uncertainty: float
    placed_by: str
    messages: tuple[str, ...]
    added: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Log:
    """A log, read. Of several files of one flight (`recordings`) name and format are the first's.

    Attributes
    ----------
    path : Path
    format : str
        ``tlog``, ``dataflash``, ``dataflash_text``, ``ulog``, ``table``.
    data : (n,) uint8
        The file's bytes; of several files the first one's.
    duration : float
        s, from the first to the last record of whatever source.
    span : (float, float)
        s, first and last record of the vehicle itself.
    messages : Mapping[str, Message]
        By key: ``ATTITUDE``, ``BATTERY_STATUS[1]``; the chosen vehicle's.
    parameters : Mapping[str, float]
        As first downloaded; what changed later stands in ``parameter_changes``.
    reported, quality : tuple
        In the order of time; ``reported`` are the events that the recorder tells of.
    clock : Clock
    vehicle, autopilot : str
    firmware : str or None
    system_id : int
    sources : tuple of Source
        All senders with their frame counts; the chosen one is marked.
    recordings : tuple of Recording
        The files where there are several, in the order given; empty for one.
    frame : str
        What a person calls the frame, where it is no ordinary one of its vehicle (``Y6``).
    board : str
        Name and serial number of the board where the format has a place for them (ULog).
    defaults : Mapping[str, float]
        The firmware's own, as far as the log tells them: DataFlash from ArduPilot 4.3 on; a ULog
        those of parameters that have another value. Empty: it tells none.
    """

    path: Path
    format: str
    data: NDArray[np.uint8]
    duration: float
    span: tuple[float, float]
    messages: Mapping[str, Message]
    parameters: Mapping[str, float]
    parameter_changes: tuple[ParameterChange, ...]
    reported: tuple[Event, ...]
    quality: tuple[QualityRecord, ...]
    clock: Clock
    vehicle: str
    autopilot: str
    firmware: str | None
    system_id: int
    sources: tuple[Source, ...]
    recordings: tuple[Recording, ...] = ()
    frame: str = ""
    board: str = ""
    defaults: Mapping[str, float] = field(default_factory=dict)
    _cache: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The file's name without its folder; of several files all names."""
        return " + ".join(self.files)

    @property
    def files(self) -> tuple[str, ...]:
        """The names of the files, without their folders."""
        return tuple(one.name for one in self.recordings) or (self.path.name,)

    @property
    def bytes(self) -> int:
        """How many bytes the file holds, or all files together."""
        return sum(one.bytes for one in self.recordings) or int(self.data.size)

    @property
    def sha256(self) -> str:
        """The SHA-256 of the file's bytes, hexadecimal; computed when it is asked for.

        Of several files: that of their hexadecimal digests one after the other.
        """
        if self.recordings:
            return sha256("".join(one.sha256 for one in self.recordings).encode()).hexdigest()
        if "sha256" not in self._cache:
            digest = sha256()
            for low in range(0, self.data.size, _BLOCK):
                digest.update(self.data[low : low + _BLOCK].data)
            self._cache["sha256"] = digest.hexdigest()
        found: str = self._cache["sha256"]
        return found

    @property
    def flights(self) -> tuple[Flight, ...]:
        """The flights in the order of time; found from the motion when they are asked for."""
        if "flights" not in self._cache:
            has_wings = self.vehicle in _WINGED and not self.frame  # named frames have rotors
            self._cache["flights"] = find_flights(
                self.messages, self.reported, self.span, has_wings=has_wings
            )
        found: tuple[Flight, ...] = self._cache["flights"]
        return found

    @property
    def ends(self) -> tuple[FlightEnd, ...]:
        """How each flight ends, in the order of time."""
        if "ends" not in self._cache:
            has_rotors = self.vehicle in ROTORS or bool(self.frame)  # named frames have rotors
            self._cache["ends"] = find_ends(
                self.messages, self.events, self.flights, has_rotors=has_rotors
            )
        found: tuple[FlightEnd, ...] = self._cache["ends"]
        return found

    @property
    def events(self) -> tuple[Event, ...]:
        """All events in the order of time, those reported and what the data show of flights."""
        if "events" not in self._cache:
            flights = self.flights
            found_in_data = [
                *flight_events(flights),
                *sensor_events(self.messages, flights),
                *lift_events(self.messages, self.reported, self.span[0], self.vehicle),
            ]
            events = [*self.reported, *found_in_data]
            self._cache["events"] = tuple(sorted(events, key=lambda e: (e.t, e.kind)))
        found: tuple[Event, ...] = self._cache["events"]
        return found

    @property
    def altered(self) -> Mapping[str, tuple[float, float]]:
        """Parameters that differ from the firmware's default, with value and default, by name."""
        return {
            name: (self.parameters[name], default)
            for name, default in self.defaults.items()
            if name in self.parameters and self.parameters[name] != default
        }

    @property
    def other_vehicles(self) -> tuple[Source, ...]:
        """The autopilots of other systems in the log, those that were not chosen."""
        return tuple(
            source
            for source in self.sources
            if not source.chosen and source.autopilot and source.system != self.system_id
        )

    def __getitem__(self, key: str) -> Message:
        found = self.messages.get(key)
        if found is None:
            raise UsageError(
                f"{self.name} has no message {key}", hint=f"it has {list(self.messages)}"
            )
        return found

    def __contains__(self, key: object) -> bool:
        return key in self.messages

    def with_message(self, message: Message) -> Log:
        """Return the log with one more message, or another one of that key."""
        kept = {name: value for name, value in self._cache.items() if name != "channels"}
        return replace(self, messages={**self.messages, message.key: message}, _cache=kept)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every numeric channel with at least one known value, sorted."""
        if "channels" not in self._cache:
            self._cache["channels"] = tuple(sorted(self._channels()))
        found: tuple[Channel, ...] = self._cache["channels"]
        return found

    def _channels(self) -> Iterable[Channel]:
        for message in self.messages.values():
            for name in message.fields:
                if message.has_known(name):
                    yield Channel(message.name, name, message.instance)

    def channel(self, channel: str | Channel) -> ChannelData:
        """Return time, SI value and unit of one channel, e.g. ``ATTITUDE.roll``.

        Raises
        ------
        UsageError
            The text names no channel, or the log has none of that name.
        """
        wanted = Channel.parse(channel) if isinstance(channel, str) else channel
        message = self[wanted.source]
        if wanted.field not in message:
            raise UsageError(
                f"{wanted.source} has no field {wanted.field}", hint=f"it has {message.fields}"
            )
        return ChannelData(message.t, message.si(wanted.field), message.unit(wanted.field))

    def state(self, t: ArrayLike) -> FlightState:
        """Return armed, airborne, mode and phase at times t (s)."""
        return flight_state(t, self.events, self.flights)

    def signals(self, requests: Iterable[Request], sampling: Sampling | None = None) -> Signals:
        """Return the requested quantities on one time grid, NaN where unknown."""
        return resample(self._material(), tuple(requests), sampling or Sampling())

    def compare(self, pairs: Iterable[tuple[Request, Request]]) -> tuple[Copy, ...]:
        """Return how far the second channel of every pair repeats the first, where that shows."""
        return compare_channels(self._material(), tuple(pairs))

    def _material(self) -> Material:
        return Material(
            self.messages,
            self.span,
            self.events,
            self.flights,
            self.parameters,
            self.name,
            self.ends,
        )

    def __repr__(self) -> str:
        records = sum(len(m) for m in self.messages.values())
        return (
            f"<Log {clean(self.name)}: {self.format}, {self.vehicle}, {self.autopilot}, "
            f"{self.duration:.1f} s, {len(self.messages)} messages, {records} records, "
            f"{len(self.flights)} flights, {len(self.quality)} findings about its quality>"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(key)}</td><td>{len(m)}</td><td>{len(m.fields)}</td></tr>"
            for key, m in self.messages.items()
        )
        head = "<tr><th>message</th><th>records</th><th>fields</th></tr>"
        return f"<p><code>{escape(repr(self))}</code></p><table>{head}{rows}</table>"
