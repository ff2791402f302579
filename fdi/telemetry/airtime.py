"""When does a vehicle fly, has settled, may be accused? The time in the air, flight by flight.

In: signals or a flight. Out: from when to when, s of the log's clock. Between take-off and landing,
and never after an impact, or on its back: what breaks then is no cause.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.events import SETTLING_S, Flight
from fdi.telemetry.impact import OVER_S
from fdi.telemetry.signals import Signals


def in_air(flight: Flight) -> tuple[float, float]:
    """Return from when to when, s, an alarm of a flight may accuse."""
    start = flight.airborne[0]
    if flight.flew and flight.takeoff is None:
        # a log that begins in the air begins with filters and controllers that have not settled
        start += 2 * SETTLING_S
    ends = (flight.landing, flight.impact, flight.end)
    return start, min(end for end in ends if end is not None)


def begun_in_air(flights: Iterable[Flight]) -> float | None:
    """Return from when on, s, a log flies that begins in the air; None for others."""
    first = next((flight for flight in flights if flight.flew), None)
    return None if first is None or first.takeoff is not None else first.start


def time_in_air(signals: Signals) -> list[tuple[float, float]]:
    """Return from when to when, s, alarms may accuse, flight by flight; all along without any."""
    if not signals.flights and len(signals.t):
        return [(float(signals.t[0]), float(signals.t[-1]))]
    over = {end.flight: end.overturned for end in signals.ends if end.overturned is not None}
    spans = enumerate(map(in_air, signals.flights))
    return [(start, min(end, over.get(i, np.inf) + OVER_S)) for i, (start, end) in spans]


def when_in_air(signals: Signals) -> NDArray[np.bool_]:
    """Return the samples, (n,) bool, at which alarms may accuse."""
    air = np.zeros(len(signals.t), bool)
    for start, end in time_in_air(signals):
        air |= (signals.t >= start) & (signals.t < end)
    return air


def airborne_mask(signals: Signals) -> NDArray[np.bool_]:
    """Return where the vehicle flies; everywhere if it never does."""
    flying = np.asarray(signals.state.airborne, dtype=bool)
    return flying if flying.any() else np.ones(len(signals.t), dtype=bool)


def settled_mask(signals: Signals) -> NDArray[np.bool_]:
    """Return where the vehicle flies and filters have settled after take-off."""
    flying = airborne_mask(signals)
    for flight in signals.flights:
        start = flight.start if flight.takeoff is None else flight.takeoff
        flying = flying & ~((signals.t >= start) & (signals.t < start + SETTLING_S))
    return np.asarray(flying)


def reference_mask(signals: Signals, length_s: float) -> NDArray[np.bool_]:
    """Return the stretch from which offsets are taken: the first seconds in the air, settled."""
    flying = airborne_mask(signals)
    if not len(flying):
        return flying
    first = signals.t[np.argmax(flying)]
    # a window of a flight may begin long after its take-off
    begins = [flight.airborne[0] for flight in signals.flights if flight.airborne[0] <= first]
    start = max(first, max(begins, default=first) + SETTLING_S)
    return np.asarray(flying & (signals.t >= start) & (signals.t < start + length_s))


def first_known(known: NDArray[np.bool_], signals: Signals, length_s: float) -> NDArray[np.bool_]:
    """Return the first seconds in the air, settled, since a quantity is known.

    They are those of `reference_mask` for most; a wing bears a VTOL only later on.

    Parameters
    ----------
    known : (n,) bool
        Where the quantity is known.
    signals : Signals
    length_s : float
    """
    begun = reference_mask(signals, np.inf)
    known = known & begun
    start = signals.t[np.argmax(known)] if known.any() else np.inf
    return np.asarray(begun & (signals.t >= start) & (signals.t < start + length_s))
