"""What are the requested quantities at the points of one time grid?

In: what a `Log` holds (`Material`), what a model asks of it (`Request`), how a policy samples
(`Sampling`). Out: `Signals`.

A quantity is computed at the times of its records, then interpolated linearly between two records
that are both known and not further apart than a gap; angles on the circle. One that is made of
codes, bits and counts alone keeps the earlier record's value there. Everywhere else it is unknown
(NaN): nothing is extrapolated and nothing is held longer. The published recipe
(``clock="record"``, ``extrapolate=True``, ``unwrap=False``, ``hold_discrete=False``) is the one
exception.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError, UsageError
from fdi.grid import checked
from fdi.shown import Shown, clean
from fdi.telemetry.channel import Channel
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.events import Event, Flight, FlightState, flight_state
from fdi.telemetry.message import Message
from fdi.telemetry.motion import heights

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[np.generic]]

TIME: Final = "$t"
"""The record times among the columns that a request's ``value`` sees; no field is called so."""
_RATES_HZ: Final = (1, 2, 3, 4, 5, 8, 10)  # what an automatic rate is rounded to
_MOST_SAMPLES: Final = 20_000_000  # a longer grid is a mistake in the call, not a flight
_SAMPLES_PER_RECORD: Final = 10  # of all messages; a longer one would be unknown nearly everywhere
_FEWEST: Final = 18_000
"""Samples that an automatic rate may give, and one more for each record: half an hour without any
at 10 Hz. Of the logs of people at hand none has more than one sample at 10 Hz for two records."""
_EXPECTED: Final = 20  # of fewer records nobody expects the next
_LIKE: Final = 2.0
_MISSED: Final = 5.0
_WITNESSES: Final = 2
_TIE: Final = 1e-9  # relative: a grid point this close to a record is that record
_STILLER: Final = 3.0  # times as long as ever before; chosen
_SEEN: Final = 20.0  # s, of a sensor before it may tell that by itself; chosen


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """What of a log its signals are made from.

    Attributes
    ----------
    messages : Mapping[str, Message]
        By key.
    span : (float, float)
        s, first and last record.
    events, flights, parameters, log_name, ends, pace
        Handed on with the signals.
    """

    messages: Mapping[str, Message]
    span: tuple[float, float]
    events: tuple[Event, ...]
    flights: tuple[Flight, ...]
    parameters: Mapping[str, float]
    log_name: str
    ends: tuple[FlightEnd, ...] = ()
    pace: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Request(Shown):
    """One measured quantity that a model asks of a log.

    Attributes
    ----------
    channel : Channel
        Its identity: the key in `Signals.columns`.
    fields : tuple of str
        Fields of the channel's message that ``value`` and ``valid`` read.
    value : callable or None
        Computes the quantity from those fields at record times; None is the field itself.
    valid : callable or None
        Says at which records it is valid; sees the fields and the flight state.
    raw : bool
        The fields as on the wire instead of SI.
    circular : bool
        The value is an angle in rad that wraps.
    stirred : tuple of (Channel, float)
        A stillness is unknown until one of these has moved by so much, SI, since it began, or
        until it lasts far longer than any before.
    silence : bool
        How long the field has not been told while messages like its own go on, instead.
    reported : callable or None
        Computes the accuracy that the message itself reports, from ``told``, its fields.
    latency, latency_accuracy : float
        s, taken off the record times; how well that is known.
    over : bool
        ``value`` is of a while of records, and those that are not valid are unknown to it.
    kept : bool
        What ``value`` was where records were valid is known afterwards.
    paces : bool
        Its records count in the automatic rate: it was recorded, and not made from what was.
    """

    channel: Channel
    fields: tuple[str, ...]
    value: Callable[[Columns], NDArray[np.generic]] | None = None
    valid: Callable[[Columns], NDArray[np.bool_]] | None = None
    raw: bool = False
    circular: bool = False
    latency: float = 0.0
    latency_accuracy: float = 0.0
    silence: bool = False
    stirred: tuple[tuple[Channel, float], ...] = ()
    reported: Callable[[Columns], NDArray[np.generic]] | None = None
    told: tuple[str, ...] = ()
    over: bool = False
    kept: bool = False
    paces: bool = True


