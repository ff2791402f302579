"""Do the motors of a multicopter turn it as its frame says?

In: a log. Out: one `Check`. The thrusts come from the outputs by the wiring and the range that the
parameters tell (`MOTORS`) and the thrust curve; the body rates from the gyroscopes' own records. A
vehicle that flips on take-off gives a log of a second or two, in which outputs go to their limits
and the rates run away: that counts, too. What the thrust curve does not tell (``THR_MDL_FAC`` 0 of
PX4) is taken to be straight, which is right for small changes about hover.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from fdi.methods.setup.against import (
    APART_S,
    HALF_A_TURN,
    Against,
    LiftOff,
    asked_moments,
    lift_off,
    turned_against,
)
from fdi.methods.setup.arrangements import ALIKE, Arrangement, arrangements, cosines, directions_of
from fdi.methods.setup.judge import CERTAIN, Judgement, judge
from fdi.methods.setup.records import Series, body_rates, series, stretches
from fdi.methods.setup.values import Check
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, Motor, motors_of

NAME: Final = "motors"
SLOWEST_S: Final = 1.0
"""Records further apart than this tell nothing of moments, which act within a tenth of that."""
_EXPLAINS: Final = 0.3
"""Share of the change of a body rate that another arrangement explains at least."""
_BETTER: Final = 2.0
"""How many times as much as the frame as set, over the axes on which they differ."""
_HALF: Final = 3.0  # log likelihood by which it is ahead in the poorer half: 1 to 20
_STIRRED: Final = 0.01  # rad/s, ten times what MAVLink's records resolve
_BESIDE: Final = 0.1
"""An axis that turns by less than this share of the one that turns most tells nothing."""
_MOST_NAMED: Final = 3
_EXPO: Final = {"ardupilot": ("MOT_THST_EXPO", 0.65), "px4": ("THR_MDL_FAC", 0.0)}
_SPIN: Final = ((("MOT_SPIN_MIN",), 0.15), (("MOT_SPIN_MAX", "MOT_THST_MAX"), 0.95))
"""How they are called, the newest name first (MOT_THST_MAX: Copter 3.3), and their defaults."""
_TCRV: Final = {"MOT_TCRV_MIDPCT": 50.0, "MOT_TCRV_MAXPCT": 100.0}
"""% of the range that give half of the thrust and all of it; by default where no curve is set."""
_AXES: Final = ("roll", "pitch", "yaw")


def check_motors(log: Log) -> Iterator[Check]:
    """Yield whether the motors act where and as the frame says."""
    if log.vehicle not in (*ROTORS, "other"):
        return
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    missing = lacking(log, motors)
    if missing:
        yield Check(NAME, "not known", missing)
        return
    rates, inputs = body_rates(log), motor_thrusts(log, motors)
    assert rates is not None
    assert inputs is not None
    ways = arrangements(log, motors)
    found = judge(rates, inputs, stretches(log), ways)
    seen = map(turned_against, lift_offs(log, rates, inputs, motors))
    flip = max(seen, key=lambda one: one.angle, default=Against(0.0, np.nan))
    if found is not None:
        yield _told(found, ways, flip)
    elif flip.angle > HALF_A_TURN:
        text = f"they do not turn the vehicle as the frame says: {_turned(flip)}"
        yield Check(NAME, "wrong", text, {"turned_against_deg": float(np.degrees(flip.angle))})
    else:
        yield Check(NAME, "not known", "the log holds no flight long enough to see moments")


def lift_offs(
    log: Log, rates: Series, thrusts: Series, motors: tuple[Motor, ...]
) -> Iterator[LiftOff]:
    """Yield what each flight holds till it has lifted off; nothing of records too far apart."""
    shares = motor_shares(log, motors)
    if shares is None or max(rates.period, thrusts.period) > APART_S:
        return
    moments = asked_moments(rates.t, thrusts, motors)
    yield from (lift_off(rates, moments, shares, flight) for flight in log.flights)


def _turned(flip: Against) -> str:
    turns = flip.angle / (2 * HALF_A_TURN)
    return f"it turned by {turns:.1f} turns against them (log {flip.since:.1f} s)"


def motor_shares(log: Log, motors: tuple[Motor, ...]) -> Series | None:
    """Return the output to every motor, (m, n), as a share of its range."""
    return series(log, "MOTORS", tuple(f"motor_{m.number}" for m in motors))


def motor_thrusts(log: Log, motors: tuple[Motor, ...]) -> Series | None:
    """Return the thrust of every motor, (m, n), as a share of its largest."""
    shares = motor_shares(log, motors)
    return None if shares is None else Series(shares.t, thrust_of(log, shares.values))


def thrust_of(log: Log, share: Floats) -> Floats:
    """Return thrusts, 0 to 1, for outputs as shares of their range, by the curve that is set.

    ArduPilot's AP_MotorsMulticopter: between MOT_SPIN_MIN and MOT_SPIN_MAX, (1 - e) x + e x2;
    before Copter 3.3 two straight pieces, to MOT_TCRV_MIDPCT and MOT_TCRV_MAXPCT, or one.
    """
    curve = log.parameters.get("MOT_TCRV_ENABLE")
    if curve is not None:
        bends = {name: log.parameters.get(name, own) for name, own in _TCRV.items()}
        middle, most = (bends if curve else _TCRV).values()
        if 0 < middle < most:
            return np.asarray(np.interp(100 * share, [0.0, middle, most], [0.0, 0.5, 1.0]))
    name, usual = _EXPO.get(log.autopilot, ("", 0.0))
    bend = min(max(log.parameters.get(name, usual), 0.0), 1.0)
    low, high = 0.0, 1.0
    if log.autopilot == "ardupilot":
        low, high = (
            next((log.parameters[n] for n in names if n in log.parameters), own)
            for names, own in _SPIN
        )
    if not 0 <= low < high <= 1:
        low, high = 0.0, 1.0
    x = np.clip((share - low) / (high - low), 0.0, 1.0)
    return np.asarray((1 - bend) * x + bend * x**2)


def lacking(log: Log, motors: tuple[Motor, ...]) -> str:
    """Return in words what keeps a log from showing what its motors do, "" for nothing."""
    if not motors:
        return "the log does not tell a frame whose motors are known to stand somewhere"
    rates, inputs = body_rates(log), motor_thrusts(log, motors)
    if inputs is None:
        return "the log does not hold what every motor is given"
    if rates is None:
        return "the log holds no body rates"
    slowest = max(rates.period, inputs.period)
    if slowest >= SLOWEST_S:
        return f"records are {slowest:.1f} s apart, too far to see moments"
    if not np.any(directions_of(motors)[:2]):
        return "the frame has no arms"
    return ""


def _told(found: Judgement, ways: tuple[Arrangement, ...], flip: Against) -> Check:
    told, best = ways[0], ways[found.best]
    numbers = {
        "misfit_as_set": float(found.misfit[0]),
        "misfit_best": float(found.misfit[found.best]),
        "log_likelihood_ahead": float(found.ahead[0]),
        "intervals": float(found.count),
        **{
            f"explained_{a}": float(e)
            for a, e in zip(_AXES, found.explained[found.best], strict=True)
        },
        "turned_against_deg": float(np.degrees(flip.angle)),
    }
    if flip.angle > HALF_A_TURN or (found.best and _beyond_doubt(found, told, best)):
        near = _near(found, ways)
        only = near[0].setting if len(near) == 1 and len(near[0].words) == 1 else None
        settings = () if only is None else (only,)
        text = _accusation(found, near)
        if flip.angle > HALF_A_TURN:
            text += f"; {_turned(flip)}"
        return Check(NAME, "wrong", text, numbers, settings)
    open_ways = [w for i, w in enumerate(ways) if i and found.ahead[i] < CERTAIN]
    others = len(ways) - 1
    excluded = others - len(open_ways)
    if not found.best and not open_ways:
        shares = ", ".join(
            f"{axis} {100 * share:.0f} %"
            for axis, share in zip(_AXES, found.explained[0], strict=True)
        )
        text = (
            f"they turn the vehicle as the frame says, better than in {others} other arrangements"
        )
        return Check(NAME, "in order", f"{text} (explained: {shares})", numbers)
    if found.ahead[0] >= CERTAIN:
        text = "the frame as set fits badly, and no other arrangement explains the whole flight"
        motors = tuple(f"motor_{number}" for number in range(1, told.directions.shape[1] + 1))
        return Check(NAME, "not known", text, numbers, strikes=True, rests_on=motors)
    text = f"these records do not decide: {excluded} of {others} other arrangements are ruled out"
    if excluded:
        named = "; ".join(way.words[0] for way in open_ways[:_MOST_NAMED])
        rest = len(open_ways) - _MOST_NAMED
        text += f", still possible: {named}{f' and {rest} more' if rest > 0 else ''}"
    return Check(NAME, "not known", text, numbers)


def _beyond_doubt(found: Judgement, told: Arrangement, best: Arrangement) -> bool:
    stirred = found.turning >= max(_STIRRED, _BESIDE * float(found.turning.max()))
    axes = (cosines(best.directions, told.directions) < ALIKE) & stirred
    now, before = found.explained[found.best][axes], found.explained[0][axes]
    return bool(
        np.any(axes)
        and found.ahead[0] >= CERTAIN
        and found.ahead_of_told >= _HALF
        and np.all(now >= _EXPLAINS)
        and now.sum() >= _BETTER * before.sum()
    )


def _near(found: Judgement, ways: tuple[Arrangement, ...]) -> list[Arrangement]:
    """Return what fits instead, likeliest first, as far as the flight cannot tell it apart."""
    order = np.argsort(found.ahead, kind="stable").tolist()
    return [ways[i] for i in order if i and (i == found.best or found.ahead[i] < CERTAIN)]


def _accusation(found: Judgement, near: list[Arrangement]) -> str:
    """Return in words what fits instead, and by how much better."""
    words = [word for way in near for word in way.words]
    named, rest = words[:_MOST_NAMED], len(words) - _MOST_NAMED
    more = f", or {rest} less likely way{'s' if rest > 1 else ''}" if rest > 0 else ""
    said = ", or ".join(named) + more
    if len(words) > 1:
        said = f"they do not turn the vehicle as the frame says; what fits: {said}"
    if not found.best:  # only the flip speaks against the frame as set
        return said
    return (
        f"{said}: moment residuals fall from {found.misfit[0]:.1f} to "
        f"{found.misfit[found.best]:.1f} standard errors"
    )
