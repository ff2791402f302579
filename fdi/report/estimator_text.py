"""What does a terminal say about an estimator's health? The page of ``fdi estimator``.

In: a log and its `EstimatorHealth`. Out: parts for a console: findings, ratios against their own
level, cores, innovations, bits, resets, the autopilot's rules as trees, and what the log lacks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from fdi.methods.estimator import EstimatorHealth
from fdi.methods.estimator.bits import Bit
from fdi.methods.estimator.ratios import GROWN
from fdi.methods.estimator.spans import Span
from fdi.methods.estimator.tree import (
    Node,
    first_path,
    unexplained,
    walk,
    without_effect,
)
from fdi.report.text import heading, table, text
from fdi.report.words import at, clean, number, per_cent, plural
from fdi.telemetry import Log
from fdi.units import customary

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.tree import Tree

MOST_INNOVATIONS: Final = 12
MOST_BITS: Final = 30
MOST_CHANGES: Final = 20
MOST_RESETS: Final = 12
COARSE_S: Final = 0.05
"""Times are told to a millisecond: where records are further apart than this, that is told too."""
GATES: Final = {"any": "OR", "all": "AND", "two": "2 OF", "event": ""}
LAST_S: Final = 1.0
"""A bit that is set until so long before the end of the flight did not change: records end."""
ALWAYS: Final = ("fault", "timeout", "rejected", "GPS check failed")
"""Kinds of bits that are told whenever they are set; the others where they change in the flight."""


def estimator_summary(log: Log, health: EstimatorHealth) -> Iterator[RenderableType]:
    """Yield what a terminal shows of an estimator's health."""
    yield text(log.name, "bold")
    yield text(_head(log, health))
    yield from _findings(health)
    yield from _ratios(health)
    yield from _cores(health)
    yield from _innovations(health)
    yield from _bits(health)
    yield from _resets(health)
    yield from _trees(health)
    if health.notes:
        yield heading("What this log cannot say")
        for note in health.notes:
            yield text(f"  {note}")


def _head(log: Log, health: EstimatorHealth) -> str:
    if health.flight is None:
        when = "no flight in this log"
    else:
        which = f"flight {health.flight + 1} of {len(log.flights)}"
        when = f"{which}, in the air from {at(health.air[0])} to {at(health.air[1])} s"
    cores = plural(len(health.cores), "core")
    return f"{health.family.name} by {health.family.status}, {cores}; {when}"


def _where(health: EstimatorHealth) -> str:
    return "in the log" if health.flight is None else "in the flight"


def _findings(health: EstimatorHealth) -> Iterator[RenderableType]:
    yield heading("Findings" if health.findings else "Nothing found")
    if not health.findings:
        if health.ratios:
            is_known = all(ratio.level is not None for ratio in health.ratios)
            rise = "no rise against the own level, " if is_known else ""
            yield text(f"  no source lost, no rejection, {rise}no whipsaw")
        else:
            yield text("  but the log has no test ratios: little could be looked at")
        return
    made = table("s", "what", "")
    made.columns[0].justify = "right"
    for one in health.findings:
        late = "after the upset: a consequence" if one.is_late else ""
        style = "dim" if one.is_late else "red" if one.kind in ("whipsaw", "not fused") else ""
        made.add_row(text(at(one.t)), text(one.text, style), text(late, "dim"))
    yield made


def _ratios(health: EstimatorHealth) -> Iterator[RenderableType]:
    if not health.ratios:
        return
    yield heading("Test ratios of the core that flew (1 is the gate)")
    made = table(
        "ratio", "own level", f"mean / level (limit {GROWN:g})", "largest", "above 1, s", ""
    )
    for column in made.columns[1:5]:
        column.justify = "right"
    for ratio in health.ratios:
        rejected = sum(high - low for low, high in ratio.rejected)
        made.add_row(
            text(ratio.quantity),
            text(number(ratio.level, 2)),
            text(number(ratio.peak_excess, 3)),
            text(number(ratio.peak, 3)),
            text(f"{rejected:.1f}" if rejected else "–"),
            text(ratio.channel, "dim"),
        )
    yield made


