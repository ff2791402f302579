"""Along which direction does a fault move the residuals, and how far have they moved along it?

In: alarms and an onset (a `Scene`), and a `Hypothesis`: a fault of a given shape, a lasting bias or
a drift, on one channel of a sensor or alike on all that show the same. Out: a `Fit`. Such a fault
moves the residuals along a direction, sample by sample (``fdi.residuals.respond``). The size is the
generalised least-squares fit along it, with the joint covariance of the residuals in the calm part
before the onset, shrunk towards its diagonal. The moment at which it began is the one that explains
most. How sure the size is, is what the very same sum of residuals gave at earlier moments, when
nothing was wrong: that holds the correlation over time as well as that between residuals.

What a sensor disturbs follows it: an estimator believes a false position after a while, and its
residuals fade. So tests that hold a fault of what the component disturbs count at first only.

References
----------
Willsky, Jones: A generalized likelihood ratio approach to the detection and estimation of jumps in
linear systems, IEEE Trans. AC 21(1), 1976. Basseville, Nikiforov: Detection of Abrupt Changes,
1993, chapter 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.model.evaluate import Floats, wrap
from fdi.model.parts import Kind
from fdi.residuals import Bank
from fdi.residuals.respond import Stretch, respond, stretch
from fdi.telemetry.events import SETTLING_S

Shape = Literal["bias", "drift"]

CALM_S: Final = 60.0
"""At most so long before the onset the residuals tell what they do in health."""
LEAST_CALM_S: Final = 6.0
GUARD_S: Final = 3.0
"""What lies so closely before the onset may be part of the fault."""
MARGIN_S: Final = 8.0
"""Derivatives need data on both sides."""
LONGEST_S: Final = 20.0
"""After the onset nothing later counts."""
FOLLOWS_S: Final = 3.0
"""So long what is disturbed has not followed the fault yet."""
BEGAN_S: Final[dict[Shape, tuple[float, ...]]] = {
    "bias": tuple(0.5 * step for step in range(-6, 3)),
    "drift": tuple(float(step) for step in range(-12, 2)),
}
"""Moments, against the onset of the alarms, at which the fault may have begun."""
EDGE_S: Final = 0.4
"""Sampling and latencies smear a step over as much."""
SLOW: Final = 0.15
"""Share of its spread by which a residual wanders too slowly for the calm part to show."""
LEAST_DRIFT_S: Final = 6.0
"""In less a drift is told from nothing else."""
FLOOR: Final = 0.1
"""No residual is quieter than this share of its predicted spread."""
CLIP: Final = 6.0
"""Standard deviations; more in one sample of the calm part counts as much."""
LEAST_SAMPLES: Final = 4
TURNS: Final = 2
"""How often a direction is taken anew at the size that it gave: residuals are not linear."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A fault: the equations that it enters, alike, and how it grows.

    ``field`` is that of its channels, which twins share; ``probe`` a size to begin with, in
    ``unit`` (of a drift: per second).
    """

    component: str
    field: str
    names: tuple[str, ...]
    equations: tuple[int, ...]
    shape: Shape
    unit: str
    probe: float


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The residuals around an onset, without their usual level, over their predicted spread.

    Attributes
    ----------
    rows : (k,) int
        Of the bank; those that can be judged.
    z, spread : (k, n) float
        Over the grid of ``piece``; NaN where unknown.
    calm : (k, m) float
        Likewise, before the onset.
    covariance : (k, k) float
    inflation : float
        By how much correlation over time widens variances.
    late, rate : (k,) bool
        Rows that hold what the component disturbs, and those with a derivative. A state is inert
        and follows late, but its rate follows at once: rows that are both never count.
    end : float
        s; nothing later counts.
    """

    bank: Bank
    onset: float
    end: float
    rows: NDArray[np.intp]
    piece: Stretch
    z: Floats
    spread: Floats
    calm: Floats
    covariance: Floats
    inflation: float
    late: NDArray[np.bool_]
    rate: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fault put against the residuals.

    Attributes
    ----------
    since : float
        s; when it began.
    value, sigma : float
        In the hypothesis' unit; of a drift per second.
    gain : float
        By how much it lowers the sum of squares: twice the logarithm of the likelihood ratio.
    left : float
        Mean square of what is left since then; one in health.
    explained : float
        Share of the sum of squares since then.
    halves : (float, float)
        The size by the first and by the second half of the samples alone.
    moved : (k, n) float
        By how much it moves each residual of the scene, over its spread, whether that counts or
        not.
    """

    hypothesis: Hypothesis
    since: float
    value: float
    sigma: float
    gain: float
    left: float
    explained: float
    halves: tuple[float, float]
    moved: Floats


def hypotheses(bank: Bank, component: str) -> list[Hypothesis]:
    """Return the faults of a sensor that have a size: one channel's, or alike on its twins'.

    A channel enters all equations that read it, those in which the model trusts it as well.
    """
    system = bank.system
    entered: dict[str, list[int]] = {}
    for number, equation in enumerate(system.equations):
        if equation.measurement is not None and not equation.measurement.stillness:
            entered.setdefault(str(equation.measurement.channel), []).append(number)
    alike: dict[tuple[str, str], list[tuple[str, tuple[int, ...], float]]] = {}
    for fault in system.faults:
        equation = system.equations[fault.equation]
        measurement = equation.measurement
        if fault.component != component or fault.group != "sensor":
            continue
        if measurement is None or measurement.stillness or not measurement.accuracy:
            continue
        key = (measurement.channel.field, system.variables[measurement.variable].unit)
        numbers = tuple(entered[str(measurement.channel)])
        alike.setdefault(key, []).append((fault.name, numbers, measurement.accuracy))
    result = []
    for (field, unit), members in alike.items():
        for group in ([[one] for one in members]) + ([members] if len(members) > 1 else []):
            accuracy = max(own for _, _, own in group)
            names = tuple(name for name, _, _ in group)
            numbers = tuple(number for _, own, _ in group for number in own)
            result += [
                Hypothesis(component, field, names, numbers, "bias", unit, accuracy),
                Hypothesis(component, field, names, numbers, "drift", unit, accuracy / 5),
            ]
    return result


def scene(alarms: Alarms, component: str, onset: float, start: float, end: float) -> Scene | None:
    """Return the residuals around an onset in a flight from ``start`` to ``end``, s.

    None where too little of the flight lies before it to know what is usual.
    """
    residuals = alarms.residuals
    bank, t, rate = residuals.bank, residuals.t, residuals.signals.rate_hz
    calm = (t >= max(start + SETTLING_S, onset - CALM_S)) & (t < onset - GUARD_S)
    if calm.sum() < LEAST_CALM_S * rate:
        return None
    equations = [bank.system.equations[generator.residual] for generator in bank.generators]
    off = residuals.values - alarms.centre[:, None]
    circular = np.array([equation.circular for equation in equations], dtype=bool)
    off[circular] = wrap(off[circular])
    known = np.isfinite(off) & (residuals.spread > 0)
    # A limit and a one-sided statement are silent within their bounds: they have no direction.
    usable = np.array([e.kind is not Kind.LIMIT and not e.side for e in equations], dtype=bool)
    usable &= (known[:, calm].mean(axis=1) > 0.5) & ~alarms.unfit
    rows = np.flatnonzero(usable)
    if not len(rows):
        return None
    first = int(np.searchsorted(t, onset + min(BEGAN_S["drift"]) - MARGIN_S))
    stop = int(np.searchsorted(t, onset + LONGEST_S + MARGIN_S))
    span = slice(first, stop)
    own = np.where(known, off, np.nan)[rows]
    level = np.nanmedian(own[:, calm], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (own - level[:, None]) / residuals.spread[rows]
    covariance, inflation = _joint(z[:, calm], rate)
    return Scene(
        bank,
        onset,
        end,
        rows,
        stretch(residuals, span),
        z[:, span],
        residuals.spread[rows][:, span],
        z[:, calm],
        covariance,
        inflation,
        _disturbed(bank, rows, component),
        _rate(bank, rows),
    )


def _joint(z: Floats, rate: float) -> tuple[Floats, float]:
    """Return the shrunk covariance of rows, and by how much their memory widens variances."""
    filled = np.nan_to_num(np.clip(z, -CLIP, CLIP))
    known = np.isfinite(z).astype(np.float64)
    joint = filled @ filled.T / np.maximum(known @ known.T, 1.0)
    # about one sample a second is news, so with few seconds little is known of so many pairs
    shrink = len(z) / (len(z) + z.shape[1] / rate)
    covariance = (1.0 - shrink) * joint
    covariance[np.diag_indices(len(z))] = np.maximum(np.diag(joint), FLOOR**2)
    power = np.maximum((filled**2).sum(axis=1), 1e-9)
    memory = np.median((filled[:, 1:] * filled[:, :-1]).sum(axis=1) / power)
    memory = float(np.clip(memory, 0.0, 0.95))
    return covariance, (1.0 + memory) / (1.0 - memory)


def _disturbed(bank: Bank, rows: NDArray[np.intp], component: str) -> NDArray[np.bool_]:
    """Return which rows, (k,), hold a fault of what a component disturbs."""
    names = set(bank.system.components[component].affects) - {component}
    owner = {fault.name: fault.component for fault in bank.system.faults}
    held = [{owner[name] for name in bank.generators[row].faults} for row in rows]
    return np.array([not names.isdisjoint(own) for own in held], dtype=bool)


def _rate(bank: Bank, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which rows, (k,), take a derivative."""
    equations = bank.system.equations
    used = [bank.generators[row].equations for row in rows]
    return np.array([any(equations[e].differential for e in own) for own in used], dtype=bool)


