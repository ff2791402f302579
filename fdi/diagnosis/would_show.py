"""From which size on would a fault have shown, and by which of its tests?

In: a fault, a bank, the alarms. Out: by every test that could clear of it (`powered`) the size of a
lasting change that brings the test beyond its threshold for most of the time, in each direction.
The thresholds and how far a change moves a test are those of the last minute in the air. What is
left to a threshold is that of the flight's own beginning, or of that minute where it is more: what
a fault has used up of it since is no proof that a smaller one would have shown.

A test clears nobody of a fault where its other side may follow: where it reads a component that the
fault disturbs (an estimator takes a lasting error of a sensor over), an input that the model takes
as known (an attitude is an estimate as well), or a constant that is fitted to the flight. Units of
one kind may all be wrong alike, so a change of one of them and of all together must show.

The trap: sizes are found from a change of one standard deviation, as if tests were linear.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.noise import trailing_mean
from fdi.diagnosis.concerns import Concerns, affected
from fdi.diagnosis.values import How, WouldShow
from fdi.model.evaluate import Floats, evaluate, wrap
from fdi.model.expression import Apply, Number, symbols
from fdi.model.parts import Kind
from fdi.model.system import Fault
from fdi.residuals import Bank
from fdi.residuals.respond import Stretch, reached, stretch
from fdi.telemetry.airtime import reference_mask, when_in_air
from fdi.units import two_digits

LOOKED_AT_S: Final = 60.0
"""The last so much of the time in the air tells what a fault would do to the tests."""
CALM_S: Final = 20.0
"""The first so much of it, settled, tells what is left to their thresholds."""
LEAST_CALM_S: Final = 2.0
"""As long as a test must be known to rule anybody out."""
MOSTLY: Final = 0.9
"""Share of the time for which a change must be beyond a threshold."""
MOST_SIGMAS: Final = 100.0
"""A change of more stated standard deviations is no size worth printing."""
MOST_ANGLE: Final = np.pi / 4
"""A direction that is further off brings a vehicle down: who would not show it has no power."""

Moved = Mapping[int, Floats]
Spare = Callable[[Mapping[str, Floats]], Floats]


class Needed(NamedTuple):
    """The sizes, upwards and downwards, that bring a test beyond its threshold; inf for none."""

    up: float
    down: float


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What tells how small a fault a test shows.

    Attributes
    ----------
    piece, calm : Stretch
        The last of the time in the air, and its beginning.
    span, first : (n,) int
        Where these stand in the alarms' grid.
    """

    alarms: Alarms
    whom: Concerns
    piece: Stretch
    calm: Stretch
    span: NDArray[np.int64]
    first: NDArray[np.int64]


def sight_of(alarms: Alarms, whom: Concerns) -> Sight | None:
    """Return what tells how small faults a flight's tests show, None without a calm beginning."""
    residuals = alarms.residuals
    signals = residuals.signals
    place = np.flatnonzero(when_in_air(signals))
    length = max(1, round(LOOKED_AT_S * signals.rate_hz))
    span = np.arange(max(int(place[0]), int(place[-1]) + 1 - length), int(place[-1]) + 1)
    first = np.flatnonzero(reference_mask(signals, CALM_S))
    if len(first) < LEAST_CALM_S * signals.rate_hz:
        return None
    return Sight(alarms, whom, stretch(residuals, span), stretch(residuals, first), span, first)


def powered(component: str, bank: Bank, whom: Concerns) -> NDArray[np.bool_]:
    """Return the tests, (r,) bool, whose silence says that a component did not change for good.

    An alarm of them must accuse it by itself, and nothing that they read may follow a fault of it.
    """
    system = bank.system
    following = affected(component, system.components) - {component}
    fitted = {name for name, one in system.parameters.items() if one.bounds is not None}
    found = np.zeros(len(bank.generators), bool)
    for row, generator in enumerate(bank.generators):
        if whom.supports[row] or component not in whom.held_by(row):
            continue
        used = [system.equations[number] for number in generator.equations]
        shown = [one.measurement for one in used if one.measurement is not None]
        read = {one.component for one in shown}
        needs = {name for one in used for name in symbols(one.left) + symbols(one.right)}
        found[row] = (
            following.isdisjoint(read)
            and fitted.isdisjoint(needs)
            and not any(one.trusted for one in shown)
        )
    return found


