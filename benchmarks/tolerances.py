r"""How far do healthy vehicles stray from what the model states? Tolerances measured on flights.

In: labelled healthy flights. Out: for every statement (equality) a `Measured`: the tolerance that a
vehicle needs that nobody has seen, given how far it strays in the first seconds of its flight.

What is measured of a flight is `Stray`: how far the test was off at first (median over the first
seconds in which it is known), and the least tolerance at which nothing later would have been an
alarm, noise apart. The later is taken to be exponential, its mean proportional to
$s = \sqrt{(n s_0^2 + a^2) / (n + 1)}$, where s_0 is what families strayed at first and a what this
flight did, or s_0 where that is less: the weight n of what families did is fitted by likelihood. Of
N families the mean of the ratio is known to within N exponentials, so that a further vehicle
exceeds $N (q^{-1/N} - 1)$ times it once in 1 / q flights (the predictive distribution of an
exponential after N observations). Families weigh alike, however many flights they have. Each is
left out once: where that moves the tolerance by more than `MOST_MOVED`, the flights do not tell it.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from fdi.decision.bounds import KNOWN_SHARE, learn
from fdi.decision.critical import least_of
from fdi.decision.judging import enough
from fdi.decision.learned import rounded
from fdi.decision.noise import trailing_mean
from fdi.decision.recipes import PredictedSpread
from fdi.decision.straying import FILE, at_first, pooled, scale_of
from fdi.errors import UsageError
from fdi.evaluation.labels import Label, load_labels
from fdi.fleet import Job, Row, row_of_log, rows
from fdi.model.parts import Kind
from fdi.report.json_text import json_text
from fdi.telemetry.airtime import when_in_air

if TYPE_CHECKING:
    from fdi.result import Analysis

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

DATA: Final = Path(__file__).resolve().parents[1] / "fdi" / "decision" / FILE
EXCEEDED: Final = 0.01
"""Share of healthy flights of vehicles never seen that may exceed a tolerance."""
MOST_MOVED: Final = 1.5
"""A tolerance that leaving out one family moves by more is not known."""
FEWEST: Final = 4
"""Families; of fewer nothing is known."""
LIGHTEST: Final = 0.05
HEAVIEST: Final = 50.0
"""What the weight of the families may be, in flights' beginnings."""
TINY: Final = 1e-12
FOLDERS: Final = 3
"""So many folders of a repository tell its vehicles and days apart."""
_STRAYS: Final = "strays"


@dataclass(frozen=True, slots=True)
class Stray:
    """How far one test of a healthy flight strayed, in the unit of its statement.

    Attributes
    ----------
    statement : str
        Its name, numbers of motors and units taken out.
    family : str
        Flights of the same vehicle, owner and days.
    first : float
        Median over the first seconds of the flight.
    later : float
        The least tolerance at which nothing would have alarmed.
    hours : float
        So long it was judged.
    """

    statement: str
    unit: str
    family: str
    flight: str
    first: float
    later: float
    hours: float


@dataclass(frozen=True, slots=True)
class Measured:
    """The tolerance of a statement, from flights of ``families``.

    Attributes
    ----------
    strays : float
        What families stray at first, s_0, in ``unit``.
    weight : float
        Of it, against what the flight itself strays at first.
    times : float
        The tolerance is so many times the s that follows from both.
    between : float
        Standard deviation of the logarithm of what families stray at first.
    range : (float, float)
        Of the tolerance of a flight that strays as families do, with one of them left out.
    """

    statement: str
    unit: str
    strays: float
    weight: float
    times: float
    between: float
    families: int
    flights: int
    hours: float
    range: tuple[float, float]

    @property
    def tolerance(self) -> float:
        """Return the tolerance of a flight that strays at first as families do."""
        return self.times * self.strays

    @property
    def is_known(self) -> bool:
        """Return whether no family moves it by much."""
        low, high = self.range
        return (
            self.families >= FEWEST
            and high <= MOST_MOVED * self.tolerance
            and low >= self.tolerance / MOST_MOVED
        )