def _cores(health: EstimatorHealth) -> Iterator[RenderableType]:
    changes = health.selection.changes
    if len(health.cores) < 2 and not changes:
        return
    changed = plural(len(changes), "change")
    yield heading(f"Cores: {changed} of the selected one {_where(health)}")
    for change in changes[:MOST_CHANGES]:
        before = "?" if change.before is None else str(change.before)
        why = f" ({change.reason})" if change.reason else ""
        yield text(f"  {at(change.t)} s: {before} -> {change.after}{clean(why)}")
    if len(changes) > MOST_CHANGES:
        yield text(f"  and {len(changes) - MOST_CHANGES} more, see --json", "dim")
    made = table("core", "combined ratio, largest in the air", "logged scores that its rule gives")
    for score in health.scores:
        share = "not in this log" if score.reproduced is None else per_cent(score.reproduced)
        largest = number(score.largest(health.air), 3)
        made.add_row(text(str(score.core)), text(largest), text(share))
    if health.scores:
        yield made
        if not health.family.is_squared:
            yield text("  (its rule counts a ratio that is not used as 1)", "dim")


def _innovations(health: EstimatorHealth) -> Iterator[RenderableType]:
    first = _flown(health)
    own = [one for one in health.innovations if one.core == first and one.peak is not None]
    if not own:
        return
    own.sort(key=lambda one: (-(one.peak or 0.0), one.channel))
    yield heading(f"Innovations of core {first}, the largest against their own level")
    made = table("channel", "own level", "mean of 4 s / level", "at s", "variance", "ratio")
    for column in made.columns[1:4]:
        column.justify = "right"
    for one in own[:MOST_INNOVATIONS]:
        unit, scale, _ = customary(one.unit)
        made.add_row(
            text(one.channel),
            text(f"{number((one.level or 0.0) * scale, 3)} {unit}"),
            text(number(one.peak, 3)),
            text(at(one.peak_t)),
            text("logged" if one.variance is not None else "not in this log"),
            text("logged" if one.ratio is not None else "not in this log"),
        )
    yield made
    if len(own) > MOST_INNOVATIONS:
        yield text(f"  and {len(own) - MOST_INNOVATIONS} more, see --json", "dim")


def _flown(health: EstimatorHealth) -> int:
    """Return the core that flew for most of the flight."""
    selection = health.selection
    inside = (selection.t >= health.air[0]) & (selection.t <= health.air[1])
    counted = Counter(selection.number[inside].tolist())
    return counted.most_common(1)[0][0] if counted else health.cores[0].number


def _bits(health: EstimatorHealth) -> Iterator[RenderableType]:
    core = _flown(health)
    shown = [bit for bit in health.bits.set if _is_told(bit, core, health.air)]
    if not shown:
        return
    yield heading("What the estimator said of itself")
    made = table("kind", "bit", "core", "set, s")
    for bit in shown[:MOST_BITS]:
        spans = [span for span in bit.spans if _is_in(span, health.air)]
        made.add_row(text(bit.kind), text(bit.name), text(str(bit.core)), text(_spans(spans)))
    yield made
    if len(shown) > MOST_BITS:
        yield text(f"  and {len(shown) - MOST_BITS} more, see --json", "dim")


def _is_told(bit: Bit, core: int, air: Span) -> bool:
    if not any(_is_in(span, air) for span in bit.spans):
        return False
    if bit.kind in ALWAYS:
        return True
    edges = [t for span in bit.spans for t in span]
    return bit.core == core and any(air[0] < t < air[1] - LAST_S for t in edges)


def _is_in(span: Span, air: Span) -> bool:
    return span[0] <= air[1] and span[1] >= air[0]


def _spans(spans: list[Span], most: int = 4) -> str:
    shown = ", ".join(f"{at(low)} to {at(high)}" for low, high in spans[:most])
    return shown + (f" and {len(spans) - most} more" if len(spans) > most else "")


