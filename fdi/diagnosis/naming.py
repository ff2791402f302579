"""Which components failed, and which alarms only follow from that?

In: an `Inquiry` and fitted weights. Out: causes, in order, with the alarms that each explains, and
effects. The alarms are gone through in the order of time. At each the candidates are weighed by all
that stands or begins soon; who is more probable than all others and nobody together is accused.
What then stands or follows without a long pause is the cause's own where one of its tests sees it,
an effect where the cause disturbs what it concerns (``affects`` in the model), and else is asked
about anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Final

import numpy as np

from fdi.diagnosis.alarm_runs import Run
from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import FEATURES, SIMULTANEOUS_S, told
from fdi.diagnosis.hypotheses import WINDOW_S, Case, Inquiry
from fdi.diagnosis.likelihood import Fitted
from fdi.diagnosis.values import Term
from fdi.model.evaluate import Floats

ENOUGH: Final = 0.5
"""Accused is who, together with those that no alarm here tells from it, is more probable than
everybody else and nobody."""
LINKED_S: Final = 15.0
"""What alarms after a longer pause is asked about anew."""
POSSIBLE: Final = 0.05
"""Whose failure is at least so probable at any moment of a flight is not ruled out."""
AS_WELL: Final = 0.5
"""Who is at least half as probable as the accused would explain it as well."""
TOLD: Final = 4
"""So many terms are told of what weighed most."""


@dataclass(frozen=True, slots=True)
class Cause:
    """An accused component with the runs it explains.

    Attributes
    ----------
    start : Run
        The alarm at which it was accused.
    runs : tuple of Run
        Its own, in the order of onset.
    probability : float
        0..1, of this component at that moment.
    rivals : tuple of (str, float)
        The other candidates for alarms that it explains, the likeliest first.
    because : tuple of Term
        What weighed most for it and against it.
    earlier : tuple of (float, float)
        From when to when, s, it had shown before, and healed.
    """

    flight: int
    component: str
    start: Run
    runs: tuple[Run, ...]
    probability: float
    rivals: tuple[tuple[str, float], ...]
    because: tuple[Term, ...]
    earlier: tuple[tuple[float, float], ...] = ()

    @property
    def onset(self) -> float:
        """When it began to show, s."""
        return self.runs[0].onset

    @property
    def alarm(self) -> float:
        """When the data allowed the accusation, s: an alarm was certain, and one of its own."""
        return max(self.start.known, min(run.known for run in self.runs))

    @property
    def end(self) -> float:
        """When it ceased, s."""
        return max(run.end for run in self.runs)

    @property
    def inseparable(self) -> tuple[str, ...]:
        """Return who would explain it as well."""
        return tuple(n for n, share in self.rivals if share >= AS_WELL * self.probability)


@dataclass(frozen=True, slots=True)
class Effect:
    """A component whose runs follow from a cause."""

    component: str
    runs: tuple[Run, ...]
    cause: Cause


def name(inquiry: Inquiry, fitted: Fitted) -> tuple[list[Cause], list[Effect]]:
    """Return who is accused in a flight, in the order of accusation, and what follows."""
    causes: list[Cause] = []
    effects: list[Effect] = []
    failed: dict[str, float] = {}
    left, after = list(inquiry.runs), -np.inf
    while (start := next((run for run in left if run.onset > after), None)) is not None:
        case = inquiry.case(start.onset, left)
        found = _accused(case, failed, start, left, inquiry, fitted)
        if found is None:
            after = start.onset + SIMULTANEOUS_S
            continue
        cause, following = found
        causes.append(cause)
        effects += _effects(cause, following, inquiry)
        failed[cause.component] = max(cause.probability, failed.get(cause.component, 0.0))
        taken = {*cause.runs, *following}
        left = [run for run in left if run not in taken]
        # what else began at this very moment is asked about anew
        after = float(np.nextafter(start.onset, -np.inf))
    return _followed(causes, effects, inquiry)


def _followed(
    causes: Sequence[Cause], effects: Sequence[Effect], inquiry: Inquiry
) -> tuple[list[Cause], list[Effect]]:
    """Return the causes that follow from none that began before them, and all effects.

    Who is accused first took alarms that another may have brought about, of whom nothing was known
    yet: the other's own alarms were asked about only then.
    """
    roots = {one: _root(one, causes, inquiry) for one in causes}
    later = [_effects(roots[one], one.runs, inquiry) for one in causes if roots[one] is not one]
    return (
        [one for one in causes if roots[one] is one],
        [replace(one, cause=roots[one.cause]) for one in chain(effects, *later)],
    )


def _root(one: Cause, causes: Sequence[Cause], inquiry: Inquiry) -> Cause:
    """Return the cause from which one follows, itself where there is none."""
    leads = (other for other in causes if _follows(one, other, inquiry))
    lead = next(leads, None)  # that nobody disturbs who disturbs him is a rule of the model
    return one if lead is None else _root(lead, causes, inquiry)


def _follows(one: Cause, other: Cause, inquiry: Inquiry) -> bool:
    """Return whether all that shows a cause is what an earlier failure of another disturbs."""
    reach = inquiry.reach[other.component]
    return (
        other.component != one.component
        and other.onset <= one.onset <= other.end + LINKED_S
        and one.component in reach
        and all(inquiry.whom.disturbed(run.row, reach) for run in one.runs)
    )


def possible(inquiry: Inquiry, fitted: Fitted) -> frozenset[str]:
    """Return whose failure is not improbable at some moment of a flight."""
    return frozenset(
        one
        for case in inquiry.cases()
        for one, share in zip(case.names, fitted.probabilities(case), strict=True)
        if share >= POSSIBLE
    )


def doubted(
    causes: Iterable[Cause], effects: Iterable[Effect], inquiries: Iterable[Inquiry], fitted: Fitted
) -> frozenset[str]:
    """Return whom the data do not rule out, whatever tests speak for them.

    Who is accused, who would explain it as well, who follows, and whose failure is possible.
    """
    causes = tuple(causes)
    named = {one.component for one in causes} | {one.component for one in effects}
    named.update(name for one in causes for name in one.inseparable)
    return frozenset(named).union(*(possible(one, fitted) for one in inquiries))


def _accused(
    case: Case,
    failed: Mapping[str, float],
    start: Run,
    left: Sequence[Run],
    inquiry: Inquiry,
    fitted: Fitted,
) -> tuple[Cause, list[Run]] | None:
    """Return the cause of a case with the runs that follow from it, None where it is nobody's."""
    if not case.names:
        return None
    shares = fitted.probabilities(case, failed)
    together = np.array([shares[(case.ties == own).all(axis=1)].sum() for own in case.ties])
    leading = int(np.lexsort((-shares, -together))[0])
    if together[leading] < ENOUGH:
        return None
    component = case.names[leading]
    own, following = _explained(component, start.onset, left, inquiry)
    # who shares no alarm with it is no rival
    shared = ((case.ties > Tie.NONE) & (case.ties[leading] > Tie.NONE)).any(axis=1)
    order = [int(i) for i in np.argsort(-shares, kind="stable") if shared[i] and i != leading]
    cause = Cause(
        inquiry.flight,
        component,
        start,
        tuple(own),
        # that it shows again does not make it surer that it was it, unless it shows more
        max(float(fitted.probabilities(case)[leading]), failed.get(component, 0.0)),
        tuple((case.names[i], float(shares[i])) for i in order),
        _terms(case.features[leading], fitted),
    )
    return cause, following


