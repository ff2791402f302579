"""Whose fault is it that a compass does not fit, where others fit with the same attitude?

In: all checks of a log. Out: the same, with what two others decide. That a compass misses the
Earth's field may be its own fault or that of the attitude it is put into earth axes with. The
attitude is right where two others say so that would show it: another compass that fits, or the
receiver, by where the vehicle leans. One alone decides nothing: the heading usually comes from a
compass, and fits it whatever that one shows.

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
    checks = _turned_together(checks)
    fit = [check.name for check in checks if _shows_the_attitude_right(check)]
    return tuple(_beside(check, fit) if check.rests_on == ATTITUDE else check for check in checks)


def _turned_together(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Return the checks, none of a compass in order that points as one does which is turned."""
    turned = [one.name for one in checks if TURNED in one.numbers]
    turned += [one.name for one in checks if one.name == heading.NAME and one.verdict == "wrong"]
    return tuple(
        _with(check, turned, checks) if check.verdict == "in order" and MISSES in check.numbers
        else check
        for check in checks
    )  # fmt: skip


def _with(check: Check, turned: list[str], checks: tuple[Check, ...]) -> Check:
    own = _apart(check.name, checks)
    near = (
        name
        for name in turned
        if name == heading.NAME or own + _apart(name, checks) < np.degrees(FITS)
    )
    other = next(near, None)
    if other is None:
        return check
    text = f"{check.text}; but it points as {other} does, which is turned: the heading follows both"
    if other == heading.NAME:
        text = f"{check.text}; but the heading that it fits is wrong itself"
    # nor does it show any more that the attitude is right
    numbers = {name: one for name, one in check.numbers.items() if not name.startswith(MISSES)}
    return replace(check, verdict="not known", text=text, numbers=numbers, strikes=True)


def _apart(name: str, checks: tuple[Check, ...]) -> float:
    """Return by how many degrees a compass points away from the first one, at most."""
    told = next((one for one in checks if one.name == f"agreement of {name}"), None)
    return 0.0 if told is None else float(told.numbers.get(f"{APART}_most", np.inf))


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
