"""Explains why a fault cannot be detected or told from another, and what measurement would help.

In: a model and the names of one or two faults. Out: an :class:`Explanation`: the reason, the
equations and unknowns that make it up, and the unknowns of which a single sensor, free of faults,
would be enough. Where it takes several sensors, :func:`fdi.structure.placement.place_sensors` with
the pair as its goal finds the sets.

Without the other fault's equations the first fault lies outside the overdetermined part: what is
computed from its equation is compared with nothing. A sensor makes exactly those equations
overdetermined from which its unknown is computed; so of what follows from the fault's equation,
inside the just-determined part, every unknown will do, and no single other one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from fdi.errors import UsageError
from fdi.structure.causality import causally_overdetermined, require_causality
from fdi.structure.decomposition import underdetermined
from fdi.structure.incidence import Fault, Model, Rows, place_of
from fdi.structure.matching import match
from fdi.structure.placement import add_sensors

MOST_NAMES = 8


class Reason(Enum):
    """Says why a fault cannot be detected or told from another.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, section IV.

    Examples
    --------
    >>> Reason.SHARED_EQUATION.value
    'the other fault enters its equations too'
    """

    NONE = "it can"
    SHARED_EQUATION = "the other fault enters its equations too"
    NOTHING_TO_SPARE = "nothing is left to compare with"
    TOO_MANY_UNKNOWNS = "more unknowns than equations"
    CAUSALITY = "its unknowns cannot be computed in this causality"


@dataclass(frozen=True, slots=True)
class Explanation:
    """Is the reason why a fault cannot be detected, or not be told from another.

    Parameters
    ----------
    fault, other : str
        Names; ``other`` is empty where detection is explained.
    reason : Reason
    equations : tuple of int
        The fault's equations that are not overdetermined without those of the other fault.
    unknowns : tuple of int
        What nothing checks: the unknowns that follow from these equations, or, where there are too
        many, the underdetermined ones among those that they contain.
    sensors : tuple of int
        Unknowns of which one further sensor, free of faults, would be enough.
    because : str
        The reason with labels, part of a sentence; empty where there is none.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, section IV.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> why(model, "f", "g").sensors
    (0, 1)
    """

    fault: str
    other: str
    reason: Reason
    equations: tuple[int, ...]
    unknowns: tuple[int, ...]
    sensors: tuple[int, ...]
    because: str

    @property
    def text(self) -> str:
        """What holds of the faults, and because of what, in one sentence."""
        aim = f"be told from {self.other}" if self.other else "be detected"
        if self.reason is Reason.NONE:
            return f"{self.fault} can {aim}"
        return f"{self.fault} cannot {aim}: {self.because}"


def why(model: Model, fault: str, other: str = "", causality: str = "mixed") -> Explanation:
    """Return why a fault cannot be detected, or not be told from another one.

    Parameters
    ----------
    model : Model
    fault : str
        Name of the fault that occurs.
    other : str
        Name of the fault that it is to be told from; by default detection is explained.
    causality : {"mixed", "integral", "derivative"}

    Returns
    -------
    Explanation

    Raises
    ------
    UsageError
        When there is no such fault or causality, or both are the same fault.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, section IV (what a sensor makes detectable).

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> print(why(model, "f", "g").text)
    f cannot be told from g: without e2 nothing checks x0, x1, which follow from e0
    >>> print(why(model, "f").text)
    f can be detected
    """
    require_causality(causality)
    if fault == other:
        raise UsageError(f"{fault!r} is to be told from itself")
    own = _fault(model, fault).equations
    gone = _fault(model, other).equations if other else ()
    kept = tuple(e for e in own if e not in gone)
    if not kept:
        return _explanation(model, (fault, other), Reason.SHARED_EQUATION, gone, own)
    if not set(kept).isdisjoint(causally_overdetermined(model, causality, without=gone)):
        return _explanation(model, (fault, other), Reason.NONE, gone, kept)
    if not set(kept).isdisjoint(causally_overdetermined(model, without=gone)):
        sensors = _by_trial(model, range(len(model.unknowns)), kept, gone, causality)
        return _explanation(model, (fault, other), Reason.CAUSALITY, gone, kept, (), sensors)
    rows = [() if e in gone else row for e, row in enumerate(model.rows)]
    equation_of, unknown_of = match(rows, len(model.unknowns))
    under, loose = underdetermined(rows, equation_of, unknown_of)
    if under.issuperset(kept):
        unknowns = tuple(sorted({u for e in kept for u in rows[e] if u in loose}))
        return _explanation(model, (fault, other), Reason.TOO_MANY_UNKNOWNS, gone, kept, unknowns)
    follow = _follow(rows, equation_of, [e for e in kept if e not in under])
    unknowns = tuple(sorted(unknown_of[e] for e in follow if e not in under))
    sensors = (
        unknowns if causality == "mixed" else _by_trial(model, unknowns, kept, gone, causality)
    )
    return _explanation(
        model, (fault, other), Reason.NOTHING_TO_SPARE, gone, kept, unknowns, sensors
    )


def _fault(model: Model, name: str) -> Fault:
    return model.faults[place_of(name, [fault.name for fault in model.faults], "fault")]


def _follow(rows: Rows, equation_of: list[int], start: list[int]) -> list[int]:
    """Return the equations whose unknowns are computed from these, themselves included."""
    users: dict[int, list[int]] = {}
    for e, row in enumerate(rows):
        for u in row:
            users.setdefault(equation_of[u], []).append(e)
    order, seen = list(start), set(start)
    for equation in order:  # grows while it is walked
        for user in users.get(equation, ()):
            if user not in seen:
                seen.add(user)
                order.append(user)
    return order


def _by_trial(
    model: Model,
    candidates: Iterable[int],
    kept: tuple[int, ...],
    gone: tuple[int, ...],
    causality: str,
) -> tuple[int, ...]:
    """Return the candidates of which one sensor is enough, each tried."""
    enough = []
    for unknown in candidates:
        over = causally_overdetermined(add_sensors(model, [unknown]), causality, without=gone)
        if not set(kept).isdisjoint(over):
            enough.append(unknown)
    return tuple(enough)


def _explanation(
    model: Model,
    names: tuple[str, str],
    reason: Reason,
    gone: tuple[int, ...],
    equations: tuple[int, ...],
    unknowns: tuple[int, ...] = (),
    sensors: tuple[int, ...] = (),
) -> Explanation:
    own = _listed(model.equations[e] for e in equations)
    what = _listed(model.unknowns[u] for u in unknowns)
    follow = "follows" if len(unknowns) == 1 else "follow"
    without = f"without {_listed(model.equations[e] for e in gone)} " if gone else ""
    because = {
        Reason.NONE: "",
        Reason.SHARED_EQUATION: f"all its equations ({own}) may hold the other fault as well",
        Reason.NOTHING_TO_SPARE: f"{without}nothing checks {what}, which {follow} from {own}",
        Reason.TOO_MANY_UNKNOWNS: f"{without}there are too few equations for {what}, of {own}",
        Reason.CAUSALITY: f"{without}what {own} contains cannot be computed in this causality",
    }[reason]
    return Explanation(*names, reason, equations, unknowns, sensors, because)


def _listed(names: Iterable[str]) -> str:
    """Return names as one text, cut after some."""
    shown = list(names)
    rest = f" and {len(shown) - MOST_NAMES} more" if len(shown) > MOST_NAMES else ""
    return ", ".join(shown[:MOST_NAMES]) + rest
