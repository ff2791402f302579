"""Do the columns of a method and the tests of the model accuse the same component?

In: what the tests of every flight did, and who is accused. Out: an `Agreement` for every method
that has something to say of an accusation, or that complains where nobody is accused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from fdi.diagnosis.alarm_runs import Run
from fdi.diagnosis.hypotheses import WINDOW_S, Inquiry
from fdi.diagnosis.naming import Cause
from fdi.diagnosis.values import Agreement
from fdi.model.naming import component_words, inside
from fdi.residuals import Bank


def agreements(
    inquiries: Sequence[Inquiry], causes: Sequence[Cause], bank: Bank
) -> tuple[Agreement, ...]:
    """Return what methods say of each accusation, and of flights without one.

    Parameters
    ----------
    inquiries : sequence of Inquiry
        One for each flight.
    causes : sequence of Cause
        In the order of their rank.
    bank : Bank
    """
    methods = bank.methods()
    found: list[Agreement] = []
    for name in dict.fromkeys(filter(None, methods)):
        rows = {row for row, method in enumerate(methods) if method == name}
        for rank, cause in enumerate(causes, 1):
            found += _of_cause(name, rows, rank, cause, inquiries[cause.flight])
        accused = {cause.flight for cause in causes}
        for inquiry in inquiries:
            if inquiry.flight not in accused:
                found += _of_nobody(name, rows, inquiry)
    return tuple(found)


def _of_cause(
    method: str, rows: set[int], rank: int, cause: Cause, inquiry: Inquiry
) -> Iterator[Agreement]:
    """Yield what a method shows while a component is accused, nothing where it shows nothing."""
    here = [
        run
        for run in inquiry.runs
        if run.row in rows and run.end >= cause.onset and run.onset <= cause.alarm + WINDOW_S
    ]
    if not here:
        return
    who = inside(component_words(cause.component, inquiry.whom.components))
    pointed = _pointed(here, inquiry)
    agrees = cause.component in pointed
    follows = not inquiry.reach[cause.component].isdisjoint(pointed)
    if agrees and all(run.row in rows for run in cause.runs):
        text = f"only the method {method} shows that the {who} failed: no test of the model does"
    elif agrees:
        text = f"the method {method} points to the {who} as well"
    elif follows:
        text = (
            f"the method {method} points to {_listed(pointed, inquiry)}, which may follow from the "
            f"failure of the {who}"
        )
    else:
        text = f"the method {method} does not point to the {who}: {_listed(pointed, inquiry)} fits"
    yield Agreement(method, cause.flight, rank, agrees, text)


def _of_nobody(method: str, rows: set[int], inquiry: Inquiry) -> Iterator[Agreement]:
    """Yield that a method complains in a flight in which nobody is accused."""
    here = [run for run in inquiry.runs if run.row in rows]
    if here:
        first = min(run.onset for run in here)
        yield Agreement(
            method,
            inquiry.flight,
            None,
            False,
            f"the method {method} shows something at {first:.1f} s that fits "
            f"{_listed(_pointed(here, inquiry), inquiry)}; that is not enough to accuse",
        )


def _pointed(here: Sequence[Run], inquiry: Inquiry) -> tuple[str, ...]:
    """Return who explains most of some alarms; a program that computes does not break."""
    whom = inquiry.whom
    count = Counter(name for row in {run.row for run in here} for name in whom.of(row))
    able = {n: c for n, c in count.items() if not whom.components[n].computed} or count
    return tuple(
        sorted((n for n in able if able[n] == max(able.values())), key=whom.order.__getitem__)
    )


def _listed(names: Sequence[str], inquiry: Inquiry) -> str:
    words = [f"the {inside(component_words(n, inquiry.whom.components))}" for n in names]
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
