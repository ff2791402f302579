"""Why does PX4's commander call position, velocity, height or attitude invalid?

In: a log of a PX4 and its estimator's bits. Out: the commander's validity tree up to the failsafe.
Flags are read as logged (``vehicle_status_flags.condition_*`` before release 1.14, the inverted
``failsafe_flags.*_invalid`` after it); what explains them is computed from the logged output of the
selected estimator and the parameters, PX4's defaults where the log has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.aiding import no_aiding, set_spans, told_gaps
from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import lasting, period, spans_of, within
from fdi.methods.estimator.tree import Node, any_of
from fdi.telemetry import Log

Floats = NDArray[np.float64]

STALE_S: Final = 1.0
"""COM_POS_FS_DELAY where the log has none: PX4's default, fixed in later releases."""
EPH_M: Final = 5.0
EVH: Final = 1.0
"""COM_POS_FS_EPH (m) and COM_VEL_FS_EVH (m/s) where the log has none: PX4's defaults."""
WHILE_VALID: Final = 2.5
"""The commander allows so many times more while the estimate is valid."""
FAILS_S: Final = 2.0
TEST_S: Final = 30.0
FAST: Final = 5.0
"""The commander's test: fails after so long (s), passed for good after so long in the air (s), or
at so much speed (m/s)."""
NORM: Final = 1e-6
"""Of the attitude's quaternion: how far its norm may be from 1."""
_FLAGS: Final = {
    "local position": "local_position",
    "local velocity": "local_velocity",
    "global position": "global_position",
    "height": "local_altitude",
    "attitude": "attitude",
    "angular velocity": "angular_velocity",
}
_OUTPUT: Final = "vehicle_local_position"
_GLOBAL: Final = "vehicle_global_position"


def validity_tree(log: Log, bits: Bits, core: int, flown: Core, takeoff: float) -> Node:
    """Return the commander's tree: failsafe, the invalid estimates below it, and their causes.

    Parameters
    ----------
    log : Log
    bits : Bits
    core : int
        The one selected first.
    flown : Core
        The ratios of the selected one.
    takeoff : float
        s.
    """
    lost = no_aiding(log, bits, core)
    failed = _navigation_failure(log, flown, takeoff)
    children = [
        _invalid(log, "local position", (*_position_causes(log, lost), failed)),
        _invalid(log, "local velocity", (*_velocity_causes(log, lost), failed)),
        _invalid(log, "global position", (*_global_causes(log, lost), failed)),
        _invalid(log, "height", _height_causes(log)),
        _invalid(log, "attitude", _attitude_causes(log)),
        _invalid(log, "angular velocity", (_stale(log, "vehicle_angular_velocity"),)),
    ]
    if "vehicle_status" in log and "failsafe" in log["vehicle_status"]:
        spans, step = set_spans(log, "vehicle_status", "failsafe", when=True)
        because = "vehicle_status.failsafe; it may have causes outside this tree"
        return Node("the commander is in failsafe", spans, because, "any", tuple(children), step)
    return Node("the commander is in failsafe", None, "not in this log", "any", tuple(children))


def _invalid(log: Log, what: str, causes: Sequence[Node]) -> Node:
    """Return the node "the commander calls it invalid": its flag, or else what makes it so."""
    name, short = f"{what} invalid", _FLAGS[what]
    for key, field, when in (
        ("vehicle_status_flags", f"condition_{short}_valid", False),
        ("failsafe_flags", f"{short}_invalid", True),
    ):
        if key in log and field in log[key]:
            spans, step = set_spans(log, key, field, when=when)
            return Node(name, spans, f"{key}.{field}", "any", tuple(causes), step)
    if what == "attitude":  # the flag is that of a norm at the edge of single precision
        return Node(name, None, "its flag is not in this log", "any", tuple(causes))
    return any_of(name, causes, "its flag is not in this log; by its causes")


def _position_causes(log: Log, lost: Node) -> tuple[Node, ...]:
    limit = log.parameters.get("COM_POS_FS_EPH", EPH_M)
    return (
        _given_up(log, "xy_valid", "pos_horiz_abs", lost),
        _stale(log, _OUTPUT),
        _inaccurate(log, _OUTPUT, "eph", limit, "m"),
    )


def _velocity_causes(log: Log, lost: Node) -> tuple[Node, ...]:
    limit = log.parameters.get("COM_VEL_FS_EVH", EVH)
    return (
        _given_up(log, "v_xy_valid", "velocity_horiz", lost),
        _stale(log, _OUTPUT),
        _inaccurate(log, _OUTPUT, "evh", limit, "m/s"),
    )


def _global_causes(log: Log, lost: Node) -> tuple[Node, ...]:
    limit = log.parameters.get("COM_POS_FS_EPH", EPH_M)
    return (
        _given_up(log, "xy_valid", "pos_horiz_abs", lost),
        _stale(log, _GLOBAL),
        _inaccurate(log, _GLOBAL, "eph", limit, "m"),
    )


