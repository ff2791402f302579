"""How do arrays of one's own become a log?

In: columns by channel with their units, and times; out: a `Log` like any other, so that models,
residuals and reports take it without a second way. Nothing is known of it but its columns: no
vehicle unless it is named, no parameters, no events, no time since boot.

Every message is a set of channels with times in common: ``MESSAGE.t`` where there is such a column,
else ``t``. A value that is NaN is unknown at its time; a record without a time is none. So a table
of channels of different rates needs a time column for each message, or its gaps are unknown values.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import FdiError, LogError, UsageError
from fdi.telemetry.channel import Channel
from fdi.telemetry.clock import Clock
from fdi.telemetry.log import Log
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import QualityRecord
from fdi.units import si_as_written

if TYPE_CHECKING:
    import pandas as pd

TIME_COLUMN: Final = "t"
MESSAGE: Final = "DATA"
"""The message of a column whose name has no message."""


def log_from_columns(
    columns: Mapping[str, ArrayLike] | pd.DataFrame,
    units: Mapping[str, str] | None = None,
    *,
    name: str = "columns",
    vehicle: str = "other",
    message: str = MESSAGE,
    data: NDArray[np.uint8] | None = None,
) -> Log:
    """Return a log that holds these columns.

    Parameters
    ----------
    columns : mapping of str to (n,) array, or DataFrame
        ``t``, the times, and channels (``GPS.alt``, ``GPS[1].alt``; ``p1`` is ``DATA.p1``). A
        message with times of its own brings ``GPS.t``. The index of a frame without a column ``t``
        are its times. NaN is unknown.
    units : mapping of str to str, optional
        Of columns, as logs or people spell them (``deg``, ``hPa``, ``knots``); times are in s,
        angles in rad.
        A column without a unit is a number: a model takes it for one only by ``raw: true``.
    name, vehicle : str
        What the log is called, and of what it is (see the interfaces), for reports.
    message : str
        The message of columns whose names have none.
    data : (m,) uint8, optional
        The bytes of the file that they come from.

    Raises
    ------
    LogError
        A column is no channel, is of another length than its times, or there are no times.
    UsageError
        A unit is of no column.

    Examples
    --------
    >>> log = log_from_columns({"t": [0, 1, 2], "TANK.p": [1.0, 2.0, 4.0]}, {"TANK.p": "kPa"})
    >>> log.channel("TANK.p").value.tolist(), log.channel("TANK.p").unit
    ([1000.0, 2000.0, 4000.0], 'Pa')
    """
    given = _given(columns)
    stated = dict(units or {})
    if strangers := sorted(stated.keys() - given.keys()):
        raise UsageError(f"{strangers[0]!r} has a unit and is no column", where=name)
    parts = _parts(given, message, name)
    times = {key: _times(key, given, own, stated, name) for key, own in parts.items()}
    start = min((float(np.nanmin(t)) for t in times.values() if np.isfinite(t).any()), default=0.0)
    messages, quality = {}, []
    for key, own in parts.items():
        made, told = _message(key, own, given, times[key] - start, stated, name)
        messages[key] = made
        quality += told
    end = max((float(m.t[-1]) for m in messages.values() if len(m)), default=None)
    if end is None:
        raise LogError("holds no record with a time", where=name)
    raw = b"".join(key.encode() + values.tobytes() for key, values in sorted(given.items()))
    unknown = np.array([np.nan])
    return Log(
        Path(name),
        "table",
        np.frombuffer(raw, np.uint8) if data is None else data,
        end,
        (0.0, end),
        MappingProxyType(dict(sorted(messages.items()))),
        MappingProxyType({}),
        (),
        (),
        tuple(quality),
        Clock(np.zeros(1), unknown, unknown, np.nan, np.nan, "none"),
        vehicle,
        "other",
        None,
        1,
        (),
    )


def _given(columns: Mapping[str, ArrayLike] | pd.DataFrame) -> dict[str, NDArray[Any]]:
    """Return every column as an array of numbers."""
    given: dict[str, Any] = {str(name): values for name, values in columns.items()}
    if TIME_COLUMN not in given and hasattr(columns, "index"):
        given[TIME_COLUMN] = columns.index
    found = {}
    for name, values in given.items():
        try:
            found[name] = np.array(values, np.float64)
        except (TypeError, ValueError):
            raise LogError(f"the column {name!r} is not made of numbers") from None
        if found[name].ndim != 1:
            raise LogError(f"the column {name!r} has the shape {found[name].shape}, not (n,)")
    return found


def _parts(given: Mapping[str, Any], message: str, where: str) -> dict[str, dict[str, Channel]]:
    """Return the channels of every message by the names of their columns."""
    parts: dict[str, dict[str, Channel]] = {}
    seen: dict[Channel, str] = {}
    for name in given:
        if name == TIME_COLUMN or name.endswith(f".{TIME_COLUMN}"):
            continue
        try:
            channel = Channel.parse(name if "." in name else f"{message}.{name}")
        except FdiError as error:
            raise LogError(str(error), where=where, hint=error.hint) from error
        if channel in seen:
            raise LogError(f"{name!r} and {seen[channel]!r} are one channel", where=where)
        seen[channel] = name
        parts.setdefault(channel.source, {})[name] = channel
    if not parts:
        raise LogError("holds no channel beside its times", where=where)
    return parts


def _times(
    key: str,
    given: Mapping[str, Floats],
    own: Mapping[str, Channel],
    units: Mapping[str, str],
    where: str,
) -> Floats:
    """Return the times of a message, (n,) s, as they are given."""
    name = next((n for n in (f"{key}.{TIME_COLUMN}", TIME_COLUMN) if n in given), None)
    if name is None:
        raise LogError(
            f"{key} has no times", where=where, hint=f"add a column {TIME_COLUMN!r}, in s"
        )
    conversion = si_as_written(units.get(name, "s"))
    if conversion.unit != "s":
        raise LogError(f"{name!r} is in {units[name]!r}, which is no time", where=where)
    for column in own:
        if given[column].shape != given[name].shape:
            raise LogError(
                f"{column!r} has {given[column].size} values, {name!r} {given[name].size}",
                where=where,
            )
    times: Floats = given[name] * conversion.scale
    return times


def _message(
    key: str,
    own: Mapping[str, Channel],
    given: Mapping[str, Floats],
    t: Floats,
    units: Mapping[str, str],
    where: str,
) -> tuple[Message, list[QualityRecord]]:
    """Return a message and what had to be repaired of its times."""
    dated = np.isfinite(t)
    stamp = t[dated]
    quality = []
    order = np.argsort(stamp, kind="stable")
    if (np.diff(stamp) < 0).any():
        count = int((np.diff(stamp) < 0).sum())
        text = f"{count} records are earlier than the one before: put in order"
        quality.append(QualityRecord("repaired", key, None, None, count, text))
    is_last = np.append(np.diff(stamp[order]) > 0, True) if stamp.size else np.zeros(0, bool)
    kept = order[is_last]
    if kept.size < stamp.size:
        count = int(stamp.size - kept.size)
        text = f"{count} records have the time of another: the last one counts"
        quality.append(QualityRecord("duplicate", key, None, None, count, text))
    columns = {}
    for name, channel in own.items():
        values = given[name][dated]
        values.flags.writeable = False
        columns[channel.field] = Column(partial(_same, values), si_as_written(units.get(name, "")))
    first = next(iter(own.values()))
    made = Message(first.message, first.instance, stamp[kept], stamp, kept, columns)
    return made, quality


def _same(values: Floats) -> Floats:
    return values.view()
