"""Which components do the data speak for, and how small a fault would they have shown?

In: alarms and who is named already. Out: the components that are ruled out, each with the size of a
lasting change from which on its faults would have shown. Ruled out is who

- has a channel: of what shows only in what the vehicle does (a motor, a surface, a controller) the
  tests do not say how small a fault they would show;
- is in no test that raised an alarm, was triggered in the last seconds before an end, or scattered
  more than at first;
- has for each fault that any test holds a test which was known for most of the time in the air and
  of those last seconds, accuses it by itself, compares it with nothing that would follow it, and is
  moved beyond its threshold by a change of a known size (``would_show.py``);
- does not end the log with its failure (``ends_log`` of the model) unless the flight ended with a
  landing.

Where it did not, the size counts for what began early enough to show, which is said.

The trap: a false exoneration does more harm than none. Whatever is in doubt stays open.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import ceil, floor, log10
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED, UNKNOWN
from fdi.diagnosis.concerns import Concerns, concerns
from fdi.diagnosis.values import How, RuledOut, WouldShow
from fdi.diagnosis.would_show import Sight, powered, sight_of, would_show
from fdi.model.evaluate import Floats
from fdi.model.parts import Kind
from fdi.model.system import Fault
from fdi.residuals import Bank
from fdi.telemetry.airtime import reference_mask, time_in_air, when_in_air
from fdi.units import customary, two_digits

Mask = NDArray[np.bool_]
KNOWN_SHARE: Final = 0.8
KNOWN_S: Final = 2.0
"""A test rules out only if it was known for at least this share of the time in the air, and this
long: an alarm needs 1.5 s."""
LAST_S: Final = 5.0
"""What brings a vehicle down may show in the last seconds only: there a test must have been known,
and quiet."""
BLOCK_S: Final = 5.0
"""Scatter is that of stretches so long."""
ROUGHER: Final = 2.0
"""A test that scatters so many times more than in the flight's beginning is not quiet: of 5 s at
2 Hz a standard deviation is known to a quarter, so this is four of its own."""


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
    quiet = quiet_tests(alarms)
    sight = sight_of(alarms, concerns(bank)) if quiet.able.any() else None
    if sight is None:
        return ()
    well, lasts = ended_well(alarms), alarms.use.mean_s
    result = []
    for component in faults_by_component(bank):
        if component in named or (not well and bank.system.components[component].ends_log):
            continue
        found = _cleared(component, sight, quiet)
        if found is not None:
            late = "" if well else f" until {lasts:g} s before the end"
            result.append(replace(found, text=found.text + late) if lasts else found)
    return tuple(sorted(result, key=lambda item: item.component))


class Quiet(NamedTuple):
    """Which tests, (r,) bool each, can speak for what they hold, and which speak against it.

    ``able``: known ``long`` enough, and to the end. ``against``: raised an alarm, was triggered in
    the last seconds, or is ``rougher``: scatters more than at first.
    """

    able: Mask
    against: Mask
    long: Mask
    rougher: Mask


def quiet_tests(alarms: Alarms) -> Quiet:
    """Return which tests can speak for what they hold, and which speak against it."""
    signals = alarms.residuals.signals
    flying = when_in_air(signals)
    against: Mask = np.array(alarms.alarm.any(axis=1), bool)
    if not flying.any():
        nothing = np.zeros(len(alarms.state), bool)
        return Quiet(nothing, against, nothing, nothing)
    known = alarms.state != UNKNOWN
    least = max(KNOWN_SHARE * flying.sum(), KNOWN_S * signals.rate_hz)
    long = np.asarray(known[:, flying].sum(axis=1) >= least)
    able = long & ~alarms.unfit
    for start, end in time_in_air(signals):
        last = flying & (signals.t >= max(start, end - LAST_S)) & (signals.t < end)
        if last.any():
            able &= known[:, last].mean(axis=1) >= KNOWN_SHARE
            against |= (alarms.state[:, last] == TRIGGERED).any(axis=1)
    rougher = _rougher(alarms, flying)
    return Quiet(able, against | rougher, long, rougher)


def _rougher(alarms: Alarms, flying: Mask) -> Mask:
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


def unpowered(component: str, bank: Bank, whom: Concerns) -> bool:
    """Return whether a fault of a component has no test at all whose silence could clear it."""
    own = said_faults(component, bank, whom)
    able = powered(component, bank, whom)
    return not own or any(not bank.incidence[able, column].any() for column, _ in own)


def said_faults(component: str, bank: Bank, whom: Concerns) -> list[tuple[int, Fault]]:
    """Return the faults of a component that a test holds which is more than a support.

    Empty where none of them is a channel's.
    """
    equations = bank.system.equations
    left = [equations[generator.residual] for generator in bank.generators]
    # that the autopilot goes on using a sensor, and the like, says little for it either way
    says = ~np.array([e.supports and e.kind in (Kind.LIMIT, Kind.EQUALITY) for e in left], bool)
    own = faults_by_component(bank).get(component, [])
    found = [(column, fault) for column, fault in own if bank.incidence[says, column].any()]
    shown = any(equations[fault.equation].measurement for _, fault in found)
    return found if shown else []


def _measures_nothing(fault: Fault, sight: Sight) -> bool:
    """Return whether the channel of a fault reads 0 all along: what is not measured stays quiet.

    Of a count or a state 0 is a reading.
    """
    system = sight.piece.bank.system
    shown = system.equations[fault.equation].measurement
    if shown is None or system.variables[shown.variable].unit == "1":
        return False
    read = sight.alarms.residuals.signals.columns.get(shown.channel)
    return read is not None and bool(np.isfinite(read).any()) and not np.nan_to_num(read).any()


def _cleared(component: str, sight: Sight, quiet: Quiet) -> RuledOut | None:
    """Return the component with the sizes that would have shown, or None where that is open."""
    bank, whom = sight.piece.bank, sight.whom
    own = said_faults(component, bank, whom)
    says = [component in whom.held_by(row) for row in range(len(bank.generators))]
    concerned = np.asarray(says) | bank.incidence[:, [column for column, _ in own]].any(axis=1)
    if unpowered(component, bank, whom) or (concerned & quiet.against).any():
        return None
    can = quiet.able & powered(component, bank, whom)
    sizes: list[WouldShow] = []
    rows: dict[int, None] = {}
    if any(_measures_nothing(fault, sight) for _, fault in own):
        return None
    for column, fault in own:
        holding = np.flatnonzero(bank.incidence[:, column] & can)
        found = would_show(fault, holding, sight) if len(holding) else None
        if found is None:
            return None
        rows |= dict.fromkeys(sorted(found[0]))
        sizes += found[1]
    tests = tuple(bank.generators[row].id for row in rows)
    return RuledOut(component, size_words(sizes), tests, tuple(sizes))


def size_words(sizes: Sequence[WouldShow]) -> str:
    """Return how large the faults are that would have shown: the largest of each unit and kind.

    Examples
    --------
    >>> size_words([WouldShow("b", 3, "s", "frozen")])
    'a frozen reading for more than 3 s would have shown'
    >>> size_words([WouldShow("a", 0.5, "V", "rises"), WouldShow("a", 0.7, "V", "falls")])
    'a lasting rise of more than 0.5 V or fall of more than 0.7 V would have shown'
    >>> size_words([WouldShow("c", 12, "dB", "rises")])
    'a lasting rise of more than 12 dB in its level would have shown'
    """
    ways: dict[str, dict[How, WouldShow]] = {}
    for one in sizes:
        ways.setdefault(one.fault, {})[one.how] = one
    kinds: dict[tuple[str, tuple[How, ...]], dict[How, float]] = {}
    for each in ways.values():
        for how, one in each.items():
            most = kinds.setdefault((one.unit, tuple(each)), {})
            most[how] = max(most.get(how, 0.0), one.size)
    told = [_words(most, unit) for (unit, _), most in kinds.items()]
    return f"{', '.join(told[:-1])}{' and ' if told[1:] else ''}{told[-1]} would have shown"


def _words(most: Mapping[How, float], unit: str) -> str:
    label, scale, _ = customary(unit)
    sized = {
        how: f"{_at_least(size * scale)} {'' if label == '1' else label}".strip()
        for how, size in most.items()
    }
    if "frozen" in sized:
        return f"a frozen reading for more than {sized['frozen']}"
    if "silent" in sized:
        return f"silence for more than {sized['silent']}"
    if "changes" in sized:
        return f"a lasting change of more than {sized['changes']} in either direction"
    named = {"rises": "rise", "falls": "fall"}
    told = [f"{named[how]} of more than {size}" for how, size in sized.items()]
    # of a level, and not of what it is the logarithm of
    return f"a lasting {' or '.join(told)}{' in its level' if label == 'dB' else ''}"


def _at_least(size: float) -> str:
    """Return a size in two digits, upwards: what is less would not have shown for certain.

    Examples
    --------
    >>> _at_least(0.5151), _at_least(21.2), _at_least(0.5)
    ('0.52', '22', '0.5')
    """
    unit = 10.0 ** (min(floor(log10(size)), 1) - 1)
    return two_digits(ceil(round(size / unit, 6)) * unit)