@dataclass(frozen=True, slots=True)
class Sampling(Shown):
    """How a policy samples.

    Attributes
    ----------
    rate_hz : float or None
        None: the median of the rates of the requested channels that pace, rounded, 1 to 10 Hz.
    window : (float, float) or None
        s of the log's clock, both ends included; None: the flights' extent, or the whole log.
    clock : "best" or "record"
        The repaired clock, or the recorder's stamps as they are.
    equal_stamps : "last" or "mean"
        What stands for two records with the same stamp.
    extrapolate : bool
        Continue the line through the first or last two records (for the published recipe).
    unwrap : bool
        Interpolate circular quantities on the circle.
    hold_discrete : bool
        Between two records codes, bits and counts keep the earlier one's value.
    gap_factor, gap_min_s : float
        A gap is longer than max(gap_min_s, gap_factor * the channel's median period).
    """

    rate_hz: float | None = None
    window: tuple[float, float] | None = None
    clock: Literal["best", "record"] = "best"
    equal_stamps: Literal["last", "mean"] = "last"
    extrapolate: bool = False
    unwrap: bool = True
    hold_discrete: bool = True
    gap_factor: float = 3.0
    gap_min_s: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Signals(Shown):
    """The requested quantities on one grid.

    Attributes
    ----------
    t : (n,) float64, s of the log's clock; start + k / rate_hz.
    columns : Mapping[Channel, (n,) float64]
        NaN is unknown; read-only.
    period : Mapping[Channel, float]
        s, the channel's own median period; NaN with fewer than two records.
    state : FlightState
        On the grid.
    accuracy : Mapping[Channel, (n,) float64]
        What the log itself says of a channel's accuracy, where it says anything.
    ends : tuple of FlightEnd
        How every flight ends.
    height : (n,) float64 or None
        m above the place of take-off (or the lowest place), NaN unknown; to tell, no channel.
    spacing : Mapping[Channel, float]
        s, how far apart the channel's records are about a moment at which it is known.
    late : Mapping[Channel, float]
        s; how well the latency of a channel is known that has any.
    pace : float
        Seconds that go to one of the log's clock, where that runs wrong (`Clock.pace`).
    """

    t: Floats
    columns: Mapping[Channel, Floats]
    period: Mapping[Channel, float]
    state: FlightState
    rate_hz: float
    events: tuple[Event, ...]
    flights: tuple[Flight, ...]
    parameters: Mapping[str, float]
    log_name: str
    accuracy: Mapping[Channel, Floats] = field(default_factory=dict)
    ends: tuple[FlightEnd, ...] = ()
    height: Floats | None = None
    spacing: Mapping[Channel, float] = field(default_factory=dict)
    late: Mapping[Channel, float] = field(default_factory=dict)
    pace: float = 1.0

    def __repr__(self) -> str:
        span = f"{self.t[0]:.1f}..{self.t[-1]:.1f} s" if self.t.size else "empty"
        size = f"{len(self.columns)} channels, {span}, {self.rate_hz:g} Hz"
        return f"<Signals of {clean(self.log_name)}: {size}>"

    def frame(self) -> pd.DataFrame:
        """Return all columns as a pandas frame with index t (s)."""
        import pandas as pd

        columns = {str(channel): values for channel, values in self.columns.items()}
        return pd.DataFrame(columns, index=pd.Index(self.t, name="t"))


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """One quantity at its records: t, s, ascending strictly; NaN is unknown."""

    t: Floats
    value: Floats
    is_circular: bool
    is_discrete: bool = False
    period: float = field(init=False)
    """Median time between two records, s; NaN with fewer than two."""

    def __post_init__(self) -> None:
        period = float(np.median(np.diff(self.t))) if self.t.size > 1 else float("nan")
        object.__setattr__(self, "period", period)

    def spacing(self, longest: float) -> float:
        """Return the mean over time of the time between two records, s; ``longest``: no gap.

        Larger than the period where records come in bunches, as through a radio.
        """
        widths = np.diff(self.t)
        widths = widths[widths <= longest]
        return float(np.sum(widths**2) / np.sum(widths)) if widths.size else float("nan")


