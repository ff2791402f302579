"""Does a vehicle swing to and fro about an axis, and its motors with it?

In: body rates, and the moments that the motors are asked for (``setup/against.py``). Out: for how
long it has swung, and one `Check`. A rate controller whose gains are too high for its vehicle, or
whose vehicle is loose, shakes it at 2 to 15 Hz, faster than any hand; gains far too high throw the
motors from one end to the other. Propellers and the frame shake faster than motors follow.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from fdi.grid import uniform
from fdi.methods.setup.against import asked_moments
from fdi.methods.setup.motors import lacking, motor_thrusts
from fdi.methods.setup.records import body_rates, stretches
from fdi.methods.setup.values import Check
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, motors_of
from fdi.windows import runs_of

NAME: Final = "oscillation"
APART_S: Final = 0.15
"""Records further apart show no such swing."""
LASTS_S: Final = 2.0
"""A gust or a stick is over by then: so long ArduPilot waits before it calls a vehicle crashed that
does not follow (CRASH_CHECK_TRIGGER_SEC)."""
AXES: Final = ("roll", "pitch", "yaw")
_OVER_S: Final = 0.5  # over which a swing is taken: of 2 Hz and more, no person's hand
_SWINGS: Final = 0.2  # rad/s, root mean square: rotors shake a vehicle that stands by 0.03 to 0.08
_DRIVEN: Final = (
    0.05  # of the largest moment; with half of it a low hover at 3.5 % of throttle swings, too
)
_FULL: Final = 0.7  # of the largest moment, which nobody needs one way and the other in turn
_IN_TURN_S: Final = 2.0  # from the one to the other: of 0.25 Hz and more
_LINE: Final = 0.5  # of the power in one frequency: a line


class Swing(NamedTuple):
    """For how long, s, since when, by what amplitude, rad/s, at what frequency (nan: at none)."""

    lasts: float
    since: float
    rate: float
    hertz: float
    axis: str


def swung(t: Floats, rate: Floats, moment: Floats) -> Floats:
    """Return for how long, s, a vehicle has swung about an axis, 0 where it does not, (n,).

    Parameters
    ----------
    t, rate, moment : (n,) float
        s, rad/s, and what its motors are asked for, of the largest.
    """
    swings = (_scatter(t, rate) > _SWINGS) & (_scatter(t, moment) > _DRIVEN)
    lasted = np.zeros(t.size)
    for low, high in runs_of(swings):
        lasted[low:high] = t[low:high] - t[low]
    return lasted


def thrown(t: Floats, moment: Floats) -> Floats:
    """Return for how long, s, motors have gone from one end to the other and back, (n,).

    Examples
    --------
    >>> t = np.arange(0.0, 6.0, 0.5)
    >>> thrown(t, np.array([0, 0, 0.9, 0.8, -0.9, 0.2, 0.8, -0.8, 0.1, 0.0, 0.0, 0.0])).tolist()
    [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.5, 2.0, 0.0, 0.0, 0.0, 0.0]
    """
    lasted = np.zeros(t.size)
    ends = np.flatnonzero(np.abs(moment) > _FULL)
    turned = np.sign(moment[ends[1:]]) != np.sign(moment[ends[:-1]])
    starts, stops = ends[:-1][turned], ends[1:][turned]
    quick = t[stops] - t[starts] <= _IN_TURN_S
    starts, stops = starts[quick], stops[quick]
    apart = t[starts[1:]] - t[stops[:-1]] > _IN_TURN_S
    for some in np.split(np.arange(starts.size), np.flatnonzero(apart) + 1):
        if some.size:
            low, high = starts[some[0]], stops[some[-1]] + 1
            lasted[stops[some[0]] : high] = t[stops[some[0]] : high] - t[low]
    return lasted


def check_oscillation(log: Log) -> Iterator[Check]:
    """Yield whether a multicopter swings in the air."""
    if log.vehicle not in ROTORS:
        return
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    rates, thrusts = body_rates(log), motor_thrusts(log, motors)
    flown = tuple(one for one in stretches(log) if not one.is_start)
    lacks = lacking(log, motors)
    if lacks or rates is None or thrusts is None:
        lacks = lacks or "the log holds no body rates"
    elif not flown:
        lacks = "the log holds no flight long enough"
    elif (slowest := max(rates.period, thrusts.period)) > APART_S:
        lacks = f"records are {slowest:.2g} s apart, and {APART_S} s are needed to see a swing"
    else:
        moments = asked_moments(rates.t, thrusts, motors)
        parts = [(rates.t >= part.start) & (rates.t <= part.end) for part in flown]
        found = [_swings(rates.t[p], rates.values[:, p], moments[:, p]) for p in parts]
        parts_of_it = (*(f"motor_{one.number}" for one in motors), "propulsion", "attitude_control")
        told = _told([swing for part in found for swing in part])
        yield replace(told, rests_on=parts_of_it)
        return
    yield Check(NAME, "not known", lacks)


def _told(found: Sequence[Swing]) -> Check:
    """Return the check; what has a line goes before what lasts longer without one."""
    if not found:
        words = f"nothing swings faster than 2 Hz for {LASTS_S:.0f} s or longer in the air"
        return Check(NAME, "in order", words)
    one = max(found, key=lambda swing: (np.isfinite(swing.hertz), swing.lasts))
    numbers = {"lasts_s": one.lasts, "amplitude_rad_s": one.rate}
    far = f"{np.degrees(one.rate):.0f} degrees a second to either side"
    when = f"for {one.lasts:.1f} s from log {one.since:.1f} s on"
    if not np.isfinite(one.hertz):
        words = (
            f"{when} it turns to and fro in {one.axis}, {far}, at no single frequency: "
            "gusts and sticks do that, too"
        )
        return Check(NAME, "not known", words, numbers)
    words = f"it swings in {one.axis} at {one.hertz:.1f} Hz, {far}, and its motors with it: {when}"
    return Check(NAME, "not known", words, {**numbers, "frequency_hz": one.hertz}, strikes=True)


def _swings(t: Floats, rates: Floats, moments: Floats) -> Iterator[Swing]:
    """Yield each swing about an axis that lasts; of (n,) s and (3, n) rad/s and moments."""
    for axis, rate, moment in zip(AXES, rates, moments, strict=True):
        quick = rate - _around(t, rate)
        for low, high in runs_of(swung(t, rate, moment) > 0):
            own = slice(max(low - 1, 0), high)  # at its first record none has lasted yet
            lasts = float(t[own][-1] - t[own][0])
            if lasts > LASTS_S:
                far = float(np.sqrt(2 * np.mean(quick[own] ** 2)))
                yield Swing(lasts, float(t[own][0]), far, _line(t[own], quick[own]), axis)


def _line(t: Floats, rate: Floats) -> float:
    """Return the frequency, Hz, that takes most of the power over some two seconds, nan for none.

    A swing of a vehicle that flies changes its frequency within a few seconds.
    """
    fastest = 0.5 / np.median(np.diff(t))
    tried = np.linspace(1 / _OVER_S, fastest, round((fastest - 1 / _OVER_S) * 4 * LASTS_S) + 1)
    most, hertz = _LINE, np.nan
    for start in uniform(t[0], t[-1] - LASTS_S, LASTS_S / 2, records=t.size):
        some = (t >= start) & (t <= start + LASTS_S)
        taken = share_of_sines(t[some], rate[some], 2 * np.pi * tried)
        best = int(np.argmax(taken))
        if 0 < best < tried.size - 1 and taken[best] > most:  # at an end it is no line
            most, hertz = float(taken[best]), float(tried[best])
    return hertz


def share_of_sines(t: Floats, values: Floats, frequencies: Floats) -> Floats:
    """Return the share of the power that a sine of each frequency takes away, (m,).

    Records may come at any times: the normalized periodogram of Lomb (1976) and Scargle (1982), as
    `scipy.signal.lombscargle` gives it, whose import takes a second.

    Parameters
    ----------
    t, values : (n,) float
        s, and about zero.
    frequencies : (m,) float
        rad/s.
    """
    phases = frequencies[:, None] * t
    waves = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    moments = waves @ values
    # of the fastest frequency cosine and sine may be one wave: a pseudo-inverse
    inverse = np.linalg.pinv(waves @ waves.transpose(0, 2, 1), rcond=1e-9, hermitian=True)
    fitted = (inverse @ moments[..., None])[..., 0]
    return np.asarray((moments * fitted).sum(axis=1) / (values @ values))


def _scatter(t: Floats, values: Floats) -> Floats:
    """Return the root mean square about the mean of half a second around, (n,)."""
    return np.sqrt(_around(t, (values - _around(t, values)) ** 2))


def _around(t: Floats, values: Floats) -> Floats:
    total = np.insert(np.cumsum(values), 0, 0.0)
    low = np.searchsorted(t, t - _OVER_S / 2)
    high = np.searchsorted(t, t + _OVER_S / 2, side="right")
    return np.asarray((total[high] - total[low]) / (high - low))
