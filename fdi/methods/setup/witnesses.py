"""Whose fault is it that a compass does not fit, where others fit with the same attitude?

In: all checks of a log. Out: the same, with what two others decide. That a compass misses the
Earth's field may be its own fault or that of the attitude it is put into earth axes with. The
attitude is right where two others say so that would show it: another compass that fits, or the
receiver, by where the vehicle leans. One alone decides nothing: the heading usually comes from a
compass, and fits it whatever that one shows.

That one is turned about the vertical an attitude shows as well whose heading followed another one
that is turned: where another one fits, two have to.

So a compass that fits is not in order where it points, before take-off, as one does of which the
gyroscopes say that it is turned (`turned.py`), nor where the receiver says that the heading is
wrong: the heading has followed it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from fdi.methods.setup import heading
from fdi.methods.setup.agreement import APART
from fdi.methods.setup.compass import ATTITUDE, MISSES, TURNED
from fdi.methods.setup.turned import FITS
from fdi.methods.setup.values import Check

ENOUGH: Final = 2


def decided(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Return the checks of a log, with each that rests on the attitude decided or left in doubt."""
    leads = [check.name for check in checks if _fits(check)]
    checks = tuple(_unless_misled(check, checks) for check in checks)
    fit = [check.name for check in checks if _shows_the_attitude_right(check)]
    return tuple(
        _beside(check, fit, leads) if check.rests_on == ATTITUDE else check for check in checks
    )


def _unless_misled(check: Check, checks: tuple[Check, ...]) -> Check:
    """Return a check, that of no compass in order which fits a heading that is wrong."""
    if check.verdict != "in order" or MISSES not in check.numbers:
        return check
    why = _misled(check, checks)
    if not why:
        return check
    # nor does it show any more that the attitude is right
    numbers = {name: one for name, one in check.numbers.items() if not name.startswith(MISSES)}
    text = f"{check.text}; but {why}"
    return replace(check, verdict="not known", text=text, numbers=numbers, strikes=True)


def _misled(check: Check, checks: tuple[Check, ...]) -> str:
    """Return why the heading that a compass fits is wrong, "" where nothing says so."""
    if any(one.name == heading.NAME and one.verdict == "wrong" for one in checks):
        return "the heading that it fits is wrong itself"
    own = _apart(check.name, checks)
    turned = (one.name for one in checks if TURNED in one.numbers)
    near = (name for name in turned if own + _apart(name, checks) < np.degrees(FITS))
    other = next(near, None)
    if other is None:
        return ""
    return f"it points as {other} does, which is turned: the heading follows both"


def _apart(name: str, checks: tuple[Check, ...]) -> float:
    """Return by how many degrees a compass points away from the first one, at most."""
    told = next((one for one in checks if one.name == f"agreement of {name}"), None)
    return 0.0 if told is None else float(told.numbers.get(f"{APART}_most", np.inf))


def _shows_the_attitude_right(check: Check) -> bool:
    if check.name == heading.NAME:
        return check.verdict == "in order"
    return _fits(check)


def _fits(check: Check) -> bool:
    """Return whether a compass fits the Earth's field with the attitude."""
    return bool(check.numbers.get(f"{MISSES}_most", np.inf) < np.degrees(FITS))


def _beside(check: Check, fit: list[str], leads: list[str]) -> Check:
    """Return a check that rests on the attitude; ``leads``: compasses that may have turned it."""
    if check.verdict == "wrong":
        if len(fit) >= ENOUGH or not leads:
            return replace(check, rests_on=())
        text = f"{check.text}, unless the heading follows {leads[0]}, and that one is turned"
        return replace(check, verdict="not known", text=text, strikes=True)
    if len(fit) < ENOUGH:
        return replace(check, text=f"{check.text}: the attitude may be wrong")
    if not check.strikes:
        return check
    others = f"{', '.join(fit[:-1])} and {fit[-1]}"
    text = f"{check.text}; {others} fit with the same attitude, so that it is this compass"
    return replace(check, verdict="wrong", text=text, strikes=False, rests_on=())