@dataclass(frozen=True, slots=True)
class Extent:
    """Which samples count: ``length`` s after the onset.

    Of tests that hold what the component disturbs, ``disturbed`` s after it.
    """

    length: float
    disturbed: float = FOLLOWS_S


def directions(
    where: Scene, hypothesis: Hypothesis, moments: Sequence[float]
) -> dict[float, Floats]:
    """Return along which direction, (k, n), a small fault moves the residuals, over their spread.

    By the time, s, from which on it is there; ``moments`` are against the onset.
    """
    times = [where.onset + moment for moment in moments]
    return {since: _direction(where, hypothesis, since, hypothesis.probe) for since in times}


def fit(
    where: Scene, hypothesis: Hypothesis, extent: Extent, begun: Mapping[float, Floats]
) -> Fit | None:
    """Return the best fit of a fault along the directions of :func:`directions`."""
    best = _likeliest(where, hypothesis, extent, begun)
    for turn in range(TURNS):
        if best is None or not best.value:
            return None
        direction = _direction(where, hypothesis, best.since, best.value)
        whole = _match(where, hypothesis, best.since, direction, extent)
        best = _match(where, hypothesis, best.since, direction, extent, edge_s=EDGE_S)
        if turn == TURNS - 1 and best is not None and whole is not None:
            return _judged(where, hypothesis, best, whole.gain, best.value * direction)
    return None


