"""Which way is up in this log?

`GLOBAL_POSITION_INT.vz` is down positive by definition, and up positive in ArduPilot until about
2016. The dialect cannot tell, the data can: against the climb rate (VFR_HUD.climb, else the change
of altitude) the correlation is -0.8..-1.0 in new logs, +0.86 and +0.95 in old ones (formats.md,
trap 1).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord

_CLEAR: Final = 0.5  # |correlation| that decides; measured ones are 0.82 and more
_MOVING: Final = 0.3  # m/s, standard deviation: on the ground there is only noise


def vertical_speed_down(
    messages: Mapping[str, Message],
) -> tuple[dict[str, Message], list[QualityRecord]]:
    """Return the messages with a down positive GLOBAL_POSITION_INT.vz, and what was turned."""
    position = messages.get("GLOBAL_POSITION_INT")
    if position is None or len(position) < 3:
        return dict(messages), []
    down = position.si("vz")
    climb = _climb(messages, position)
    known = np.isfinite(down) & np.isfinite(climb)
    if known.sum() < 3 or min(np.std(down[known]), np.std(climb[known])) < _MOVING:
        return dict(messages), []
    correlation = float(np.corrcoef(down[known], climb[known])[0, 1])
    if correlation < _CLEAR:
        return dict(messages), []
    turned = position.with_sign("vz", -1.0)
    text = f"vz is up positive in this log (r = {correlation:+.2f} with the climb rate): turned"
    span = float(position.t[0]), float(position.t[-1])
    record = QualityRecord("repaired", "GLOBAL_POSITION_INT.vz", *span, len(position), text)
    return {**messages, "GLOBAL_POSITION_INT": turned}, [record]


def _climb(messages: Mapping[str, Message], position: Message) -> NDArray[np.float64]:
    hud = messages.get("VFR_HUD")
    if hud is not None and len(hud) > 2:
        return np.interp(position.t, hud.t, hud.si("climb"), left=np.nan, right=np.nan)
    altitude = position.si("relative_alt")
    return np.gradient(altitude, position.t)