def _height_causes(log: Log) -> tuple[Node, ...]:
    return (_given_up(log, "z_valid", "pos_vert_abs", None), _stale(log, _OUTPUT))


def _given_up(log: Log, field: str, bit: str, lost: Node | None) -> Node:
    """Return the node "the estimator declares it invalid", by its output or its solution's bit."""
    children = () if lost is None else (lost,)
    name = f"the estimator gives up its solution ({field})"
    if _OUTPUT in log and field in log[_OUTPUT]:
        spans, step = set_spans(log, _OUTPUT, field, when=False)
        return Node(name, spans, f"{_OUTPUT}.{field}", "any", children, step)
    if "ESTIMATOR_STATUS" in log and "flags" in log["ESTIMATOR_STATUS"]:
        message = log["ESTIMATOR_STATUS"]
        number = {"velocity_horiz": 1, "pos_horiz_abs": 4, "pos_vert_abs": 5}[bit]
        flags = np.nan_to_num(message.si("flags"), nan=2.0**number).astype(np.int64)
        spans = spans_of(message.t, (flags >> number) & 1 == 0)
        because = f"ESTIMATOR_STATUS.flags without {bit}"
        return Node(name, spans, because, "any", children, period(message.t))
    return Node(name, None, "not in this log", "any", children)


def _stale(log: Log, key: str) -> Node:
    """Return the node "the estimate is old": no record while the recorder wrote others."""
    least = log.parameters.get("COM_POS_FS_DELAY", STALE_S)
    name = f"{key} is older than {least:g} s"
    message = log.messages.get(key)
    if message is None or not len(message) or message.made_from:
        return Node(name, None, "not in this log")
    spans = lasting(told_gaps(log, message.t, least), least)
    return Node(name, spans, f"{key}, as logged", resolution=period(message.t))


def _inaccurate(log: Log, key: str, field: str, limit: float, unit: str) -> Node:
    """Return the node "its own accuracy is worse than allowed"."""
    allowed = limit * WHILE_VALID
    name = f"its accuracy {field} is {allowed:g} {unit} or worse"
    because = f"{key}.{field}, {limit:g} {unit} times {WHILE_VALID:g} while it is valid"
    if key not in log or field not in log[key] or log[key].made_from:
        return Node(name, None, f"{key}.{field} is not in this log")
    message = log[key]
    with np.errstate(invalid="ignore"):
        spans = spans_of(message.t, message.si(field) >= allowed)
    return Node(name, spans, because, resolution=period(message.t))


def _navigation_failure(log: Log, flown: Core, takeoff: float) -> Node:
    """Return the node "the test after take-off fails": velocity and position rejected together."""
    name = "the commander's test after take-off fails"
    parts = [flown.ratios.get(quantity) for quantity in ("velocity", "horizontal position")]
    if parts[0] is None or parts[1] is None:
        return Node(name, None, "a ratio of velocity or position is not used, or not in this log")
    with np.errstate(invalid="ignore"):
        both = (parts[0] >= 1.0) & (parts[1] >= 1.0)
    tested = (takeoff, min(takeoff + TEST_S, _fast(log, takeoff)))
    spans = within(lasting(spans_of(flown.t, both), FAILS_S), tested)
    because = (
        f"velocity and position ratio 1 or above for {FAILS_S:g} s, in the first {TEST_S:g} s or "
        f"until {FAST:g} m/s"
    )
    return Node(name, spans, because, resolution=period(flown.t))


def _fast(log: Log, takeoff: float) -> float:
    """Return when the vehicle was first so fast after take-off that the test counts as passed."""
    if _OUTPUT not in log or "vx" not in log[_OUTPUT] or "vy" not in log[_OUTPUT]:
        return np.inf
    message = log[_OUTPUT]
    with np.errstate(invalid="ignore"):
        fast = np.hypot(message.si("vx"), message.si("vy")) > FAST
    rows = np.flatnonzero(fast & (message.t > takeoff))
    return float(message.t[rows[0]]) if rows.size else np.inf


def _attitude_causes(log: Log) -> tuple[Node, ...]:
    name = "the attitude's quaternion is none"
    key = "vehicle_attitude"
    stale = _stale(log, key)
    fields = [f"q[{i}]" for i in range(4)]
    if key not in log or any(field not in log[key] for field in fields):
        return stale, Node(name, None, "not in this log")
    message = log[key]
    q = np.array([message.si(field) for field in fields])
    with np.errstate(invalid="ignore"):
        bad = (np.abs(q) > 1.0).any(axis=0) | (np.abs(np.sqrt((q * q).sum(axis=0)) - 1.0) > NORM)
    because = f"{key}.q: an element above 1, or its norm off by more than {NORM:g}"
    return stale, Node(name, spans_of(message.t, bad), because, resolution=period(message.t))
