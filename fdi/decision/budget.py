"""How high must thresholds be for noise to alarm as seldom as asked for, all tests together?

In: residuals and a policy with a budget, the false alarms by noise per flight hour. Out: ``Alarms``
of thresholds that keep it. All thresholds of noise have one scale. The flight's own calm residuals
tell their noise (``fdi.decision.resampling``); hours of it are drawn, and every stretch of it has a
scale below which a test would alarm. The largest of these scales are the tail of a distribution,
log rate linear in the squared scale as for Gaussian noise; from it comes the scale for rates below
what the simulated hours show. Whom an alarm accuses, and whether anybody, is the diagnosis' to say.

The random numbers have a fixed seed: the same log gives the same answer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision.alarms import Alarms, Use
from fdi.decision.bounds import Bounds, learn
from fdi.decision.critical import critical_scales
from fdi.decision.judging import judge
from fdi.decision.recipes import PredictedSpread
from fdi.decision.resampling import NoiseModel, fit_noise
from fdi.model.evaluate import Floats
from fdi.residuals import Residuals
from fdi.telemetry.airtime import airborne_mask, when_in_air

SEED: Final = 0
SAMPLES: Final = 16_384
"""Simulated at once."""
ROUNDS: Final = 5
MOST_ROUNDS: Final = 25
SEEN: Final = 2.0
"""So many of the alarms asked for are simulated, if that takes no more rounds than that: tails are
heavier than a Gaussian one, and what lies far beyond the simulated hours is underestimated (Both
are chosen.)"""
MOST_SAMPLES: Final = 40_000
"""Of one flight; of a longer one its first so many in the air."""
AROUND_S: Final = 15.0
"""So near an alarm its residual is not calm: a fault swells and fades."""
IN_PLAY: Final = 0.6
"""Residuals that reach less than this share of the scale sought in the first round are left out of
the others."""
TAIL: Final = 80
"""So many of the largest scales are fitted."""
FLOOR: Final = 0.05
"""A scale below this means no noise at all."""
STRETCH_S: Final = 10.0
"""Alarms within so long are one."""


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """The calm residuals of a flight as a model, and what they would be judged by.

    Attributes
    ----------
    model : NoiseModel
        Of the residuals over ``unit``.
    unit : (r, n) float
    rows : (k,) int
        The residuals that vary.
    known : (r, n) bool
        Where each is judged, in the air.
    bounds : Bounds
    first : int
        The flight's sample with which all these begin.
    rate_hz : float
    hours : float
        In the air.
    """

    model: NoiseModel
    unit: Floats
    rows: NDArray[np.intp]
    known: NDArray[np.bool_]
    bounds: Bounds
    first: int
    rate_hz: float
    hours: float


def decide_within_budget(recipe: PredictedSpread, residuals: Residuals, use: Use) -> Alarms:
    """Return the alarms of a flight, its thresholds scaled to the recipe's budget if it has one.

    Parameters
    ----------
    recipe : PredictedSpread
    residuals : Residuals
    use : Use
    """
    bounds = learn(residuals, recipe)
    alarms = judge(residuals, bounds, recipe, use)
    if recipe.budget_per_hour is None:
        return alarms
    noise = noise_of(alarms, bounds)
    found = scale_for(recipe.budget_per_hour, noise, recipe)
    scale = float(np.clip(found, recipe.least_scale, recipe.most_scale))
    return alarms if scale == 1.0 else judge(residuals, bounds, recipe, use, scale)


def noise_of(alarms: Alarms, bounds: Bounds) -> Noise:
    """Return the noise of a flight: its residuals in the air while they are far from an alarm.

    What the model states (limits, equalities) and tests that are not judged have none.
    """
    residuals = alarms.residuals
    signals = residuals.signals
    air = when_in_air(signals)
    place = np.flatnonzero(air)[:MOST_SAMPLES]
    columns = slice(place[0], place[-1] + 1) if len(place) else slice(0)
    bounds = bounds.at(columns)
    off = bounds.told.strayed(residuals.values[:, columns])[0]
    unit = np.where(bounds.spread > 0, bounds.spread, 1.0)
    known = np.isfinite(off) & air[columns] & ~(bounds.told.stated | bounds.told.unfit)[:, None]
    loud = _around(alarms.alarm, round(AROUND_S * signals.rate_hz))
    calm = known & ~loud[:, columns] & airborne_mask(signals)[columns]
    model = fit_noise(np.where(calm, off / unit, 0.0), calm, signals.rate_hz)
    rows = np.flatnonzero(model.deviation > 0)
    hours = float(air[columns].sum()) / signals.rate_hz / 3600.0
    return Noise(
        model,
        unit,
        rows,
        known,
        bounds,
        columns.start or 0,
        signals.rate_hz,
        hours,
    )


def _around(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Return where a row has a true sample within so many samples."""
    total = np.cumsum(np.pad(mask, ((0, 0), (reach + 1, reach))), axis=1)
    return np.asarray(total[:, 2 * reach + 1 :] > total[:, : -2 * reach - 1])


