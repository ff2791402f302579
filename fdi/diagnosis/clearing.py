"""Which components do the data speak for, and how small a fault would they have shown?

In: alarms and who is named already. Out: the components that are ruled out, each with the size of a
lasting change from which on its faults would have shown. Ruled out is who

- has a channel: of what shows only in what the vehicle does (a motor, a surface, a controller) the
  tests do not say how small a fault they would show;
- is in no test that raised an alarm, was triggered in the last seconds before an end, or scattered
  more than at first;
- has for each fault that any test holds a test which was known for most of the time in the air and
  of those last seconds, and is moved beyond its threshold by a change of a known size;
- does not end the log with its failure (``ends_log`` of the model) unless the flight ended with a
  landing.

Where it did not, the size counts for what began early enough to show, which is said.

The trap: a false exoneration does more harm than none. Whatever is in doubt stays open.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED, UNKNOWN
from fdi.diagnosis.values import RuledOut, WouldShow
from fdi.model.evaluate import Floats, evaluate, wrap
from fdi.model.expression import Apply, Expression, Number
from fdi.model.parts import Kind
from fdi.model.system import Fault
from fdi.residuals import Bank
from fdi.residuals.respond import Stretch, reached, stretch
from fdi.telemetry.airtime import reference_mask, time_in_air, when_in_air
from fdi.units import customary, two_digits

KNOWN_SHARE: Final = 0.8
KNOWN_S: Final = 2.0
"""A test rules out only if it was known for at least this share of the time in the air, and this
long: an alarm needs 1.5 s."""
LAST_S: Final = 5.0
"""What brings a vehicle down may show in the last seconds only: there a test must have been known,
and quiet."""
LOOKED_AT_S: Final = 60.0
"""The last so much of the time in the air tells what a fault would do to the tests."""
BLOCK_S: Final = 5.0
"""Scatter is that of stretches so long."""
ROUGHER: Final = 2.0
"""A test that scatters so many times more than in the flight's beginning is not quiet: of 5 s at
2 Hz a standard deviation is known to a quarter, so this is four of its own."""
MOST_SIGMAS: Final = 100.0
"""A change of more stated standard deviations is no size worth printing."""
MOST_ANGLE: Final = np.pi / 4
"""A direction that is further off brings a vehicle down: who would not show it has no power."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """What tells how small a fault a test shows: a stretch of the flight and the thresholds."""

    piece: Stretch
    bound: Floats
    able: NDArray[np.bool_]
    against: NDArray[np.bool_]


def ruled_out(alarms: Alarms, bank: Bank, named: Collection[str]) -> tuple[RuledOut, ...]:
    """Return the components that the data speak for.

    Parameters
    ----------
    alarms : Alarms
    bank : Bank
        The bank that the alarms come from.
    named : collection of str
        Components that are accused, marked, or of which a relation fell away.
    """
    able, against = quiet_tests(alarms)
    if not able.any():
        return ()
    place = np.flatnonzero(when_in_air(alarms.residuals.signals))
    length = round(LOOKED_AT_S * alarms.residuals.signals.rate_hz)
    span = slice(max(int(place[0]), int(place[-1]) + 1 - length), int(place[-1]) + 1)
    sight = _Sight(stretch(alarms.residuals, span), _bounds(alarms, span), able, against)
    well, lasts = ended_well(alarms), alarms.use.mean_s
    result = []
    for component, faults in faults_by_component(bank).items():
        if component in named or (not well and bank.system.components[component].ends_log):
            continue
        found = _cleared(component, faults, sight)
        if found is not None:
            late = "" if well else f" until {lasts:g} s before the end"
            result.append(replace(found, text=found.text + late) if lasts else found)
    return tuple(sorted(result, key=lambda item: item.component))


def quiet_tests(alarms: Alarms) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the tests, (r,) bool, that can speak for what they hold, and those that speak against.

    The first were known long enough and to the end; the second raised an alarm, were triggered in
    the last seconds, or scatter more than at first.
    """
    signals = alarms.residuals.signals
    flying = when_in_air(signals)
    against: NDArray[np.bool_] = np.array(alarms.alarm.any(axis=1), bool)
    if not flying.any():
        return np.zeros(len(alarms.state), bool), against
    known = alarms.state != UNKNOWN
    least = max(KNOWN_SHARE * flying.sum(), KNOWN_S * signals.rate_hz)
    able = (known[:, flying].sum(axis=1) >= least) & ~alarms.unfit
    for start, end in time_in_air(signals):
        last = flying & (signals.t >= max(start, end - LAST_S)) & (signals.t < end)
        if last.any():
            able &= known[:, last].mean(axis=1) >= KNOWN_SHARE
            against |= (alarms.state[:, last] == TRIGGERED).any(axis=1)
    against |= _rougher(alarms, flying)
    return able, against


