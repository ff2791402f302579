"""How are times, numbers and foreign text written for a person?

In: seconds of the log's clock, SI values, text from a log or model. Out: short plain text. Logs and
models come from strangers: whatever is shown passes through :func:`clean` first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from fdi.shown import clean as clean  # for all of report
from fdi.units import customary, hundredths

if TYPE_CHECKING:
    from fdi.model import System
    from fdi.residuals.accuracy import Told
    from fdi.residuals.latency import Lag
    from fdi.result import Analysis
    from fdi.telemetry import Flight, Input, Log


_EARTH_M: Final = 6.371e6  # mean radius: an angle of place as a length
_PLACES: Final = ("lat", "lon", "lng", "latitude", "longitude", "latitude_deg", "longitude_deg")


def span(seconds: float) -> str:
    """Return a length of time, in minutes above one.

    Examples
    --------
    >>> span(7.26), span(127.04), span(3725)
    ('7.3 s', '2 min 07.0 s', '1 h 02 min 05 s')
    """
    tenths = round(abs(seconds) * 10)
    if tenths < 600:
        return f"{tenths / 10:.1f} s"
    if tenths < 36000:
        return f"{tenths // 600} min {tenths % 600 / 10:04.1f} s"
    whole = round(abs(seconds))
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min {whole % 60:02d} s"


def at(t: float | None) -> str:
    """Return a time of the log's clock to a tenth of a second.

    Examples
    --------
    >>> at(-0.04), at(12.25), at(None)
    ('0.0', '12.2', '–')
    """
    return "–" if t is None else f"{round(t, 1) + 0.0:.1f}"


def unit(name: str) -> str:
    """Return a unit as it stands behind a number; a plain number has none."""
    return "" if name == "1" else clean(name)


def into_flight(t: float, log: Log, number: int | None = None) -> str:
    """Return a time as a person tells it: so long into the flight.

    Parameters
    ----------
    t : float
        s of the log's clock.
    number : int, optional
        The flight, from 0; by default the one that holds the time.
    """
    flight = _flight(t, log.flights, number)
    if flight is None or not flight.flew:
        # `span` has no sign: what is stamped before the first record was sent before it
        return f"{span(t)} {'before the first record' if t < 0 else 'into the log'}"
    start = flight.start if flight.takeoff is None else flight.takeoff
    since = "take-off" if flight.takeoff is not None else "the start of the flight"
    if t < start:
        return f"{span(start - t)} before {since}"
    which = f" {log.flights.index(flight) + 1}" if len(log.flights) > 1 else ""
    least = "" if flight.takeoff is not None else "at least "  # the log begins in the air
    return f"{least}{span(t - start)} into " + (f"flight{which}" if which else "the flight")


def _flight(t: float, flights: Sequence[Flight], number: int | None) -> Flight | None:
    if number is not None and number < len(flights):
        return flights[number]
    return next((flight for flight in flights if flight.start <= t <= flight.end), None)


def used(one: Input) -> str:
    """Return whether an input of tests is used, and why.

    Examples
    --------
    >>> from fdi.telemetry import Input
    >>> used(Input("charge", ("SYS_STATUS.battery_remaining",), True, "it never rises"))
    'used: it never rises'
    """
    return f"{'not used' if one.believed is False else 'used'}: {one.why}"


def flown(flights: Sequence[Flight]) -> str:
    """Return how many flights a log holds, that it lacks a beginning, and how the last one ends.

    Examples
    --------
    >>> from fdi.telemetry import Flight
    >>> flown([Flight(0, 60, takeoff=5, landing=50), Flight(90, 120, takeoff=91, landing=110)])
    '2 flights'
    >>> flown([Flight(0, 60)])
    '1 flight, begun before the recording; the recording stops in flight'
    >>> flown([Flight(0, 60, takeoff=5, impact=59, impact_speed=9.0)])
    '1 flight, which ends with an impact, 9.0 m/s downwards (log 59.0 s)'
    >>> flown([Flight(0, 60, takeoff=5, restart=59)])
    '1 flight, which ends with a restart of the autopilot (log 59.0 s)'
    >>> flown([]), flown([Flight(0, 60, flew=False)])
    ('no flight', 'no flight, armed only')
    """
    made = [flight for flight in flights if flight.flew]
    if not made:
        return "no flight, armed only" if flights else "no flight"
    last = made[-1]
    count = plural(len(made), "flight")
    which = "the last of which" if len(made) > 1 else "which"
    if made[0].takeoff is None:
        count += ", the first begun" if len(made) > 1 else ", begun"
        count += " before the recording"
    if last.impact is not None:
        speed = "" if last.impact_speed is None else f", {last.impact_speed:.1f} m/s downwards"
        return f"{count}, {which} ends with an impact{speed} (log {at(last.impact)} s)"
    if last.landing is not None:
        return count
    if last.restart is not None:
        return f"{count}, {which} ends with a restart of the autopilot (log {at(last.restart)} s)"
    return f"{count}; the recording stops in {'flight' if len(made) == 1 else 'the last of them'}"


def log_time(t: float, log: Log) -> str:
    """Return a time of the log's clock, with UTC where it is known."""
    utc = log.clock.utc(t)
    return f"log {at(t)} s" + (f", {utc[:10]} {utc[11:21]} UTC" if utc else "")


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with so many significant digits, a dash where it is unknown.

    Examples
    --------
    >>> number(0.123456), number(None), number(12345.6), number(3.0)
    ('0.1235', '–', '12346', '3')
    """
    if value is None or not math.isfinite(value):
        return "–"
    if 10.0 ** (digits - 1) <= abs(value) < 1e7:
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def size(count: int) -> str:
    """Return a number of bytes.

    Examples
    --------
    >>> size(512), size(5_500_000)
    ('512 bytes', '5.5 MB')
    """
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= scale:
            return f"{count / scale:.1f} {unit}"
    return f"{count} bytes"


def plural(count: int, noun: str, nouns: str = "") -> str:
    """Return a count with its noun.

    Examples
    --------
    >>> plural(1, "fault"), plural(3, "fault"), plural(2, "entry", "entries")
    ('1 fault', '3 faults', '2 entries')
    """
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def per_cent(share: float) -> str:
    """Return a share of one as a percentage.

    Examples
    --------
    >>> per_cent(0.534)
    '53 %'
    """
    return f"{hundredths(share)} %"


def share(value: float) -> str:
    """Return a small probability as a percentage that does not claim to be nothing.

    Examples
    --------
    >>> share(0.0004), share(0.04)
    ('below 1 %', '4 %')
    """
    return per_cent(value) if value >= 0.005 else "below 1 %"


def shortened(names: Sequence[str], most: int) -> str:
    """Return names with commas, the first of them and how many more there are.

    Examples
    --------
    >>> shortened(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    shown = ", ".join(clean(name) for name in names[:most])
    more = len(names) - most
    return f"{shown} and {more} more" if more > 0 else shown


def budget(analysis: Analysis) -> str:
    """Return what a policy's budget is, and what it does to the thresholds of this flight."""
    per_hour, scale = analysis.policy.budget_per_hour, analysis.alarms.scale
    if per_hour is None:
        return ""
    scaled = "" if scale == 1.0 else f" (thresholds are {scale:.2f} times as wide for that)"
    often = "once" if per_hour == 1 else f"{per_hour:g} times"
    return f", noise may alarm {often} an hour at the most{scaled}"


def window(analysis: Analysis) -> str:
    """Return what part of the log was looked at, nothing if all of it."""
    asked = analysis.policy.sampling.window
    return "" if asked is None else f", only {asked[0]:g} to {asked[1]:g} s of the log"


def copied(system: System) -> list[str]:
    """Return which messages repeat another one, a line each, and what is left out for it."""
    lines: dict[tuple[str, str], list[str]] = {}
    without: dict[tuple[str, str], list[str]] = {}
    for copy in system.copies:
        pair = (copy.channel.source, copy.of.source)
        lines.setdefault(pair, []).append(copy.channel.field)
        left_out = [name for name, by in system.implied.items() if by == copy]
        without.setdefault(pair, []).extend(left_out)
    return [
        f"{channel} repeats {of} ({', '.join(fields)}): not counted"
        + (f"; left out: {', '.join(without[channel, of])}" if without[channel, of] else "")
        for (channel, of), fields in lines.items()
    ]


def latencies(lags: Sequence[Lag]) -> list[str]:
    """Return how late sensors come by the log, a line each, and which stay as stated."""
    lines = [
        f"{lag.component} in {lag.source}: {lag.stated + lag.value:.3f} +- {lag.sigma:.3f} s "
        f"behind {' and '.join(lag.against)} (stated {lag.stated:g} s), taken off"
        for lag in lags
        if lag.used
    ]
    stays: dict[str, list[str]] = {}
    for lag in lags:
        if not lag.used:
            stays.setdefault(lag.why, []).append(f"{lag.component} in {lag.source}")
    lines += [f"as the model states, {why}: {', '.join(names)}" for why, names in stays.items()]
    return lines


def accuracies(found: Sequence[Told]) -> list[str]:
    """Return what channels report of their own accuracy where it is worse than the model's."""
    lines = []
    for one in found:
        is_place = one.unit == "rad" and one.channel.field.lower() in _PLACES
        label, scale = ("m", _EARTH_M) if is_place else customary(one.unit)[:2]
        told, used, worst, stated = (
            f"{value * scale:.2g} {unit(label)}".rstrip()
            for value in (one.reported, one.used, one.worst, one.stated)
        )
        # what differs beyond the printed digits only is as stated
        if max(float(used.split()[0]), float(worst.split()[0])) <= float(stated.split()[0]):
            continue
        beyond = f", bounded for {per_cent(one.bounded)} of the flight" if one.bounded else ""
        lines.append(
            f"{one.channel} reports {told} in the median, {worst} at worst; the model states "
            f"{stated}, and {used} is used in the median{beyond}"
        )
    return lines