def _explained(
    component: str, at: float, left: Sequence[Run], inquiry: Inquiry
) -> tuple[list[Run], list[Run]]:
    """Return the runs that a component shows itself, and those that it disturbs, from ``at`` on."""
    ties = inquiry.ties[component]
    own: list[Run] = []
    following: list[Run] = []
    end = at
    for run in left:
        # what was weighed belongs to it, however long the pause before
        if run.end < at or run.onset > max(end + LINKED_S, at + WINDOW_S):
            continue
        if ties[run.row] >= Tie.SUSPECTED:
            own.append(run)
            end = max(end, run.end)
        elif inquiry.whom.disturbed(run.row, inquiry.reach[component]):
            following.append(run)
    return own, following


def _terms(values: Floats, fitted: Fitted) -> tuple[Term, ...]:
    """Return what weighed most, the strongest first."""
    parts = dict(zip(FEATURES, values * fitted.vector, strict=True))
    said = dict(zip(FEATURES, values.tolist(), strict=True))
    parts.pop("one")
    strongest = sorted(parts, key=lambda feature: -abs(parts[feature]))[:TOLD]
    return tuple(
        Term(feature, told(feature, said[feature]), float(parts[feature]))
        for feature in strongest
        if parts[feature]
    )


def _effects(cause: Cause, following: Sequence[Run], inquiry: Inquiry) -> list[Effect]:
    """Return the runs that follow from a cause by the component each concerns first."""
    whom, reach = inquiry.whom, inquiry.reach[cause.component]
    by_component: dict[str, list[Run]] = {}
    for run in following:
        held = whom.held_by(run.row)
        first = min(whom.disturbed(run.row, reach), key=lambda n: (n not in held, whom.order[n]))
        by_component.setdefault(first, []).append(run)
    return [Effect(component, tuple(runs), cause) for component, runs in by_component.items()]
