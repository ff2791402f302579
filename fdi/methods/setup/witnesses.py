"""Whose fault is it that a compass does not fit, where others fit with the same attitude?

In: all checks of a log. Out: the same, with what two others decide. That a compass misses the
Earth's field may be its own fault or that of the attitude it is put into earth axes with. The
attitude is right where two others say so that would show it: another compass that fits, or the
receiver, by where the vehicle leans. One alone decides nothing: the heading usually comes from a
compass, and fits it whatever that one shows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from fdi.methods.setup import heading
from fdi.methods.setup.compass import ATTITUDE, MISSES
from fdi.methods.setup.turned import FITS
from fdi.methods.setup.values import Check

ENOUGH: Final = 2


def decided(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Return the checks of a log, with each that rests on the attitude decided or left in doubt."""
    fit = [check.name for check in checks if _shows_the_attitude_right(check)]
    return tuple(_beside(check, fit) if check.rests_on == ATTITUDE else check for check in checks)


def _shows_the_attitude_right(check: Check) -> bool:
    if check.name == heading.NAME:
        return check.verdict == "in order"
    return bool(check.numbers.get(f"{MISSES}_most", np.inf) < np.degrees(FITS))


def _beside(check: Check, fit: list[str]) -> Check:
    if len(fit) < ENOUGH:
        return replace(check, text=f"{check.text}: the attitude may be wrong")
    if not check.strikes:
        return check
    others = f"{', '.join(fit[:-1])} and {fit[-1]}"
    text = f"{check.text}; {others} fit with the same attitude, so that it is this compass"
    return replace(check, verdict="wrong", text=text, strikes=False, rests_on=())
