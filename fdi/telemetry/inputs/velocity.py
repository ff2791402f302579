"""Does anything tell the estimator where the vehicle goes?

In: the receiver's kind of fix while the vehicle is armed, what else may tell a position, and the
estimated velocity. Out: whether estimated position and velocity over ground are more than the
accelerometers, integrated: half a degree of tilt is 1 m/s after 12 s and 50 m/s after ten minutes.
Estimators that nothing aids say up to thousands of metres a second, downwards too; whoever flies by
attitude alone, indoors or before the receiver has found its satellites, does not miss them.

What the receiver loses in flight is its failure, and costs the estimate no belief.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.inputs.values import LEAST, Judged, first_half, judged, while_armed
from fdi.telemetry.message import Floats, Message

FIXED: Final = 3
"""A position in three dimensions, or better (MAVLink, ``GPS_FIX_TYPE``)."""
SELDOM: Final = 0.1
"""Of the armed time with such a fix: less is no source of a position."""
FASTEST: Final = 150.0
"""m/s, along one axis: twice what the fastest vehicle with such an autopilot dives with."""
OFTEN: Final = 0.1
"""Of the first half of the armed time: who is as fast there has no velocity, he has an estimator
that was never right."""
SECOND: Final = "AHRS2"
"""What ArduPilot does not fly by: where an estimator runs away, it flies by the other one."""
VERTICAL: Final = ("z", "vz", "alt", "relative_alt")
ESTIMATED: Final = {
    "LOCAL_POSITION_NED": ("x", "y", "z", "vx", "vy", "vz"),
    "GLOBAL_POSITION_INT": ("lat", "lon", "vx", "vy", "vz"),
    SECOND: ("roll", "pitch", "yaw", "altitude", "lat", "lng"),
}
_ON_BOARD: Final = ("ATT", "vehicle_attitude")
"""Records on board leave no receiver out, as links do."""
_AIDS: Final = (
    *("OPTICAL_FLOW", "OPTICAL_FLOW_RAD", "ODOMETRY", "VISION_POSITION_ESTIMATE"),
    *("VISION_SPEED_ESTIMATE", "VICON_POSITION_ESTIMATE", "ATT_POS_MOCAP", "GPS2_RAW"),
    *("OF", "VISO", "VISP", "VISV", "BCN", "optical_flow", "vehicle_optical_flow"),
    *("vehicle_visual_odometry", "vehicle_mocap_odometry", "vehicle_gps_position[1]", "GPS[1]"),
)
"""What else tells an estimator where it goes."""


def judge_velocity(messages: Mapping[str, Message], armed: Floats) -> Iterator[Judged]:
    """Yield what is to be said of estimated position and velocity.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    armed : (k, 2) float
        From when to when, s.
    """
    unaided = _unaided(messages, armed)
    away = next(filter(None, (_runs_away(messages.get(key), armed) for key in ESTIMATED)), "")
    for key, fields in ESTIMATED.items():
        message = messages.get(key)
        own = tuple(field for field in fields if message is not None and field in message)
        if message is None or not own:
            continue
        if away:
            yield judged("estimates beside the attitude", message, own, False, away)
            continue
        level = tuple(field for field in own if field not in VERTICAL)
        if unaided is not None and key != SECOND and level:
            why = unaided or "the receiver tells the position"
            yield judged("estimated velocity over ground", message, level, not unaided, why)


def _unaided(messages: Mapping[str, Message], armed: Floats) -> str | None:
    """Return why nothing tells where it goes, "" where something does; None: that is not known."""
    if any(key in messages for key in _AIDS):
        return None
    receiver = messages.get("GPS_RAW_INT")
    if receiver is None and any(key in messages for key in _ON_BOARD):
        return "no receiver is in the log, and nothing else tells it"
    if receiver is None or "fix_type" not in receiver:
        return None
    fix = receiver.si("fix_type")
    on = while_armed(receiver.t, armed) & np.isfinite(fix)
    if np.count_nonzero(on) < LEAST:
        return None
    share = float(np.mean(fix[on] >= FIXED))
    if share >= SELDOM:
        return ""
    seldom = f"the receiver has a position in {100 * share:.0f} % of the armed time"
    return f"{seldom}, and nothing else tells it"


def _runs_away(message: Message | None, armed: Floats) -> str:
    """Return why an estimate is none from the beginning on, "" where it may be one."""
    if message is None:
        return ""
    speeds = [message.si(name) for name in ("vx", "vy", "vz") if name in message]
    if not speeds:
        return ""
    fastest = np.max(np.abs(speeds), axis=0)
    half = first_half(while_armed(message.t, armed) & np.isfinite(fastest))
    if np.count_nonzero(half) < LEAST or np.mean(fastest[half] > FASTEST) < OFTEN:
        return ""
    return f"by them the vehicle flies with up to {fastest[half].max():.0f} m/s"
