"""How does a healthy log become one with known faults?

In: a log and faults, each at a channel, or at a component of the model that the log is analysed
with. Out: the bytes of the changed log, in the same format. A component's fault is at all channels
by which the model measures it; a bias, drift or noise has one unit, so such channels must have one,
too. A channel in MAVLink's words of a DataFlash log is changed where it comes from.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fdi.errors import UsageError
from fdi.evaluation.injected_fault import (
    Floats,
    InjectedFault,
    Mask,
    faulty,
    lost_records,
)
from fdi.model import load_airframe
from fdi.model.choose import choose_model
from fdi.telemetry import Channel, Log, Message
from fdi.telemetry.meaning import origin
from fdi.telemetry.writing import Change, rewritten

_WITH_UNIT = ("bias", "drift", "noise")


def injected(log: Log, *faults: InjectedFault, model: str = "auto") -> bytes:
    """Return the bytes of the log with the faults, one after another in the order given.

    Raises
    ------
    UsageError
        The log does not have the channel or component, or cannot be rewritten.
    """
    changes: dict[str, Change] = {}
    for fault in faults:
        if not log.span[0] <= fault.start <= log.span[1]:
            raise UsageError(
                f"the fault begins at {fault.start:g} s, outside the log, which spans "
                f"{log.span[0]:z.1f} to {log.span[1]:.1f} s",
                where=log.name,
            )
        for channel in channels_of(log, fault.target, fault.kind, model):
            key, field, factor = home(log, channel)
            earlier = changes.get(key, Change({}))
            changes[key] = _with(earlier, log[key], field, fault, factor, str(channel))
    return rewritten(log, changes)


def _with(
    earlier: Change, message: Message, field: str, fault: InjectedFault, factor: float, channel: str
) -> Change:
    """Return what becomes of a message with one fault more."""
    t = _times(message)
    if fault.kind == "dropout":
        lost = lost_records(fault, t, message=message.key)
        return Change(earlier.values, lost if earlier.lost is None else lost | earlier.lost)
    own = _changed(message, field, fault, t, factor, channel, earlier.values.get(field))
    return Change({**earlier.values, field: own}, earlier.lost)


def channels_of(log: Log, target: str, kind: str, model: str = "auto") -> Sequence[Channel]:
    """Return the channel that a text names, or those that measure a component.

    Raises
    ------
    UsageError
        The log has no such channel, and the model measures no such component.
    """
    if "." in target or "/" in target:
        channel = Channel.parse(target)
        log.channel(channel)
        return (channel,)
    airframe = load_airframe(choose_model(log) if model == "auto" else model)
    system = airframe.observe(log)
    found = sorted(
        {
            equation.measurement.channel
            for equation in system.equations
            if equation.measurement is not None
            and equation.fault is not None
            and equation.component == target
        }
    )
    if not found:
        raise UsageError(
            f"{airframe.name} measures no component {target!r} with this log",
            hint="name a channel, such as GPS_RAW_INT.alt",
        )
    units = {log.channel(channel).unit for channel in found}
    if kind in _WITH_UNIT and len(units) > 1:
        raise UsageError(
            f"the channels of {target} have several units, so a {kind} has no size for all",
            hint=f"name one of {', '.join(map(str, found))}",
        )
    return found


def home(log: Log, channel: Channel) -> tuple[str, str, float]:
    """Return key and field of the log's own message, and what its value is multiplied by."""
    message = log[channel.source]
    if message.made_from is None:
        return channel.source, channel.field, 1.0
    found = origin(log.messages, channel.source, channel.field, log.vehicle, form=log.format)
    if found is None:
        raise UsageError(
            f"{channel} is made of several fields of this log", hint="name one of the log's own"
        )
    read, factor = found
    return read.key, read.field, factor


def _times(message: Message) -> Floats:
    """Return the log's time of every raw record, (m,); of one that says nothing new, the last's.

    So a receiver's fix that is sent twice reads the same twice.
    """
    order = np.argsort(message.kept, kind="stable")
    place = np.searchsorted(message.kept[order], np.arange(message.stamp.size), side="right")
    times: Floats = message.t[order][np.maximum(place - 1, 0)]
    return times


def _changed(
    message: Message,
    field: str,
    fault: InjectedFault,
    t: Floats,
    factor: float,
    channel: str,
    earlier: tuple[Floats, Mask] | None,
) -> tuple[Floats, Mask]:
    """Return the raw values of a field with the fault, and where they are to be written."""
    own = message.si_of_records(field)
    _, scale, offset = message.columns[field].conversion
    written = np.zeros(own.size, bool)
    if earlier is not None:
        raw, written = earlier
        own = np.where(written, scale * raw + offset, own)
    seen = faulty(fault, t, factor * own, channel=channel) / factor
    where: Mask = np.isfinite(seen) & (seen != own) & fault.holds(t)
    values = np.where(where, seen, np.where(written, own, 0.0))
    return (values - offset) / scale, where | written
