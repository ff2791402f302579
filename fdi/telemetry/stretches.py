"""What did the vehicle do, stretch by stretch, for a person?

In: a `Course`. Out: `Stretch`es, one after the other: it stands, is
moved about without power, is armed on the ground, is in the air, lies on its side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from fdi.shown import Shown
from fdi.telemetry.course import Course, when_armed

What = Literal["standing", "moved about", "armed on the ground", "in the air", "lying on its side"]

CARRIED: Final = 0.3
"""rad/s: who stands does not turn so fast for long."""
ON_ITS_SIDE: Final = 0.5
"""Cosine of the tilt: beyond 60 degrees no landing gear stands."""
LEAST_S: Final = 2.0
"""Shorter stretches on the ground belong to the one before."""
_WHAT: Final[tuple[What, ...]] = (
    "standing", "moved about", "armed on the ground", "in the air", "lying on its side",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Stretch(Shown):
    """One stretch of a log.

    Attributes
    ----------
    start, end : float
        s of the log's clock.
    what : str
    sure : float
        Mean probability that it is in the air, or that it is not.
    """

    start: float
    end: float
    what: What
    sure: float


def find_stretches(course: Course) -> tuple[Stretch, ...]:
    """Return what the vehicle did, in the order of time; nothing without heights."""
    phases = course.phases
    if phases is None:
        return ()
    motion = course.motion.at(np.searchsorted(course.motion.t, phases.t))
    armed = when_armed(motion, course.armed)
    lies = motion.upright < ON_ITS_SIDE
    place = np.select([phases.in_air, lies, armed, motion.turns > CARRIED], [3, 4, 2, 1], 0)
    first = np.append(0, np.flatnonzero(np.diff(place)) + 1)
    edges = np.append(phases.t[first], phases.t[-1])
    kept = (place[first] == 3) | (np.diff(edges) >= LEAST_S)
    kept[0] = True
    first = first[kept]
    first = first[np.append(True, np.diff(place[first]) != 0)]
    last = np.append(first[1:], phases.t.size)
    return tuple(
        Stretch(
            float(phases.t[low]),
            float(phases.t[min(high, phases.t.size - 1)]),
            _WHAT[place[low]],
            float(np.mean(phases.sure[low:high] if place[low] == 3 else 1 - phases.sure[low:high])),
        )
        for low, high in zip(first.tolist(), last.tolist(), strict=True)
    )
