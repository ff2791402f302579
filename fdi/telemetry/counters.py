"""Which parameters of a vehicle does nobody set, because the autopilot counts in them?

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


def is_counter(parameter: str) -> bool:
    """Return whether the autopilot counts in a parameter.

    Examples
    --------
    >>> is_counter("STAT_RUNTIME"), is_counter("LND_FLIGHT_T_LO"), is_counter("BATT_CAPACITY")
    (True, True, False)
    """
    return _COUNTER.fullmatch(parameter) is not None
