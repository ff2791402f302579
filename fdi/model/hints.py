"""Which message would test a component, and which setting of the autopilot logs it?

In: a component, a model and a log whose telemetry does not show it. Out: words that a person can
act on ("GPS_RAW_INT at 2 Hz or more would test it (SRn_EXT_STAT)"), in the terms of the autopilot
and the kind of log at hand. Whether a message would do follows from structure alone, so that it
works for any model. The settings are data: ``telemetry/data/logging.json``, with its sources.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Final

import numpy as np

from fdi.model.airframe import Airframe
from fdi.model.expression import symbols
from fdi.model.parts import Kind
from fdi.model.system import System, SystemEquation
from fdi.structure import decompose, submodel
from fdi.telemetry import Log
from fdi.telemetry.catalogue import data_table, recorded_message
from fdi.telemetry.dialect import definition_by_name


@dataclass(frozen=True, slots=True)
class Hint:
    """The telemetry that would test a component.

    Attributes
    ----------
    what : str
        The messages, with the rate that is needed.
    how : str
        The autopilot's settings that record them, "" for unknown.
    now : str
        How often they come in this log, "" where they do not come at all.
    """

    what: str
    how: str = ""
    now: str = ""

    @property
    def wanted(self) -> str:
        """Return what to record, and how."""
        return f"{self.what} ({self.how})" if self.how else self.what

    def __str__(self) -> str:
        how = f" ({self.how})" if self.how else ""
        return f"{self.what} would test it{how}{f'; {self.now}' if self.now else ''}"


_STEP: Final = "step"
"""In a condition: the statement needs samples often enough."""
_MAPPED: Final = {"dataflash": "mavlink_dataflash", "ulog": "mavlink_ulog"}


def would_test(
    component: str, airframe: Airframe, log: Log, system: System | None = None
) -> Hint | None:
    """Return which telemetry would test a component that this log does not show, None for none.

    Messages of the component itself come first; where none does alone, a smallest choice of them.

    Parameters
    ----------
    component : str
        A component of the model.
    airframe : Airframe
    log : Log
    system : System, optional
        What holds with the log, where that is known already.

    Raises
    ------
    LogError
        The log has no channel that the model measures.
    """
    system = system or airframe.observe(log)
    if _tests(component, system):
        return _more_often(component, system, log)
    wanted = [source for source in _lacking(component, airframe, log) if recorded_as(source, log)]
    told = {e.component for e in airframe.equations} | {m.component for m in airframe.measurements}
    if component not in told:  # no telemetry helps where the model states nothing
        return None
    left_out = {str(copy.channel) for copy in system.copies} | set(system.implied)

    def tested(sources: Collection[str]) -> bool:
        # Comparing all channels anew for copies would cost ten times the rest: they are known.
        more = airframe.observe(log, also=frozenset(sources), repeated=True)
        return bool(_tests(component, more, left_out))

    alone = next((source for source in wanted if tested([source])), None)
    if alone is not None:
        return _hint([alone], log)
    if not tested(wanted):
        return None
    for source in reversed(wanted):
        without = [other for other in wanted if other != source]
        wanted = without if tested(without) else wanted
    return _hint(wanted, log)


def recorded_as(source: str, log: Log) -> str:
    """Return what a log of this kind calls a message of the model, "" where it has none such.

    What is made of another message is called as that one.
    """
    source = recorded_message(source)
    if log.format in _MAPPED:
        row = data_table(_MAPPED[log.format])["messages"].get(source)
        if row is not None:
            return str(row["base"][0]).partition(" on ")[0]
        own = source.islower() if log.format == "ulog" else len(source.partition("[")[0]) <= 4
        return source if own else ""
    if log.autopilot == "px4":
        return str(data_table("logging")["px4_streams"].get(source, ""))
    return source if definition_by_name(source.partition("[")[0]) else ""


def is_lacking(source: str, log: Log) -> bool:
    """Return whether a log would have a message of the model if it were recorded.

    What is made of a message that is there is not lacking: it could not be made of it.
    """
    return source not in log and recorded_message(source) not in log


def setting_of(source: str, log: Log) -> str:
    """Return the setting by which the autopilot logs a message of the model, "" for unknown."""
    table = data_table("logging")
    name = recorded_as(source, log)
    source = recorded_message(source)
    bare = name.partition("[")[0]
    if log.format == "dataflash":
        groups = data_table("mavlink_dataflash")["groups"]
        kind = next((kind for kind, vehicles in groups.items() if log.vehicle in vehicles), "")
        bit = table["bits"].get(kind, {}).get(bare, "")
        return f"LOG_BITMASK, {bit}" if bit else ""
    if log.format == "ulog":
        profile = table["profiles"].get(bare, table["profiles"]["default"])
        return f"SDLOG_PROFILE, {profile}" if name else ""
    if log.autopilot == "px4":
        return f"mavlink stream -s {name} -r {table['rate_hz']:g}" if name else ""
    if log.autopilot != "ardupilot":
        return ""
    stream = next((key for key, own in table["streams"].items() if source in own), "")
    renamed = any(parameter.startswith("MAV1_") for parameter in log.parameters)  # since 4.7
    return f"{'MAVn' if renamed else 'SRn'}_{stream}" if stream else ""


def _hint(sources: Sequence[str], log: Log) -> Hint:
    """Return messages with the rate that is needed, and their settings."""
    table = data_table("logging")
    names = list(dict.fromkeys(recorded_as(source, log) for source in sources))
    settings = dict.fromkeys(s for s in (setting_of(source, log) for source in sources) if s)
    slow = all(source in table["slow"] for source in sources)
    rate = "" if slow else f" at {table['rate_hz']:g} Hz or more"
    return Hint(f"{_listed(names)}{rate}", "; ".join(settings))


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _tests(component: str, system: System, left_out: Collection[str] = ()) -> list[SystemEquation]:
    """Return the statements about a component that the rest of the system can hold against it."""
    model = system.structure()
    equation_of = {equation.name: equation for equation in system.equations}
    used = [
        i
        for i, name in enumerate(model.equations)
        if not equation_of[name].supports and name not in left_out
    ]
    part = submodel(model, used)
    over = (equation_of[part.equations[i]] for i in decompose(part).over.equations)
    return [equation for equation in over if equation.component == component]


def _lacking(component: str, airframe: Airframe, log: Log) -> list[str]:
    """Return the messages of a model that a log lacks, those of the component first."""
    absent = [m for m in airframe.measurements if is_lacking(m.channel.source, log)]
    absent = [m for m in absent if not m.made_by]
    own = [m.channel.source for m in absent if m.component == component and not m.trusted]
    return list(dict.fromkeys(chain(own, (m.channel.source for m in absent))))


def _more_often(component: str, system: System, log: Log) -> Hint | None:
    """Return which messages come too seldom for what the tests of a component need."""
    longest = 1.0 / data_table("logging")["least_hz"]
    found: dict[str, float] = {}
    for source in _needed(component, system):
        t = log[source].t
        period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        if period > longest:
            found[source] = 1.0 / period
    if not found:
        return None
    now = "it comes at" if len(found) == 1 else "the slowest comes at"
    return replace(_hint(list(found), log), now=f"{now} {min(found.values()):.1f} Hz")


def _needed(component: str, system: System) -> Iterable[str]:
    """Return the messages behind those tests of a component that need frequent samples."""
    own = {n for e in _tests(component, system) for n in e.edges}
    fast = [
        e
        for e in system.equations
        if e.when is not None
        and _STEP in symbols(e.when)
        and (e.component == component or own.intersection(e.edges))
    ]
    names = own.union(*(e.edges for e in fast)) if fast else set()
    return dict.fromkeys(
        e.measurement.channel.source
        for e in system.equations
        if e.measurement is not None
        and e.measurement.variable in names
        and (e.kind is Kind.INPUT or e.component == component)
    )
