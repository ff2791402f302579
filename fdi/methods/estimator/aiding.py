"""Since when did the estimator of a PX4 have nothing to hold its position by?

In: a log and what it says of sources. Out: the branch of the validity tree below an invalid
estimate: the last measurement, dead reckoning, no aiding for so long that the solution is given up.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.records import table
from fdi.methods.estimator.spans import Span, gaps, lasting, period, spans_of
from fdi.methods.estimator.tree import Node, all_of
from fdi.telemetry import Log

Floats = NDArray[np.float64]

NO_AID_S: Final = 5.0
"""EKF2_NOAID_TOUT where the log has no parameter: PX4's default."""
DEAD_S: Final = 1.0
"""PX4 calls it dead reckoning after 1 s without a measurement of position or velocity."""
FIX_3D: Final = 3
_GPS: Final = ("vehicle_gps_position", "sensor_gps", "GPS_RAW_INT")
_DEAD: Final = (
    "vehicle_global_position.dead_reckoning",
    "vehicle_local_position.dead_reckoning",
    "estimator_status_flags.cs_inertial_dead_reckoning",
)
_PULSE: Final = ("vehicle_status", "estimator_status", "ATTITUDE")
"""Messages that come whatever the sources of position do."""
_OTHERS: Final = ("optical flow", "external vision")


def no_aiding(log: Log, bits: Bits, core: int) -> Node:
    """Return the node "no aiding for so long that the solution is given up", with its causes."""
    stopped = gps_stopped(log)
    least = log.parameters.get("EKF2_NOAID_TOUT", NO_AID_S * 1e6) * 1e-6
    said = "EKF2_NOAID_TOUT" if "EKF2_NOAID_TOUT" in log.parameters else "PX4's default"
    others = _other_aids(bits, core)
    spans = None
    if stopped.spans is not None and not others:
        spans = lasting(stopped.spans, least)
    because = f"no fix for {least:g} s ({said})"
    if others:
        because = f"{' and '.join(others)} was used too: when it last helped is not in this log"
    children = (_dead_reckoning(log, stopped),)
    name = f"nothing to hold the position by for {least:g} s"
    return Node(name, spans, because, "all", children, stopped.resolution)


def gps_stopped(log: Log) -> Node:
    """Return the node "no GPS measurement": from the last fix to the next one."""
    for key in _GPS:
        message = log.messages.get(key)
        if message is not None and "fix_type" in message and len(message) > 2:
            fixed = message.t[message.si("fix_type") >= FIX_3D]
            because = f"last {key} with a 3D fix, none for more than {DEAD_S:g} s"
            # a telemetry stream that pauses is no receiver that stops: it has to say so itself
            pulse = message.t if log.format == "tlog" else None
            spans = told_gaps(log, fixed, DEAD_S, pulse) if fixed.size else None
            step = period(message.t)
            return Node("no GPS measurement", spans, because, resolution=step)
    return Node("no GPS measurement", None, "no GPS in this log")


def _dead_reckoning(log: Log, stopped: Node) -> Node:
    name = "dead reckoning"
    for channel in _DEAD:
        key, _, field = channel.partition(".")
        if key in log and field in log[key]:
            message = log[key]
            spans = spans_of(message.t, message.si(field) > 0)
            # a topic that ends while it is true says no more: true to the end of the log
            spans = tuple((a, log.span[1] if b >= message.t[-1] else b) for a, b in spans)
            return Node(name, spans, channel, "all", (stopped,), period(message.t))
    return all_of(name, (stopped,), "not in this log; by the last GPS measurement")


def _other_aids(bits: Bits, core: int) -> list[str]:
    fused = table("masks")["fused"]
    return [
        name for name in _OTHERS if any(bits.spans("control", bit, core) for bit in fused[name])
    ]


def told_gaps(log: Log, t: Floats, least: float, pulse: Floats | None = None) -> tuple[Span, ...]:
    """Return where records stay away for longer than ``least`` s while others (``pulse``) came.

    Where nothing came the recorder, or the link to it, was down: that says nothing of the vehicle.
    """
    if pulse is None:
        pulse = next((log[key].t for key in _PULSE if key in log and len(log[key])), np.empty(0))
    return tuple(
        (low, high)
        for low, high in gaps(t, least, log.span[1])
        if np.any((pulse > low + least) & (pulse < high))
    )


def set_spans(log: Log, key: str, field: str, *, when: bool) -> tuple[tuple[Span, ...], float]:
    """Return where a flag of a topic is set (or is not), and the time between its records."""
    message = log[key]
    values = message.si(field)
    holds = (values > 0) if when else (values == 0)
    return spans_of(message.t, holds), period(message.t)