def gain(
    where: Scene, hypothesis: Hypothesis, extent: Extent, begun: Mapping[float, Floats]
) -> float:
    """Return what the best fit gains, roughly: the directions are those of a small size."""
    found = _likeliest(where, hypothesis, extent, begun)
    return 0.0 if found is None else found.gain


def _likeliest(
    where: Scene, hypothesis: Hypothesis, extent: Extent, begun: Mapping[float, Floats]
) -> _Match | None:
    tried = (_match(where, hypothesis, since, s, extent) for since, s in begun.items())
    known = [found for found in tried if found is not None and found.value]
    return max(known, key=lambda found: found.gain, default=None)


@dataclass(frozen=True, slots=True, eq=False)
class _Match:
    """z and the direction s over the rows and samples that count, and the product of the two."""

    since: float
    rows: NDArray[np.intp]
    inside: NDArray[np.bool_]
    known: NDArray[np.bool_]
    z: Floats
    s: Floats
    weights: Floats
    a: float
    b: float

    @property
    def value(self) -> float:
        return self.b / self.a

    @property
    def gain(self) -> float:
        return self.b**2 / self.a


def _direction(where: Scene, hypothesis: Hypothesis, since: float, size: float) -> Floats:
    t = where.piece.t
    grown = (t >= since).astype(np.float64)
    if hypothesis.shape == "drift":
        grown *= t - since
    # what is taken off the data brings back what they would be without the fault
    change = respond(where.piece, dict.fromkeys(hypothesis.equations, -size * grown))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(change[where.rows] / -size / where.spread)