def strays_of(
    labels: Sequence[Label],
    *,
    policy: str = "default",
    workers: int = 1,
    progress: Progress | None = None,
) -> list[Stray]:
    """Return how far the statements of healthy flights strayed.

    Parameters
    ----------
    labels : sequence of Label
        Flights with a fault and those that are to be read only are left out, and so is of a flight
        what concerns a component that its label would accept.
    policy : str
    workers : int
    progress : callable, optional

    Raises
    ------
    UsageError
        None of the flights is healthy.
    """
    wanted = [label for label in labels if label.use == "diagnosis" and not label.faults]
    if not wanted:
        raise UsageError("no healthy flight is among the labels")
    jobs = [Job(str(label.path), policy=policy) for label in wanted]
    found: list[Stray] = []
    for done, (number, row) in enumerate(rows(jobs, workers=workers, work=_analyze), 1):
        label = wanted[number]
        for statement, unit, component, first, later, hours in row.get(_STRAYS, ()):
            if component not in label.accept:
                family = family_of(label)
                found.append(Stray(statement, unit, family, label.key, first, later, hours))
        if progress:
            progress(label.path.name, done / len(jobs))
    return sorted(found, key=lambda one: (one.statement, one.family, one.flight))


def family_of(label: Label) -> str:
    """Return what a flight has in common with its kind: a repository and the first folders in it.

    Simulated flights of one simulator are one family.

    Parameters
    ----------
    label : Label
    """
    if label.origin != "recorded":
        return PurePosixPath(label.key).parts[0] if "/" in label.key else label.origin
    owner, _, path = label.provenance.partition(" ")
    folders = PurePosixPath(path).parent.parts[:FOLDERS] if "/" in owner else ()
    return "/".join((owner, *folders))


def _analyze(job: Job) -> Row:
    return row_of_log(job, lambda found: {_STRAYS: list(_of_flight(found))})


def _of_flight(found: Analysis) -> Iterator[tuple[str, str, str | None, float, float, float]]:
    """Yield how far each statement of a flight strayed: its name, unit, component, and `Stray`."""
    residuals, recipe = found.alarms.residuals, found.policy.decision
    assert isinstance(recipe, PredictedSpread)
    rate_hz = residuals.signals.rate_hz
    bounds = learn(residuals, replace(recipe, usual=False))
    told = bounds.told
    _, size = told.strayed(residuals.values)
    air = when_in_air(residuals.signals)
    # a mean beyond this many spreads would be an alarm, too
    long = recipe.mean_samples(rate_hz)
    slow = trailing_mean(np.where(bounds.settled, size, np.nan), long, round(KNOWN_SHARE * long))
    slow -= np.where(np.isfinite(bounds.mean_bound), bounds.mean_bound, 0.0)
    # what the model allows beside its tolerance (constants, parameters that are not sure) stays
    beside = bounds.tolerance - residuals.tolerance[:, None]
    equations = residuals.bank.system.equations
    least = recipe.alarm_samples(rate_hz)
    first = at_first(size, residuals, recipe.reference_s)
    for row, generator in enumerate(residuals.bank.generators):
        equation = equations[generator.residual]
        known = air & np.isfinite(size[row])
        if equation.kind is not Kind.EQUALITY or np.isnan(first[row]) or known.sum() < least:
            continue
        own = size[row : row + 1, known]
        threshold = (beside[row] + bounds.noise[row])[known]
        # the tolerance at which a short and strong or a long and weak alarm would just not be one
        later = max(
            float(least_of(own / over - threshold, count).max(initial=0.0))
            for over, count in enough(least)
            if own.shape[1] >= count
        )
        lasting = (slow - beside)[row, known]
        later = max(later, float(np.nanmax(lasting, initial=0.0)))
        hours = float(known.sum()) / rate_hz / 3600
        name = pooled(equation.name)
        yield name, equation.unit, equation.component, float(first[row]), later, hours


def fit_tolerances(strays: Sequence[Stray]) -> tuple[Measured, ...]:
    """Return the tolerance of every statement that strayed at all, by name.

    Parameters
    ----------
    strays : sequence of Stray
    """
    by_statement: dict[str, list[Stray]] = {}
    for one in strays:
        by_statement.setdefault(one.statement, []).append(one)
    return tuple(
        _measured(name, own)
        for name, own in sorted(by_statement.items())
        if any(one.first > 0 for one in own)
    )


