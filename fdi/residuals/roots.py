"""Which are all the solutions of a small system of equations, within the domains of its unknowns?

In: equations that are zero, unknowns with their domains, columns of what is known. Out: at every
sample all roots, and whether it is proven that these are all. Boxes are made smaller by undoing the
equations, proven to hold one root or none by Krawczyk's operator, or else cut in two; a sample that
needs too many boxes is left undecided. All boxes of all samples are treated together.

References
----------
Krawczyk, Computing 4, 1969; Neumaier, Interval Methods for Systems of Equations, 1990, section 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Column, Floats
from fdi.model.expression import Expression
from fdi.model.parts import Variable
from fdi.residuals.interval import Bounds, Enclosure, Unknowns, enclose, narrow

MAX_BOXES: Final = 150
"""Boxes for each sample and unknown; what needs more is told as not decided."""
CHUNK: Final = 2_000
"""Samples treated together."""
SWEEPS: Final = 3
POLISHING: Final = 6
"""Newton steps within a box that is proven to hold one root: each doubles the digits."""
INFLATED: Final = 0.05
"""Share by which a box is widened before it is tested, so that a root on its side is proven."""
SAME: Final = 1e-7
"""Two roots that differ by less, relative to their size, are one found in two boxes."""
FAR_APART: Final = 1e-3
"""Roots that differ by more, relative to their size, are two for certain."""
WIDE: Final = 100.0
"""A wider box is cut by orders of magnitude."""
FAR: Final = 1e30
"""No quantity of a model is larger, in SI units."""
AT: Final = 0.4871
"""Where a box is cut: roots lie on round numbers more often than on others."""


class Roots(NamedTuple):
    """All roots, (k, m, n), NaN where there are fewer, and whether these are all, (n,)."""

    values: Floats
    complete: NDArray[np.bool_]


@dataclass(slots=True, eq=False)
class _Boxes:
    sample: NDArray[np.intp]
    low: Floats
    high: Floats

    def take(self, which: NDArray[np.bool_]) -> _Boxes:
        return _Boxes(self.sample[which], self.low[:, which], self.high[:, which])


@dataclass(slots=True)
class _Found:
    sample: list[NDArray[np.intp]] = field(default_factory=list)
    root: list[Floats] = field(default_factory=list)


def all_roots(
    equations: Sequence[Expression],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    size: int,
    shown: NDArray[np.bool_] | None = None,
) -> Roots:
    """Return all roots of a system at every sample.

    Parameters
    ----------
    equations : sequence of Expression
        As many as unknowns, each zero at a root.
    unknowns : sequence of Variable
        A circular one without a domain has one turn.
    columns : mapping of str to (n,) float or scalar
    size : int
        n. Where a column is NaN no root is given, and none is said to be missing.
    shown : (n,) bool, optional
        Where something tells roots apart. Elsewhere two of them are enough, and the search ends.
    """
    told = np.ones(size, dtype=bool) if shown is None else shown
    parts = []
    for start in range(0, size, CHUNK):
        samples = np.arange(start, min(start + CHUNK, size))
        own = {k: v if np.ndim(v) == 0 else np.asarray(v)[samples] for k, v in columns.items()}
        parts.append(_chunk(equations, unknowns, own, told[samples]))
    most = max((len(part.values) for part in parts), default=0)
    values = np.full((most, len(unknowns), size), np.nan)
    for part, start in zip(parts, range(0, size, CHUNK), strict=True):
        values[: len(part.values), :, start : start + part.values.shape[2]] = part.values
    return Roots(values, np.concatenate([part.complete for part in parts]))


def domain_of(variable: Variable) -> tuple[float, float]:
    """Return the bounds of a variable; an angle without any has one turn."""
    low = -FAR if variable.low is None else variable.low
    high = FAR if variable.high is None else variable.high
    if variable.circular and high - low > 2 * np.pi:
        return -np.pi, np.pi
    return low, high


def _chunk(
    equations: Sequence[Expression],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    told: NDArray[np.bool_],
) -> Roots:
    size = len(told)
    known = np.ones(size, dtype=bool)
    for column in columns.values():
        known &= np.isfinite(np.asarray(column, dtype=float))
    domain = np.array([domain_of(u) for u in unknowns])
    slack = 1e-9 * (1 + np.abs(domain))
    samples = np.flatnonzero(known)
    ends = np.repeat(
        (domain + slack * [-1, 1])[:, :, None], len(samples), axis=2
    )  # (unknowns, 2, samples)
    boxes = _Boxes(samples, ends[:, 0], ends[:, 1])
    names = [u.name for u in unknowns]
    complete = np.ones(size, dtype=bool)
    used = np.zeros(size, dtype=np.intp)
    found = _Found()
    while boxes.sample.size:
        used += np.bincount(boxes.sample, minlength=size)
        over = used > MAX_BOXES * len(unknowns)
        complete &= ~over
        boxes = boxes.take(~over[boxes.sample])
        boxes = _round(equations, names, columns, boxes, found)
        boxes = boxes.take((told | ~_several(found, len(unknowns), size))[boxes.sample])
    values = _gathered(found, len(unknowns), size, unknowns)
    least, most = (domain + slack * [-1, 1]).T[:, :, None]
    outside = np.any((values < least) | (values > most), axis=1)
    return Roots(np.where(outside[:, None, :], np.nan, values), complete)


def _several(found: _Found, m: int, size: int) -> NDArray[np.bool_]:
    """Return the samples of which two roots are known that are far from one another."""
    low, high = np.full((m, size), np.inf), np.full((m, size), -np.inf)
    for sample, root in zip(found.sample, found.root, strict=True):
        for place in range(m):
            np.fmin.at(low[place], sample, root[place])
            np.fmax.at(high[place], sample, root[place])
    with np.errstate(invalid="ignore"):
        apart = high - low > FAR_APART * (1e-3 + np.maximum(np.abs(low), np.abs(high)))
    return np.asarray(np.any(apart, axis=0))


def _round(
    equations: Sequence[Expression],
    names: Sequence[str],
    columns: Mapping[str, Column],
    boxes: _Boxes,
    found: _Found,
) -> _Boxes:
    """Return the boxes that are still undecided after one round, cut in two."""
    own = {k: v if np.ndim(v) == 0 else np.asarray(v)[boxes.sample] for k, v in columns.items()}
    box = {name: Bounds(boxes.low[i], boxes.high[i]) for i, name in enumerate(names)}
    zero = Bounds(np.zeros(len(boxes.sample)), np.zeros(len(boxes.sample)))
    for _ in range(SWEEPS):
        for equation in equations:
            narrow(enclose(equation, _placed(box, names), own), zero, box)
    boxes = _Boxes(
        boxes.sample,
        np.array([box[name].low for name in names]),
        np.array([box[name].high for name in names]),
    )
    kept = np.all(boxes.low <= boxes.high, axis=0)
    boxes = boxes.take(kept)
    if not boxes.sample.size:
        return boxes
    own = {k: v if np.ndim(v) == 0 else v[kept] for k, v in own.items()}
    boxes, smear = _krawczyk(equations, names, own, boxes, found)
    return _cut(boxes, smear)


def _placed(box: Mapping[str, Bounds], names: Sequence[str]) -> Unknowns:
    return {name: (place, box[name]) for place, name in enumerate(names)}


def _enclosed(
    equations: Sequence[Expression],
    names: Sequence[str],
    columns: Mapping[str, Column],
    low: Floats,
    high: Floats,
) -> tuple[list[Enclosure], Floats, Floats]:
    """Return the enclosures over boxes, and bounds of slopes, (b, equations, unknowns)."""
    unknowns = {name: (i, Bounds(low[i], high[i])) for i, name in enumerate(names)}
    found = [enclose(equation, unknowns, columns) for equation in equations]
    zero = np.zeros_like(low)
    lows = np.array([zero if one.slope is None else one.slope.low for one in found])
    highs = np.array([zero if one.slope is None else one.slope.high for one in found])
    return found, lows.transpose(2, 0, 1), highs.transpose(2, 0, 1)


def _krawczyk(
    equations: Sequence[Expression],
    names: Sequence[str],
    columns: Mapping[str, Column],
    boxes: _Boxes,
    found: _Found,
) -> tuple[_Boxes, Floats]:
    """Return the boxes not decided, made smaller, and by which unknown each equation varies most.

    In units of the boxes' half widths the operator is -C f(centre) + (I - C J) [-1, 1]; within the
    box there is one root where it lies inside [-1, 1], none where it does not meet the box.
    """
    with np.errstate(all="ignore"):
        centre = 0.5 * boxes.low + 0.5 * boxes.high
        radius = (0.5 * boxes.high - 0.5 * boxes.low) * (1 + INFLATED)
        radius += 1e-12 * np.abs(centre) + 1e-300
        low, high = centre - radius, centre + radius
        _, least, most = _enclosed(equations, names, columns, low, high)
        least, most = least * radius.T[:, None, :], most * radius.T[:, None, :]
        size = np.maximum(np.abs(least), np.abs(most)).max(axis=2, keepdims=True)
        size = np.where(size > 0, size, 1.0)
        least, most = least / size, most / size
        smear = np.maximum(np.abs(least), np.abs(most)).max(axis=1)  # (b, unknowns)
        middle, spread = 0.5 * (least + most), 0.5 * (most - least)
        usable = np.isfinite(middle).all(axis=(1, 2)) & np.isfinite(spread).all(axis=(1, 2))
        usable &= np.isfinite(centre).all(axis=0)
        middle[~usable] = np.eye(len(names))
        usable &= np.abs(np.linalg.det(middle)) > 1e-12
        middle[~usable] = np.eye(len(names))
        inverse = np.linalg.inv(middle)
        points = [one.value for one in _enclosed(equations, names, columns, centre, centre)[0]]
        value = np.array([0.5 * (p.low + p.high) for p in points]).T / size[:, :, 0]
        doubt = np.array([0.5 * (p.high - p.low) for p in points]).T / size[:, :, 0]
        step = -np.einsum("bij,bj->bi", inverse, value)
        rounding = np.einsum("bij,bj->bi", np.abs(inverse), doubt)
        left = np.abs(np.eye(len(names)) - inverse @ middle) + np.abs(inverse) @ spread
        reach = left.sum(axis=2) + rounding
        usable &= np.isfinite(step).all(axis=1) & np.isfinite(reach).all(axis=1)
    one = usable & np.all(np.abs(step) + reach < 1, axis=1)
    none = usable & np.any(np.abs(step) - reach > 1, axis=1)
    if one.any():
        _keep(equations, names, columns, boxes, one, (centre + radius * step.T), found)
    undecided = ~one & ~none
    tighter = usable & undecided
    step, reach = np.where(tighter, step.T, 0.0), np.where(tighter, reach.T, 0.0)
    reached_low, reached_high = centre + radius * (step - reach), centre + radius * (step + reach)
    boxes = _Boxes(
        boxes.sample,
        np.where(tighter, np.maximum(boxes.low, reached_low), boxes.low),
        np.where(tighter, np.minimum(boxes.high, reached_high), boxes.high),
    )
    undecided &= np.all(boxes.low <= boxes.high, axis=0)
    smear = np.where(usable[:, None], smear, np.nan)
    return boxes.take(undecided), smear[undecided]


def _keep(
    equations: Sequence[Expression],
    names: Sequence[str],
    columns: Mapping[str, Column],
    boxes: _Boxes,
    one: NDArray[np.bool_],
    near: Floats,
    found: _Found,
) -> None:
    """Add the root of every box that holds one."""
    own = {k: v if np.ndim(v) == 0 else v[one] for k, v in columns.items()}
    found.sample.append(boxes.sample[one])
    found.root.append(polished(equations, names, own, near[:, one]))


def polished(
    equations: Sequence[Expression],
    names: Sequence[str],
    columns: Mapping[str, Column],
    point: Floats,
) -> Floats:
    """Return points, (m, b), after some Newton steps; NaN where a slope or value is unknown."""
    for _ in range(POLISHING):
        enclosed, least, most = _enclosed(equations, names, columns, point, point)
        with np.errstate(all="ignore"):
            value = np.array([0.5 * (one.value.low + one.value.high) for one in enclosed])
            slopes = 0.5 * (least + most)
            size = np.abs(slopes).max(axis=2, keepdims=True)
            size = np.where(size > 0, size, 1.0)
            slopes, value = slopes / size, value / size[:, :, 0].T
            wrong = ~np.isfinite(slopes).all(axis=(1, 2)) | ~np.isfinite(value).all(axis=0)
            across = np.abs(slopes).max(axis=1, keepdims=True)
            across = np.where(across > 0, across, 1.0)
            slopes = slopes / across
            slopes[wrong] = np.eye(len(names))
            wrong |= ~(np.abs(np.linalg.det(slopes)) > 1e-200)
            slopes[wrong] = np.eye(len(names))
            step = np.linalg.solve(slopes, value.T[:, :, None])[:, :, 0] / across[:, 0]
        point = np.where(wrong, np.nan, point - step.T)
    return point


def _cut(boxes: _Boxes, smear: Floats) -> _Boxes:
    """Return every box as two, cut along the unknown that the equations vary most with."""
    if not boxes.sample.size:
        return boxes
    # In this measure every order of magnitude is as wide as any other, and zero is within reach.
    low, high = np.arcsinh(boxes.low), np.arcsinh(boxes.high)
    width = (high - low).T
    usable: NDArray[np.bool_] = np.asarray(np.isfinite(smear).all(axis=1))
    along = np.argmax(np.where(usable[:, None], smear, width), axis=1)
    column = np.arange(len(along))
    a, b = boxes.low[along, column], boxes.high[along, column]
    even = np.sinh((1 - AT) * low[along, column] + AT * high[along, column])
    at = np.where(b - a > WIDE, even, (1 - AT) * a + AT * b)
    left_high, right_low = boxes.high.copy(), boxes.low.copy()
    left_high[along, column] = at
    right_low[along, column] = at
    return _Boxes(
        np.concatenate([boxes.sample, boxes.sample]),
        np.concatenate([boxes.low, right_low], axis=1),
        np.concatenate([left_high, boxes.high], axis=1),
    )


def _gathered(found: _Found, m: int, size: int, unknowns: Sequence[Variable]) -> Floats:
    """Return the roots by sample, each once, (k, m, n)."""
    if not found.sample:
        return np.full((1, m, size), np.nan)
    sample, root = np.concatenate(found.sample), np.concatenate(found.root, axis=1)
    order = np.argsort(sample, kind="stable")
    sample, root = sample[order], root[:, order]
    first = np.searchsorted(sample, sample)
    place = np.arange(len(sample)) - first
    values = np.full((int(place.max()) + 1, m, size), np.nan)
    values[place, :, sample] = root.T
    turn = np.array([2 * np.pi if u.circular else np.inf for u in unknowns])[:, None]
    for later in range(1, len(values)):
        for earlier in range(later):
            gap = np.abs(values[later] - values[earlier])
            gap = np.minimum(gap, np.abs(turn - gap))
            same = gap <= SAME * (np.abs(values[later]) + np.abs(values[earlier])) + 1e-13
            # A root at zero, or beside one, has no size of its own: that of the others counts.
            scale = np.max(np.abs(values[later]), axis=0)
            same |= gap <= 1e-12 * scale
            values[later][:, np.all(same, axis=0)] = np.nan
    return values