def resample(material: Material, requests: tuple[Request, ...], sampling: Sampling) -> Signals:
    """Return the requested quantities of a log on one grid.

    Raises
    ------
    UsageError
        The window or rate makes no grid.
    LogError
        The automatic rate is wanted and no requested channel is in the log.
    """
    states = states_at_records(material, requests, sampling)
    records = {r.channel: records_of(material, r, sampling, states) for r in requests}
    pacing = [records[r.channel] for r in requests if r.paces]
    rate = sampling.rate_hz or _own_rate(pacing) or _own_rate(records.values())
    if rate is None:
        raise LogError("none of the requested channels is in the log")
    if sampling.rate_hz is None and sampling.window is None:
        rate = _filled(rate, material)
    t = _grid(material, sampling.window, rate)
    columns, period, accuracy, spacing = {}, {}, {}, {}
    for channel, record in records.items():
        values = _interpolate(record, t, sampling)
        values.flags.writeable = False
        columns[channel] = values
        period[channel] = record.period
        spacing[channel] = record.spacing(_longest(record, sampling))
    for request in requests:
        told = _told(material, request, sampling)
        if told is not None:
            accuracy[request.channel] = _interpolate(told, t, sampling)
            accuracy[request.channel].flags.writeable = False
    t.flags.writeable = False
    return Signals(
        t,
        MappingProxyType(columns),
        MappingProxyType(period),
        flight_state(t, material.events, material.flights),
        rate,
        material.events,
        material.flights,
        material.parameters,
        material.log_name,
        MappingProxyType(accuracy),
        material.ends,
        _height(material, t),
        MappingProxyType(spacing),
        {r.channel: r.latency_accuracy for r in requests if r.latency_accuracy},
        material.pace,
    )


def _height(material: Material, t: Floats) -> Floats | None:
    known_t, height = heights(material.messages)
    if not known_t.size:
        return None
    found: Floats = np.interp(t, known_t, height, left=np.nan, right=np.nan)
    found.flags.writeable = False
    return found


def _extent(material: Material) -> tuple[float, float]:
    if not material.flights:
        return material.span
    return min(f.start for f in material.flights), max(f.end for f in material.flights)


def _own_rate(records: Collection[Records]) -> float | None:
    periods = [r.period for r in records if r.t.size > 1]
    if not periods:
        return None
    rate = 1 / float(np.median(periods))
    return float(min(_RATES_HZ, key=lambda hz: abs(np.log(hz / rate))))


def _filled(rate: float, material: Material) -> float:
    """Return the rate, or a lower one where the records could not fill the grid."""
    low, high = _extent(material)
    fitting = [hz for hz in _RATES_HZ if (high - low) * hz <= _FEWEST + _record_count(material)]
    if not fitting:
        said = f"{high - low:g} s at {_RATES_HZ[0]:g} Hz"
        checked(high - low, _record_count(material), said, least=_FEWEST, per_record=1)
    return min(rate, max(fitting))


def _record_count(material: Material) -> int:
    own = [one for one in material.messages.values() if one.made_from is None]
    return sum(message.stamp.size for message in own)


def _grid(material: Material, window: tuple[float, float] | None, rate: float) -> Floats:
    low, high = _extent(material) if window is None else window
    if not (np.isfinite([low, high, rate]).all() and low <= high and rate > 0):
        raise UsageError(f"a window from {low} to {high} s at {rate} Hz makes no grid")
    count = int((high - low) * rate * (1 + _TIE) + _TIE) + 1
    said = f"{high - low:g} s at {rate:g} Hz"
    if count > _MOST_SAMPLES:
        raise (LogError if window is None else UsageError)(f"{said} make {count} samples")
    if window is None:  # the extent is the log's own
        checked(count, _record_count(material), said, per_record=_SAMPLES_PER_RECORD)
    return low + np.arange(count) / rate


def states_at_records(
    material: Material, requests: Iterable[Request], sampling: Sampling
) -> dict[str, FlightState]:
    """Return the vehicle's state at the records of every message that a condition looks at."""
    sources = {r.channel.source for r in requests if r.valid is not None}
    return {
        source: flight_state(_times(message, sampling), material.events, material.flights)
        for source, message in material.messages.items()
        if source in sources
    }


def _times(message: Message, sampling: Sampling) -> Floats:
    return message.stamp if sampling.clock == "record" else message.t


