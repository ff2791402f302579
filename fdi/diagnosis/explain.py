"""What is said about a finding, in words that a person can check against a plot?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.diagnosis.alarm_runs import Run
from fdi.diagnosis.features import SIMULTANEOUS_S
from fdi.diagnosis.naming import Cause
from fdi.diagnosis.plain import the_part
from fdi.diagnosis.values import Evidence, Size
from fdi.model.evaluate import evaluate, wrap
from fdi.model.expression import Apply, Number, Symbol, symbols, to_text
from fdi.model.parts import Kind, without_over
from fdi.model.system import SystemEquation
from fdi.residuals import Bank, Generator
from fdi.residuals.amount import amounts
from fdi.units import customary

MOST_NAMED: Final = 4
"""Channels in a sentence; the finding names all."""
MOSTLY: Final = 0.5
"""Of an alarm an amount must be known to be told."""


def evidence(cause: Cause, alarms: Alarms) -> Evidence:
    """Return the evidence for a cause: the strongest early alarm in words, and all residuals."""
    bank = alarms.residuals.bank
    onset = cause.runs[0].onset
    first = [run for run in cause.runs if run.onset <= onset + SIMULTANEOUS_S]
    telling = max(
        first,
        key=lambda run: (
            _reads(cause.component, bank, bank.generators[run.row]),
            len(bank.generators[run.row].faults) == 1,
            run.peak,
        ),
    )
    rows = list(dict.fromkeys(run.row for run in cause.runs))
    channels = dict.fromkeys(str(c) for row in rows for c in bank.channels(bank.generators[row]))
    more = len(rows) - 1
    tail = f"; {more} more test{'s' if more > 1 else ''} agree{'s' if more == 1 else ''}"
    said = sentence(telling, alarms, cause.component)
    return Evidence(
        _of_another(cause.component, telling, bank) + said + (tail if more else ""),
        tuple(bank.generators[row].id for row in rows),
        tuple(channels),
        bank.generators[telling.row].id,
    )


def _of_another(component: str, run: Run, bank: Bank) -> str:
    """Return whom an alarm is a statement of, where that is not the component it speaks against."""
    system = bank.system
    left = system.equations[bank.generators[run.row].residual]
    if left.component in (None, component) or component not in left.suspects:
        return ""
    owner, suspect = (the_part(str(one), system.components) for one in (left.component, component))
    return f"a statement of {owner}, behind which {suspect} may be: "


def _reads(component: str, bank: Bank, generator: Generator) -> bool:
    """Return whether a generator reads a channel of a component."""
    read = (bank.system.equations[number].measurement for number in generator.equations)
    return any(m is not None and not m.trusted and m.component == component for m in read)


def sentence(run: Run, alarms: Alarms, component: str = "") -> str:
    """Return one alarm as a sentence with its numbers; a component's channels are named first."""
    residuals = alarms.residuals
    bank = residuals.bank
    generator = bank.generators[run.row]
    equation = bank.system.equations[generator.residual]
    times = scattered(run, alarms)
    size, threshold, lasting = judged(run, alarms)
    worst = int(np.nanargmax(np.where(np.isfinite(size), size, -np.inf)))
    label, scale, zero = customary(equation.unit)
    label = "" if label == "1" else label
    amount = f"{_figure(size[worst] * scale)} {label}".strip()
    bound = f"{_figure(threshold[worst] * scale)} {label}".strip()
    when = f"from {run.onset:.1f} s for {run.end - run.onset:.1f} s"
    sensors, inputs = _sources(bank, generator, component)
    names = listed(sensors) or listed(inputs) or equation.name
    if equation.kind is Kind.LIMIT:
        allowed = _allowed(equation, bank)
        if allowed is None:
            what = equation.name.replace("_", " ")
            return f"{what}: {statement(equation)} is violated by up to {amount} {when} ({names})"
        variable, least, most = allowed

        def shown(value: float) -> str:
            return f"{_figure(value * scale + zero)} {label}".rstrip()

        if least is not None and most is not None:
            reached = f"up to {amount} beyond the {shown(least)} to {shown(most)} that are allowed"
        elif most is not None:
            reached = f"{shown(most + size[worst])} where at most {shown(most)} is allowed"
        else:
            assert least is not None
            reached = f"{shown(least - size[worst])} where at least {shown(least)} is allowed"
        described = bank.system.variables[variable].description
        return f"{described or variable.replace('_', ' ')}: {reached}, {when} ({names})"
    told = _amounts(run, alarms)
    if told and times is None:
        return f"{', '.join(told)}, {when} ({names})"
    against = f" against {listed(inputs)}" if sensors and inputs else ""
    if times is not None:
        return (
            f"{names}{against} scatter{'s' if len(sensors or inputs) == 1 else ''} up to "
            f"{times:.2g} times as much as at first {when}, {alarms.scatter_most:g} times is "
            "within health"
        )
    off = f"by up to {amount}{lasting} {when}, {bound} is within health"
    about = _about(equation, bank, by_sensors=bool(sensors))
    if about:
        return f"{about}: off {off} ({names}{against})"
    several = len(sensors or inputs) > 1
    agree = f"{'do' if several else 'does'} not agree: off" if several or against else "is off"
    return f"{names}{against} {agree} {off}"


