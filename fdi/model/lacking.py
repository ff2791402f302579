"""What falls away because a log lacks it, in words of messages and parts?

In: the statements of a model that need a quantity which no channel of the log shows, with the
channels that could. Out: a line for every message that is lacking, however many quantities it has.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from fdi.model.naming import component_words, inside
from fdi.model.parts import Component, Equation
from fdi.telemetry import Channel, Log
from fdi.telemetry.catalogue import recorded_message

_UNIT: Final = re.compile(r"(?:(?<=[A-Z])([23])|\[([12])\])$")
_ORDINAL: Final = ("", "", "second ", "third ")
_MOST: Final = 3


@dataclass(frozen=True, slots=True)
class Fallen:
    """Statements that need one quantity, and the channels of which any would show it."""

    channels: frozenset[Channel]
    equations: tuple[Equation, ...]


def lacking_words(
    fallen: Iterable[Fallen], components: Mapping[str, Component], log: Log | None
) -> Iterator[str]:
    """Yield what a log lacks and which tests fall away for it, those of one message in one line."""
    together: dict[tuple[str, ...], list[Fallen]] = {}
    for one in fallen:
        sources = tuple(sorted({recorded_message(channel.source) for channel in one.channels}))
        together.setdefault(sources, []).append(one)
    for sources, group in together.items():
        equations = [equation for one in group for equation in one.equations]
        names = list(dict.fromkeys(e.component for e in equations if e.component))
        parts = [inside(component_words(name, components)) for name in names]
        fields = sorted(
            {channel.field.partition(":")[0] for one in group for channel in one.channels}
        )
        count = len(equations)
        numbered = bool(parts) and any(map(str.isdigit, parts[0]))  # motor 1, and not "the motor 1"
        of = f" of {'' if numbered else 'the '}{_listed(parts)}" if parts else ""
        tests = f"{count} test{of} is" if count == 1 else f"{count} tests{of} are"
        yield f"{_absent(sources, fields, parts, log)}: {tests} left out"


def _absent(sources: tuple[str, ...], fields: list[str], parts: list[str], log: Log | None) -> str:
    """Return what is not there: a unit, a message, or fields of one that is there."""
    shown = ", ".join(fields[:_MOST]) + (", ..." if len(fields) > _MOST else "")
    unit = _UNIT.search(sources[0])
    if len(sources) == 1 and unit and len(parts) == 1:
        number = int(unit[1]) if unit[1] else int(unit[2]) + 1
        return f"no {_ORDINAL[number]}{parts[0]} in this log ({sources[0]}: {shown})"
    there = [source for source in sources if log is not None and source in log]
    if log is not None and there:
        named = " and ".join(there)
        why = _doubt(there, fields, log)
        if why:
            are = "is" if len(fields) == 1 else "are"
            return f"{shown} of {named} in this log {are} not believed ({why})"
        return f"{named} in this log {'shows' if len(there) == 1 else 'show'} no {shown}"
    return f"no {' or '.join(sources)} in this log ({shown})"


def _doubt(there: list[str], fields: list[str], log: Log) -> str:
    """Return why the fields that these messages do show are not believed, else nothing."""
    for one in log.inputs:
        told = (channel.partition(".") for channel in one.channels)
        if one.believed is False and any(
            field in fields and recorded_message(source) in there for source, _, field in told
        ):
            return one.why
    return ""


def _listed(parts: list[str]) -> str:
    more = len(parts) - _MOST
    return ", ".join(parts[:_MOST]) + (f" and {more} more" if more > 0 else "")
