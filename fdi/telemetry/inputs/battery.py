"""Are a battery's charge and current measured?

In: charge, current, throttle. Out: whether they are what they are called. PX4 without a capacity
(``BAT1_CAPACITY`` -1, its default) tells as charge what the voltage under load is (Battery.cpp,
calculateStateOfChargeVoltageBased): it falls at take-off, and comes back when the load goes. A
charge never comes back in flight. A vehicle under power draws more than its board: a current that
is next to nothing then comes from no sensor, or from none at that moment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.inputs.values import LEAST, Judged, Mask, first_half, judged, while_armed
from fdi.telemetry.message import Floats, Message

_CHARGE: Final = "battery_remaining"
_CURRENT: Final = "current_battery"
RISES: Final = 0.02
"""Twice the resolution of a charge in MAVLink, one per cent."""
BOARD_A: Final = 0.5
"""A: boards draw up to that (Pixhawk with receiver and radio, 2.5 W), no motor that lifts it so
little."""
UNDER_POWER: Final = 0.1
"""Of full throttle."""
FEW: Final = 0.05
"""Of the records under power, that a sensor may drop."""
MOST: Final = 0.5


def judge_batteries(messages: Mapping[str, Message], armed: Floats) -> Iterator[Judged]:
    """Yield what is to be said of the charge and the current of every battery.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    armed : (k, 2) float
        From when to when, s.
    """
    for message in messages.values():
        if message.name not in ("SYS_STATUS", "BATTERY_STATUS"):
            continue
        number = f" {message.instance + 1}" if message.instance else " 1"
        if _CHARGE in message and message.has_known(_CHARGE):
            yield _charge(f"charge of battery{number}", message)
        if _CURRENT in message and message.has_known(_CURRENT):
            name = f"current of battery{number}"
            yield _current(name, message, _powered(messages, message.t, armed))


def _charge(name: str, message: Message) -> Judged:
    left = message.si(_CHARGE)
    left = left[np.isfinite(left)]
    rise = float((left - np.minimum.accumulate(left)).max())
    if rise > RISES:
        why = f"it rises by {100 * rise:.0f} %: it is a voltage, not a charge"
        return judged(name, message, (_CHARGE,), False, why)
    return judged(name, message, (_CHARGE,), True, "it never rises")


def _powered(messages: Mapping[str, Message], t: Floats, armed: Floats) -> Mask:
    """Return when the motors are given power, (n,) bool."""
    on = while_armed(t, armed)
    hud = messages.get("VFR_HUD")
    if hud is None or "throttle" not in hud or len(hud) < 2:
        return np.zeros(t.size, np.bool_)
    return on & (np.interp(t, hud.t, hud.si("throttle")) > UNDER_POWER)


def _current(name: str, message: Message, powered: Mask) -> Judged:
    current = message.si(_CURRENT)
    known = np.isfinite(current) & powered
    fields = (_CURRENT,)
    if known.sum() < LEAST:
        return judged(name, message, fields, None, "the vehicle is not seen under power")
    with np.errstate(invalid="ignore"):
        little = powered & (current < BOARD_A)
    share = float(little[first_half(known)].mean())
    if share > MOST:
        why = f"under power it is below {BOARD_A} A in {100 * share:.0f} % of the records"
        return judged(name, message, fields, False, f"{why}: nothing measures it")
    if share > FEW:
        why = f"{100 * share:.0f} % of its records under power are next to 0 A and are left out"
        return judged(name, message, fields, True, why, little)
    return judged(name, message, fields, True, "it is there under power")