def _figure(value: float) -> str:
    """Return a number with three digits, and without an exponent where a person reads it.

    >>> _figure(0.12345), _figure(1374.2)
    ('0.123', '1370')
    """
    return f"{float(f'{value:.3g}'):g}"


def listed(names: Sequence[str]) -> str:
    """Return names as a person lists them; of many the first, and how many more.

    Examples
    --------
    >>> listed(["A.x"]), listed(["A.x", "B.y"])
    ('A.x', 'A.x and B.y')
    >>> listed([f"A.x{i}" for i in range(7)])
    'A.x0, A.x1, A.x2 and 4 more channels'
    """
    shown = list(names) if len(names) <= MOST_NAMED else list(names[: MOST_NAMED - 1])
    more = len(names) - len(shown)
    parts = [*shown, f"{more} more channels"] if more else shown
    return " and ".join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


def _amounts(run: Run, alarms: Alarms) -> list[str]:
    """Return what the model lets a person check of an alarm: medians over it, with one sigma."""
    residuals = alarms.residuals
    span, found = slice(run.first, run.last), list[str]()
    for told in amounts(residuals, residuals.bank.generators[run.row]):
        known = np.isfinite(told.value[span])
        if known.mean() >= MOSTLY and run.end - run.onset >= told.least:
            label, scale, _ = ("%", 100.0, 0.0) if told.unit in ("", "1") else customary(told.unit)
            middle = scale * float(np.median(told.value[span][known]))
            sigma = scale * float(np.median(told.sigma[span][known]))
            value, sure = rounded(middle, sigma)
            found.append(told.words.replace("#", f"{value} +- {sure} {label}"))
    return found


def size_in_words(size: Size) -> str:
    """Return by how much a sensor is wrong, as a sentence with its uncertainty.

    Examples
    --------
    >>> size_in_words(Size(("GPS.vel",), (), "bias", -3.14, 0.42, "m/s", 12.0))
    'GPS.vel reads 3.1 +- 0.4 m/s too low from 12.0 s on'
    >>> size_in_words(Size(("A.p", "B.p"), (), "drift", 50.0, 4.0, "Pa", 12.0))
    'A.p and B.p read ever higher from 12.0 s on, by 0.50 +- 0.04 hPa a second'
    """
    label, scale, _ = customary(size.unit)
    aside = ""
    if size.shown is not None:
        shown_label, shown_scale, _ = customary(size.shown_unit)
        # a place on the ground is told in metres
        if size.unit == "rad" and size.shown_unit == "m":
            label, scale = shown_label, size.shown / abs(size.value)
        else:
            aside = f" ({size.shown * shown_scale:.2g} {shown_label})"
    value, sigma = rounded(abs(size.value) * scale, size.sigma * scale)
    amount = f"{value} +- {sigma} {label}{aside}"
    names = " and ".join(size.channels)
    verb = "reads" if len(size.channels) == 1 else "read"
    more = "higher" if size.value > 0 else "lower"
    than = f" than {' and '.join(size.against)}" if size.against else ""
    when = f"from {size.since:.1f} s on"
    if size.shape == "drift":
        return f"{names} {verb} ever {more}{than} {when}, by {amount} a second"
    side = f"{more}{than}" if size.against else f"too {'high' if size.value > 0 else 'low'}"
    return f"{names} {verb} {amount} {side} {when}"


