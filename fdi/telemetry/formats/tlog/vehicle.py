"""Who sent these messages, and which of the senders is the vehicle?

In: the payloads per sender. Out: the `Vehicle`, and every sender as a `Source`.

The vehicle is the sender whose heartbeat names an autopilot and no ground station, with most
frames; ``system`` decides otherwise. Ground stations and radios are it only where there is nobody
else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry.catalogue import mavlink_autopilot, mavlink_vehicle
from fdi.telemetry.formats.tlog.columns import Payloads
from fdi.telemetry.formats.tlog.groups import Key, Sender
from fdi.telemetry.log import Source

Identities = Mapping[Sender, tuple[int, int] | None]  # (MAV_TYPE, MAV_AUTOPILOT), None: unknown

RADIO: Final[Sender] = (51, 68)
"""System and component of SiK radios."""

_GROUND_STATION: Final = 6  # MAV_TYPE_GCS
_NO_AUTOPILOT: Final = 8  # MAV_AUTOPILOT_INVALID
_HEARTBEAT: Final = 0


class Sent(NamedTuple):
    """How many frames of a sender are in the file, and how many are missing by their numbers."""

    frames: int
    lost: int


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The sender that a log is about; ``vehicle`` and ``autopilot`` as in `Log`."""

    system: int
    component: int
    vehicle: str
    autopilot: str

    @property
    def sender(self) -> Sender:
        """Its autopilot: what other components of the system say is not the vehicle's state."""
        return self.system, self.component


def by_parameters(vehicle: Vehicle, values: Mapping[str, float]) -> Vehicle:
    """Return the vehicle, one that rotors lift as well where its parameters say so.

    The heartbeats of ArduPlane before 4.0 call it a plane.
    """
    lifted = vehicle.autopilot == "ardupilot" and values.get("Q_ENABLE", 0.0) > 0
    return replace(vehicle, vehicle="vtol") if lifted and vehicle.vehicle == "plane" else vehicle


def identities(groups: Mapping[Key, Payloads]) -> Identities:
    """Return what every sender's heartbeats say that it is."""
    return {
        sender: _identity(groups, sender) for sender in dict.fromkeys(key[:2] for key in groups)
    }


def _identity(groups: Mapping[Key, Payloads], sender: Sender) -> tuple[int, int] | None:
    """Return (MAV_TYPE, MAV_AUTOPILOT) that a sender's heartbeats name most often."""
    beats = groups.get((*sender, _HEARTBEAT))
    if beats is None:
        return None
    both = beats.field("type").astype(np.int64) << 8 | beats.field("autopilot")
    most = int(np.argmax(np.bincount(both)))
    return most >> 8, most & 0xFF


def choose_vehicle(
    senders: Mapping[Sender, Sent], known: Identities, system: int | None
) -> Vehicle:
    """Return the vehicle.

    Raises
    ------
    UsageError
        Nobody in the log has that system number.
    """
    wanted = [sender for sender in senders if system is None or sender[0] == system]
    if not wanted:
        present = ", ".join(str(s) for s in sorted({s for s, _ in senders}))
        raise UsageError(f"the log has no system {system}", hint=f"it has {present}")

    def rank(sender: Sender) -> tuple[bool, bool, int]:
        kind = known[sender]
        flies = kind is not None and kind[0] != _GROUND_STATION and kind[1] != _NO_AUTOPILOT
        is_ground = (kind is not None and kind[0] == _GROUND_STATION) or sender == RADIO
        return flies, not is_ground, senders[sender].frames

    sender = max(wanted, key=rank)
    kind = known[sender]
    if kind is None:
        return Vehicle(*sender, "other", "other")
    return Vehicle(*sender, mavlink_vehicle(kind[0]), mavlink_autopilot(kind[1]))


def sources(
    senders: Mapping[Sender, Sent], known: Identities, vehicle: Vehicle
) -> Iterator[Source]:
    """Yield every sender, ascending."""
    for sender, sent in senders.items():
        kind = known[sender]
        yield Source(
            *sender,
            *sent,
            None if kind is None or kind[0] == _GROUND_STATION else mavlink_vehicle(kind[0]),
            None if kind is None or kind[1] == _NO_AUTOPILOT else mavlink_autopilot(kind[1]),
            sender == vehicle.sender,
        )