def would_show(
    fault: Fault, rows: NDArray[np.intp], sight: Sight
) -> tuple[set[int], tuple[WouldShow, ...]] | None:
    """Return which tests show the smallest lasting change of a fault, and its sizes.

    None where a size is too large to say anything, and where only one direction shows of a sensor,
    which may read too high and too low.
    """
    system = sight.piece.bank.system
    equation = system.equations[fault.equation]
    measured = equation.measurement
    unit, one = equation.unit, 1.0
    if measured is not None:
        unit = system.variables[measured.variable].unit
        one = measured.accuracy or 1.0
    most = MOST_SIGMAS * one if measured is not None else MOST_ANGLE if unit == "rad" else np.inf
    needed = _needed_of(fault, rows, one, sight)
    best = {way: min(needed, key=lambda row: getattr(needed[row], way)) for way in Needed._fields}
    up, down = (getattr(needed[best[way]], way) for way in Needed._fields)
    up, down = (float(size) if size <= most else np.inf for size in (up, down))
    lasting = _lasting(best["up"], sight)
    if lasting is not None:
        sizes = [WouldShow(fault.name, up, unit, lasting)] if np.isfinite(up) else []
        return ({best["up"]}, tuple(sizes)) if sizes else None
    if measured is not None and system.components[fault.component].group == "sensor":
        up, down = (size if np.isfinite(max(up, down)) else np.inf for size in (up, down))
    sizes = _sizes(fault.name, unit, up, down)
    ways = zip(Needed._fields, (up, down), strict=True)
    telling = {best[way] for way, size in ways if np.isfinite(size)}
    return (telling, tuple(sizes)) if sizes else None


def _sizes(name: str, unit: str, up: float, down: float) -> list[WouldShow]:
    if np.isfinite([up, down]).all() and two_digits(up) == two_digits(down):
        return [WouldShow(name, max(up, down), unit, "changes")]
    ways: tuple[tuple[How, float], ...] = (("rises", up), ("falls", down))
    return [WouldShow(name, size, unit, how) for how, size in ways if np.isfinite(size)]


def _lasting(row: int, sight: Sight) -> How | None:
    """Return which state it is whose length a test bounds, None where it bounds a quantity."""
    bank = sight.piece.bank
    read = [bank.system.equations[number] for number in bank.generators[row].equations]
    behaviour = {one.measurement.behaviour for one in read if one.measurement is not None}
    return "frozen" if "freeze" in behaviour else "silent" if "loss" in behaviour else None


def _needed_of(fault: Fault, rows: NDArray[np.intp], one: float, sight: Sight) -> dict[int, Needed]:
    """Return the sizes that each test needs, by a change of this channel and of all alike."""
    worst = {int(row): Needed(0.0, 0.0) for row in rows}
    for group in _alike(fault, sight.piece.bank):
        up, down = (
            reached(sight.piece, {i: np.full(len(sight.piece.t), sign * one) for i in group})
            for sign in (1.0, -1.0)
        )
        for row, before in worst.items():
            now = (
                _size(row, fault.equation, sign, one, moved, sight)
                for sign, moved in ((1.0, up), (-1.0, down))
            )
            worst[row] = Needed(*(max(pair) for pair in zip(before, now, strict=True)))
    return worst


def _alike(fault: Fault, bank: Bank) -> list[tuple[int, ...]]:
    """Return which equations change: the fault's own, and those of all channels of its kind."""
    system = bank.system

    def unit(number: int) -> str:
        shown = system.equations[number].measurement
        return system.variables[shown.variable].unit if shown is not None else ""

    own = [one.equation for one in system.faults if one.component == fault.component]
    alike = tuple(i for i in own if unit(i) and unit(i) == unit(fault.equation))
    return [(fault.equation,)] + ([alike] if len(alike) > 1 else [])


def _size(row: int, faulty: int, sign: float, one: float, moved: Moved, sight: Sight) -> float:
    """Return from which size on a change shows in a test, inf where it never does."""
    generator = sight.piece.bank.generators[row]
    if generator.node not in moved:
        return np.inf
    equation = sight.piece.bank.system.equations[generator.residual]
    if equation.kind is Kind.LIMIT:
        return _to_limit(
            row, sign * one if generator.residual == faulty else None, one, moved, sight
        )
    return _to_threshold(row, one, moved, sight)


