"""Which values have a model's unknown parameters on this very vehicle?

In: a bank, signals, how to differentiate. Out: the same bank with the parameters that have
``identify:`` fitted to the first seconds of the flight in which it tells of them, and then left
alone: a fault that comes later must not become its own reference. The variable that a parameter
shall bring to ``zero`` must depend on it linearly; over that stretch it is averaged over blocks,
because neighbouring samples err alike, and blocks far off the others do not count. Least squares
with the prior as one more measurement: what the flight does not excite keeps the prior and its
width.

How well a value is known follows from what the fit leaves, wider for few blocks, wider where single
blocks move it by more than that (those in a turn or a gust tell most and err most), and wider where
the two halves of the stretch contradict each other. What is left in the calmer half counts
afterwards as noise: as if the parameter itself went up and down by so much. The bank's nodes do not
depend on values, so nothing is derived again.

Where healthy flights before this one have taught values (a policy of ``fdi calibrate``), those are
the priors, and two of their deviations the bounds. Where this flight's own values, taken together,
are as far from them as few healthy flights are (``between.py``), the learned ones hold: what was
wrong before take-off must not become its own reference either.

References
----------
Ljung, System Identification, 1999, sections 7.4 (regularised least squares) and 9.6 (accuracy).
MacKinnon and White, J. Econometrics 29, 1985, p. 305 (blocks that err differently: HC3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.model.evaluate import Floats
from fdi.model.system import Estimate, ParameterValue
from fdi.residuals.bank import Bank
from fdi.residuals.between import STRETCH_S, departure
from fdi.residuals.differentiate import Differentiation
from fdi.residuals.evaluate import compute_node, context_of
from fdi.residuals.reads import needed_for
from fdi.residuals.value import Context, Value
from fdi.telemetry import Signals
from fdi.telemetry.airtime import first_known

BLOCK_S: Final = 1.0
LEAST_BLOCKS: Final = 5
"""Fewer tell no scatter."""
KNOWN_SHARE: Final = 0.5
"""Of a block."""
FAR: Final = 3.0
"""Standard deviations: blocks, halves and bounds further off contradict."""
OF_MEDIAN: Final = 1.4826
"""Standard deviation of normal values over their median distance from the middle."""
MOST_FAR: Final = 0.5
"""Of the blocks; more that are far off are no outliers, but the majority."""
MOST_ALIKE: Final = 0.9
"""Correlation of neighbouring blocks; more cannot be told from so few of them."""
LINEAR: Final = 1e-6
"""Share of a change by which that of the opposite step may differ; rounding."""
TWO_SIGMA: Final = 0.975
"""Quantile to which the tails of few blocks are taken."""


@dataclass(frozen=True, slots=True)
class Fit:
    """What least squares made of k parameters, (k,) each, as differences from their priors.

    ``wanders`` is by how much each would have to go up and down from block to block to explain,
    all together, what no constant values do. ``correlation``, (k, k): how they err together.
    """

    value: Floats
    std: Floats
    wanders: Floats
    correlation: Floats


def identified(bank: Bank, signals: Signals, recipe: Differentiation) -> Bank:
    """Return the bank with what this flight tells of its parameters.

    Parameters
    ----------
    bank : Bank
    signals : Signals
    recipe : Differentiation

    Returns
    -------
    Bank
        The same nodes and generators; the parameters have the source ``identified``, a standard
        deviation and how far they wander, or ``policy`` where this flight contradicts earlier
        ones. Warnings tell which could not be, and why.
    """
    groups: dict[str, list[str]] = {}
    for name, parameter in bank.system.parameters.items():
        if parameter.bounds is not None:
            groups.setdefault(parameter.zero, []).append(name)
    if not groups:
        return bank
    context = replace(context_of(bank.system, bank.nodes, signals, recipe), spreads=False)
    size = max(1, round(BLOCK_S * signals.rate_hz))
    found: dict[str, ParameterValue] = {}
    told = list[str]()
    for zero, names in groups.items():
        number = next((i for i, n in enumerate(bank.nodes) if n.variables == (zero,)), None)
        if number is None:  # no test needs it
            continue
        priors = [bank.system.parameters[name] for name in names]
        columns = _columns(number, names, context, signals)
        blocks = np.empty((0, 1 + len(names))) if columns is None else _blocks(columns, size)
        if len(blocks) < LEAST_BLOCKS:
            why = (
                f"{zero} is not linear in them"
                if columns is None
                else "its beginning tells too little"
            )
            told.append(f"{', '.join(names)}: not learned from this flight, because {why}")
            continue
        found |= zip(names, _fitted(names, blocks, priors), strict=True)
    off = departure(found)
    rare = off is not None and off.rare
    for names in groups.values():
        unfit = [n for n in names if n in found and found[n].source != "identified"]
        learned = any(found[n].learned for n in unfit)
        if unfit and not (rare and learned):
            range_of = "two deviations of what earlier flights taught" if learned else "the model"
            told.append(
                f"{', '.join(unfit)}: not learned from this flight, whose beginning does not fit "
                f"the range of {range_of}"
            )
    if rare:
        found = {n: _kept(bank.system.parameters[n], value) for n, value in found.items()}
    parameters = {**bank.system.parameters, **found}
    warnings = (*bank.system.warnings, *told)
    return replace(bank, system=replace(bank.system, parameters=parameters, warnings=warnings))


def _kept(before: ParameterValue, found: ParameterValue) -> ParameterValue:
    """Return what earlier flights taught, with what this one tells, or else what was found."""
    if before.learned is None:
        return found
    return replace(before, wanders=found.wanders, flight=found.flight)


def _fitted(
    names: Sequence[str], blocks: Floats, priors: Sequence[ParameterValue]
) -> list[ParameterValue]:
    """Return parameters of one variable with what this flight tells of them.

    Where the flight contradicts the bounds of one, none is identified: what fits the others holds
    with that one only. One that was learned keeps what was, which fits the others too.
    """
    own = fit_with_halves(blocks, np.array([prior.width for prior in priors]))
    fit = own
    if any(prior.learned for prior in priors):
        fit = fit_with_halves(blocks, np.array([prior.std for prior in priors], float))
    alone = [
        replace(prior, flight=Estimate(prior.value + float(value), float(std)))
        for prior, value, std in zip(priors, own.value, own.std, strict=True)
    ]
    shares = fit.std[:, None] * np.linalg.cholesky(fit.correlation)
    found = list[ParameterValue]()
    numbers = zip(fit.value, fit.std, fit.wanders, strict=True)
    for prior, row, share in zip(alone, numbers, shares, strict=True):
        value = _within(prior, *map(float, row))
        if value is None and prior.learned is None:
            return alone
        shared = tuple(zip(names, map(float, share), strict=True))
        found.append(prior if value is None else replace(value, shares=shared))
    return found


def _within(
    prior: ParameterValue, change: float, std: float, wanders: float
) -> ParameterValue | None:
    """Return an identified value, within its bounds; None where the flight contradicts these.

    What was learned holds within two of its deviations, as the model's bounds hold those of the
    prior.
    """
    assert prior.bounds is not None
    low, high = prior.bounds
    if prior.learned and prior.std:
        low, high = max(low, prior.value - 2 * prior.std), min(high, prior.value + 2 * prior.std)
    value = prior.value + change
    inside = float(np.clip(value, low, high))
    if abs(value - inside) > FAR * std:
        return None
    return replace(prior, value=inside, source="identified", std=std, wanders=wanders)


def _columns(
    number: int, names: Sequence[str], context: Context, signals: Signals
) -> Floats | None:
    """Return a node over its first seconds and what a unit of each parameter adds, (n, 1 + k).

    None where it is not linear in them.
    """

    def at(name: str, step: float) -> Floats:
        constants = {**context.constants, name: context.constants[name] + step}
        moved, done = replace(context, constants=constants), dict[int, Value]()
        for needed in needed_for(context.nodes, number):
            done[needed] = compute_node(context.nodes[needed], done, moved)
        return done[number].column

    whole = at(names[0], 0.0)
    stretch = first_known(np.isfinite(whole), signals, STRETCH_S)
    columns = [whole[stretch]]
    for name in names:
        std = context.system.parameters[name].std or 1.0
        up = at(name, std)[stretch] - columns[0]
        down = columns[0] - at(name, -std)[stretch]
        bent, moved = (np.nan_to_num(np.abs(change)).max(initial=0.0) for change in (up - down, up))
        if bent > LINEAR * moved:
            return None
        columns.append(up / std)
    return np.column_stack(columns)


def _blocks(columns: Floats, size: int) -> Floats:
    """Return the means of columns over every ``size`` samples, where enough of these are known."""
    count = len(columns) // size
    cut = columns[: count * size].reshape(count, size, columns.shape[1])
    known = np.asarray(np.isfinite(cut).all(axis=2))
    enough = np.asarray(known.mean(axis=1) >= KNOWN_SHARE)
    total = np.where(known[:, :, None], cut, 0.0).sum(axis=1)[enough]
    return np.asarray(total / known.sum(axis=1)[enough, None], np.float64)


def fit_with_halves(blocks: Floats, widths: Floats) -> Fit:
    """Return a fit of all blocks, as sure as the two halves of them agree.

    Parameters
    ----------
    blocks, widths
        As of :func:`fit_linear`.
    """
    half = len(blocks) // 2
    whole, first, second = (fit_linear(b, widths) for b in (blocks, blocks[:half], blocks[half:]))
    apart = np.abs(first.value - second.value)
    contradict = apart > FAR * np.hypot(first.std, second.std)
    std = np.where(contradict, np.clip(apart / 2, whole.std, widths), whole.std)
    return replace(whole, std=std, wanders=np.fmin(first.wanders, second.wanders))


def fit_linear(blocks: Floats, widths: Floats) -> Fit:
    """Return by least squares what makes a quantity zero.

    Parameters
    ----------
    blocks : (b, 1 + k) float
        The quantity, and what a unit of every parameter adds to it.
    widths : (k,) float
        Standard deviations of the parameters before.

    Examples
    --------
    >>> blocks = np.array([[1.0, -1.0], [1.2, -1.0], [0.8, -1.0], [1.1, -1.0], [0.9, -1.0]])
    >>> fit = fit_linear(blocks, np.array([10.0]))
    >>> fit.value.round(3).item(), fit.std.round(3).item(), fit.wanders.round(3).item()
    (1.0, 0.112, 0.158)
    """
    from scipy.special import ndtri, stdtrit  # half a second that most vehicles do not need

    inliers, noise, fewer = _scatter(blocks, widths)
    wrong, slopes = (inliers / (noise * fewer))[:, 0], (inliers / (noise * fewer))[:, 1:]
    covariance = np.asarray(np.linalg.inv(slopes.T @ slopes + np.diag(widths**-2.0)), np.float64)
    # few blocks tell their own scatter badly
    free = max(len(inliers) - len(widths), 1)
    wider = float(stdtrit(free, TWO_SIGMA) / ndtri(TWO_SIGMA))
    own = np.sqrt(np.diag(covariance))
    std = np.minimum(wider * np.maximum(own, fewer * _moved(wrong, slopes, covariance)), widths)
    slope = np.sqrt(len(widths) * (inliers[:, 1:] ** 2).mean(axis=0))
    wanders = np.divide(noise, slope, out=np.zeros(len(slope)), where=slope > 0)
    return Fit(-covariance @ slopes.T @ wrong, std, wanders, covariance / np.outer(own, own))


def _moved(wrong: Floats, slopes: Floats, covariance: Floats) -> Floats:
    """Return by how much the values, (k,), move where blocks are left out one by one.

    The root of the sum of squares: the standard error where some blocks err more than others.
    """
    gain = slopes @ covariance
    left = wrong - gain @ (slopes.T @ wrong)
    lever = np.minimum((gain * slopes).sum(axis=1), 1 - LINEAR)
    moved = gain * (left / (1 - lever))[:, None]
    return np.asarray(np.sqrt((moved**2).sum(axis=0)))


def _scatter(blocks: Floats, widths: Floats) -> tuple[Floats, float, float]:
    """Return the blocks that are not far off the others, their scatter, and what that lacks.

    Wind and turns last: neighbouring blocks err alike, and count as fewer ones. By how many tells
    the correlation of neighbours, that of an autoregression of first order.
    """
    inliers = blocks
    for _ in range(2):
        values = np.asarray(np.linalg.lstsq(inliers[:, 1:], -inliers[:, 0], rcond=None)[0])
        left = blocks[:, 0] + blocks[:, 1:] @ values
        off = np.abs(left - np.median(left))
        free = max(len(inliers) - len(widths), 1)
        near = off <= FAR * OF_MEDIAN * np.sqrt(len(inliers) / free) * np.median(off)
        inliers = blocks[near] if near.mean() > 1 - MOST_FAR else blocks
    left = inliers[:, 0] + inliers[:, 1:] @ values
    noise = np.sqrt((left**2).sum() / max(len(inliers) - len(widths), 1))
    least = LINEAR * float((np.abs(blocks[:, 1:]) @ widths).max())
    noise = max(float(noise), least, float(np.finfo(float).tiny))
    power = float((left**2).sum())
    alike = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    # a fit takes away what neighbours have in common: of blocks that err alone so much is expected
    basis = np.linalg.qr(inliers[:, 1:])[0]
    alike += float((basis[1:] * basis[:-1]).sum()) / max(len(inliers) - len(widths), 1)
    alike = min(max(alike, 0.0), MOST_ALIKE)
    return inliers, noise, float(np.sqrt((1 + alike) / (1 - alike)))
