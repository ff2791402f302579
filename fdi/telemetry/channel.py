"""How is one measured quantity of a log named?

``MESSAGE.field``, with an instance ``MESSAGE[1].field``; instance 0 has no bracket. The published
notation ``74/airspeed`` (message number, field, any case) is accepted wherever a channel is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final

from fdi.errors import UsageError
from fdi.shown import Shown
from fdi.telemetry.dialect import MessageDefinition, definition, definition_by_name

_PART: Final = r"[\w/-]+(?:\[\d{1,5}\])?"  # the stroke and the hyphen are ULog's
_FIELD: Final = rf"{_PART}(?:\.{_PART})*"  # ULog nests: esc[0].esc_rpm
_INSTANCE: Final = r"(?:\[(-?\d{1,10})\])?"
_NAMED: Final = re.compile(rf"(?!\d+/)([\w/-]+(?:#\d+)?){_INSTANCE}\.({_FIELD})", re.A)
_NUMBERED: Final = re.compile(rf"(\d{{1,8}}){_INSTANCE}/(\w+(?:\[\d{{1,5}}\])?)", re.A)
_DATAFLASH_NAME: Final = 4  # characters at most
_HINT: Final = "write MESSAGE.field, MESSAGE[1].field or number/field, e.g. VFR_HUD.airspeed"


@dataclass(frozen=True, slots=True)
class Channel(Shown):
    """One field of one message (of one instance of it); a key: equality, hash and order.

    Examples
    --------
    >>> str(Channel("BATTERY_STATUS", "temperature", 1))
    'BATTERY_STATUS[1].temperature'
    >>> Channel.parse("74/AirSpeed")
    Channel(message='VFR_HUD', field='airspeed', instance=None)
    """

    message: str
    field: str
    instance: int | None = None

    def __str__(self) -> str:
        return f"{self.source}.{self.field}"

    def __lt__(self, other: Channel) -> bool:
        return self._key() < other._key()

    def _key(self) -> tuple[str, int, str]:
        # dataclass(order=True) would compare None with int
        return self.message, self.instance or 0, self.field

    @property
    def source(self) -> str:
        """The key of the log's message that holds this channel, e.g. ``BATTERY_STATUS[1]``."""
        return self.message if self.instance is None else f"{self.message}[{self.instance}]"

    @classmethod
    def parse(cls, text: str) -> Channel:
        """Return the channel that a text names.

        The field is resolved to the dialect's spelling, whatever its case. A message that the
        dialect does not know (of another log format) is taken as it is written. A name in small
        letters is a ULog's topic: some are called like MAVLink's messages (``battery_status``),
        and have other fields.

        Raises
        ------
        UsageError
            The text is no channel, its number unknown, or the message has no such field.
        """
        named, numbered = _NAMED.fullmatch(text.strip()), _NUMBERED.fullmatch(text.strip())
        found = named or numbered
        if found is None:
            raise UsageError(f"{text[:80]!r} is no channel", hint=_HINT)
        message, instance_text, field = found.groups()
        instance = int(instance_text or 0) or None
        if numbered:
            known = definition(int(message))
            if known is None:
                raise UsageError(f"{text!r}: no MAVLink message has the number {message}")
        else:
            known = definition_by_name(message if message.islower() else message.upper())
            if known is None or (len(message) <= _DATAFLASH_NAME and not _has(known, field)):
                return cls(message, field, instance)
        return cls(known.name, _spelling(known, field, text), instance)


def _has(message: MessageDefinition, field: str) -> bool:
    return field.partition("[")[0].lower() in (f.name.lower() for f in message.fields)


def _spelling(message: MessageDefinition, field: str, text: str) -> str:
    base, bracket, index = field.partition("[")
    names = {f.name.lower(): f for f in message.fields}
    found = None if "." in field else names.get(base.lower())
    if found is None:
        near = get_close_matches(base.lower(), names, n=1)
        hint = f"did you mean {names[near[0]].name}?" if near else f"it has {', '.join(names)}"
        raise UsageError(f"{text!r}: {message.name} has no field {base}", hint=hint)
    if bracket and int(index[:-1]) >= found.count:
        raise UsageError(f"{text!r}: {message.name}.{found.name} has {found.count} entries")
    return found.name + bracket + index