def rounded(value: float, sigma: float) -> tuple[str, str]:
    """Return a value and its uncertainty with the digits that the uncertainty leaves.

    Examples
    --------
    >>> rounded(3.14159, 0.42), rounded(1234.5, 61.0), rounded(0.5, 0.0123)
    (('3.1', '0.4'), ('1234', '61'), ('0.50', '0.01'))
    """
    digits = max(0, -math.floor(math.log10(sigma))) if sigma > 0 else 3
    return f"{value:.{digits}f}", f"{sigma:.{digits}f}"


def judged(
    run: Run, alarms: Alarms
) -> tuple[NDArray[np.float64], NDArray[np.float64], Literal["", " on average"]]:
    """Return what was compared with which threshold over an alarm, and whether it is a mean."""
    residuals = alarms.residuals
    equation = residuals.bank.system.equations[residuals.bank.generators[run.row].residual]
    span = slice(run.first, run.last)
    off = residuals.values[run.row, span] - alarms.centre[run.row]
    off = wrap(off) if equation.circular else off
    # a residual is right minus left: below zero where the left side is above
    size = np.maximum(-off if equation.side == "above" else off, 0) if equation.side else abs(off)
    threshold = alarms.threshold[run.row, span]
    mean, bound = np.abs(alarms.mean[run.row, span]), alarms.mean_threshold[run.row, span]
    with np.errstate(divide="ignore", invalid="ignore"):
        fast, slow = size / threshold, mean / bound
    if np.nanmax(np.append(slow, 0.0)) > max(1.0, np.nanmax(np.append(fast, 0.0))):
        tolerance = alarms.allowed[run.row, span]  # means are of what is beyond it
        return mean + tolerance, bound + tolerance, " on average"
    return size, threshold, ""


def scattered(run: Run, alarms: Alarms) -> float | None:
    """Return how many times as much as at first a test scattered, if that is what raised it."""
    scatter = alarms.scatter[run.row, run.first : run.last]
    top = float(np.nanmax(np.append(scatter, 0.0)))
    share = top / alarms.scatter_most
    size, threshold, _ = judged(run, alarms)
    with np.errstate(divide="ignore", invalid="ignore"):
        others = float(np.nanmax(np.append(size / threshold, 0.0)))
    return top if share > max(1.0, others) else None


def _allowed(equation: SystemEquation, bank: Bank) -> tuple[str, float | None, float | None] | None:
    """Return the variable of a limit and the least and the most of it; None where they vary."""
    match equation.left:
        case Apply("max", (*terms, Number())):
            pairs = [
                one.arguments for one in terms if isinstance(one, Apply) and one.operator == "-"
            ]
        case _:
            return None
    constants = {n: np.asarray(p.value) for n, p in bank.system.parameters.items()}
    bounds: dict[int, float] = {}
    found = None
    for above, below in pairs:
        for side, other, sign in ((above, below, 1), (below, above, -1)):
            is_fixed = constants.keys() >= set(symbols(other))  # else the bound varies in flight
            if is_fixed and isinstance(side, Symbol) and side.name in bank.system.variables:
                found, bounds[sign] = side.name, float(evaluate(other, constants))
    if found is None or len(bounds) < len(pairs):
        return None
    return found, bounds.get(-1), bounds.get(1)


def _about(equation: SystemEquation, bank: Bank, *, by_sensors: bool) -> str:
    """Return in words which quantity an equation states, "" where its channels tell that better.

    They do where a sensor is held against others; not of what should be a number, nor where all
    that is read are inputs, as a field and angles that give a heading.
    """
    match equation.left:
        case Symbol(name) if name in bank.system.variables and equation.measurement is None:
            if not (by_sensors and symbols(equation.right)):
                return bank.system.variables[name].description
    return ""


def _sources(
    bank: Bank, generator: Generator, component: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the channels that bring faults, a component's first, and those that are inputs."""
    found: tuple[dict[str, None], dict[str, None]] = ({}, {})
    held = [bank.system.equations[number].measurement for number in generator.equations]
    for measurement in sorted(held, key=lambda one: one is None or one.component != component):
        if measurement is not None:
            # what a field was over a while is told by the field
            channel = without_over(str(measurement.channel))
            found[measurement.trusted][channel] = None
    return tuple(found[0]), tuple(found[1])


def statement(equation: SystemEquation) -> str:
    """Return an equation as text."""
    return equation.text or f"{to_text(equation.left)} = {to_text(equation.right)}"
