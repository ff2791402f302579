"""What does a terminal say about what a model shows beyond an older one?

In: a gain. Out: parts for a console: what was added and which channel gives it, which tests that
makes, what they detect and tell apart, what is lost, and what is still lacking.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from math import isnan
from typing import TYPE_CHECKING, Final

from fdi.model.parts import Kind
from fdi.model.system import ParameterValue
from fdi.report.model_document import ModelStudy
from fdi.report.model_gain import ModelGain, NamedTest, Pair
from fdi.report.model_text import why_not_told, why_undetectable
from fdi.report.text import heading, text
from fdi.report.words import number, plural, shortened, unit

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

MOST: Final = 20
"""Lines of one section; the rest is counted, and in the JSON."""
NAMES: Final = 8


def gain_summary(gain: ModelGain) -> Iterator[RenderableType]:
    """Yield what a terminal shows of what a model adds to an older one."""
    after = gain.after
    names = [found.airframe.files[-1].name for found in (after, gain.before)]
    yield text(" against ".join(names), "bold")
    source = f"the channels of {after.log_name}" if after.log_name else "every measurement present"
    yield text(f"with {source}")
    added = [_statement(after, name) for name in gain.added]
    yield from _section("Added", added or ["nothing that holds here"])
    changed = [_statement(after, name) for name in gain.changed]
    yield from _section("Changed", changed)
    yield from _section("Removed", [_statement(gain.before, name) for name in gain.removed])
    yield from _section("Added, but to no effect with this telemetry", gain.idle)
    yield from _section("New parameters", [_parameter(*one) for one in gain.parameters.items()])
    yield from _bought(gain)
    yield from _lost(gain)
    yield from _lacking(after)
    for line in after.warnings:
        if line not in gain.before.warnings:
            yield text(f"warning: {line}", "yellow")


def _section(title: str, lines: Sequence[str]) -> Iterator[Text]:
    if not lines:
        return
    yield heading(title)
    yield from (text(f"  {line}") for line in lines[:MOST])
    if len(lines) > MOST:
        yield text(f"  and {len(lines) - MOST} more", "dim")


def _statement(found: ModelStudy, name: str) -> str:
    """Return what an equation states, and what it is unless a relation."""
    equation = next(one for one in found.system.equations if one.name == name)
    if equation.measurement:
        return f"{equation.text} ({equation.kind.value})"
    own = f"{name}: {equation.text}"
    return own if equation.kind is Kind.RELATION else f"{own} ({equation.kind.value})"


def _parameter(name: str, value: ParameterValue) -> str:
    of = f" {unit(value.unit)}".rstrip()
    if value.source == "log":
        known = "unknown" if isnan(value.value) else f"{number(value.value)}{of}, from the log"
    elif value.bounds is not None:
        low, high = map(number, value.bounds)
        known = (
            f"not known before the analysis, which fits it to the log's beginning: {low} to {high}"
            f"{of}, {number(value.value)} until then"
        )
    else:
        known = "unknown" if isnan(value.value) else f"{number(value.value)}{of}, from the model"
    return f"{name}: {known}"


def _bought(gain: ModelGain) -> Iterator[Text]:
    after = gain.after
    before, now = len(gain.before.bank.generators), len(after.bank.generators)
    partly = "" if gain.before.bank.listed and after.bank.listed else " of those selected"
    title = f"{plural(len(gain.new_tests), 'new test')}{partly}: {before} before, {now} now"
    if gain.new_tests:
        yield from _section(title, [_test(one) for one in gain.new_tests])
    else:
        yield heading(title)
    told = _among_seen(gain.told_apart, gain.before)
    yield from _section("Now detectable", [_detectable(one, after) for one in gain.detectable])
    yield from _section("Now told apart", told)
    if not gain.detectable and not told:
        yield heading("No further fault can be detected or told from another")


def _detectable(fault: str, found: ModelStudy) -> str:
    """Return a fault, and from which others that are seen as well it is told."""
    names, matrix = found.implementable.faults, found.implementable.matrix
    seen = found.implementable.detectable
    row = names.index(fault)
    others = [i for i in range(len(names)) if i != row and seen[i]]
    alike = [names[i] for i in others if not matrix[row, i]]
    if alike:
        return f"{fault}, not told from {shortened(alike, NAMES)}"
    return f"{fault}, told from every other" if others else fault


def _lost(gain: ModelGain) -> Iterator[Text]:
    after = gain.after
    yield from _section("Tests no longer there", [_test(one) for one in gain.lost_tests])
    yield from _section("No longer detectable", [*gain.no_longer_detectable])
    yield from _section("No longer told apart", _among_seen(gain.no_longer_told_apart, after))


def _among_seen(pairs: Iterable[Pair], found: ModelStudy) -> list[str]:
    """Return a line for each fault told from others, where a study sees both."""
    seen = dict(zip(found.implementable.faults, found.implementable.detectable, strict=True))
    others: dict[str, list[str]] = defaultdict(list)
    for one, other in pairs:
        if seen.get(one, False) and seen.get(other, False):
            others[one].append(other)
    return [f"{one} from {shortened(names, NAMES)}" for one, names in others.items()]


def _test(one: NamedTest) -> str:
    """Return what a test sees, and by which equations and channels."""
    # an input's name is its channel and, behind it, the variable
    by = dict.fromkeys(name.partition(">")[0] for name in one.equations)
    return f"{', '.join(one.faults) or 'no fault'} by {', '.join(by)}"


def _lacking(found: ModelStudy) -> Iterator[Text]:
    lines = [f"{fault} cannot be detected: {why}" for fault, why in why_undetectable(found).items()]
    for group in found.implementable.groups:
        why, sensors = why_not_told(found, group)
        would = f"; a sensor would do of {shortened(sensors, NAMES)}" if sensors else ""
        lines.append(f"{shortened(group, NAMES)} cannot all be told apart: {why}{would}")
    yield from _section("Still lacking", lines)