def _to_threshold(row: int, one: float, moved: Moved, sight: Sight) -> float:
    """Return what brings a difference of two sides beyond the lower of its thresholds."""
    alarms, bank = sight.alarms, sight.piece.bank
    node = bank.generators[row].node
    equation = bank.system.equations[bank.generators[row].residual]
    move = moved[node] - sight.piece.nodes[node].column
    off = alarms.residuals.values[row] - alarms.centre[row]
    if equation.circular:
        move, off = wrap(move), wrap(off)
    if equation.side:  # a residual is right minus left: below zero where the left side is above
        away = -1.0 if equation.side == "above" else 1.0
        move, off = np.maximum(away * move, 0.0), away * off
    # one sample counts with its noise, a mean without it
    ways = (-off,) if equation.side else (-off, off)
    spare, steady = (
        max(_left(way[which], share) for way in ways for which in (sight.first, sight.span))
        for share in (MOSTLY, 0.5)
    )
    count = max(1, round(alarms.use.mean_s * alarms.residuals.signals.rate_hz))
    floor = _of_a_constant(row, sight)
    single = np.maximum(alarms.threshold[row, sight.span], floor)
    mean = alarms.mean_threshold[row, sight.span] + alarms.allowed[row, sight.span]
    mean = np.maximum(mean, floor)
    moved_mean = np.abs(trailing_mean(move[None], count, 1)[0])
    return one * min(
        _mostly(_ratio(single + spare, np.abs(move))),
        _mostly(_ratio(mean + steady, moved_mean)),
    )


def _of_a_constant(row: int, sight: Sight) -> Floats:
    """Return the size, (n,), from which on a change is not taken for the test's own constant.

    That of a fault which fills most of the flight's beginning would be, if it were smaller.
    """
    residuals = sight.alarms.residuals
    if not (np.nan_to_num(residuals.allowance[row]) > 0).any():
        return np.zeros(sight.span.size)
    spread = residuals.spread[row, sight.span]
    tolerance = np.maximum(residuals.lasting[row, sight.span], sight.alarms.stray[row])
    return np.asarray(tolerance + sight.alarms.use.sigmas * spread)


def _left(spare: Floats, share: float) -> float:
    """Return how much is left at the most for a share of the time, not negative; inf unknown."""
    known = spare[np.isfinite(spare)]
    return max(float(np.quantile(known, share)), 0.0) if len(known) else np.inf


def _to_limit(row: int, own: float | None, one: float, moved: Moved, sight: Sight) -> float:
    """Return what brings a quantity beyond a limit: all that is left to it in the beginning."""
    bank = sight.piece.bank
    equation = bank.system.equations[bank.generators[row].residual]
    alarms = sight.alarms
    tolerance = max(alarms.residuals.tolerance[row], alarms.stray[row])
    assert isinstance(equation.left, Apply)
    parts = [
        lambda values, part=part: -evaluate(part, values)
        for part in equation.left.arguments
        if not isinstance(part, Number)
    ]
    found = np.inf
    for spare in parts:
        before = _value(spare, row, {}, sight.piece)
        gain = before - _value(spare, row, moved, sight.piece) if own is None else own
        left = max(_left(_value(spare, row, {}, sight.calm), MOSTLY), _left(before, MOSTLY))
        left += sight.alarms.use.sigmas * _noise(spare, row, sight)
        ratio = _ratio(np.full(before.shape, left + tolerance), np.broadcast_to(gain, before.shape))
        found = min(found, one * _mostly(ratio))
    return found


def _noise(spare: Spare, row: int, sight: Sight) -> float:
    """Return the standard deviation of what is left to a limit, by the channels' accuracies."""
    piece = sight.piece
    before, squares = _value(spare, row, {}, piece), [0.0]
    for number in piece.bank.generators[row].equations:
        shown = piece.bank.system.equations[number].measurement
        if shown is not None and shown.accuracy:
            moved = reached(piece, {number: np.full(len(piece.t), shown.accuracy)})
            off = before - _value(spare, row, moved, piece)
            squares.append(
                float(np.median(off[np.isfinite(off)] ** 2)) if np.isfinite(off).any() else 0.0
            )
    return float(np.sqrt(sum(squares)))


def _value(of: Spare, row: int, moved: Moved, piece: Stretch) -> Floats:
    node = piece.bank.nodes[piece.bank.generators[row].node]
    columns = {name: moved.get(i, piece.nodes[i].column) for name, i in node.arguments}
    return np.broadcast_to(of({**piece.context.constants, **columns}), piece.t.shape)


def _ratio(left: Floats, gain: Floats) -> Floats:
    """Return by how many times a gain closes what is left, inf where it does not, NaN unknown."""
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        found: Floats = np.where(gain > 0, left / gain, np.inf)
    return np.where(np.isnan(left) | np.isnan(gain), np.nan, found)


def _mostly(sizes: Floats) -> float:
    """Return what is enough for most of the time that is known, inf where nothing is."""
    known = sizes[~np.isnan(sizes)]
    return float(np.quantile(known, MOSTLY, method="higher")) if len(known) else np.inf
