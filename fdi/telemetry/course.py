"""How does a log's vehicle move, when is it armed, and when is it in the air?

In: messages, the arming events and what carries the vehicle. Out: a `Course`, from which flights
and stretches follow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.telemetry.events import Event
from fdi.telemetry.message import Message
from fdi.telemetry.motion import Motion, motion_of
from fdi.telemetry.phases import IDLE, Mask, Phases, Wings, find_phases, never_up

Armed = tuple[float, float, bool]
"""Armed from when to when, s, and whether it was disarmed then."""

BEFORE_ARMING_S: Final = 3.0
"""Heartbeats come once a second: arming is seen late, motion is not."""
FEW: Final = 3
"""Records of height; fewer tell no flight."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What a vehicle did, by all that its log tells.

    Attributes
    ----------
    motion : Motion
    phases : Phases or None
        None without heights.
    armed : tuple of (float, float, bool)
        From when to when, s, and whether it was disarmed then; the whole log where nothing tells.
    is_told : bool
        Whether the log tells when it is armed.
    wings : str
        As in `find_phases`.
    restarts : tuple of float
        When the autopilot started anew, s.
    """

    motion: Motion
    phases: Phases | None
    armed: tuple[Armed, ...]
    is_told: bool
    wings: Wings
    restarts: tuple[float, ...] = ()


def find_course(
    messages: Mapping[str, Message],
    events: Sequence[Event],
    span: tuple[float, float],
    *,
    wings: Wings,
    may_fly: bool = True,
    is_driven: bool = True,
) -> Course:
    """Return the course of a log's vehicle.

    Parameters
    ----------
    messages : Mapping[str, Message]
    events : sequence of Event
        Arming, disarming and reboots.
    span : (float, float)
        First and last time of the vehicle's own messages, s.
    wings : str
        What carries it, as in `find_phases`.
    may_fly : bool
        Whether it is a vehicle that flies, and none that drives or swims.
    is_driven : bool
        Whether the outputs in the log drive it. Else arming and throttle are not this vehicle's
        either.
    """
    motion = motion_of(messages)
    if not is_driven:
        events = [e for e in events if e.kind not in ("arm", "disarm")]
        motion = replace(motion, throttle=np.full(motion.t.size, np.nan))
    armed = tuple(_armed(events, motion, span))
    is_told = any(e.kind in ("arm", "disarm") for e in events)
    phases = None
    if motion.t.size >= FEW:
        on = when_armed(motion, armed)
        phases = find_phases(motion, on, wings=wings) if may_fly else never_up(motion)
    restarts = tuple(e.t for e in events if e.kind == "reboot")
    return Course(motion, phases, armed, is_told, wings, restarts)


def _armed(events: Sequence[Event], motion: Motion, span: tuple[float, float]) -> Iterator[Armed]:
    """Yield the armed times, and whether each ends by disarming; the whole log without any.

    What starts anew is not armed any more, and nobody disarmed it. But a watchdog's restart comes
    up armed: rotors and propellers are given throttle before anybody arms them.
    """
    arming = [e for e in events if e.kind in ("arm", "disarm", "reboot")]
    told = [e.kind for e in arming if e.kind != "reboot"]
    since = span[0] if not told or told[0] == "disarm" else None
    bounds = [*(e.t for e in arming), span[1]]
    for event, until in zip(arming if told else (), bounds[1:], strict=False):
        if event.kind == "arm":
            since = event.t if since is None else since
            continue
        if since is not None:
            yield since, event.t, event.kind == "disarm"
        is_given = event.kind == "reboot" and _throttled(motion, event.t, until)
        since = event.t if is_given else None
    if since is not None:
        yield since, max(span[1], since), False


def _throttled(motion: Motion, low: float, high: float) -> bool:
    """Return whether anything drives it in that time."""
    return bool((motion.throttle[motion.rows(low, high)] > IDLE).any())


def when_armed(motion: Motion, armed: Sequence[Armed]) -> Mask:
    """Return at which times of the motion, (n,) bool, it is armed, or soon will be."""
    found = np.zeros(motion.t.size, np.bool_)
    for low, high, _ in armed:
        found[motion.rows(low - BEFORE_ARMING_S, high)] = True
    return found
