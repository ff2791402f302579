"""What speaks for an accusation, for a person to check? Tests, curves, equations, quiet tests.

In: an analysis and a finding, or the bad end of a flight that nobody is accused for. Out: a `Case`:
the tests that tell most, each with what is stated against what was found, its residual beside the
thresholds that were used (of a sample and of a long mean apart), and the recorded channels that
move it most, the accused component's first, beside what the rest of the test predicts for them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED, UNKNOWN
from fdi.diagnosis import Ending, Finding, Size, runs
from fdi.diagnosis.concerns import Concerns, concerns
from fdi.diagnosis.ending import BEFORE_S, went_wrong
from fdi.diagnosis.explain import size_in_words
from fdi.diagnosis.plain import alarm_words, channel_words
from fdi.model.naming import component_words, inside
from fdi.model.parts import Kind
from fdi.model.system import System, SystemEquation
from fdi.report.page.overview import curve_of
from fdi.report.page.panel import Curve, Panel
from fdi.report.page.sides import Parts, Side, residual_of, sides
from fdi.residuals.respond import Stretch, stretch
from fdi.result import Analysis
from fdi.telemetry import Channel
from fdi.units import customary

MOST_TESTS: Final = 3
MOST_CHANNELS: Final = 3
"""Of a case, beside the curves of its tests."""
MOST_QUIET: Final = 2
"""Quiet tests that are told of each other component."""
BEFORE: Final = 15.0
AFTER: Final = 5.0
"""s around the onset that are shown at first."""
SOON: Final = 10.0
SIBLING_COLOURS: Final = (2, 3, 4, 6, 5)
"""Of the page's curves; the first two are of what is recorded and predicted."""
LONGEST_LABEL: Final = 48
LEAST: Final = 2
"""Samples beyond a threshold; one alone is noise."""
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Equation:
    """An equation of a test: its name, in symbols, in words."""

    name: str
    symbols: str
    words: str


