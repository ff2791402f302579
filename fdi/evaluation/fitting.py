"""Which weights make the probabilities of candidates true?

In: labelled flights with what their tests did (`Flown`). Out: a `Fit`: weights for the features,
each with its interval.

A flight teaches at each of its alarms, gone through as if nobody had been accused: before the fault
that it is nobody's, from the fault on that it is one of the right components, or nobody's where
none of these is among the candidates. The weights maximise the penalised likelihood of that, each
with the sign that its feature may have, normal with a standard deviation of one over that of its
values; the weight of ``one`` is free. The cases of one flight are no independent ones: n of them
count as the root of n, and a recording in two formats counts once, half for each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.likelihood import Fitted
from fdi.errors import UsageError
from fdi.evaluation.score import EARLY_S, is_right
from fdi.evaluation.totals import plain

if TYPE_CHECKING:
    from fdi.diagnosis.hypotheses import Inquiry
    from fdi.evaluation.labels import Label

Floats = NDArray[np.float64]

PENALTY: Final = 1.0
"""One over the variance of a weight before any flight is seen, for values of unit deviation."""
AFTER: Final = 6
"""So many cases of a flight teach what failed: what comes later follows from it."""
ROUNDING: Final = 1e-9
_Z: Final = 1.959964  # 95 % of a normal distribution


@dataclass(frozen=True, slots=True)
class Flown:
    """A labelled flight with what its tests did.

    Attributes
    ----------
    origin : str
        Where it comes from: recorded, or which simulation.
    clearable : tuple of str
        The components that the data speak for, whoever is accused.
    """

    label: Label
    inquiries: tuple[Inquiry, ...]
    origin: str
    clearable: tuple[str, ...]

    @property
    def recording(self) -> str:
        """Return the name of the flight, the same for all formats that it is kept in."""
        return str(self.label.path.with_suffix(""))

    @property
    def components(self) -> frozenset[str]:
        """Return the kinds of components that failed on it, or may be said to have."""
        failed = {fault.component for fault in self.label.faults}
        return frozenset(plain(name) for name in failed | self.label.accept)


@dataclass(frozen=True, slots=True, eq=False)
class Lesson:
    """A case of a labelled flight: the features of its candidates, (c, k), and who is right.

    ``copies``: in so many formats the recording is among those that teach.
    """

    features: Floats
    right: NDArray[np.bool_]
    weight: float
    copies: int = 1


@dataclass(frozen=True, slots=True)
class Fit:
    """Weights, and from where to where each lies with 95 %."""

    fitted: Fitted
    intervals: dict[str, tuple[float, float]]
    lessons: int
    flights: float


def lessons(flown: Flown, copies: int = 1) -> list[Lesson]:
    """Return what a flight teaches.

    Parameters
    ----------
    flown : Flown
    copies : int
        In so many formats the recording is among those that teach.
    """
    label = flown.label
    until = float("inf") if label.evaluate_until is None else label.evaluate_until
    true = float("inf") if label.onset is None else label.onset - EARLY_S
    cases = [case for one in flown.inquiries for case in one.cases() if case.at <= until]
    before = [case for case in cases if case.at < true]
    after = list(islice((case for case in cases if case.at >= true), AFTER))
    found = []
    for part in (before, after):
        for case in part:
            right = [part is after and is_right(name, label) for name in case.names]
            weight = 1.0 / copies / len(part) ** 0.5
            found.append(Lesson(case.features, np.array(right, bool), weight, copies))
    return found


def lessons_of(flights: Sequence[Flown]) -> list[list[Lesson]]:
    """Return what each of some flights teaches."""
    copies = Counter(one.recording for one in flights)
    return [lessons(one, copies[one.recording]) for one in flights]


def fit(taught: Sequence[Sequence[Lesson]]) -> Fit:
    """Return the weights that suit what flights teach best.

    Parameters
    ----------
    taught : sequence of sequence of Lesson
        By flight.

    Raises
    ------
    UsageError
        There is no fault among them that shows, or no alarm that is nobody's.
    """
    from scipy.optimize import minimize

    known = [lesson for own in taught for lesson in own]
    seen = [lesson.right.any() for lesson in known]
    if not any(seen) or all(seen):
        raise UsageError(
            f"{len(taught)} flights with {sum(seen)} alarms of a fault among {len(seen)} teach "
            "nothing",
            hint="give flights with faults that show, and with alarms that are nobody's",
        )
    problem = _Problem(known)
    at = np.zeros(len(FEATURES))
    bounds = [{0: (None, None), 1: (0.0, None), -1: (None, 0.0)}[f.sign] for f in FEATURES.values()]
    found = minimize(problem.loss, at, jac=True, method="L-BFGS-B", bounds=bounds).x
    flights = round(sum(1.0 / own[0].copies for own in taught if own), 1)
    weights = dict(zip(FEATURES, (found / problem.unit).tolist(), strict=True))
    return Fit(
        Fitted(weights, (flights + 1) / (flights + 2)),
        dict(zip(FEATURES, problem.intervals(found), strict=True)),
        len(known),
        flights,
    )


class _Problem:
    """The penalised likelihood of lessons; weights are for values of unit deviation."""

    def __init__(self, known: Sequence[Lesson]) -> None:
        rows = np.concatenate([lesson.features for lesson in known])
        deviation = rows.std(axis=0)
        # a column that is the same throughout deviates by its rounding
        is_constant = deviation <= ROUNDING * np.abs(rows).max(axis=0)
        self.unit = np.where(is_constant, 1.0, deviation)
        self.rows: Floats = rows / self.unit
        self.right = np.concatenate([lesson.right for lesson in known])
        sizes = np.array([len(lesson.right) for lesson in known])
        self.case = np.repeat(np.arange(len(known)), sizes)
        self.first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        self.weight = np.array([lesson.weight for lesson in known])
        self.seen = np.logical_or.reduceat(self.right, self.first)
        free = np.array([name == "one" for name in FEATURES])
        self.penalty = np.where(free, 0.0, PENALTY)

    def loss(self, at: Floats) -> tuple[float, Floats]:
        """Return the penalised negative log likelihood with its gradient."""
        odds = self.rows @ at
        total = self._log_sum(odds, 0.0)
        theirs = self._log_sum(np.where(self.right, odds, -np.inf), -np.inf)
        true = np.where(self.seen, theirs, 0.0)
        value = self.weight @ (total - true) + self.penalty @ at**2 / 2
        share = np.exp(odds - total[self.case])
        posterior = np.exp(np.where(self.right, odds, -np.inf) - true[self.case])
        off = (share - posterior) * self.weight[self.case]
        return float(value), self.rows.T @ off + self.penalty * at

    def _log_sum(self, odds: Floats, nobody: float) -> Floats:
        """Return the logarithm of the sum of exponentials of every case, nobody's included."""
        top = np.maximum(np.maximum.reduceat(odds, self.first), nobody)
        top = np.where(np.isfinite(top), top, 0.0)
        shares = np.add.reduceat(np.exp(odds - top[self.case]), self.first)
        with np.errstate(divide="ignore"):
            found: Floats = top + np.log(shares + np.exp(nobody - top))
        return found

    def intervals(self, at: Floats) -> Iterator[tuple[float, float]]:
        """Yield from where to where each weight lies with 95 %, by Laplace's approximation.

        A weight that its sign holds at zero has an interval on the allowed side only.
        """
        step = 1e-4
        moved = [
            (self.loss(at + step * unit)[1] - self.loss(at - step * unit)[1]) / (2 * step)
            for unit in np.eye(len(at))
        ]
        hessian = (np.array(moved) + np.array(moved).T) / 2 + 1e-9 * np.eye(len(at))
        half = _Z * np.sqrt(np.maximum(np.diag(np.linalg.inv(hessian)), 0.0))
        for value, reach, unit, feature in zip(at, half, self.unit, FEATURES.values(), strict=True):
            low, high = (value - reach) / unit, (value + reach) / unit
            low = max(low, 0.0) if feature.sign > 0 else low
            high = min(high, 0.0) if feature.sign < 0 else high
            yield float(low), float(high)


def fit_text(found: Fit) -> str:
    """Return the weights with their intervals as a table."""
    lines = [f"{found.lessons} cases of {found.flights:.0f} recordings with alarms."]
    lines += ["", "| feature | weight | from | to | says |", "| --- | --- | --- | --- | --- |"]
    for name, weight in found.fitted.weights.items():
        low, high = found.intervals[name]
        lines.append(f"| {name} | {weight:.2f} | {low:.2f} | {high:.2f} | {FEATURES[name].words} |")
    return "\n".join(lines) + "\n"


def fitted_document(found: Fit) -> dict[str, Any]:
    """Return the content of ``likelihood.json``: weights, and what is said about them."""
    return {
        "format": 1,
        "fitted_by": "fdi fit",
        "recordings": round(found.flights),
        "cases": found.lessons,
        "most": round(found.fitted.most, 4),
        "weights": {
            name: {
                "value": round(value, 4),
                "interval": [round(end, 3) for end in found.intervals[name]],
                "says": FEATURES[name].words,
            }
            for name, value in found.fitted.weights.items()
        },
    }
