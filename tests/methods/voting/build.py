"""Composes what a voter is given: views by hand, and whole ULogs of an autopilot with its peers.

A lost flag, a peer that falls silent, a stamp of another clock is one changed argument.
"""

import struct
from collections.abc import Callable, Mapping

import numpy as np
from telemetry import build_ulog as ulog

from fdi.methods.voting.flags import FlagSamples
from fdi.methods.voting.replay import View
from fdi.methods.voting.rules import Inputs

S = 1_000_000  # us
CONDITIONS = (
    "condition_system_sensors_initialized",
    "condition_angular_velocity_valid",
    "condition_local_altitude_valid",
    "condition_local_position_valid",
    "condition_local_velocity_valid",
    "condition_global_position_valid",
    "condition_home_position_valid",
    "condition_battery_healthy",
)
STATUS = ("failsafe", "data_link_lost", "mission_failure")
UTC_US = 1_632_838_728 * S


def inputs(now_s, bad, *, own=0, heard_s=None):
    """What an autopilot knows in a cycle; ``bad`` is (n, f), and everybody was heard just now."""
    bad = np.asarray(bad, float)
    now = round(now_s * S)
    heard = np.full(bad.shape[0], now) if heard_s is None else np.rint(np.array(heard_s) * S)
    return Inputs(np.array(now), np.array(own), bad, heard.astype(np.int64))


def samples(t_s, bad, *, sent_s=None, takeoff_s=1.0):
    """Flags of an autopilot: ``bad`` (m,) of one flag, or (m, f)."""
    t = np.rint(np.asarray(t_s, float) * S).astype(np.int64)
    bad = np.asarray(bad, float).reshape(t.size, -1 if t.size else 1)
    sent = t if sent_s is None else np.rint(np.asarray(sent_s) * S).astype(np.int64)
    since = np.full(t.size, round(takeoff_s * S), np.int64)
    return FlagSamples(t, sent, bad, since, since > 0)


def view(*of_each, own=0):
    return View(own, tuple(of_each), 0)


Bad = Mapping[str, Callable[[float], bool]]


def autopilot(
    number=1,
    *,
    bad: Bad | None = None,
    peers=None,
    silent_from: Mapping[int, float] | None = None,
    stamp_ahead_s=0.0,
    raw: Mapping[str, int] | None = None,
    without=(),
    utc=True,
    takeoff_s=5.0,
    lasts_s=40.0,
    booted_utc_us=UTC_US,
):
    """Return the ULog of an autopilot: its flags at 2 Hz, those of its peers at 1 Hz.

    ``bad``: by flag, whether it is bad at a time since boot; ``silent_from``: by peer; ``raw``:
    values that stand in the place of a flag of its own; ``without``: flags that the log lacks.
    """
    bad, raw = bad or {}, raw or {}
    peers = [k for k in (1, 2, 3) if k != number][:2] if peers is None else peers
    conditions = [name for name in CONDITIONS if name not in without]
    status = [name for name in STATUS if name not in without]
    received = "".join(f"bool {name};" for name in (*CONDITIONS, *STATUS))
    stamps = "uint64_t timestamp;uint64_t timestamp_pilot;uint64_t takeoff_time;"
    topics = ("redundancy_firstpilot", "redundancy_secondpilot")[: len(peers)]
    made = [
        ulog.header(S),
        ulog.flag_bits(),
        ulog.info("sys_name", "PX4"),
        ulog.topic(
            "vehicle_status_flags:uint64_t timestamp;"
            + "".join(f"bool {name};" for name in conditions)
        ),
        ulog.topic(
            "vehicle_status:uint64_t timestamp;uint64_t takeoff_time;uint8_t arming_state;"
            + "".join(f"bool {name};" for name in status)
        ),
        ulog.topic("vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;"),
        *(ulog.topic(f"{name}:{stamps}{received}") for name in topics),
        ulog.parameter("MAV_TYPE", 2),
        ulog.parameter("MAV_SYS_ID", number),
        ulog.subscribe(0, "vehicle_status_flags"),
        ulog.subscribe(1, "vehicle_status"),
        ulog.subscribe(2, "vehicle_gps_position"),
        *(ulog.subscribe(3 + k, name) for k, name in enumerate(topics)),
    ]

    def good(name):
        return int(name in CONDITIONS)

    def own(name, t):
        return raw.get(name, good(name) ^ bool(name in bad and bad[name](t)))

    for half in range(2, int(2 * lasts_s)):
        t, us = half / 2, half * S // 2
        if not half % 2:
            for k, peer in enumerate(peers):
                if t < (silent_from or {}).get(peer, np.inf):
                    stamp = us + round((stamp_ahead_s - 0.5) * S)
                    values = [good(name) for name in (*CONDITIONS, *STATUS)]
                    made.append(ulog.data(3 + k, f"3Q{len(values)}B", us, stamp, 0, *values))
        values = [own(name, t) for name in conditions]
        made.append(ulog.data(0, f"Q{len(values)}B", us, *values))
        values = [own(name, t) for name in status]
        takeoff = round(takeoff_s * S) if t >= takeoff_s else 0
        made.append(ulog.data(1, f"2QB{len(values)}B", us, takeoff, 2, *values))
        if utc:
            made.append(struct.pack("<HBH2Q", 18, ord("D"), 2, us, booted_utc_us + us))
    return b"".join(made)
