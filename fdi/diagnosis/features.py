"""What speaks for and against a component, as numbers that know no names?

In: what the tests of a flight did around a moment (`Doings`), and how a component is tied to each.
Out: a value for every one of `FEATURES`. A feature speaks of relations (its own test, a test that
concerns nobody else, what disturbs it), never of components, so the weights that are fitted on some
of them hold for one that no flight ever had. Each has the sign that its weight may take: more
evidence never makes an accusation less likely.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.concerns import Concerns, Tie
from fdi.model.evaluate import Floats

MOST: Final = 5.0
"""Times its threshold; more says no more: so far beyond noise only what the model leaves out could
have made it, and that does not get less likely."""
LEAST: Final = 0.05
"""Of its threshold; less is as quiet as can be."""
WELL: Final = 0.5
"""Of its threshold; a test that stays above has not come to rest after an alarm."""
SIMULTANEOUS_S: Final = 2.0
"""Alarms this close together are not ordered: persistence and sampling blur onsets by as much."""


class Feature(NamedTuple):
    """A feature, for the fit and for a person.

    ``sign``: that a weight may have. ``words``: what is counted. ``told``: what a value says of an
    accused component, as a clause; ``#`` is the value as ``shown`` makes it.
    """

    sign: int
    words: str
    told: str = ""
    shown: Callable[[float], str] = str


def _counted(value: float) -> str:
    count = round(np.expm1(value))
    return f"{count} of its tests alarmed"


def _share(value: float) -> str:
    return f"{100 * np.exp(value):.0f} %"


def _seconds(value: float) -> str:
    return f"{np.expm1(value):.1f} s"


FEATURES: Final[Mapping[str, Feature]] = {
    "one": Feature(0, "before any evidence"),
    "tests": Feature(1, "how many tests of it alarm", "#", _counted),
    "alone": Feature(
        1, "an alarm that concerns nobody else", "a test that concerns no other part alarms"
    ),
    "fit": Feature(
        1,
        "how much of what alarms and what is quiet one fault of it explains",
        "a single fault of it would explain # of what the tests show, alarms and silence alike",
        lambda value: f"{100 * value:.0f} %",
    ),
    "near": Feature(
        1,
        "how close its own tests come to their thresholds",
        "no test of its own goes beyond # of its threshold",
        _share,
    ),
    "quiet": Feature(
        1,
        "how close what would show it alone comes to its threshold",
        "the tests that would show it alone reach # of their thresholds at most",
        _share,
    ),
    "healed": Feature(
        -1, "how long it has been well again", "its tests were quiet again, for # in all", _seconds
    ),
    "late": Feature(
        -1,
        "how long after the first alarm its own come",
        "its own alarms come # after the first",
        _seconds,
    ),
    "explains": Feature(
        1,
        "alarms, not before its own, of what it disturbs",
        "what it disturbs alarms too, and not before it",
    ),
    "computed": Feature(
        -1, "it has no parts that break", "it is computed: it has no part that breaks"
    ),
    "controller": Feature(
        -1,
        "it is a program, and does as well as what it is given",
        "it is a program, which does as well as what it is given",
    ),
}


@dataclass(frozen=True, slots=True, eq=False)
class Doings:
    """What the tests of a flight did around the moment ``at``, s; r tests.

    Attributes
    ----------
    alarmed, judged : (r,) bool
        Of the second it is known for most of the time what they did.
    onset, over : (r,) float
        s, of the alarms; inf and -inf without one.
    near : (r,) float
        Logarithm of the largest share of its threshold that a test reached.
    t : (m,) float
        s, from that moment to the end of what counts of the flight.
    share : (r, m) float32
        Of its threshold that a test reaches then; NaN where that is not known.
    """

    at: float
    alarmed: NDArray[np.bool_]
    judged: NDArray[np.bool_]
    onset: Floats
    over: Floats
    near: Floats
    t: Floats
    share: NDArray[np.float32]

    def well_again(self, rows: NDArray[np.bool_]) -> float:
        """Return for how long some tests have been well since their alarms, s.

        A moment counts by how far below half of its threshold the worst of them is: a test that
        stays above has not healed.
        """
        first = int(np.searchsorted(self.t, self.over[rows].max(), "right"))
        after = self.share[rows, first:].astype(float)
        if after.size == 0:
            return 0.0
        worst = np.where(np.isfinite(after), after, -1.0).max(axis=0)
        known = worst >= 0
        return float(np.maximum(1.0 - worst[known] / WELL, 0.0).sum() * (self.t[1] - self.t[0]))


def told(name: str, value: float) -> str:
    """Return what the value of a feature says of an accused component, as a clause.

    Examples
    --------
    >>> told("tests", 1.3863), told("tests", 0.6931)
    ('3 of its tests alarmed', '1 of its tests alarmed')
    >>> told("late", 1.2528)
    'its own alarms come 2.5 s after the first'
    """
    feature = FEATURES[name]
    return feature.told.replace("#", feature.shown(value))


def features(
    asked: Sequence[str],
    ties: Mapping[str, NDArray[np.int8]],
    reach: Mapping[str, frozenset[str]],
    done: Doings,
    whom: Concerns,
    outvoted: Mapping[str, NDArray[np.bool_]],
) -> Floats:
    """Return the values of all features for some components, (c, len(FEATURES)).

    Parameters
    ----------
    asked : sequence of str
        Components, of each of which at least one alarming test speaks.
    ties : mapping
        Of every component the (r,) `Tie` to each test.
    reach : mapping
        Of every component those that its failure disturbs.
    done : Doings
    whom : Concerns
    outvoted : mapping
        Of components the tests, (r,), whose alarms are not what they disturb.
    """
    # an alarm at its threshold is hardly evidence, one far beyond it is much
    evidence = np.where(done.alarmed, np.maximum(done.near, 0.0), 0.0)
    only = np.array([len(whom.of(row)) == 1 for row in range(len(evidence))], bool)
    found = []
    for name in asked:
        component, tie = whom.components[name], ties[name]
        held, mine = (tie == Tie.HELD) & done.alarmed, (tie >= Tie.SUSPECTED) & done.alarmed
        judged = speaking(tie, reach[name], done, whom)
        # tests that concern nobody else
        unique = judged & only & ~whom.supports
        alone = held & only & ~whom.supports
        since = float(done.onset[mine].min())
        shown = done.alarmed & ~outvoted.get(name, np.False_)
        below = [shown & (ties[n] == Tie.HELD) for n in reach[name] if n in ties]
        below = [r for r in below if done.onset[r].min(initial=np.inf) >= since - SIMULTANEOUS_S]
        values = {
            "one": 1.0,
            "tests": np.log1p(len(set(whom.residual[mine]))),
            "alone": _most(evidence[alone]),
            "fit": _fit(name, done, evidence, whom),
            "near": min(float(done.near[judged].max()), 0.0) if judged.any() else 0.0,
            "quiet": float(done.near[unique].clip(max=0.0).max()) if unique.any() else 0.0,
            "healed": np.log1p(done.well_again(mine)),
            "late": np.log1p(max(since - done.at, 0.0)),
            "explains": max((_most(evidence[rows]) for rows in below), default=0.0),
            "computed": float(component.computed),
            "controller": float(component.group == "autopilot"),
        }
        found.append([values[feature] for feature in FEATURES])
    return np.array(found, float).reshape(len(asked), len(FEATURES))


def speaking(
    tie: NDArray[np.int8], reach: frozenset[str], done: Doings, whom: Concerns
) -> NDArray[np.bool_]:
    """Return the tests, (r,), whose alarm or silence says something of a component.

    Parameters
    ----------
    tie : (r,) int8
        The component's `Tie` to each test.
    reach : frozenset of str
        Those that its failure disturbs.
    done : Doings
    whom : Concerns
    """
    # an estimator that uses a sensor follows it: that the two agree says little of the sensor;
    # nor does it say much of a sensor that its readings change, or do not scatter
    echoed = np.array([not reach.isdisjoint(own) for own in whom.through], bool)
    moot = echoed | whom.narrow
    says: NDArray[np.bool_] = (tie == Tie.HELD) & done.judged & (done.alarmed | ~moot)
    return says


def _most(values: Floats) -> float:
    return float(values.max(initial=0.0))


def _fit(name: str, done: Doings, evidence: Floats, whom: Concerns) -> float:
    """Return which share of all that alarms, and of what is quiet, the best of its faults explains.

    Each equation left over counts once, by the strongest of its tests that hold the fault.
    """
    counts = done.judged & ~whom.supports
    total, best = sum(_strongest(evidence, counts & done.alarmed, whom).values()), 0.0
    for fault, component in whom.component.items():
        if component != name or fault in whom.suspected:
            continue
        holds = counts & np.array([fault in faults for faults in whom.faults], bool)
        hit = sum(_strongest(evidence, holds & done.alarmed, whom).values())
        missed = len(set(whom.residual[holds & ~done.alarmed]))
        # the 1 is chance, as nobody has it in the likelihood: what hardly alarms hardly fits
        best = max(best, hit / (1.0 + total + missed))
    return best


def _strongest(evidence: Floats, among: NDArray[np.bool_], whom: Concerns) -> dict[int, float]:
    """Return the largest evidence among some tests of each equation left over."""
    found: dict[int, float] = {}
    for row in np.flatnonzero(among):
        left = int(whom.residual[row])
        found[left] = max(found.get(left, 0.0), float(evidence[row]))
    return found
