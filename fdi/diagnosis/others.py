"""Why was it not another part? What a flight shows of everybody else when somebody is accused.

In: an accusation and what the tests of its flight did around it. Out: an `Other` for each component
with a test that ran then, in a pilot's words: which of the accused's alarms it does not explain,
which of its own tests stayed quiet, that its alarms came later, that the accused disturbs it. These
are facts of this flight and seldom a proof: a fault that is smaller than its tests can see leaves
them quiet as well. Who is cleared says ``clearing.py``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import SIMULTANEOUS_S, WELL, Doings, speaking
from fdi.diagnosis.hypotheses import Inquiry
from fdi.diagnosis.naming import Cause
from fdi.diagnosis.plain import alarm_fact, the_part
from fdi.diagnosis.values import Other
from fdi.residuals import Bank
from fdi.units import hundredths


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """An accusation with what all tests did around it."""

    cause: Cause
    inquiry: Inquiry
    bank: Bank
    done: Doings

    def alarms(self, name: str) -> list[int]:
        """Return the tests about a component that alarmed."""
        about = self.inquiry.ties[name] > Tie.NONE
        return [int(row) for row in np.flatnonzero(about & self.done.alarmed)]

    def speaking(self, name: str) -> list[int]:
        """Return the tests whose silence would say something of a component."""
        whom = self.inquiry.whom
        own = speaking(self.inquiry.ties[name], self.inquiry.reach[name], self.done, whom)
        return [int(row) for row in np.flatnonzero(own & ~whom.supports)]

    def first(self, name: str) -> float | None:
        """Return when the first alarm about a component began, s."""
        return min((float(self.done.onset[row]) for row in self.alarms(name)), default=None)

    def fact(self, name: str, row: int) -> str:
        return alarm_fact(name, self.bank.generators[row], self.bank.system)


def others(cause: Cause, inquiry: Inquiry, bank: Bank) -> tuple[Other, ...]:
    """Return what the flight shows of everybody else: the likeliest first, then by first alarms.

    Parameters
    ----------
    cause : Cause
    inquiry : Inquiry
        Of its flight.
    bank : Bank
    """
    scene = _Scene(cause, inquiry, bank, inquiry.doings(cause.start.onset, inquiry.runs))
    rivals = [name for name, _ in cause.rivals]
    told = [
        Other(name, scene.first(name), tuple(_against(name, scene)))
        for name in inquiry.ties
        if name != cause.component and (scene.alarms(name) or scene.speaking(name))
    ]
    return tuple(
        sorted(
            told,
            key=lambda one: (
                rivals.index(one.component) if one.component in rivals else len(rivals),
                np.inf if one.alarm is None else one.alarm,
                inquiry.whom.order[one.component],
            ),
        )
    )


def _against(name: str, scene: _Scene) -> Iterator[str]:
    if scene.alarms(name):
        yield from _follows(name, scene)
        yield from _unexplained(name, scene)
    yield from _silent(name, scene)
    component = scene.inquiry.whom.components[name]
    if component.computed:
        yield "it is computed, and has no part that breaks"
    elif component.group == "autopilot":
        yield "it is a program, which does as well as what it is given"


def _follows(name: str, scene: _Scene) -> Iterator[str]:
    """Yield that a component's alarms came later, and may follow from the accused."""
    first, start = scene.first(name), scene.first(scene.cause.component)
    if first is None or start is None:
        return
    if first > start + SIMULTANEOUS_S:
        yield f"its first alarm came {first - start:.1f} s later"
    if first >= start - SIMULTANEOUS_S and name in scene.inquiry.reach[scene.cause.component]:
        words = the_part(scene.cause.component, scene.bank.system.components)
        yield f"a failure of {words} disturbs it too"


def _unexplained(name: str, scene: _Scene) -> Iterator[str]:
    """Yield how many of the accused's alarms a component neither shows in nor disturbs."""
    whom, ties = scene.inquiry.whom, scene.inquiry.ties
    rows, reach = scene.alarms(scene.cause.component), scene.inquiry.reach[name]
    left = [r for r in rows if ties[name][r] == Tie.NONE and not whom.disturbed(r, reach)]
    if not left:
        return
    telling = max(left, key=lambda r: (ties[scene.cause.component][r], scene.done.near[r]))
    fact = scene.fact(scene.cause.component, telling)
    if len(rows) == 1:
        yield f"it does not explain that {fact}"
    elif len(left) == len(rows):
        yield f"it explains none of the {len(rows)} alarms at first, such as that {fact}"
    else:
        yield (
            f"it does not explain {len(left)} of the {len(rows)} alarms at first, such as "
            f"that {fact}"
        )


def _silent(name: str, scene: _Scene) -> Iterator[str]:
    """Yield which tests that hold a fault of a component stayed below half of their thresholds.

    An alarm may concern it all the same: a test that the model only suspects it of.
    """
    rows, done = scene.speaking(name), scene.done
    quiet = [row for row in rows if not done.alarmed[row] and done.near[row] <= np.log(WELL)]
    if not quiet:
        return
    of = scene.inquiry.whom.of
    telling = min(quiet, key=lambda row: (len(of(row)), done.near[row]))
    share = hundredths(float(np.exp(done.near[telling])))
    many = "the only test of its own was quiet"
    if len(rows) > 1:
        which = "all" if len(quiet) == len(rows) else f"{len(quiet)} of"
        many = f"{which} {len(rows)} tests of its own were quiet"
    more = ", such as" if len(quiet) > 1 else ":"
    yield f"{many}{more} whether {scene.fact(name, telling)} ({share} % of the threshold at most)"