def _resets(health: EstimatorHealth) -> Iterator[RenderableType]:
    output = [one for one in health.resets if one.core is None] or list(health.resets)
    if not output:
        return
    yield heading(f"{plural(len(output), 'reset')} of the state, from arming to disarming")
    for one in output[:MOST_RESETS]:
        yield text(f"  {at(one.t)} s: {one.state} ({one.source})")
    if len(output) > MOST_RESETS:
        yield text(f"  and {len(output) - MOST_RESETS} more, see --json", "dim")


def shown_trees(health: EstimatorHealth) -> tuple[list[Node], int]:
    """Return the trees a person wants to see, and how many of single healthy cores are left out."""
    shown = [
        tree
        for tree in health.trees
        if not tree.name.startswith("estimator ") or tree.since is not None
    ]
    return shown, len(health.trees) - len(shown)


def _trees(health: EstimatorHealth) -> Iterator[RenderableType]:
    shown, hidden = shown_trees(health)
    for top in shown:
        yield heading(f"Tree: {top.name}")
        steps = first_path(top)
        if not steps:
            seen = all(node.spans is not None for node, _, _ in walk(top))
            known = "" if seen else ", as far as this log tells"
            yield text(f"  nothing in it became true {_where(health)}{known}")
        elif top.since is None:
            yield text("  the top event did not come; part of the way to it:")
        for node in steps:
            yield text(f"  {node.since or 0.0:9.3f} s  {node.name}{_doubt(node, health)}", "bold")
        yield _drawn(top)
    if hidden:
        cores = plural(hidden, "core")
        yield text(f"  {cores}: the selector's tree of it did not come true", "dim")


def _doubt(node: Node, health: EstimatorHealth) -> str:
    """Return how sure the moment is at which a node became true."""
    if node.since == health.air[0]:
        return f" (held at {'take-off' if health.flight is not None else 'the beginning'} already)"
    return f" (records every {node.resolution:.2g} s)" if node.resolution >= COARSE_S else ""


def _drawn(top: Node) -> Tree:
    from rich.tree import Tree

    on_path = {node.name for node in first_path(top)}
    branches: list[Tree] = []
    for node, depth, is_again in walk(top):
        words = _label(node, on_path, is_again=is_again)
        if depth:
            branches[depth:] = [branches[depth - 1].add(words)]
        else:
            branches = [Tree(words, guide_style="dim")]
    return branches[0]


def state_of(node: Node) -> str:
    """Return in words whether a node became true, and when."""
    if node.spans is None:
        return "not known"
    if node.since is None:
        return "no"
    times = f", {len(node.spans)} times" if len(node.spans) > 1 else ""
    return f"since {node.since:.3f} s{times}"


def gate_of(node: Node) -> str:
    """Return how a node joins its children, and where the log contradicts that.

    One child needs no word.
    """
    said = [GATES[node.gate]] if len(node.children) > 1 else []
    odd = len(unexplained(node))
    if odd:
        times = "" if odd == len(node.spans or ()) else f" {plural(odd, 'time')}"
        seen = all(child.spans is not None for child in node.children)
        said.append(f"though{times} by none of these" + ("" if seen else ", as far as is known"))
    idle = [clean(child.name) for child in node.children if without_effect(node, child)]
    if idle:
        said.append(f"though not by '{', '.join(idle)}' alone")
    return ", ".join(said)


def _label(node: Node, on_path: set[str], *, is_again: bool) -> RenderableType:
    from rich.text import Text

    style = "bold red" if node.name in on_path else "red" if node.since is not None else ""
    style = "dim" if node.spans is None else style
    tells = node.because and (node.spans is None or node.since is not None)
    because = "" if not tells or is_again else f" [{clean(node.because)}]"
    ending = "  (as above)" if is_again else f"  {gate_of(node)}"
    state = f"{clean(node.name)}: {state_of(node)}"
    return Text.assemble((state, style), (because, "dim"), (ending.rstrip(), "dim"))
