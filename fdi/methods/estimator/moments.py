"""When was the vehicle upset, and when did the estimator first complain?

In: a log, one of its flights, and what the estimator showed. Out: `Moment`s. A vehicle that is out
of control, rolled over or on the ground before the estimator complains was not brought there by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.methods.estimator.cores import Selection
from fdi.methods.estimator.ratios import Ratio
from fdi.methods.estimator.spans import spans_of
from fdi.methods.estimator.tree import Node
from fdi.telemetry import Flight, Log

UPSET: Final = 60.0
"""deg: FD_FAIL_R, FD_FAIL_P where the log has none: PX4's default."""
UPSET_S: Final = 0.3
"""FD_FAIL_R_TTRI, FD_FAIL_P_TTRI: PX4's default."""
_ROTORS: Final = ("quad", "hexa", "octa", "helicopter")


@dataclass(frozen=True, slots=True)
class Moment:
    """Something that happened, in words."""

    t: float
    what: str


def upset_of(log: Log, number: int, flight: Flight) -> Moment | None:
    """Return when the vehicle was upset: control lost, rolled over, hit something."""
    end = next((one for one in log.ends if one.flight == number), None)
    if end is None or not end.is_bad:
        return None
    found = [
        Moment(t, what)
        for t, what in (
            (end.lost_control, end.loss),
            (end.overturned, "it lay on its back"),
            (flight.impact, "it hit the ground"),
        )
        if t is not None
    ]
    over = _rolled_over(log, flight) if log.vehicle in _ROTORS else None
    if over is not None:
        found.append(Moment(over, "it rolled over"))
    return min(found, key=lambda one: one.t, default=None)


def _rolled_over(log: Log, flight: Flight) -> float | None:
    attitude = log.messages.get("ATTITUDE")
    if attitude is None or "roll" not in attitude or "pitch" not in attitude:
        return None
    limits = [np.radians(log.parameters.get(f"FD_FAIL_{axis}", UPSET) or UPSET) for axis in "RP"]
    with np.errstate(invalid="ignore"):
        over = (np.abs(attitude.si("roll")) > limits[0]) | (
            np.abs(attitude.si("pitch")) > limits[1]
        )
    low, high = flight.airborne
    over &= (attitude.t >= low) & (attitude.t <= high)
    spans = [span for span in spans_of(attitude.t, over) if span[1] - span[0] >= UPSET_S]
    return spans[0][0] if spans else None


def complaint_of(
    ratios: Sequence[Ratio], complaints: Sequence[Node], selection: Selection, takeoff: float
) -> Moment | None:
    """Return the estimator's first complaint in the flight, None where it has none.

    A rejection, an invalid estimate, a failsafe or another core. What held at take-off already is
    none.
    """
    found = [
        Moment(low, f"{ratio.quantity} ratio above 1")
        for ratio in ratios
        for low, _ in ratio.rejected
    ]
    found.extend(Moment(low, node.name) for node in complaints for low, _ in node.spans or ())
    found.extend(Moment(c.t, f"change to core {c.after}") for c in selection.changes)
    new = [one for one in found if one.t > takeoff]
    return min(new, key=lambda one: one.t, default=None)
