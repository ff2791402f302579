"""Which parameters does nobody set, because the autopilot counts in them, and which steer nothing?

In: a parameter's name. Out: whether it is one of them. They change with every flight and while one
is recorded, so a list of what was set otherwise is without them.

References
----------
ArduPilot, ``AP_Stats`` (``STAT_BOOTCNT``, ``STAT_FLTTIME``, ``STAT_RUNTIME``, ``STAT_RESET``,
``STAT_FLTCNT``, ``STAT_DISTFLWN``). PX4, parameter reference: ``LND_FLIGHT_T_HI``, ``_LO`` (total
flight time), ``COM_FLIGHT_UUID`` (number of the next flight).
"""

from __future__ import annotations

import re
from typing import Final

_COUNTER: Final = re.compile(r"STAT_[A-Z0-9_]+|LND_FLIGHT_T_(HI|LO)|COM_FLIGHT_UUID", re.ASCII)


_ASIDE: Final = re.compile(
    r"(BARO\d*|GND)_(GND|ABS)_(PRESS|TEMP)|GND_TEMP|(SR|MAV_?)\d_\w+|SYS_NUM_RESETS|MIS_TOTAL"
    r"|FENCE_TOTAL|RALLY_TOTAL|(Q_M|MOT)_THST_HOVER|FFT_(FREQ_HOVER|BW_HOVER|THR_REF)"
    r"|EKF2_MAGBIAS_[XYZ]",
    re.ASCII,
)
"""The pressure of the ground, how often a stream is sent, how many points are stored; and what an
autopilot learns in flight and writes down as it is disarmed (``MOT_HOVER_LEARN``, in-flight FFT,
``EKF2_MAGBIAS``): it had it in force before."""


def steers(parameter: str) -> bool:
    """Return whether a parameter may change how a vehicle flies.

    Examples
    --------
    >>> steers("ATC_RAT_RLL_P"), steers("SERVO1_FUNCTION"), steers("COMPASS_OFS_X")
    (True, True, True)
    >>> steers("STAT_RUNTIME"), steers("BARO1_GND_PRESS"), steers("MOT_THST_HOVER")
    (False, False, False)
    """
    return not is_counter(parameter) and _ASIDE.fullmatch(parameter) is None


def is_counter(parameter: str) -> bool:
    """Return whether the autopilot counts in a parameter.

    Examples
    --------
    >>> is_counter("STAT_RUNTIME"), is_counter("LND_FLIGHT_T_LO"), is_counter("BATT_CAPACITY")
    (True, True, False)
    """
    return _COUNTER.fullmatch(parameter) is not None
