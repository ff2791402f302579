"""Do the control surfaces of a plane turn it the way in which the autopilot means them?

In: a log. Out: a `Check` for ailerons, elevator and rudder. A deflection is told as the autopilot
means it: positive rolls right, pitches up, yaws right; ``SERVOn_REVERSED`` (before 3.9 ``RCn_REV``)
turns the pulse round, and is turned back here. What a linkage does nobody logs, so a surface is
wrong where the vehicle turns against what is meant. PX4 says what each surface is meant to do in
``CA_SV_CSn_TRQ_R``, ``_P``, ``_Y``.

Both ways are compared for one axis at a time. In turbulence a controller pushes against what the
air does, which looks like a reversed surface at one interval length; `judge` asks at several.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from fdi.methods.setup.arrangements import Arrangement
from fdi.methods.setup.judge import CERTAIN, judge
from fdi.methods.setup.records import Series, Stretch, body_rates, series, stretches
from fdi.methods.setup.values import Check
from fdi.telemetry import Log
from fdi.telemetry.meaning.outputs import drives_of

_WINGED: Final = ("plane", "vtol")
_SURFACES: Final = (
    ("aileron", "ailerons", 0),
    ("elevator", "elevator", 1),
    ("rudder", "rudder", 2),
)
_AXES: Final = ("roll", "pitch", "yaw")
_TORQUE: Final = "CA_SV_CS{}_TRQ_{}"
_SLOWEST_S: Final = 0.6
"""Records further apart than this miss how a plane answers, which takes about as long."""
_EXPLAINS: Final = 0.3
_HALF: Final = 3.0
_STIRRED: Final = 0.02  # rad/s


def check_surfaces(log: Log) -> Iterator[Check]:
    """Yield for each kind of surface whether it is reversed."""
    if log.vehicle not in _WINGED:
        return
    rates, parts = body_rates(log), stretches(log)
    for surface, name, axis in _SURFACES:
        given = _meant(log, surface)
        if isinstance(given, str):
            yield Check(name, "not known", given)
        elif rates is None:
            yield Check(name, "not known", "the log holds no body rates")
        elif max(rates.period, given.period) > _SLOWEST_S:
            slowest = max(rates.period, given.period)
            yield Check(
                name, "not known", f"records are {slowest:.1f} s apart, too far to see moments"
            )
        else:
            yield _judged(name, axis, rates, given, parts)


def _judged(
    name: str, axis: int, rates: Series, given: Series, parts: tuple[Stretch, ...]
) -> Check:
    direction = np.zeros((3, 1))
    direction[axis, 0] = 1.0
    ways = (Arrangement(direction, ()), Arrangement(-direction, ("reversed",)))
    found = judge(rates, given, parts, ways)
    if found is None:
        return Check(name, "not known", "the log holds no flight long enough to see moments")
    forth, back = (float(found.explained[i, axis]) for i in (0, 1))
    verb = "are" if name.endswith("s") else "is"
    numbers = {
        "explained_as_meant": forth,
        "explained_reversed": back,
        "log_likelihood_ahead": float(max(found.ahead)),
    }
    words = f"{_AXES[axis]} follows {100 * forth:.0f} % as meant, {100 * back:.0f} % the other way"
    stirred = found.turning[axis] >= _STIRRED
    if (
        found.best == 1
        and stirred
        and found.ahead[0] >= CERTAIN
        and found.ahead_of_told >= _HALF
        and back >= _EXPLAINS
        and back > 2 * forth
    ):
        return Check(name, "wrong", f"{verb} reversed: {words}", numbers)
    if found.best == 0 and stirred and found.ahead[1] >= CERTAIN:
        return Check(name, "in order", f"{words}", numbers)
    return Check(name, "not known", f"too little of it shows in these records: {words}", numbers)


def _meant(log: Log, surface: str) -> Series | str:
    """Return what a kind of surface is meant to do, (1, n), or why that is not known."""
    if log.autopilot == "px4":
        return _px4(log, surface)
    drives = [n for n, what in drives_of(log.parameters, log.autopilot) if what == surface]
    signs = {n: _sign(log, n) for n in drives}
    told = [n for n in drives if signs[n]]
    found = [
        (s, signs[n]) for n in told if (s := series(log, "SERVO_OUTPUT_RAW", (f"servo{n}_raw",)))
    ]
    if not drives:
        return "the log does not tell which output drives it"
    if not found:
        return "the log does not hold its output, or not whether that is reversed (SERVOn_REVERSED)"
    t = found[0][0].t
    mean = np.mean(
        [sign * (np.interp(t, s.t, s.values[0]) - 1500) / 400 for s, sign in found], axis=0
    )
    return Series(t, mean[None])


def _sign(log: Log, output: int) -> float:
    """Return -1 for an output that is turned round, 1 for one that is not, 0 where nobody says."""
    turned = log.parameters.get(f"SERVO{output}_REVERSED")
    if turned is not None:
        return -1.0 if turned else 1.0
    older = log.parameters.get(f"RC{output}_REV")
    return 0.0 if older is None else float(np.sign(older))


def _px4(log: Log, surface: str) -> Series | str:
    axis = {"aileron": "R", "elevator": "P", "rudder": "Y"}[surface]
    message = log.messages.get("actuator_servos")
    if message is None:
        return "the log does not hold what its servo is given (actuator_servos)"
    kinds = {"aileron": (1, 2, 15), "elevator": (3,), "rudder": (4,)}[surface]
    total, t = [], None
    for n in range(8):
        torque = log.parameters.get(_TORQUE.format(n, axis), 0.0)
        if log.parameters.get(f"CA_SV_CS{n}_TYPE") in kinds and torque:
            s = series(log, "actuator_servos", (f"control[{n}]",))
            if s is not None:
                t = s.t if t is None else t
                total.append(np.sign(torque) * np.interp(t, s.t, s.values[0]))
    if t is None:
        return "the log does not tell which servo moves it, and which way it is meant to turn"
    return Series(t, np.mean(total, axis=0)[None])
