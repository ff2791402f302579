"""Why does PX4's selector call one of its estimators unhealthy?

In: a log, its cores' bits. Out: a tree per core: filter fault, a faulty gyroscope or accelerometer
that this core uses, a combined ratio not above 0, no message for longer than the timeout.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from fdi.methods.estimator.aiding import set_spans
from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.records import Core, instance
from fdi.methods.estimator.spans import period, spans_of
from fdi.methods.estimator.tree import Node, any_of, joined
from fdi.telemetry import Log

_SELECTOR: Final = "estimator_selector_status"
_FAULTS: Final = "estimator_status_flags"
IMU: Final = {
    "gyroscope": ("gyro", "EKF2_SEL_IMU_ANG", 15.0, np.pi / 180.0, "deg"),
    "accelerometer": ("accel", "EKF2_SEL_IMU_VEL", 2.0, 1.0, "m/s"),
}
"""By sensor: how its fields begin; the parameter of the accumulated error, PX4's default, to SI."""
SENSORS: Final = 4
"""As many inertial sensors the selector compares."""
_TIMEOUT: Final = re.compile(r"primary EKF changed (\d+) \(timeout\)")


def unhealthy_tree(log: Log, core: Core, bits: Bits) -> Node:
    """Return the tree of one core."""
    children = (
        _filter_fault(log, core, bits),
        _sensor(log, core, "gyroscope"),
        _sensor(log, core, "accelerometer"),
        _timeout(log, core),
    )
    name = f"estimator {core.number} is unhealthy"
    field = f"healthy[{core.number}]"
    if _SELECTOR in log and field in log[_SELECTOR]:
        spans, step = set_spans(log, _SELECTOR, field, when=False)
        return Node(name, spans, f"{_SELECTOR}.{field}", "any", children, step)
    return any_of(name, children, "the log has no selector's word; by its causes")


def _filter_fault(log: Log, core: Core, bits: Bits) -> Node:
    own = [bit for bit in bits.of("fault") if bit.core == core.number]
    masks = [m for m in bits.masks if m.kind == "fault" and m.core == core.number]
    if not masks:
        return Node("filter fault", None, "not in this log")
    source = masks[0].source
    key = source.partition(".")[0]
    step = period(log[key].t)
    children = tuple(Node(bit.name, bit.spans, bit.source, resolution=step) for bit in own)
    spans = joined([span for bit in own for span in bit.spans])
    return Node("filter fault", spans, source, "any", children, step)


def _sensor(log: Log, core: Core, sensor: str) -> Node:
    """Return the node "the sensor that this core uses is the faulty one"."""
    short, parameter, default, to_si, unit = IMU[sensor]
    limit = log.parameters.get(parameter, default)
    name = f"its {sensor} is the faulty one"
    errors = [f"accumulated_{short}_error[{i}]" for i in range(SENSORS)]
    ids = [f"{short}_device_ids[{i}]" for i in range(SENSORS)]
    selector, imu = log.messages.get(_SELECTOR), log.messages.get("sensors_status_imu")
    own = log.messages.get(instance("estimator_status", core.number))
    detected = f"{short}_fault_detected"
    if selector is None or imu is None or own is None or detected not in selector:
        return Node(name, None, "not in this log")
    if f"{short}_device_id" not in own or not all(e in selector for e in errors):
        return Node(name, None, "not in this log")
    error = np.array([np.nan_to_num(selector.si(e), nan=-1.0) for e in errors])
    devices = np.array([imu.si(d)[-1] if d in imu else 0.0 for d in ids])
    faulty = devices[np.argmax(error, axis=0)]
    used = float(own.si(f"{short}_device_id")[-1])
    with np.errstate(invalid="ignore"):
        bad = (selector.si(detected) > 0) & (error.max(axis=0) > limit * to_si) & (faulty == used)
    bad &= np.count_nonzero(devices) > 2  # of two the selector cannot tell which
    because = f"{_SELECTOR}.{detected}, accumulated error above {limit:g} {unit} ({parameter})"
    return Node(name, spans_of(selector.t, bad), because, resolution=period(selector.t))


def _timeout(log: Log, core: Core) -> Node:
    """Return the node "no message in time": seen only in what the selector says."""
    said = [
        (e.t, e.t)
        for e in log.reported
        if e.kind == "text"
        and (found := _TIMEOUT.search(e.text)) is not None
        and int(found[1]) == core.number
    ]
    name = "no estimator_status for longer than the selector's timeout"
    if said:
        return Node(name, tuple(said), "text of the selector")
    return Node(name, None, "not in this log: the timeout is shorter than the time between records")
