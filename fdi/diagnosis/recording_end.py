"""Where a recording stops in flight: was power there, and what else may have stopped it?

In: a log. Out: one `Fact`, or none. Power is told by the voltages of
the last seconds against those before; what a recorder of this kind stops for is told as what it may
be, and no more.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.diagnosis.stood_out import ENDING, Fact
from fdi.telemetry import Log

LAST_S: Final = 3.0
"""In which a voltage tells of the end: batteries are reported once a second, or twice."""
BEFORE_S: Final = 30.0
KEPT: Final = 0.9
"""Of its voltage half a minute before, that a pack under load keeps at least: one that is run down
loses a tenth in minutes."""
BOARD_V: Final = 4.5
"""Brown-out margin of 5 V autopilots (models/shared/health.yaml)."""
_OPEN: Final = ("in_air", "control_lost")
"""Ends without the ground."""
_CELLS: Final = (("SYS_STATUS", "voltage_battery", "battery"), ("POWER_STATUS", "Vcc", "board"))
_KINDS: Final = {
    "tlog": "a telemetry log stops as well when the link is lost or the ground station stops",
    "dataflash": "a log on board stops as well when its recorder is stopped",
    "ulog": "a log on board stops as well when its recorder is stopped",
}


def recording_end(log: Log) -> tuple[Fact, ...]:
    """Return what is known of why the recording stops; nothing where the flight ends otherwise."""
    if not any(end.how in _OPEN for end in log.ends[-1:]):
        return ()
    stop = log.span[1]
    told = [one for one in (_voltage(log, stop, *cell) for cell in _CELLS) if one is not None]
    if not told:
        power = "no voltage in the log tells whether power was there"
    else:
        has_power = all(kept for kept, _ in told)
        listed = " and ".join(words for _, words in told)
        power = f"power was {'there' if has_power else 'going'} at its last records ({listed})"
    other = _KINDS.get(log.format, "")
    off = any(e.kind == "disarm" and e.t > stop - LAST_S for e in log.events)
    if off:
        other = "the autopilot had just been disarmed, at which recorders stop"
    text = f"the recording stops in flight (log {stop:.1f} s): {power}"
    return (Fact(ENDING, f"{text}; {other}" if other else text),)


def _voltage(log: Log, stop: float, key: str, field: str, name: str) -> tuple[bool, str] | None:
    """Return whether a voltage was kept to the end, and what it was; None where it is not told."""
    message = log.messages.get(key)
    if message is None or field not in message or not message.has_known(field):
        return None
    t, value = message.t, message.si(field)
    late = value[(t > stop - LAST_S) & np.isfinite(value)]
    early = value[(t <= stop - LAST_S) & (t > stop - BEFORE_S) & np.isfinite(value)]
    if not late.size or not early.size:
        return None
    before, last = float(np.median(early)), float(late[-1])
    kept = last >= KEPT * before and (name != "board" or last >= BOARD_V)
    return kept, f"{name} {last:.1f} V" + ("" if kept else f" after {before:.1f} V")
