"""How far may each residual of a flight stray? What is learned from the flight before judging it.

In: residuals and the recipe ``predicted_spread``. Out: ``Bounds``: the constant to take off, the
threshold of single samples from stated accuracies and the flight's own calm part, and the threshold
of means from the means of that length in this flight. Residuals are held against bounds in
``judging.judge``; they need not be those that the bounds were learned from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision.noise import centres, spread_factors, trailing_mean
from fdi.decision.recipes import Learned, PredictedSpread
from fdi.decision.scatter import differences, levels
from fdi.decision.straying import least_tolerances
from fdi.model.evaluate import Floats, wrap
from fdi.model.expression import symbols
from fdi.model.parts import Kind
from fdi.model.system import System
from fdi.residuals import Bank, Generator, Residuals
from fdi.telemetry import Signals
from fdi.telemetry.airtime import airborne_mask, begun_in_air, reference_mask, settled_mask

CLIP: Final = 5.0
"""Standard deviations; more in one sample counts as much in a mean."""
KNOWN_SHARE: Final = 0.7
"""Of the samples of a mean."""
STANDING: Final = 0.8
"""What is violated for this share of the flight's beginning is a condition."""
TOLD: Final = 0.5
"""Of the beginning so much must be known to tell that."""
CALM_SHARE: Final = 0.4
"""Quantile of the means that tells the flight's own level: a fault may fill half of the flight."""
SWINGING: Final = 1 / 3
"""Standard deviation of a constant that swings with the vehicle, as a share of what it was."""
ROUGHER: Final = 3.0
"""So much more than at first a healthy flight may shake later."""


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What the beginning of a flight tells of its r residuals: it serves what comes later as well.

    Attributes
    ----------
    centre : (r,) float
        The constant that is taken off.
    circular : (r,) bool
        The residual is an angle.
    side : (r,) int8
        -1 and 1: a residual below and above zero counts only; 0: either.
    stated : (r,) bool
        The model states the bound (limits, equalities): it is not one of noise.
    unfit : (r,) bool
        Not judged.
    level : (r,) float
        Usual size of second differences at first, over the spread; NaN where none is judged.
    stray : (r,) float
        Least tolerance.
    factor : (r,) float
        By which the threshold of noise is beyond the spread.
    calm, quieter : (r,) float
        The spread that is predicted for the beginning, and what of it the residual really has.
    mean_most : (r,) float
        What the trailing mean may reach, over that of the spread; NaN where it is not judged.
    """

    centre: Floats
    circular: NDArray[np.bool_]
    side: NDArray[np.int8]
    stated: NDArray[np.bool_]
    unfit: NDArray[np.bool_]
    level: Floats
    stray: Floats
    factor: Floats
    calm: Floats
    quieter: Floats
    mean_most: Floats

    def strayed(self, values: Floats) -> tuple[Floats, Floats]:
        """Return how far residuals are off their centre, and the size of what counts of that."""
        return strayed(values, self.centre, self.circular, self.side)

    def noise(self, spread: Floats) -> Floats:
        """Return the threshold of noise, (r, n).

        A residual that is quieter in the beginning than was predicted is so later as well; what
        manoeuvres add to the prediction a calm beginning does not tell.
        """
        calm = np.fmin(spread, self.calm[:, None])
        less = (1.0 - self.quieter**2)[:, None] * calm**2
        noise: Floats = self.factor[:, None] * np.sqrt(spread**2 - less)
        return noise


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """What the residuals of a flight are held against; r residuals, n samples.

    Attributes
    ----------
    told : Told
    tolerance : (r, n) float
    noise : (r, n) float
        The threshold beyond the tolerance.
    spread : (r, n) float
        Predicted standard deviation.
    settled : (n,) bool
        Means are taken here.
    mean_spread, mean_bound : (r, n) float
        The trailing mean of the spread, and what the trailing mean of the residual may reach; NaN
        where it is not judged.
    """

    told: Told
    tolerance: Floats
    noise: Floats
    spread: Floats
    settled: NDArray[np.bool_]
    mean_spread: Floats
    mean_bound: Floats

    def at(self, columns: slice) -> Bounds:
        """Return the bounds of some of the samples."""
        return Bounds(
            self.told,
            self.tolerance[:, columns],
            self.noise[:, columns],
            self.spread[:, columns],
            self.settled[columns],
            self.mean_spread[:, columns],
            self.mean_bound[:, columns],
        )


def learn(residuals: Residuals, recipe: PredictedSpread) -> Bounds:
    """Return what residuals may reach, from the model's statements and the flight's calm part."""
    return held_against(residuals, told_by(residuals, recipe), recipe)


def told_by(residuals: Residuals, recipe: PredictedSpread) -> Told:
    """Return what a flight, or as much of it as there is, tells of its residuals."""
    signals = residuals.signals
    bank = residuals.bank
    equations = [bank.system.equations[generator.residual] for generator in bank.generators]
    # A limit states its bound itself, and within it the residual is zero: nothing to learn there.
    limit = np.array([equation.kind is Kind.LIMIT for equation in equations], bool)
    stated = limit | np.array([equation.kind is Kind.EQUALITY for equation in equations], bool)
    circular = np.array([equation.circular for equation in equations], bool)
    # A residual is right minus left: below zero where the left side is above.
    side = np.array([{"above": -1, "below": 1}.get(e.side, 0) for e in equations], np.int8)
    keys = [key_of(bank.system, generator) for generator in bank.generators]
    known = [recipe.learned.get(key, Learned()) for key in keys]
    stray = np.array([one.stray for one in known])
    tolerance = np.maximum(residuals.lasting, stray[:, None])
    reference = reference_mask(signals, recipe.reference_s)
    first = reference_mask(signals, recipe.block_s)
    centre = _constants(residuals, tolerance + recipe.sigmas * residuals.spread, reference, first)
    centre = np.clip(centre, *np.array([one.centre for one in known]).reshape(-1, 2).T)
    centre = np.where(limit, 0.0, centre)
    # what lies on the other side at first is no reference for a test of one side
    centre[side * centre < 0] = 0.0
    off, size = strayed(residuals.values, centre, circular, side)
    if recipe.usual:
        stray = np.maximum(stray, least_tolerances(size, residuals, recipe.reference_s))
    tolerance = np.maximum(tolerance, stray[:, None])
    deviation = np.maximum(size - tolerance, 0.0)
    spread = _swung(residuals, centre)
    block = max(3, round(recipe.block_s * signals.rate_hz))
    noisy = _noisy(residuals)
    where = (airborne_mask(signals) & noisy, reference & noisy)
    factor = _factors(deviation, spread, where, block, recipe)
    factor = np.where(limit, 1.0, np.where(stated, np.minimum(factor, 1.0), factor))
    unfit = _unfit(residuals, size, tolerance, (reference, first), recipe)
    steady = np.array([equation.steady for equation in equations], bool)
    rough = differences(over_spread(off, spread))
    ratio = normalised(off, tolerance, spread, settled_mask(signals))
    ratio[limit] = np.nan
    count = recipe.mean_samples(signals.rate_hz)
    mean = np.abs(lasting_mean(ratio, count))
    scale = np.array([one.scale for one in known])
    return Told(
        centre,
        circular,
        side,
        stated,
        unfit,
        np.where(steady & ~stated, levels(rough, reference), np.nan),
        stray,
        scale * recipe.sigmas * np.maximum(factor, 1.0),
        _usual(spread, reference),
        np.minimum(factor, 1.0),
        scale * _mean_bounds(mean, count, recipe),
    )


def held_against(residuals: Residuals, told: Told, recipe: PredictedSpread) -> Bounds:
    """Return the bounds of residuals, which may be later ones than those that told."""
    signals = residuals.signals
    equations = [residuals.bank.system.equations[g.residual] for g in residuals.bank.generators]
    limit = np.array([equation.kind is Kind.LIMIT for equation in equations], bool)
    tolerance = np.maximum(residuals.lasting, told.stray[:, None])
    off, _ = told.strayed(residuals.values)
    spread = _swung(residuals, told.centre)
    settled = settled_mask(signals)
    ratio = normalised(off, tolerance, spread, settled)
    ratio[limit] = np.nan
    count = recipe.mean_samples(signals.rate_hz)
    mean_spread = trailing_mean(np.where(np.isfinite(ratio), spread, np.nan), count, 1)
    return Bounds(
        told,
        tolerance,
        told.noise(spread),
        spread,
        settled,
        mean_spread,
        told.mean_most[:, None] * mean_spread,
    )


def _usual(spread: Floats, reference: NDArray[np.bool_]) -> Floats:
    """Return the median of each row where it is known, (r,), NaN where it never is."""
    known = np.where(np.isfinite(spread), spread, np.nan)[:, reference]
    found = np.full(len(known), np.nan)
    some = np.isfinite(known).any(axis=1)
    found[some] = np.nanmedian(known[some], axis=1)
    return found


def _noisy(residuals: Residuals) -> NDArray[np.bool_]:
    """Return where noise is the larger part of the spread, (r, n): only there it can be told."""
    if residuals.swung is None:
        return np.ones(residuals.values.shape, np.bool_)
    with np.errstate(invalid="ignore"):
        return np.asarray(2.0 * residuals.swung**2 <= residuals.spread**2)


def _swung(residuals: Residuals, centre: Floats) -> Floats:
    return np.hypot(residuals.spread, SWINGING * np.abs(centre)[:, None] * residuals.swing)


def _unfit(
    residuals: Residuals,
    size: Floats,
    tolerance: Floats,
    where: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    recipe: PredictedSpread,
) -> NDArray[np.bool_]:
    """Return the tests that do not hold from the beginning of the flight on.

    ``where``: the reference, and its first block.
    """
    reference, first = where
    rate_hz = residuals.signals.rate_hz
    block = max(3, round(recipe.block_s * rate_hz))
    deviation = np.maximum(size - tolerance, 0.0)
    equations = [residuals.bank.system.equations[g.residual] for g in residuals.bank.generators]
    limit = np.array([equation.kind is Kind.LIMIT for equation in equations], bool)
    equality = np.array([equation.kind is Kind.EQUALITY for equation in equations], bool)
    supports = np.array([equation.supports for equation in equations], bool)
    always = np.array([equation.always for equation in equations], bool)
    with np.errstate(invalid="ignore"):
        unfit = spread_factors(deviation, residuals.spread, reference, block) > recipe.most_factor
        # what begins within the reference is a fault and no condition, unless it came with a turn
        known = np.isfinite(deviation) & reference
        least = int(np.ceil(TOLD * np.count_nonzero(first)))
        early = known & (np.cumsum(known, axis=1) <= least)
        begins = spread_factors(deviation, residuals.spread, early, max(1, least // 2))
        most = np.nanmax(np.where(reference, np.nan_to_num(size), 0.0), axis=1, initial=0.0)
        unfit &= ~(begins <= recipe.most_factor) | _turned(residuals, reference, most)
    stands = _stands(size > tolerance, np.isfinite(size), reference)
    # An order that came in flight is no condition of the vehicle, however early it came; nor is
    # what begins while it flies already, without a take-off to settle from.
    sudden = np.array([equation.command for equation in equations], bool)
    sudden |= begun_in_air(residuals.signals.flights) is not None
    began = _began(size > tolerance, np.isfinite(size), residuals.signals, reference)
    stands &= ~(sudden & began)
    unfit = np.where(limit | supports, stands, unfit) & ~always & ~_taught(residuals)
    # where the constant that is allowed could not be learned, nothing is held against the test
    unlearned = ~np.isfinite(residuals.values[:, reference]).any(axis=1)
    is_short = np.count_nonzero(reference) < TOLD * recipe.reference_s * rate_hz
    has_constant = (np.nan_to_num(residuals.allowance) > 0).any(axis=1)
    unfit |= ~limit & has_constant & (equality & unlearned | is_short)
    unfit |= _spoiled(unfit & supports, residuals.bank)
    return np.asarray(unfit, bool)


def _taught(residuals: Residuals) -> NDArray[np.bool_]:
    """Return the tests, (r,), whose parameters are all known from other flights of the vehicle.

    Then it is the flight that does not fit, and not the test.
    """
    system = residuals.bank.system
    unknown = {name: one for name, one in system.parameters.items() if one.bounds is not None}
    found = np.zeros(len(residuals.values), np.bool_)
    for row, generator in enumerate(residuals.bank.generators):
        used = {
            name
            for equation in map(system.equations.__getitem__, generator.equations)
            for name in (*symbols(equation.left), *symbols(equation.right))
        }
        needed = used & unknown.keys()
        found[row] = bool(needed) and all(unknown[name].learned for name in needed)
    return found


def _factors(
    deviation: Floats,
    spread: Floats,
    where: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    block: int,
    recipe: PredictedSpread,
) -> Floats:
    """Return by what each stated spread is off ``where`` the vehicle flies, and in the reference.

    A fault that fills most of the flight must not widen its own threshold.
    """
    factor, early = (spread_factors(deviation, spread, mask, block) for mask in where)
    factor = np.fmin(factor, ROUGHER * np.maximum(early, recipe.least_factor))
    known = np.nan_to_num(factor, nan=1.0)
    kept: Floats = np.clip(known, recipe.least_factor, recipe.most_factor)
    return kept


def _constants(
    residuals: Residuals,
    threshold: Floats,
    reference: NDArray[np.bool_],
    first: NDArray[np.bool_],
) -> Floats:
    """Return the constant of each residual: in the reference or, if it moves, in its first block.

    A fault that begins within the reference may fill most of it: what then lies beyond a threshold,
    (r, n), from where it was at first is no constant, but for one that swings with the vehicle.
    """
    values, allowance = residuals.values, residuals.allowance
    centre, early = (centres(values, allowance, mask) for mask in (reference, first))
    equations = residuals.bank.system.equations
    circular = [equations[g.residual].circular for g in residuals.bank.generators]
    apart = np.abs(np.where(circular, wrap(early - centre), early - centre))
    told = np.isfinite(values[:, first]).sum(axis=1) >= TOLD * np.count_nonzero(first)
    moves = apart > np.nanmax(threshold[:, first], axis=1, initial=0.0)
    return np.where(told & moves & ~_turned(residuals, reference, apart), early, centre)


def _turned(residuals: Residuals, reference: NDArray[np.bool_], moved: Floats) -> NDArray[np.bool_]:
    """Return which residuals may have moved so far, (r,), because the vehicle turned.

    A compass that is not calibrated is off by half a turn at the most.
    """
    swing = residuals.swing[:, reference].max(axis=1, initial=0.0)
    return np.asarray((swing > 0) & (moved <= np.pi * swing))


def key_of(system: System, generator: Generator) -> str:
    """Return a name of a test, the same in every log: the equation left over and its faults."""
    return f"{system.equations[generator.residual].name}: {', '.join(sorted(generator.faults))}"


def strayed(
    values: Floats, centre: Floats, circular: NDArray[np.bool_], side: NDArray[np.int8]
) -> tuple[Floats, Floats]:
    """Return how far residuals are off their centre, and the size of what counts of that."""
    off = values - centre[:, None]
    off[circular] = wrap(off[circular])
    size = np.abs(off)
    for row in np.flatnonzero(side):
        size[row] = np.maximum(side[row] * off[row], 0.0)
        off[row] = np.where(np.isfinite(off[row]), size[row], np.nan)
    return off, size


def normalised(
    off: Floats, tolerance: Floats, spread: Floats, settled: NDArray[np.bool_]
) -> Floats:
    """Return what means are taken of: the residual beyond its tolerance over its spread, clipped.

    Clipped, so that neither a single outlier nor a manoeuvre, in which residuals and spread swell
    together, decides.
    """
    beyond = np.sign(off) * np.maximum(np.abs(off) - tolerance, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.clip(np.where(spread > 0, beyond / spread, np.nan), -CLIP, CLIP)
    ratio[:, ~settled] = np.nan
    return ratio


def lasting_mean(ratio: Floats, count: int) -> Floats:
    """Return the trailing mean of what `normalised` gives, NaN where too little of it is known."""
    return trailing_mean(ratio, count, round(KNOWN_SHARE * count))


def over_spread(off: Floats, spread: Floats) -> Floats:
    """Return residuals over their predicted spread, NaN where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(spread > 0, off / spread, np.nan)