@dataclass(frozen=True, slots=True)
class Quiet:
    """A test that held another component and stayed quiet, up to ``peak`` of its threshold."""

    component: str
    test: str
    words: str
    peak: float


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """A test of a case, with its panels."""

    id: str
    says: str
    statement: str
    equations: tuple[Equation, ...]
    symbols: tuple[tuple[str, str], ...]
    panels: tuple[Panel, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What speaks for an accusation.

    ``window``: s, what is shown at first. ``others``: the other components that the tests hold.
    ``sized``: channels with the fault that was fitted to them.
    """

    at: float
    window: tuple[float, float]
    tests: tuple[Told, ...]
    quiet: tuple[Quiet, ...]
    others: tuple[str, ...]
    sized: tuple[Panel, ...] = ()

    def panels(self) -> Iterator[Panel]:
        """Yield every panel of the case."""
        yield from self.sized
        for test in self.tests:
            yield from test.panels


class Court:
    """Makes the cases of one analysis; what they share is computed once."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._alarms: Alarms = analysis.alarms
        self._system: System = analysis.system
        self._whom: Concerns = concerns(analysis.bank)
        self._piece: Stretch = stretch(analysis.residual_values, slice(0, None))
        self._parts = Parts(analysis.alarms, self._piece)

    def of_finding(self, finding: Finding) -> Case | None:
        """Return the case of a finding, None where it names no test of the bank."""
        place = {g.id: row for row, g in enumerate(self._analysis.bank.generators)}
        named = [place[name] for name in finding.evidence.residuals if name in place]
        telling = place.get(finding.evidence.telling)
        rows = sorted(named, key=lambda row: (row != telling, -self._peak(row, finding.onset), row))
        if not rows:
            return None
        onset, alarm = finding.onset, finding.alarm
        # of what takes long to be certain the alarm is shown as well
        until = (onset if alarm < onset + AFTER else alarm) + AFTER
        case = self._case(rows, finding.component, onset, until)
        size = finding.size
        return case if size is None else replace(case, sized=tuple(self._sized(size, case.window)))

    def of_ending(self, ending: Ending) -> Case:
        """Return what was first where a flight went wrong, whatever tests say of it."""
        moment = went_wrong(ending.end)
        t = self._alarms.residuals.t
        near = (t >= moment - BEFORE_S) & (t <= moment)
        beyond = (self._alarms.state == TRIGGERED) & near
        rows = [int(row) for row in np.flatnonzero(beyond.sum(axis=1) >= LEAST)]
        rows.sort(key=lambda row: (int(np.argmax(beyond[row])), row))
        return self._case(rows, None, moment, moment + AFTER)

    def _case(self, rows: Sequence[int], component: str | None, at: float, until: float) -> Case:
        low, high = (float(self._alarms.residuals.t[i]) for i in (0, -1))
        window = (max(at - BEFORE, low), min(max(until, low + AFTER), high))
        window = window if window[1] > window[0] else (low, max(high, low + 1.0))
        shown = rows[:MOST_TESTS]
        named: set[int] = set()
        tests = tuple(self._told(row, component, window, named) for row in shown)
        others = dict.fromkeys(
            name for row in shown for name in self._whom.in_order(row) if name != component
        )
        return Case(at, window, tests, self._quiet(tuple(others), at), tuple(others))

    def _peak(self, row: int, onset: float) -> float:
        t = self._alarms.residuals.t
        soon = (t >= onset - 0.5) & (t <= onset + SOON)
        own = self._alarms.strength[row, soon & self._alarms.alarm[row]]
        known = own[np.isfinite(own)]
        return float(known.max()) if len(known) else 0.0

    def _told(
        self, row: int, component: str | None, window: tuple[float, float], named: set[int]
    ) -> Told:
        bank, system = self._analysis.bank, self._system
        generator = bank.generators[row]
        equation = system.equations[generator.residual]
        names = self._whom.in_order(row)
        whom = component if component in names else (names[0] if names else equation.name)
        used = [system.equations[i] for i in generator.equations]
        return Told(
            generator.id,
            alarm_words(whom or equation.name, generator, system),
            equation.text or equation.name,
            tuple(Equation(e.name, e.text or e.name, equation_words(e, system)) for e in used),
            _symbols(used, system),
            (
                *self._statement(row, window),
                *self._residual(row, window),
                *self._channels(row, component, window, named),
            ),
        )

    def _statement(self, row: int, window: tuple[float, float]) -> list[Panel]:
        generator = self._analysis.bank.generators[row]
        equation = self._system.equations[generator.residual]
        unit, scale, offset = customary(equation.unit)
        found = sides(self._piece, generator)
        curves = tuple(
            Curve(
                _side_words(side, place),
                self._piece.t,
                side.value * scale + offset,
                look="bound" if side.is_bound else "line" if place == 0 else "dash",
                colour=-1 if not side.is_bound else 7,
            )
            for place, side in enumerate(found)
        )
        title = f"{generator.id}: {self._about(found)}{equation.text or equation.name}"
        hot = self._hot(row)
        return [Panel(title, _plain(unit), curves, hot, window)] if curves else []

    def _about(self, found: Sequence[Side]) -> str:
        """Return what a statement is about, before its symbols."""
        first = next((one.label for one in found if not one.is_bound), "")
        known = first in self._system.variables
        return f"{_described(first, self._system)}; stated: " if known else "what is stated, "

    def _residual(self, row: int, window: tuple[float, float]) -> list[Panel]:
        alarms, t = self._alarms, self._alarms.residuals.t
        generator = self._analysis.bank.generators[row]
        equation = self._system.equations[generator.residual]
        unit, scale, _ = customary(equation.unit)
        inside = (t >= window[0]) & (t <= window[1])
        hot = self._hot(row)
        # what violates a statement that has but one side is drawn upwards
        ways = (1,) if equation.way else (1, -1)
        scale *= equation.way or 1

        def panel(title: str, name: str, value: Floats, bound: Floats, unit: str) -> Panel:
            names = ("threshold", "the same below")
            bounds = (
                Curve(told, t, way * bound, look="bound", colour=7)
                for told, way in zip(names, ways, strict=False)
            )
            return Panel(title, unit, (Curve(name, t, value), *bounds), hot, window)

        found = [
            panel(
                f"{generator.id}: residual, sample by sample",
                "beyond the bound" if equation.kind is Kind.LIMIT else "residual",
                residual_of(alarms, row) * scale,
                alarms.threshold[row] * abs(scale),
                _plain(unit),
            )
        ]
        mean, most = alarms.mean[row], alarms.mean_threshold[row]
        with np.errstate(divide="ignore", invalid="ignore"):
            slow = np.abs(mean[inside]) / most[inside]
        if (slow[np.isfinite(slow)] > 1.0).any():
            title = f"{generator.id}: mean of what is beyond its tolerance"
            found.append(panel(title, "mean", mean * scale, most * abs(scale), _plain(unit)))
        scatter = alarms.scatter[row]
        if (np.nan_to_num(scatter[inside]) > alarms.scatter_most).any():
            limit = np.full(len(t), alarms.scatter_most)
            curves = (
                Curve("scatter", t, scatter),
                Curve("threshold", t, limit, look="bound", colour=7),
            )
            title = f"{generator.id}: scatter, times what it was at first"
            found.append(Panel(title, "", curves, hot, window))
        return found

    def _channels(
        self, row: int, component: str | None, window: tuple[float, float], named: set[int]
    ) -> list[Panel]:
        panels = []
        for part in self._parts.of(row, component, window):
            if len(named) >= MOST_CHANNELS or part.equation in named:
                continue
            named.add(part.equation)
            measurement = self._system.equations[part.equation].measurement
            assert measurement is not None
            test = self._analysis.bank.generators[row].id
            if part.recorded is None:  # what is held of it is how long it says the same
                channel = _plain_field(measurement.channel)
                shown = curve_of(self._analysis.log, "recorded", str(channel))
                if shown is not None:
                    title = f"{channel}, recorded, in {test}"
                    known = (*self._siblings(row, part.equation, shown[1]), shown[0])
                    panels.append(Panel(title, shown[1], known, self._hot(row), window))
                continue
            unit, scale, offset = customary(self._system.variables[measurement.variable].unit)
            curves = [Curve("recorded", self._piece.t, part.recorded * scale + offset)]
            if part.predicted is not None:
                told, value = "as all else in the test predicts it", part.predicted * scale + offset
                curves.append(Curve(told, self._piece.t, value, look="dash"))
            curves = [*self._siblings(row, part.equation, _plain(unit)), *curves]
            words = channel_words(measurement, self._system.variables)
            title = f"{measurement.channel} ({words}), in {test}"
            panels.append(Panel(title, _plain(unit), tuple(curves), self._hot(row), window))
        return panels

    def _siblings(self, row: int, number: int, unit: str) -> Iterator[Curve]:
        """Yield what a test holds beside a channel: the same message's that differ by a number.

        Of one motor's output the others say whether it is unlike them. They come first: what is
        drawn later lies above.
        """
        system = self._system
        own = system.equations[number].measurement
        assert own is not None
        numbers = self._analysis.bank.generators[row].equations
        held = (system.equations[i].measurement for i in numbers)
        names = dict.fromkeys(_plain_field(one.channel) for one in held if one is not None)
        family, itself = _unnumbered(own.channel), _plain_field(own.channel)
        alike = [one for one in names if one != itself and _unnumbered(one) == family]
        found = (curve_of(self._analysis.log, one.field, str(one)) for one in alike)
        shown = [curve for curve, label in filter(None, found) if label == unit]
        for place, curve in enumerate(shown):
            yield replace(curve, colour=SIBLING_COLOURS[place % len(SIBLING_COLOURS)])

    def _sized(self, size: Size, window: tuple[float, float]) -> list[Panel]:
        """Return the channels that a fault of a size was fitted to, with and without it."""
        panels = []
        for name in size.channels:
            found = curve_of(self._analysis.log, "recorded", name)
            if found is None:
                continue
            curve, unit = found
            since = np.maximum(curve.t - size.since, 0.0)
            grown = since if size.shape == "drift" else (curve.t >= size.since).astype(float)
            fitted = size.value * customary(size.unit).scale * grown
            told = "less the fault that was fitted"
            curves = (curve, Curve(told, curve.t, curve.value - fitted, look="dash"))
            panels.append(Panel(size_in_words(size), unit, curves, (), window))
        return panels

    def _hot(self, row: int) -> list[list[float]]:
        return runs(self._alarms.residuals.t, self._alarms.alarm[row])

    def _quiet(self, others: Sequence[str], at: float) -> tuple[Quiet, ...]:
        """Return tests that hold one of the others, and were judged and quiet then."""
        alarms, t = self._alarms, self._alarms.residuals.t
        inside = (t >= at - 1.0) & (t <= at + SOON)
        found = []
        for component in others:
            rows = []
            for row in range(len(alarms.state)):
                if component not in self._whom.held_by(row) or not inside.any():
                    continue
                state, strength = alarms.state[row, inside], alarms.strength[row, inside]
                known = strength[np.isfinite(strength)]
                is_quiet = not alarms.alarm[row, inside].any() and not (state == TRIGGERED).any()
                if is_quiet and known.size and (state != UNKNOWN).mean() > 0.5:
                    rows.append((len(self._whom.of(row)), float(known.max()), row))
            for _, peak, row in sorted(rows)[:MOST_QUIET]:
                generator = self._analysis.bank.generators[row]
                equation = self._system.equations[generator.residual]
                found.append(Quiet(component, generator.id, equation.text or equation.name, peak))
        return tuple(found)


def _side_words(side: Side, place: int) -> str:
    """Return what the curve of a side is called: a long formula stands in the title already."""
    if len(side.label) <= LONGEST_LABEL:
        return side.label
    return "the other side" if place else "the first side"


def _plain_field(channel: Channel) -> Channel:
    """Return a channel itself where another says how long it has been the same."""
    return replace(channel, field=channel.field.partition(":")[0])


def _unnumbered(channel: Channel) -> tuple[str, str]:
    """Return what a channel has in common with those of which it is one of several."""
    return channel.source, re.sub(r"\d+", "#", _plain_field(channel).field)


def _plain(unit: str) -> str:
    return "" if unit == "1" else unit


def equation_words(equation: SystemEquation, system: System) -> str:
    """Return what an equation states, in words."""
    measurement = equation.measurement
    if measurement is not None:
        known = measurement.component in system.components
        words = component_words(measurement.component, system.components)
        who = f" of the {inside(words)}" if known and not measurement.trusted else ""
        what = channel_words(measurement, system.variables)
        if measurement.silence:
            return f"how long {measurement.channel.source} has been silent"
        if measurement.stillness:
            return f"how long {measurement.channel.source} has shown the same: {what}"
        trusted = ", taken as it is" if measurement.trusted else ""
        return f"{measurement.channel}{who} shows the {inside(what)}{trusted}"
    about = [_described(name, system) for name in equation.edges]
    said = f": an alarm means that it {equation.says}" if equation.says else ""
    if equation.differential:
        return f"{about[0]} is the rate of change of {about[-1]}{said}"
    names = " and ".join([", ".join(about[:-1]), about[-1]] if len(about) > 1 else about)
    return f"{'ties' if len(about) > 1 else 'bounds'} {names}{said}"


def _described(name: str, system: System) -> str:
    variable = system.variables.get(name)
    told = variable.description if variable is not None else ""
    return inside(told) if told else name.replace("_", " ").strip()


def _symbols(equations: Sequence[SystemEquation], system: System) -> tuple[tuple[str, str], ...]:
    """Return the symbols of equations with what they stand for, and its unit."""
    names = dict.fromkeys(name for equation in equations for name in equation.edges)
    return tuple(
        (name, ", ".join(filter(None, (_described(name, system), _plain(variable.unit)))))
        for name in names
        if (variable := system.variables.get(name)) is not None
    )
