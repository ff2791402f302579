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
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import UsageError
from fdi.shown import clean, html_table
from fdi.telemetry.channel import Channel
from fdi.telemetry.clock import Clock
from fdi.telemetry.copies import Copy, compare_channels
from fdi.telemetry.course import Course, find_course
from fdi.telemetry.ends import FlightEnd, find_ends
from fdi.telemetry.events import Event, Flight, FlightState, flight_state
from fdi.telemetry.flights import find_flights, flight_events
from fdi.telemetry.inputs import Input, Judge, believed, inputs_of
from fdi.telemetry.lift import lift_events
from fdi.telemetry.message import Floats, Message
from fdi.telemetry.motors import ROTORS
from fdi.telemetry.ordered import chain_of, with_setters
from fdi.telemetry.phases import Wings
from fdi.telemetry.quality import QualityRecord
from fdi.telemetry.sensors import sensor_events
from fdi.telemetry.signals import Material, Request, Sampling, Signals, resample
from fdi.telemetry.stretches import Stretch, find_stretches

if TYPE_CHECKING:
    import pandas

_BLOCK: Final = 1 << 20  # bytes hashed at once: a mapped file is not held in memory
_GROUNDED: Final = ("rover", "boat", "sub")
_WINGS: Final[Mapping[str, Wings]] = {"plane": "alone", "vtol": "maybe", "other": "maybe"}


class ChannelData(NamedTuple):
    """One channel of a log: t (n,) s, value (n,) SI with NaN for unknown, and the SI unit."""

    t: Floats
    value: Floats
    unit: str

    def to_pandas(self) -> pandas.Series:
        """Return the values as a series by time, s; its name is the unit."""
        import pandas as pd

        return pd.Series(self.value, pd.Index(self.t, name="t"), name=self.unit)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {value}" for name, value in self._told())
        return f"<ChannelData: {told}>"

    def _repr_html_(self) -> str:
        return html_table("ChannelData", ("of the channel", ""), self._told())

    def _told(self) -> list[tuple[str, str]]:
        known = self.value[np.isfinite(self.value)]
        found = [("records", str(self.t.size)), ("unknown", str(self.t.size - known.size))]
        if self.t.size:
            found += [("from", f"{self.t[0]:.3f} s"), ("to", f"{self.t[-1]:.3f} s")]
        if known.size:
            found += [("least", f"{known.min():.6g}"), ("most", f"{known.max():.6g}")]
        return [*found, ("unit", self.unit or "none")]


class ParameterChange(NamedTuple):
    """A parameter that took another value while the log was recorded."""

    t: float
    name: str
    old: float
    new: float

    def event(self) -> Event:
        """Return the change as something that happened."""
        return Event(self.t, "parameter", self.name, None, self.new, before=self.old)


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


def recorder_of(form: str) -> str:
    """Return which recorder writes logs of a format.

    Examples
    --------
    >>> recorder_of("dataflash_text"), recorder_of("ulog")
    ('dataflash', 'ulog')
    """
    return form.removesuffix("_text")


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
        What tells the offset: ``first`` (its clock is the log's), ``boot``, ``signals``, ``utc``.
    end : float
        s, of its last record, on the log's clock.
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
    end: float
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
    judge: Judge = tuple
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
    def records(self) -> int:
        """How many records there are of all messages, without those made from others."""
        return sum(len(m) for m in self.messages.values() if m.made_from is None)

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

    def believing(self) -> Log:
        """Return the log with inputs that it does not bear out unknown (`inputs` says which)."""
        messages, judge = believed(
            self.messages, self.reported, wings=self._wings != "none", autopilot=self.autopilot
        )
        return replace(self, messages=messages, judge=judge, _cache={})

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The commands, demands and states that tests read, and whether each is believed."""
        return inputs_of(self.judge())

    @property
    def flights(self) -> tuple[Flight, ...]:
        """The flights in the order of time; found from the motion when they are asked for."""
        if "flights" not in self._cache:
            self._cache["flights"] = find_flights(self._course())
        found: tuple[Flight, ...] = self._cache["flights"]
        return found

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """What the vehicle did, stretch by stretch: it stands, flies, lies on its side."""
        return find_stretches(self._course())

    @property
    def _wings(self) -> Wings:
        return "none" if self.frame else _WINGS.get(self.vehicle, "none")  # a frame: Y6 and such

    def _course(self) -> Course:
        if "course" not in self._cache:
            wings = self._wings
            rejected = [one for one in self.inputs if one.believed is False]
            # rotors do not stay up by an attitude that is far off
            may_fly = wings != "none" or not any(one.levels for one in rejected)
            self._cache["course"] = find_course(
                self.messages,
                self.reported,
                self.span,
                wings=wings,
                may_fly=may_fly and self.vehicle not in _GROUNDED,
                is_driven=not any(one.drives for one in rejected),
            )
        found: Course = self._cache["course"]
        return found

    @property
    def ends(self) -> tuple[FlightEnd, ...]:
        """How each flight ends, in the order of time."""
        if "ends" not in self._cache:
            has_rotors = self.vehicle in ROTORS or bool(self.frame)  # named frames have rotors
            ends = find_ends(self.messages, self.events, self.flights, has_rotors=has_rotors)
            self._cache["ends"] = tuple(self._with_chain(end) for end in ends)
        found: tuple[FlightEnd, ...] = self._cache["ends"]
        return found

    def _with_chain(self, end: FlightEnd) -> FlightEnd:
        until = end.at if end.lost_control is None else end.lost_control
        flight = self.flights[end.flight]
        chain = chain_of(until, flight, self.events, self.messages, self.parameters)
        return replace(end, chain=chain if flight.flew else ())

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
            events.sort(key=lambda e: (e.t, e.kind))
            self._cache["events"] = with_setters(events, self.parameters)
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
            self.clock.pace,
        )

    def __repr__(self) -> str:
        counts = (
            (len(self.messages), "message"),
            (self.records, "record"),
            (len(self.flights), "flight"),
            (len(self.quality), "finding"),
        )
        told = ", ".join(f"{count} {noun}{'s' * (count != 1)}" for count, noun in counts)
        return (
            f"<Log {clean(self.name)}: {self.format}, {self.vehicle}, {self.autopilot}, "
            f"{self.duration:.1f} s, {told} about its quality>"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(key)}</td><td>{len(m)}</td><td>{len(m.fields)}</td></tr>"
            for key, m in self.messages.items()
        )
        head = "<tr><th>message</th><th>records</th><th>fields</th></tr>"
        return f"<p><code>{escape(repr(self))}</code></p><table>{head}{rows}</table>"