def scale_for(budget: float, noise: Noise, recipe: PredictedSpread) -> float:
    """Return the scale at which noise alarms ``budget`` times per hour in the air.

    Parameters
    ----------
    budget : float
        Per hour.
    noise : Noise
    recipe : PredictedSpread
    """
    if not len(noise.rows) or not noise.hours:
        return FLOOR
    rng = np.random.default_rng(SEED)
    flights = max(1, SAMPLES // noise.model.samples)
    drawn, found, hours = noise, [], 0.0
    rounds = int(np.clip(np.ceil(SEEN / (budget * flights * noise.hours)), ROUNDS, MOST_ROUNDS))
    for _ in range(rounds):
        scales = simulated(drawn, drawn.model.of(drawn.rows).draw(flights, rng), recipe)
        found.append(peaks(np.max(list(scales.values()), axis=0)))
        hours += flights * noise.hours
        if drawn is noise:
            sought = IN_PLAY * scale_of_rate(budget, found[0], hours)
            heard = [row for row, own in scales.items() if own.max(initial=-np.inf) > sought]
            if not heard:
                break
            drawn = replace(noise, rows=np.array(heard, np.intp))
    return max(FLOOR, scale_of_rate(budget, np.concatenate(found), hours))


def simulated(noise: Noise, drawn: Floats, recipe: PredictedSpread) -> dict[int, Floats]:
    """Return by residual the scales below which stretches of noise alarm, (flights, stretches).

    Parameters
    ----------
    noise : Noise
    drawn : (k, flights, n) float
        Noise of the residuals ``noise.rows``.
    recipe : PredictedSpread
    """
    flights = drawn.shape[1]
    width = max(1, round(STRETCH_S * noise.rate_hz))
    stretches = -(-drawn.shape[2] // width)
    found = {}
    for row, own in zip(noise.rows.tolist(), drawn, strict=True):
        off, known = own * noise.unit[row], noise.known[row]
        whole = np.full((flights, stretches * width), -np.inf)
        whole[:, : off.shape[1]] = critical_scales(
            off, row, noise.bounds, known, recipe, noise.rate_hz
        )
        found[row] = whole.reshape(flights, stretches, width).max(axis=2)
    return found


def peaks(scales: Floats) -> Floats:
    """Return the largest of every run of stretches, (k,): neighbours are one alarm."""
    around = np.pad(scales, ((0, 0), (1, 1)), constant_values=-np.inf)
    is_peak = (scales >= around[:, :-2]) & (scales > around[:, 2:]) & (scales > 0)
    found: Floats = scales[is_peak]
    return found


def scale_of_rate(rate: float, found: Floats, hours: float) -> float:
    """Return the scale that peaks exceed at a rate, per hour, from their tail.

    Parameters
    ----------
    rate : float
    found : (k,) float
        Peaks of so many ``hours``.
    hours : float

    Notes
    -----
    Beyond the level that ``TAIL`` peaks exceed, log rate is taken as linear in the squared scale:
    squares of excesses over a level are then exponential, and their mean is the estimate.

    Examples
    --------
    >>> round(scale_of_rate(1.0, np.sqrt(2 * np.log(1000 / np.arange(1, 1000))), 1.0), 1)
    3.7
    """
    ordered = np.sort(found)[::-1]
    if not len(ordered):
        return 0.0
    wanted = rate * hours
    count = min(TAIL, len(ordered) - 1)
    if wanted >= count:
        return float(ordered[min(int(wanted), len(ordered) - 1)])
    level = ordered[count] ** 2
    mean = float(np.mean(ordered[:count] ** 2 - level))
    return float(np.sqrt(level + mean * np.log(count / wanted)))
