"""Which of its sensors did the autopilot stop using in flight?

In: the messages and the flights. Out: events. SYS_STATUS says by bits which sensors are there and
which are used (enabled). A used one that is used no more while it is still there was switched off
by the autopilot, because it did not believe it, or by hand: what it did, not who was wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from fdi.telemetry.events import Event, Flight
from fdi.telemetry.message import Message

# MAV_SYS_STATUS_SENSOR; what controllers do (bits 10 to 15) changes with the flight mode
SENSORS: Final = {
    0: "gyroscope",
    1: "accelerometer",
    2: "compass",
    3: "barometer",
    4: "airspeed sensor",
    5: "GPS receiver",
    6: "optical flow sensor",
    8: "rangefinder",
    16: "radio control receiver",
}
WARNING: Final = 4  # MAV_SEVERITY
NOTICE: Final = 5


def sensor_events(messages: Mapping[str, Message], flights: Sequence[Flight]) -> Iterator[Event]:
    """Yield where in flight a sensor is no longer used, and where it is used again."""
    status = messages.get("SYS_STATUS")
    names = ("onboard_control_sensors_present", "onboard_control_sensors_enabled")
    if status is None or len(status) < 2 or any(name not in status for name in names):
        return
    present, enabled = (np.nan_to_num(status.raw(name)[status.kept]).astype(int) for name in names)
    t = status.t
    flies = np.zeros(t.size, np.bool_)
    for flight in flights:
        low, high = flight.airborne
        flies |= flight.flew & (t > low) & (t <= high)
    for bit, name in SENSORS.items():
        used = (enabled >> bit) & 1
        there = (present >> bit) & 1 == 1
        stays = np.append(False, there[1:] & there[:-1]) & flies
        off = False
        for row in np.flatnonzero(stays & (np.diff(used, prepend=used[0]) != 0)).tolist():
            if used[row] and off:
                yield Event(float(t[row]), "sensor", f"the {name} is used again", NOTICE)
            elif not used[row]:
                what = f"the autopilot no longer uses the {name}"
                yield Event(float(t[row]), "sensor", what, WARNING)
            off = not used[row]