def _mean_bounds(mean: Floats, count: int, recipe: PredictedSpread) -> Floats:
    """Return what means may reach, in standard deviations, from the sizes they have."""
    bound = np.full(len(mean), np.nan)
    for row, own in enumerate(mean):
        known = own[np.isfinite(own)]
        if len(known):
            first = known[: max(count, len(known) // 3)]
            level, early = (float(np.quantile(part, CALM_SHARE)) for part in (known, first))
            level, early = recipe.mean_levels * level, recipe.mean_levels * early
            # A fault may fill most of the flight, but not its first third as well: there means as
            # large as this are the test's nature, and no mean is judged.
            if early <= recipe.mean_most:
                level = min(level, ROUGHER * early)
                bound[row] = np.clip(level, recipe.mean_least, recipe.mean_most)
    return bound


def _spoiled(unfit: NDArray[np.bool_], bank: Bank) -> NDArray[np.bool_]:
    """Return the tests that use all the channels of an unfit one.

    A compass that does not show the field shows no heading either.
    """
    used = [
        {m.channel for i in g.equations if (m := bank.system.equations[i].measurement)}
        for g in bank.generators
    ]
    bad = [used[row] for row in np.flatnonzero(unfit) if used[row]]
    return np.array([any(own >= other for other in bad) for own in used], dtype=bool)


def _began(
    violated: NDArray[np.bool_],
    known: NDArray[np.bool_],
    signals: Signals,
    reference: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return the tests that were in order as the flight began, before the reference did."""
    before = airborne_mask(signals) & (np.cumsum(reference) == 0)
    over, told = (which[:, before].sum(axis=1) for which in (violated, known))
    return np.asarray((told > TOLD * np.count_nonzero(before)) & (over < TOLD * told))


def _stands(
    violated: NDArray[np.bool_], known: NDArray[np.bool_], reference: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which statements are violated from the beginning of the flight on.

    Of what is known of the beginning: what a poor link lost tells nothing.
    """
    over, told = (which[:, reference].sum(axis=1) for which in (violated, known))
    return np.asarray(
        (told > 0) & (told >= TOLD * np.count_nonzero(reference)) & (over >= STANDING * told)
    )
