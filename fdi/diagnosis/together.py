"""Which components together explain every alarm of a flight, where one is not the whole answer?

In: what the tests did in every flight, who is accused, and what follows from that. Out: the minimal
diagnoses of one and of two components (``fdi.structure.hitting``): the conflicts are the components
that each alarming test concerns. Alarms that follow from an accused component are no conflicts.
Nothing is told where nobody or one component is accused and one explains all, nor where no two do:
that more than two would have to fail together tells nobody anything.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fdi.diagnosis.hypotheses import Inquiry
from fdi.diagnosis.naming import Cause, Effect
from fdi.diagnosis.values import Together
from fdi.structure import members
from fdi.structure.hitting import minimal_hitting_sets

MOST = 2
"""Components that may have failed together: three of thirty are 4,060 sets that tell nothing."""


def together(
    inquiries: Sequence[Inquiry], causes: Sequence[Cause], effects: Sequence[Effect]
) -> Iterator[Together]:
    """Yield of every flight that asks for it the minimal diagnoses, those of the accused first."""
    for inquiry in inquiries:
        accused = {cause.component for cause in causes if cause.flight == inquiry.flight}
        follows = {
            run
            for effect in effects
            if effect.cause.flight == inquiry.flight
            for run in effect.runs
        }
        names = tuple(inquiry.ties)
        conflicts, rows = set(), set()
        for run in inquiry.runs:
            concerned = inquiry.whom.of(run.row)
            bits = sum(1 << i for i, name in enumerate(names) if name in concerned)
            if bits and run not in follows and not inquiry.whom.supports[run.row]:
                conflicts.add(bits)
                rows.add(run.row)
        if not conflicts:
            continue
        sets = minimal_hitting_sets(conflicts, most=MOST)
        found = [tuple(names[i] for i in members(one)) for one in sets]
        if not found or (len(accused) < 2 and any(len(one) == 1 for one in found)):
            continue
        found.sort(key=lambda one: (len(one), -len(accused & set(one))))
        yield Together(inquiry.flight, len(rows), tuple(found))
