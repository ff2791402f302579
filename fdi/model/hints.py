"""Which message would test a component, and which setting of the autopilot logs it?

In: a component, a model and a log whose telemetry does not show it. Out: words that a person can
act on ("GPS_RAW_INT at 2 Hz or more would test it (SRn_EXT_STAT)"), in the terms of the autopilot
and the kind of log at hand. Whether a message would do follows from structure alone, so that it
works for any model. The settings are data: ``telemetry/data/logging.json``, with its sources.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain
from typing import Final

import numpy as np

from fdi.model.airframe import Airframe
from fdi.model.expression import symbols
from fdi.model.parts import Kind, Measurement
from fdi.model.system import System, SystemEquation
from fdi.structure import decompose, submodel
from fdi.telemetry import Log
from fdi.telemetry.catalogue import data_table, recorded_message
from fdi.telemetry.dialect import definition_by_name
from fdi.telemetry.log import recorder_of


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


_BIT: Final = re.compile(r"bit (\d+)")
_STEP: Final = "step"
"""In a condition: the statement needs samples often enough."""
_MAPPED: Final = {"dataflash": "mavlink_dataflash", "ulog": "mavlink_ulog"}


def would_test(
    components: Iterable[str], airframe: Airframe, log: Log, system: System | None = None
) -> dict[str, Hint]:
    """Return which telemetry would test components that this log does not show, where any would.

    Messages of the component itself come first; where none does alone, a smallest choice of them.

    Parameters
    ----------
    components : iterable of str
        Components of the model.
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
    shown = _tested(system)
    left_out = {str(copy.channel) for copy in system.copies} | set(system.implied)
    absent = [m for m in _absent(airframe, log) if _could_be(m.channel.source, log)]

    @cache
    def held(sources: frozenset[str]) -> System:
        # Comparing all channels anew for copies would cost ten times the rest: they are known.
        return airframe.observe(log, also=sources, repeated=True)

    @cache  # what one component asks, others ask as well
    def likely(sources: frozenset[str]) -> set[str]:
        """Return what they test by structure, in a fifteenth of the time of a look anew."""
        whole = held(frozenset(m.channel.source for m in absent))
        return _tested(whole, left_out, {m.channel.source for m in absent} - sources)

    def surely(sources: frozenset[str]) -> set[str]:
        return _tested(held(sources), left_out)

    found = dict[str, Hint | None]()
    for component in components:
        if component in shown:
            found[component] = _more_often(component, system, log)
            continue
        own = [m.channel.source for m in absent if m.component == component and not m.trusted]
        wanted = list(dict.fromkeys(chain(own, (m.channel.source for m in absent))))
        chosen = _chosen(component, wanted, likely)
        if chosen and component not in surely(frozenset(chosen)):
            chosen = _chosen(component, wanted, surely)
        found[component] = _hint(chosen, log) if chosen else None
    return {component: hint for component, hint in found.items() if hint is not None}


def _chosen(
    component: str, wanted: list[str], tested: Callable[[frozenset[str]], set[str]]
) -> list[str]:
    """Return the first message that tests a component alone, or few that do together, or none."""
    if not wanted or component not in tested(frozenset(wanted)):  # more never test less
        return []
    for source in wanted:
        if component in tested(frozenset([source])):
            return [source]
    for source in reversed(wanted):
        without = [other for other in wanted if other != source]
        wanted = without if component in tested(frozenset(without)) else wanted
    return wanted


def _could_be(source: str, log: Log) -> bool:
    """Return whether a log of this vehicle could hold a message: its sensor may be on board."""
    told = data_table("logging")["sensors"].get(recorded_message(source), ())
    values = [log.parameters[name] for name in told if name in log.parameters]
    is_fitted = log.autopilot != "ardupilot" or not values or any(value > 0 for value in values)
    return is_fitted and bool(recorded_as(source, log))


def recorded_as(source: str, log: Log) -> str:
    """Return what a log of this kind calls a message of the model, "" where it has none such.

    What is made of another message is called as that one.
    """
    source = recorded_message(source)
    if recorder_of(log.format) in _MAPPED:
        row = data_table(_MAPPED[recorder_of(log.format)])["messages"].get(source)
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
    if recorder_of(log.format) == "dataflash":
        bit = _bit_words(bare, log)
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


def log_bit(record: str, log: Log) -> int | None:
    """Return the bit of ArduPilot's LOG_BITMASK for a record, by the kind of vehicle, or None."""
    found = _BIT.search(_bit_words(record, log))
    return int(found[1]) if found else None


def _bit_words(record: str, log: Log) -> str:
    groups = data_table("mavlink_dataflash")["groups"]
    kind = next((kind for kind, vehicles in groups.items() if log.vehicle in vehicles), "")
    return str(data_table("logging")["bits"].get(kind, {}).get(record, ""))


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


def _tests(
    system: System, left_out: Collection[str] = (), without: Collection[str] = ()
) -> list[SystemEquation]:
    """Return the statements that the rest of the system can hold against their component.

    ``left_out`` are equations that count for nothing, ``without`` messages that are not there.
    """
    model = system.structure()
    equation_of = {equation.name: equation for equation in system.equations}
    told = {e.name: e.measurement for e in system.equations if e.measurement is not None}
    unheard = {name for name, one in told.items() if one.channel.source in without}
    inputs = {told[name].variable for name in unheard if equation_of[name].kind is Kind.INPUT}

    def is_used(name: str) -> bool:
        equation = equation_of[name]
        lacks = name in unheard or not inputs.isdisjoint(equation.edges)  # see `usable`
        return not (equation.supports or lacks or name in left_out)

    part = submodel(model, [i for i, name in enumerate(model.equations) if is_used(name)])
    return [equation_of[part.equations[i]] for i in decompose(part).over.equations]


def _tested(
    system: System, left_out: Collection[str] = (), without: Collection[str] = ()
) -> set[str]:
    """Return the components of which anything is tested."""
    statements = _tests(system, left_out, without)
    return {one.component for one in statements if one.component is not None}


def _absent(airframe: Airframe, log: Log) -> list[Measurement]:
    """Return the measurements of a model whose messages a log lacks."""
    absent = [m for m in airframe.measurements if is_lacking(m.channel.source, log)]
    return [m for m in absent if not m.made_by and not _is_set(m.channel.source, log)]


def _is_set(source: str, log: Log) -> bool:
    """Return whether the log was to hold a message: its firmware or its sensors have none."""
    record = recorded_as(source, log).partition("[")[0]
    if log.format == "ulog":
        profiles = data_table("logging")["profiles"]
        found = _BIT.search(profiles.get(record, profiles["default"]))
        bit, mask = int(found[1]) if found else None, log.parameters.get("SDLOG_PROFILE")
    elif recorder_of(log.format) == "dataflash":
        bit, mask = log_bit(record, log), log.parameters.get("LOG_BITMASK")
    else:
        return False
    return bit is not None and mask is not None and bool(int(mask) >> bit & 1)


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
    own = {n for e in _tests(system) if e.component == component for n in e.edges}
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