def _match(
    where: Scene,
    hypothesis: Hypothesis,
    since: float,
    direction: Floats,
    extent: Extent,
    *,
    edge_s: float = 0.0,
) -> _Match | None:
    """Return the match with a fault that began at ``since``.

    What lies closer to it than an edge is left out; not where moments are compared, for all of them
    must explain the same samples.
    """
    t = where.piece.t
    rows = np.flatnonzero(np.nan_to_num(direction).any(axis=1) & ~(where.late & where.rate))
    first = where.onset + min(BEGAN_S["drift"])
    inside = (t >= first) & (t < min(where.onset + extent.length, where.end))
    inside &= np.abs(t - since - 0.5 * edge_s) >= edge_s
    z, s = where.z[np.ix_(rows, inside)], direction[np.ix_(rows, inside)]
    known = np.isfinite(z) & np.isfinite(s)
    known &= ~(where.late[rows][:, None] & (t[inside] >= where.onset + extent.disturbed))
    shown = t[inside][known.any(axis=0) & (t[inside] >= since)]
    if len(shown) < LEAST_SAMPLES:
        return None
    if hypothesis.shape == "drift" and shown[-1] - since < LEAST_DRIFT_S:
        return None
    z, s = np.where(known, z, 0.0), np.where(known, s, 0.0)
    z, s, weights = _whitened(where.covariance[np.ix_(rows, rows)], known, z, s)
    a, b = float((s**2).sum()), float((s * z).sum())
    return _Match(since, rows, inside, known, z, s, weights, a, b) if a > 0 else None


def _judged(
    where: Scene, hypothesis: Hypothesis, found: _Match, gained: float, moved: Floats
) -> Fit:
    value = found.value
    after = where.piece.t[found.inside] >= found.since
    rest = float(((found.z - value * found.s)[:, after] ** 2).sum())
    whole = float((found.z[:, after] ** 2).sum())
    left = rest / max(1, found.known[:, after].sum())
    sigma = float(np.sqrt(where.inflation * max(1.0, left) / found.a))
    weights = found.weights[:, after] / found.a
    earlier = _earlier(where.calm[found.rows], weights)
    # what wanders looks like the fault: a lasting difference, or one that grows
    grown = np.ones(weights.shape[1])
    if hypothesis.shape == "drift":
        grown = np.linspace(0.0, 1.0, weights.shape[1])
    slow = SLOW * float(np.sqrt(((weights @ grown) ** 2).sum()))
    return Fit(
        hypothesis,
        found.since,
        value,
        float(np.hypot(max(sigma, earlier), slow)),
        gained,
        left,
        1.0 - rest / whole if whole > 0 else 0.0,
        _halves(found.s, found.z, value),
        moved,
    )


def _whitened(
    covariance: Floats, known: NDArray[np.bool_], z: Floats, s: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return z and s with their rows made independent, and the weights of z in their product."""
    result = tuple(np.zeros(z.shape) for _ in range(3))
    _, codes = np.unique(np.packbits(known, axis=0), axis=1, return_inverse=True)
    codes = codes.ravel()  # which rows are known, a number per sample
    for code in range(codes.max(initial=-1) + 1):
        columns = np.flatnonzero(codes == code)
        rows = np.flatnonzero(known[:, columns[0]])
        if not len(rows):
            continue
        place = np.ix_(rows, columns)
        root = np.linalg.cholesky(covariance[np.ix_(rows, rows)])
        result[0][place] = np.linalg.solve(root, z[place])
        result[1][place] = np.linalg.solve(root, s[place])
        result[2][place] = np.linalg.solve(root.T, result[1][place])
    return result[0], result[1], result[2]


def _earlier(calm: Floats, weights: Floats) -> float:
    """Return the root mean square of a weighted sum at earlier moments, 0 where they are few."""
    size = weights.shape[1]
    places = calm.shape[1] - size + 1
    if places < size // 2:
        return 0.0
    windows = np.lib.stride_tricks.sliding_window_view(np.nan_to_num(calm), size, axis=1)
    sums = np.einsum("rpn,rn->p", windows, weights)
    return float(np.sqrt(np.mean(sums**2)))


def _halves(s: Floats, z: Floats, value: float) -> tuple[float, float]:
    """Return the size by the samples that bring the first and the second half of what is known."""
    known = np.cumsum((s**2).sum(axis=0))
    first = known <= known[-1] / 2
    sizes = []
    for part in (first, ~first):
        a = (s[:, part] ** 2).sum()
        sizes.append(float((s[:, part] * z[:, part]).sum() / a) if a > 0 else value)
    return sizes[0], sizes[1]
