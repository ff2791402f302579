"""Are these two logs of one flight? By few numbers of each, so that many logs are soon compared.

In: a log. Out: its `Track`: where the vehicle was at whole seconds since boot, `MOST` of them at
most. Recorders of one flight tell the same estimate of the position at the same moment of the
vehicle's own clock, whatever else they record, and whatever their own clocks say. The seconds are
multiples of a power of two, so that those of a short log hold those of a long one.

Measured on simulated flights, many of one plan that begin at the same place and second: between the
two logs of one flight (12 pairs) the median distance is 0.02 m at most, between those of two
flights (4,657 pairs) 0.26 m at least.

What it does not do: `join` finds how logs lie on one clock; a log without the vehicle's clock,
without a position, or with a restart in it has no track, and is of no other log's flight here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry.airtime import in_air
from fdi.telemetry.log import Log

MOST: Final = 64
LEAST: Final = 10
"""Common seconds; of fewer nothing is said."""
SAME_M: Final = 0.1
"""Between the two distances that are measured; see the module."""
_EARTH_M: Final = 6.371e6  # mean radius
_POSITION: Final = "GLOBAL_POSITION_INT"
_CELL_RAD: Final = 1e-5
"""About 64 m: two tracks of one flight share most of their cells, and few others any."""

Cell = tuple[int, int, int]


class Track(NamedTuple):
    """Where a vehicle was: whole seconds since boot (n,), latitude and longitude (n,), rad."""

    boot_s: tuple[int, ...]
    lat: tuple[float, ...]
    lon: tuple[float, ...]


NOWHERE: Final = Track((), (), ())


def track_of(log: Log) -> Track:
    """Return the track of a log while it is in the air; `NOWHERE` where it tells none."""
    offset = log.clock.boot_offset
    if _POSITION not in log or len(offset) != 1 or not np.isfinite(offset[0]):
        return NOWHERE
    message, boot = log[_POSITION], float(offset[0])
    if "lat" not in message or "lon" not in message:
        return NOWHERE
    lat, lon = (message.si(name) for name in ("lat", "lon"))
    known = np.isfinite(lat) & np.isfinite(lon)
    if not known.any():
        return NOWHERE
    t = message.t[known]
    spans = [in_air(flight) for flight in log.flights if flight.flew]
    low = max(float(t[0]), min((start for start, _ in spans), default=np.inf)) + boot
    high = min(float(t[-1]), max((end for _, end in spans), default=-np.inf)) + boot
    step = 1
    while (high - low) / step > MOST:
        step *= 2
    seconds = np.ceil(low / step) * step + step * np.arange(MOST + 1)
    seconds = seconds[seconds < high]
    north, east = (np.interp(seconds - boot, t, values[known]) for values in (lat, lon))
    return Track(
        tuple(seconds.astype(int).tolist()),
        tuple(np.round(north, 10).tolist()),
        tuple(np.round(east, 10).tolist()),
    )


def are_one_flight(one: Track, other: Track) -> bool:
    """Return whether two tracks are of one flight, as far as both tell.

    Examples
    --------
    >>> seconds = tuple(range(20))
    >>> line = Track(seconds, tuple(1e-6 * s for s in seconds), (0.0,) * 20)
    >>> aside = Track(seconds, line.lat, (1e-7,) * 20)  # 0.64 m
    >>> are_one_flight(line, line), are_one_flight(line, aside)
    (True, False)
    """
    common, mine, its = np.intersect1d(one.boot_s, other.boot_s, return_indices=True)
    if len(common) < LEAST:
        return False
    lat = np.array(one.lat)[mine]
    north = lat - np.array(other.lat)[its]
    east = np.angle(np.exp(1j * (np.array(one.lon)[mine] - np.array(other.lon)[its])))
    return float(np.median(np.hypot(north, np.cos(lat) * east))) * _EARTH_M < SAME_M


def first_of_flights(tracks: Sequence[tuple[object, Track]]) -> list[int]:
    """Return for each track the place of the first one that is of its flight, its own if none.

    Parameters
    ----------
    tracks : sequence of (object, Track)
        With whose track it is; those of different vehicles are not compared.

    Notes
    -----
    Only tracks that share a place at a second are compared, so that many cost little.
    """
    by_cell: dict[tuple[object, Cell], list[int]] = {}
    first: list[int] = []
    for place, (whose, track) in enumerate(tracks):
        cells = {(whose, cell) for cell in _cells(track)}
        near = sorted({other for cell in cells for other in by_cell.get(cell, ())})
        found = next((i for i in near if are_one_flight(tracks[i][1], track)), None)
        first.append(place if found is None else first[found])
        for cell in cells:
            by_cell.setdefault(cell, []).append(place)
    return first


def _cells(track: Track) -> Iterator[Cell]:
    for second, lat, lon in zip(*track, strict=True):
        yield second, round(lat / _CELL_RAD), round(lon / _CELL_RAD)