def records_of(
    material: Material, request: Request, sampling: Sampling, states: Mapping[str, FlightState]
) -> Records:
    """Return a requested quantity at its own records, empty where the log does not have it.

    ``states``: of `states_at_records`, with the message of a request that has a condition.
    """
    message = material.messages.get(request.channel.source)
    names = dict.fromkeys((*request.fields, *(() if request.value else (request.channel.field,))))
    if message is None or any(name not in message for name in names):
        return Records(np.empty(0), np.empty(0), request.circular)
    if request.silence:
        field = request.channel.field.partition(":")[0]  # of ``FIELD:silent``
        return _silence(message, field, material.messages.values())
    every = sampling.clock == "record"
    t = _times(message, sampling)
    fields = {name: _field(message, name, raw=request.raw, every=every) for name in names}
    with np.errstate(all="ignore"):
        valid = None
        if request.valid is not None:
            seen = {**fields, **states[request.channel.source].named()}
            valid = np.broadcast_to(np.asarray(request.valid(seen), np.bool_), t.shape)
        known = {**fields, TIME: t}
        if request.over:  # what is of a while is so by a clock that goes right
            known = {**_only(fields, valid), TIME: material.pace * t}
        found = request.value(known) if request.value else fields[request.channel.field]
        value = np.array(np.broadcast_to(found, t.shape), np.float64)
        value[~np.isfinite(value)] = np.nan
        if valid is not None and not request.kept:
            value[~valid] = np.nan
    t, value = _ascending(t, value, sampling.equal_stamps)
    if request.stirred:
        told = _stirred(material, request, t, t - value) | _stiller_than_ever(t, value)
        value[(value > 0) & ~told] = np.nan
    is_discrete = all(message.columns[name].is_discrete for name in names)
    return Records(t - request.latency, value, request.circular, is_discrete)


def _stirred(material: Material, request: Request, t: Floats, since: Floats) -> NDArray[np.bool_]:
    """Return whether something has moved by as much as it must, from ``since`` until ``t``."""
    moved = np.zeros(t.size, np.bool_)
    for channel, least in request.stirred:
        message = material.messages.get(channel.source)
        if message is None or channel.field not in message:
            continue
        values = message.si(channel.field)
        known = np.isfinite(values)
        at, values = message.t[known], values[known]
        if message.unit(channel.field) == "rad":
            values = np.unwrap(values)
        first, last = np.searchsorted(at, since), np.searchsorted(at, t, side="right")
        for begin in np.unique(first[last - first > 1]):  # the records of one stillness
            rows = np.flatnonzero((first == begin) & (last - first > 1))
            piece = values[begin : last[rows].max()]
            reach = np.maximum.accumulate(piece) - np.minimum.accumulate(piece)
            moved[rows] |= reach[last[rows] - begin - 1] >= least
    return moved


def _stiller_than_ever(t: Floats, held: Floats) -> NDArray[np.bool_]:
    """Return whether a field stands still for far longer than it ever did before.

    A sensor's own noise moves it at rest too: one that has been seen for a while tells by itself
    how long that may take.
    """
    still = np.nan_to_num(held)
    began = np.searchsorted(t, t - still)
    before = np.concatenate([[0.0], np.maximum.accumulate(still)])[began]
    seen = t - still - (t[0] if t.size else 0.0)
    return (still > _STILLER * before) & (seen > np.maximum(_STILLER * still, _SEEN))


def _silence(message: Message, field: str, others: Iterable[Message]) -> Records:
    """Return how long, s, a field has not been told while messages go on.

    Where the field's own message goes on and calls it unknown, the clock tells; otherwise messages
    like its own do.
    """
    if field not in message:
        return Records(np.empty(0), np.empty(0), False)
    known = np.isfinite(message.si(field))
    told = message.t[known]
    if len(told) < _EXPECTED:
        return Records(np.empty(0), np.empty(0), False)
    like = _like_silence(message, told, others)
    # while its own message goes on without it, that alone tells
    before = np.searchsorted(message.t, like.t, side="right") - 1
    like_rows = (before < 0) | known[before]
    own = message.t[~known & (message.t > told[0])]
    lasted = own - told[np.searchsorted(told, own) - 1]
    t = np.concatenate([like.t[like_rows], own])
    order = np.argsort(t, kind="stable")
    return Records(t[order], np.concatenate([like.value[like_rows], lasted])[order], False)


def _like_silence(message: Message, told: Floats, others: Iterable[Message]) -> Records:
    """Return how long, s, nothing has been told while messages like this one go on.

    Those are the messages that come at most twice as often and as seldom. Time is counted in their
    records (the median of them all): a radio link loses what is sent at one moment together, and
    for seconds. Five periods are none: a link that loses every second message loses five in a row
    once in 32 times. Before the first record it is unknown, and so it is with fewer than two alike.
    """
    period = float(np.median(np.diff(message.t)))
    like = [
        other.t
        for other in others
        if other.made_from is None
        and other.key not in (message.key, message.made_from)
        and len(other) >= _EXPECTED
        and 1 / _LIKE <= float(np.median(np.diff(other.t))) / period <= _LIKE
    ]
    if len(like) < _WITNESSES:
        return Records(np.empty(0), np.empty(0), False)
    t = np.unique(np.concatenate(like))
    since = np.searchsorted(told, t, side="right") - 1
    last = told[since]
    heard = [
        np.searchsorted(o, t, side="right") - np.searchsorted(o, last, side="right") for o in like
    ]
    value = np.maximum(np.median(heard, axis=0) - _MISSED, 0.0) * period
    return Records(t, np.where(since >= 0, value, np.nan), False)