def _rougher(alarms: Alarms, flying: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the tests, (r,) bool, that scatter more later than in the flight's beginning."""
    residuals = alarms.residuals
    signals = residuals.signals
    block = max(4, round(BLOCK_S * signals.rate_hz))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(residuals.spread > 0, residuals.values / residuals.spread, np.nan)
    first = reference_mask(signals, 4 * BLOCK_S)
    early, later = (_scatter(ratio[:, mask], block) for mask in (first, flying))
    with np.errstate(invalid="ignore"):
        return np.asarray(later > ROUGHER * early)


def _scatter(ratio: Floats, block: int) -> Floats:
    """Return the standard deviation that one in ten blocks of each row exceeds, NaN without one."""
    count = ratio.shape[1] // block
    if not count:
        return np.full(len(ratio), np.nan)
    blocks = ratio[:, : count * block].reshape(len(ratio), count, block)
    deviation = blocks.std(axis=2)  # NaN where a sample of the block is unknown
    found = np.full(len(ratio), np.nan)
    for row, own in enumerate(deviation):
        known = own[np.isfinite(own)]
        if len(known):
            found[row] = np.quantile(known, 0.9)
    return found


def _bounds(alarms: Alarms, span: slice) -> Floats:
    """Return what a lasting change must reach to be seen by each test, (r,), NaN unknown."""
    sample = alarms.threshold[:, span]
    mean = (
        alarms.mean_threshold[:, span] + alarms.residuals.lasting[:, span]
    )  # of what is beyond it
    found = np.full(len(sample), np.nan)
    for row in range(len(sample)):
        tops = [
            float(np.quantile(own[np.isfinite(own)], 0.9))
            for own in (sample[row], mean[row])
            if np.isfinite(own).any()
        ]
        found[row] = min(tops, default=np.nan)
    return found


def ended_well(alarms: Alarms) -> bool:
    """Return whether the last flight ended on the ground, and softly."""
    ends, flights = alarms.residuals.signals.ends, alarms.residuals.signals.flights
    if not ends or ends[-1].how not in ("landed", "failsafe", "on_ground"):
        return False
    return not flights[-1].flew or flights[-1].landing is not None


def faults_by_component(bank: Bank) -> Mapping[str, list[tuple[int, Fault]]]:
    """Return the faults of every component with their columns in the incidence."""
    found: dict[str, list[tuple[int, Fault]]] = {}
    for column, fault in enumerate(bank.system.faults):
        found.setdefault(fault.component, []).append((column, fault))
    return found


def _cleared(component: str, faults: list[tuple[int, Fault]], sight: _Sight) -> RuledOut | None:
    """Return the component with the sizes that would have shown, or None where that is open."""
    bank = sight.piece.bank
    equations = bank.system.equations
    left = [equations[generator.residual] for generator in bank.generators]
    # that the autopilot goes on using a sensor, and the like, says little for it either way
    says = ~np.array([e.supports and e.kind in (Kind.LIMIT, Kind.EQUALITY) for e in left], bool)
    testable = [(c, fault) for c, fault in faults if bank.incidence[says, c].any()]
    if not any(equations[fault.equation].measurement for _, fault in testable):
        return None
    if bank.incidence[:, [column for column, _ in testable]][sight.against].any():
        return None
    sizes, rows = [], []
    for column, fault in testable:
        own = np.flatnonzero(bank.incidence[:, column] & sight.able)
        found = _would_show(fault, own, sight) if len(own) else None
        if found is None:
            return None
        row, size, unit = found
        sizes.append(WouldShow(fault.name, size, unit))
        rows.append(row)
    tests = tuple(bank.generators[row].id for row in dict.fromkeys(rows))
    return RuledOut(component, _text(sizes), tests, tuple(sizes)) if sizes else None


def _text(sizes: Sequence[WouldShow]) -> str:
    """Return how large the faults are that would have shown: the largest of each unit."""
    largest: dict[str, float] = {}
    for one in sizes:
        label, scale, _ = customary(one.unit)
        largest[label] = max(largest.get(label, 0.0), one.size * scale)
    still = largest.pop("s", None)
    told = [
        f"{two_digits(size)} {'' if label == '1' else label}".strip()
        for label, size in largest.items()
    ]
    told = [f"a lasting change of {' or of '.join(told)}"] if told else []
    if still is not None:
        told.append(f"standing still for {two_digits(still)} s")
    return f"{' and '.join(told)} would have shown"


def _would_show(
    fault: Fault, rows: NDArray[np.intp], sight: _Sight
) -> tuple[int, float, str] | None:
    """Return which test shows the smallest lasting change of a fault, its size and unit."""
    piece = sight.piece
    equation = piece.bank.system.equations[fault.equation]
    measured = equation.measurement
    unit, one = equation.unit, 1.0
    if measured is not None:
        unit = piece.bank.system.variables[measured.variable].unit
        one = measured.accuracy or 1.0
    moved = reached(piece, {fault.equation: np.full(len(piece.t), one)})
    shares = {int(row): _share(int(row), fault.equation, one, moved, sight) for row in rows}
    row = max(shares, key=lambda row: shares[row])
    most = MOST_SIGMAS * one if measured is not None else MOST_ANGLE if unit == "rad" else np.inf
    if not shares[row] > 0 or one / shares[row] > most:
        return None
    return row, one / shares[row], unit


def _share(row: int, faulty: int, one: float, moved: Mapping[int, Floats], sight: _Sight) -> float:
    """Return what share of the way to its threshold a change moves a test, 0 where it is blind."""
    piece = sight.piece
    generator = piece.bank.generators[row]
    equation = piece.bank.system.equations[generator.residual]
    if generator.node not in moved:
        return 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        if equation.kind is Kind.LIMIT:
            before = _spare(equation.left, row, {}, sight)
            after = before - one
            if generator.residual != faulty:
                after = _spare(equation.left, row, moved, sight)
            share = np.abs(after - before) / np.where(before > 0, before, np.nan)
        else:
            change = moved[generator.node] - piece.nodes[generator.node].column
            size = np.abs(wrap(change) if equation.circular else change)
            share = size / sight.bound[row]
    known = share[np.isfinite(share)]
    return float(np.median(known)) if len(known) else 0.0


def _spare(left: Expression, row: int, moved: Mapping[int, Floats], sight: _Sight) -> Floats:
    """Return how much is left to a limit, (n,), with some nodes moved: the limit is max(.., 0)."""
    assert isinstance(left, Apply)
    piece = sight.piece
    node = piece.bank.nodes[piece.bank.generators[row].node]
    columns = {
        name: moved.get(number, piece.nodes[number].column) for name, number in node.arguments
    }
    values = {**piece.context.constants, **columns}
    beyond = [evaluate(part, values) for part in left.arguments if not isinstance(part, Number)]
    spare: Floats = -np.max(np.broadcast_arrays(*beyond), axis=0)
    return spare
