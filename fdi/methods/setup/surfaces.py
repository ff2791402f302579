"""Do the control surfaces of a plane turn it the way in which the autopilot means them?

In: a log. Out: a `Check` for ailerons, elevator and rudder. A deflection is told as the autopilot
means it: positive rolls right, pitches up, yaws right; ``SERVOn_REVERSED`` (before 3.9 ``RCn_REV``)
turns the pulse round, and is turned back here. What a linkage does nobody logs, so a surface is
wrong where the vehicle turns against what is meant. PX4 says what each surface is meant to do in
``CA_SV_CSn_TRQ_R``, ``_P``, ``_Y``.

Both ways are compared for one axis at a time. In turbulence a controller pushes against what the
air does, which looks like a reversed surface at one interval length; `judge` asks at several. Where
a flight is too short for that, as the first one with a reversed aileron is, a plane that rolls by a
quarter of a turn against its ailerons, or pitches so far against its elevator, tells enough.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from fdi.methods.setup.against import APART_S, angle_against
from fdi.methods.setup.arrangements import Arrangement
from fdi.methods.setup.interval import in_percent, numbers_of, of_explained
from fdi.methods.setup.judge import CERTAIN, judge
from fdi.methods.setup.records import Series, Stretch, body_rates, series, stretches, within
from fdi.methods.setup.values import Check, Setting
from fdi.telemetry import Log
from fdi.telemetry.meaning.outputs import drives_of
from fdi.telemetry.message import Floats

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
QUARTER_TURN: Final = np.pi / 2
_SERVO_S: Final = 0.1
"""By which a vehicle follows an output: 60 degrees of a servo take 0.1 to 0.2 s."""
_TURNS: Final = {"aileron": ("rolls", 0), "elevator": ("pitches", 1)}
"""By which axis a surface tells at once; a fin holds the nose whatever a rudder does."""


def check_surfaces(log: Log) -> Iterator[Check]:
    """Yield for each kind of surface whether it is reversed."""
    if log.vehicle not in _WINGED:
        return
    rates, parts = body_rates(log), stretches(log)
    for surface, name, axis in _SURFACES:
        given = meant(log, surface)
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
            found = _judged(name, axis, rates, given, parts)
            if surface in _TURNS and found.verdict == "not known":
                found = _turned_over(found, surface, rates, given, parts)
            wrong = found.verdict == "wrong"
            yield replace(found, settings=_turned_round(log, surface)) if wrong else found


def _judged(
    name: str, axis: int, rates: Series, given: Series, parts: tuple[Stretch, ...]
) -> Check:
    direction = np.ones((1, 1))
    ways = (Arrangement(direction, ()), Arrangement(-direction, ("reversed",)))
    turns = Series(rates.t, rates.values[axis : axis + 1])
    found = judge(turns, given, parts, ways)
    if found is None:
        return Check(name, "not known", "the log holds no flight long enough to see moments")
    forth, back = (
        of_explained(float(found.explained[i, 0]), float(found.independent[0])) for i in (0, 1)
    )
    verb = "are" if name.endswith("s") else "is"
    numbers = {
        **numbers_of("explained_as_meant", forth),
        **numbers_of("explained_reversed", back),
        "log_likelihood_ahead": float(max(found.ahead)),
    }
    words = f"{_AXES[axis]} follows {in_percent(forth)} as meant, {in_percent(back)} the other way"
    stirred = found.turning[0] >= _STIRRED
    if found.best == 0 and stirred and found.ahead[1] >= CERTAIN:
        return Check(name, "in order", words, numbers)
    reversed_ = back.value >= _EXPLAINS and back.value > 2 * forth.value and back.least > 0
    if not (found.best == 1 and stirred and reversed_):
        return Check(name, "not known", f"too little shows in these records: {words}", numbers)
    if found.ahead[0] >= CERTAIN and found.ahead_of_told >= _HALF:
        return Check(name, "wrong", f"{verb} reversed: {words}", numbers)
    text = f"{words}: {verb} perhaps reversed, which not every part of the flight bears out"
    return Check(name, "not known", text, numbers, strikes=True)


def turned_against_surface(surface: str, rates: Series, given: Series) -> Floats:
    """Return the angle turned so far at a stretch against what a surface is meant to do, (n,) rad.

    Zero once the vehicle has turned by half a turn at a stretch as meant: a linkage does not turn
    round in flight, and who is stalled spins whatever the ailerons do.

    Parameters
    ----------
    surface : str
        ``aileron`` (about the roll axis) or ``elevator`` (pitch).
    rates : Series
        (3, n) rad/s.
    given : Series
        As `meant` gives it.
    """
    asked = np.interp(rates.t - _SERVO_S, given.t, given.values[0])
    rate = rates.values[_TURNS[surface][1]]
    as_meant = np.maximum.accumulate(angle_against(rates.t, rate, -asked))
    return np.where(as_meant < np.pi, angle_against(rates.t, rate, asked), 0.0)


def _turned_over(
    found: Check, surface: str, rates: Series, given: Series, parts: tuple[Stretch, ...]
) -> Check:
    """Return a check that knows by how much the vehicle turned against a surface."""
    if max(rates.period, given.period) > APART_S:
        return found
    angle = turned_against_surface(surface, rates, given)
    most = float(angle[within(rates.t, parts)].max(initial=0.0))
    numbers = {**found.numbers, "turned_against_deg": float(np.degrees(most))}
    if most <= QUARTER_TURN:
        return replace(found, numbers=numbers)
    verb, are = _TURNS[surface][0], "they are" if found.name.endswith("s") else "it is"
    text = f"the vehicle {verb} by {np.degrees(most):.0f} degrees against what {are} meant to do"
    return replace(found, verdict="wrong", text=text, numbers=numbers)


def meant(log: Log, surface: str) -> Series | str:
    """Return what a kind of surface is meant to do, (1, n), or why that is not known."""
    if log.autopilot == "px4":
        return _px4(log, surface)
    drives = [n for n, what in drives_of(log.parameters, log.autopilot) if what == surface]
    signs = {n: _sign(log, n) for n in drives}
    told = [n for n in drives if signs[n]]
    found = [
        (s, signs[n], _rest(log, n))
        for n in told
        if (s := series(log, "SERVO_OUTPUT_RAW", (f"servo{n}_raw",)))
    ]
    if not drives:
        return "the log does not tell which output drives it"
    if not found:
        return "the log does not hold its output, or not whether that is reversed (SERVOn_REVERSED)"
    t = found[0][0].t
    shares = [sign * (np.interp(t, s.t, s.values[0]) - rest) / 400 for s, sign, rest in found]
    return Series(t, np.mean(shares, axis=0)[None])


def _sign(log: Log, output: int) -> float:
    """Return -1 for an output that is turned round, 1 for one that is not, 0 where nobody says."""
    turned = log.parameters.get(f"SERVO{output}_REVERSED")
    if turned is not None:
        return -1.0 if turned else 1.0
    older = log.parameters.get(f"RC{output}_REV")
    return 0.0 if older is None else float(np.sign(older))


def _rest(log: Log, output: int) -> float:
    """Return the pulse, us, by which an output asks for nothing."""
    older = f"SERVO{output}_REVERSED" not in log.parameters  # before 3.9
    return float(log.parameters.get(f"{'RC' if older else 'SERVO'}{output}_TRIM", 1500.0))


def _turned_round(log: Log, surface: str) -> tuple[Setting, ...]:
    """Return the parameters that would turn a surface round."""
    if log.autopilot == "px4":
        return ()  # CA_SV_CSn_TRQ_* says what it does; PWM_*_REV, a mask, is not known by output
    why = "The vehicle turns against what this output is meant to do"
    found = []
    for n, what in drives_of(log.parameters, log.autopilot):
        name, older = f"SERVO{n}_REVERSED", f"RC{n}_REV"
        now = log.parameters.get(name)
        before = log.parameters.get(older)
        if what == surface and now is not None:
            found.append(Setting(name, now, 0.0 if now else 1.0, why))
        elif what == surface and before is not None:
            found.append(Setting(older, before, -before, why))
    return tuple(found)


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
