"""Which estimator flew, and where do its cores stand in the log?

In: a log. Out: `Family`, the estimator whose records the log has, and its `Core`s with their
ratios. What corresponds stands in ``records.json``; of the core that flew, the log's own
``EKF_STATUS_REPORT``, which means the same in all formats, is taken.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry import Log, Message

Floats = NDArray[np.float64]

MOST_CORES: Final = 9  # EKF2_MAX_INSTANCES of PX4
REPORT: Final = "EKF_STATUS_REPORT"
TELEMETRY: Final = (REPORT, "ESTIMATOR_STATUS")
"""Messages that tell only of the core that flies."""
TYPE: Final = "AHRS_EKF_TYPE"


@dataclass(frozen=True, slots=True)
class Family:
    """Which records an estimator writes.

    Attributes
    ----------
    name : str
    status : str
        The message of a core's ratios.
    selected : str
        The channel that says which core flies; "" where only that core is told of.
    combined, relative : str
        Channels of the selector's scores, with ``{core}`` and ``{instance}``.
    is_squared : bool
        The selector compares squares of the root ratios.
    zero_is_unused : bool
        A ratio of 0 says that the source is not used.
    ratios : Mapping[str, tuple of str]
        By quantity the fields that may hold it.
    """

    name: str
    status: str
    selected: str
    combined: str
    relative: str
    is_squared: bool
    zero_is_unused: bool
    ratios: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class Core:
    """One core's ratios: roots of the innovation test ratio, 1 is the gate, NaN unknown or unused.

    Attributes
    ----------
    number : int
        As the selector counts.
    source : str
        Key of its message.
    t : (n,) float, s
    ratios : Mapping[str, (n,) float]
        By quantity; a quantity that the log never has is absent.
    channels : Mapping[str, str]
        By quantity what it was read from.
    """

    number: int
    source: str
    t: Floats
    ratios: Mapping[str, Floats]
    channels: Mapping[str, str]


@cache
def table(name: str) -> Mapping[str, Any]:
    """Return one of the tables beside this file."""
    text = files("fdi.methods.estimator").joinpath(f"{name}.json").read_text("utf-8")
    found: Mapping[str, Any] = json.loads(text)
    return found


def family_of(log: Log) -> Family:
    """Return the estimator whose records the log has: the one it flies on, where it says so.

    Raises
    ------
    LogError
        There is not one record of an estimator's health.
    """
    kind = log.parameters.get(TYPE)
    there = [
        row
        for row in table("records")["families"]
        if row["status"] in log and len(log[row["status"]]) and row["autopilot"] == log.autopilot
    ]
    there.sort(key=lambda row: kind is not None and row.get("type") not in (None, kind))
    for row in there:
        family = replace(_family(row), name=_name(row, log))
        if any(_read(log[family.status], names) for names in family.ratios.values()):
            return family
    raise LogError(
        "holds no message of an estimator's health",
        where=log.name,
        hint="looked for " + ", ".join(row["status"] for row in table("records")["families"]),
    )


def _name(row: Mapping[str, Any], log: Log) -> str:
    """Return the name of the estimator that fills a message, where a parameter chooses it."""
    for parameter, names in row.get("renamed", {}).items():
        chosen = names.get(f"{log.parameters.get(parameter, np.nan):g}")
        if chosen is not None:
            return str(chosen)
    return str(row["name"])


def _family(row: Mapping[str, Any]) -> Family:
    return Family(
        row["name"],
        row["status"],
        row.get("selected", ""),
        row.get("combined", ""),
        row.get("relative", ""),
        row["score"] == "squares",
        row["unused"],
        {quantity: tuple(names) for quantity, names in row["ratios"].items()},
    )


def cores_of(log: Log, family: Family) -> tuple[Core, ...]:
    """Return all cores that the log tells of, by number."""
    keys = [(n, instance(family.status, n)) for n in range(MOST_CORES)]
    return tuple(
        _core(n, log[key], family.ratios, zero_is_unused=family.zero_is_unused)
        for n, key in keys
        if key in log and len(log[key])
    )


def flown(log: Log, family: Family, cores: tuple[Core, ...]) -> Core:
    """Return the ratios of the core that flew, by the table that all formats share."""
    report = log.messages.get(REPORT)
    own = (report.made_from or report.key) if report is not None and len(report) else None
    if report is None or own is None or own.partition("[")[0] != family.status:
        return cores[0]
    fields = {name: (field,) for name, field in table("records")["quantities"].items()}
    found = _core(-1, report, fields, zero_is_unused=family.zero_is_unused)
    lacking = {name: v for name, v in cores[0].ratios.items() if name not in found.ratios}
    if len(cores) > 1 or not lacking or cores[0].t.shape != found.t.shape:
        return found
    order = [name for name in family.ratios if name in {*found.ratios, *lacking}]
    ratios, channels = {**found.ratios, **lacking}, {**cores[0].channels, **found.channels}
    return Core(-1, found.source, found.t, {q: ratios[q] for q in order}, channels)


def instance(message: str, number: int) -> str:
    """Return the key of a message's instance."""
    return message if number == 0 else f"{message}[{number}]"


def _core(
    number: int, message: Message, fields: Mapping[str, tuple[str, ...]], *, zero_is_unused: bool
) -> Core:
    ratios: dict[str, Floats] = {}
    channels: dict[str, str] = {}
    for quantity, names in fields.items():
        field = _read(message, names)
        if field is None:
            continue
        parts = [message.si(name) for name in field.split("+")]
        values = np.sqrt(sum(part * part for part in parts)) if len(parts) > 1 else parts[0].copy()
        # an airspeed ratio of 0 comes without a sensor in every format
        if zero_is_unused or quantity == "airspeed":
            values[values == 0.0] = np.nan
        if np.isfinite(values).any():
            values.flags.writeable = False
            ratios[quantity], channels[quantity] = values, f"{message.key}.{field}"
    return Core(number, message.key, message.t, ratios, channels)


def _read(message: Message, names: tuple[str, ...]) -> str | None:
    """Return the first of the fields, or sums of fields, that the message has."""
    return next((n for n in names if all(part in message for part in n.split("+"))), None)