def _measured(statement: str, strays: Sequence[Stray]) -> Measured:
    families = sorted({one.family for one in strays})
    fitted = _fit(strays)
    left_out = [
        _fit(kept).tolerance(fitted.strays)
        for family in families
        if (kept := [one for one in strays if one.family != family])
    ]
    first = _of_families(strays)
    return Measured(
        statement,
        strays[0].unit,
        rounded(fitted.strays),
        rounded(fitted.weight),
        rounded(fitted.times),
        rounded(float(np.std(np.log(first[first > 0])))),
        len(families),
        len({one.flight for one in strays}),
        rounded(sum(one.hours for one in strays)),
        (rounded(min(left_out, default=0.0)), rounded(max(left_out, default=np.inf))),
    )


@dataclass(frozen=True, slots=True)
class _Fit:
    strays: float
    weight: float
    times: float

    def tolerance(self, first: float) -> float:
        """Return the tolerance of a flight that strays so far at first."""
        return self.times * float(scale_of(self.strays, self.weight, np.array(first)))


def _fit(strays: Sequence[Stray]) -> _Fit:
    """Return how what strays later follows from what strays at first, families weighing alike."""
    count = Counter(one.family for one in strays)
    weight = np.array([1.0 / count[one.family] for one in strays])
    weight /= weight.sum()
    first = np.array([one.first for one in strays])
    later = np.array([one.later for one in strays])
    usual = float(np.sqrt((weight * first**2).sum()))
    if not usual:
        return _Fit(0.0, HEAVIEST, 0.0)

    def mean_ratio(log_weight: float) -> float:
        return float((weight * later / scale_of(usual, float(np.exp(log_weight)), first)).sum())

    def unlikely(log_weight: float) -> float:
        scale = scale_of(usual, float(np.exp(log_weight)), first)
        return float((weight * np.log(scale)).sum() + np.log(max(mean_ratio(log_weight), TINY)))

    # of an exponential the likeliest mean is that of the ratios
    best = minimize_scalar(unlikely, bounds=np.log([LIGHTEST, HEAVIEST]), method="bounded").x
    n = len(count)
    return _Fit(
        usual, float(np.exp(best)), n * (EXCEEDED ** (-1.0 / n) - 1.0) * mean_ratio(float(best))
    )


def _of_families(strays: Sequence[Stray]) -> Floats:
    """Return what each family strays at first, the root of the mean square of its flights."""
    own: dict[str, list[float]] = {}
    for one in strays:
        own.setdefault(one.family, []).append(one.first)
    return np.array([np.sqrt(np.mean(np.square(values))) for values in own.values()])


def document_of(one: Measured) -> dict[str, object]:
    """Return what the package holds of a statement: what it reads, and what that rests on."""
    tree = asdict(one)
    return {name: tree[name] for name in tree if name not in ("statement", "between")}


def main() -> None:
    parser = argparse.ArgumentParser(description="How far healthy flights stray, by statement.")
    parser.add_argument("labels", nargs="+")
    parser.add_argument("--recorded", action="store_true", help="recorded flights only")
    parser.add_argument("--write", action="store_true", help="what is known into the package")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    labels = [one for path in asked.labels for one in load_labels(path)]
    if asked.recorded:
        labels = [one for one in labels if one.origin == "recorded"]
    measured = fit_tolerances(strays_of(labels, workers=asked.workers))
    if asked.write:
        tree = {one.statement: document_of(one) for one in measured if one.is_known and one.times}
        DATA.write_text(json_text(tree), "utf-8")
    for one in measured:
        low, high = one.range
        print(
            f"{one.statement:32} {one.tolerance:9.3g} {one.unit:6} of {one.families} families, "
            f"{one.flights} flights, {one.hours:.2f} h; one left out {low:.3g} to {high:.3g}"
            f"{'' if one.is_known else ': not known'}"
        )


if __name__ == "__main__":
    main()