def _told(material: Material, request: Request, sampling: Sampling) -> Records | None:
    """Return what a message reports of a channel's accuracy; nothing or no length is unknown."""
    message = material.messages.get(request.channel.source)
    if request.reported is None or message is None or any(f not in message for f in request.told):
        return None
    asked = replace(request, fields=request.told, value=request.reported, raw=False, circular=False)
    found = records_of(material, replace(asked, valid=None), sampling, {})
    found.value[~(found.value > 0)] = np.nan
    return found if np.isfinite(found.value).any() else None


def _field(message: Message, name: str, *, raw: bool, every: bool) -> NDArray[np.generic]:
    if raw:
        values = message.raw(name)
        return values if every else values[message.kept]
    return message.si_of_records(name) if every else message.si(name)


def _only(fields: Columns, valid: NDArray[np.bool_] | None) -> Columns:
    """Return fields whose numbers are unknown where a record is not valid."""
    if valid is None:
        return fields
    return {
        name: np.where(valid, own, np.nan) if own.dtype.kind in "fiub" else own
        for name, own in fields.items()
    }


def _ascending(t: Floats, value: Floats, equal: str) -> tuple[Floats, Floats]:
    """Return the records in strictly ascending time."""
    if t.size < 2 or (np.diff(t) > 0).all():
        return t, value
    order = np.argsort(t, kind="stable")
    t, value = t[order], value[order]
    is_last = np.concatenate((np.diff(t) > 0, [True]))
    if equal == "mean":
        first = np.concatenate(([0], np.flatnonzero(is_last)[:-1] + 1))
        value = np.add.reduceat(value, first) / np.diff(np.append(first, t.size))
        return t[is_last], value
    return t[is_last], value[is_last]


def _interpolate(records: Records, t: Floats, sampling: Sampling) -> Floats:
    """Return the quantity on the grid, NaN where it is unknown."""
    known_t, value = records.t, records.value
    out = np.full(t.size, np.nan)
    if not known_t.size:
        return out
    if known_t.size == 1:
        out[np.abs(t - known_t[0]) <= _TIE * np.maximum(1, np.abs(t))] = value[0]
        return out
    left = np.clip(np.searchsorted(known_t, t, side="right") - 1, 0, known_t.size - 2)
    width = known_t[left + 1] - known_t[left]
    weight = (t - known_t[left]) / width
    turns = records.is_circular and sampling.unwrap
    steps = records.is_discrete and sampling.hold_discrete
    with np.errstate(over="ignore", invalid="ignore"):  # damaged values may be of any size
        rise = value[left + 1] - value[left]
        if turns:
            rise = (rise + np.pi) % (2 * np.pi) - np.pi
        between = value[left] + ((weight >= 1) if steps else weight) * rise
    between[np.isinf(between)] = np.nan
    if turns:
        between = _same_range(between, value)
    inside = (weight >= 0) & (weight <= 1) & (width <= _longest(records, sampling) * (1 + _TIE))
    if sampling.extrapolate:
        inside |= (weight < 0) | (weight > 1)
    out[inside] = between[inside]
    # at a record its own value counts, whatever its neighbour is
    tie = _TIE * np.maximum(1.0, np.abs(t))
    for neighbour in (left, left + 1):
        hit = np.abs(t - known_t[neighbour]) <= tie
        out[hit] = value[neighbour[hit]]
    return out


def _longest(records: Records, sampling: Sampling) -> float:
    """Return how far apart two records may be that are no gap apart, s."""
    return max(sampling.gap_min_s, sampling.gap_factor * records.period)


def _same_range(angle: Floats, like: Floats) -> Floats:
    """Return angles in [0, 2 pi) if the records are, else in [-pi, pi)."""
    with np.errstate(invalid="ignore"):
        low = 0.0 if like.size and not np.any(like < 0) and np.any(like > np.pi) else -np.pi
    return (angle - low) % (2 * np.pi) + low
