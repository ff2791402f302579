"""Was power there at a moment, by the voltages that the log holds?

In: messages and the time, s. Out: a `Supply` for battery and board, as far as records of the last
seconds tell. A voltage is told by its last record against those of half a minute before.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.telemetry.message import Message

LAST_S: Final = 3.0
"""In which a voltage tells of a moment: batteries are reported once a second, or twice."""
BEFORE_S: Final = 30.0
KEPT: Final = 0.9
"""Of its voltage half a minute before, that a pack under load keeps at least: one that is run down
loses a tenth in minutes."""
BOARD_V: Final = 4.5
"""Brown-out margin of 5 V autopilots (models/shared/health.yaml)."""
_FIELDS: Final = {
    "battery": (("SYS_STATUS", "voltage_battery"), ("BATTERY_STATUS", "voltages[0]")),
    "board": (("POWER_STATUS", "Vcc"), ("HWSTATUS", "Vcc")),
}


@dataclass(frozen=True, slots=True)
class Supply:
    """A voltage about a moment, V: before it, at its last record, at the first one after.

    ``source`` is the field that tells it, ``at`` the time of its last record, s.
    """

    name: str
    before: float
    last: float
    after: float | None
    source: str
    at: float

    @property
    def kept(self) -> bool:
        """Whether it was there at its last record."""
        return self.last >= KEPT * self.before and (self.name != "board" or self.last >= BOARD_V)

    def words(self) -> str:
        """Return its name and voltage, with that of before where it fell."""
        fell = "" if self.kept else f" after {self.before:.1f} V"
        return f"{self.name} {self.last:.1f} V{fell}"

    def record(self) -> str:
        """Return the record that tells it."""
        before = f"median of the {BEFORE_S:.0f} s before {self.before:.2f} V"
        return f"{self.source}: {self.last:.2f} V at log {self.at:.1f} s, {before}"


def supplies(messages: Mapping[str, Message], at: float) -> tuple[Supply, ...]:
    """Return what is known of battery and board, in that order."""
    found = (
        next(filter(None, (_supply(messages, at, name, *field) for field in fields)), None)
        for name, fields in _FIELDS.items()
    )
    return tuple(one for one in found if one is not None)


def _supply(
    messages: Mapping[str, Message], at: float, name: str, key: str, field: str
) -> Supply | None:
    message = messages.get(key)
    if message is None or field not in message or not message.has_known(field):
        return None
    known = np.isfinite(message.si(field))
    t, value = message.t[known], message.si(field)[known]
    is_late = (t > at - LAST_S) & (t <= at)
    late = value[is_late]
    early = value[(t <= at - LAST_S) & (t > at - BEFORE_S)]
    if not late.size or not early.size:
        return None
    after = value[(t > at) & (t <= at + BEFORE_S)]
    first = float(after[0]) if after.size else None
    before, last, told = float(np.median(early)), float(late[-1]), float(t[is_late][-1])
    return Supply(name, before, last, first, f"{key}.{field}", told)
