"""What does a terminal say about a model? The page of ``fdi structure``.

In: a study of a model. Out: parts for a console: how large it is, what it can show, what it cannot
and why, what cannot be told apart, and which tests cannot be implemented and why.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from fdi import structure
from fdi.report.model_document import ModelStudy
from fdi.report.text import heading, table, text
from fdi.report.words import clean, plural, shortened
from fdi.structure.explain import why as explain

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST_REASONS: Final = 12
MOST_GAINS: Final = 20
MOST_SETS: Final = 3


def model_summary(found: ModelStudy) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a model."""
    yield text(found.airframe.name, "bold")
    if found.airframe.description:
        yield text(found.airframe.description)
    source = f"the channels of {found.log_name}" if found.log_name else "every measurement present"
    yield text(f"with {source}; sha256 {found.airframe.sha256[:16]}…")
    files = found.airframe.files
    for shipped, of in ((False, "files of its own"), (True, "shipped files")):
        names = ", ".join(clean(file.name) for file in files if file.shipped is shipped)
        if names:
            yield text(f"{of}: {names}")
    yield from _counts(found)
    yield from _undetectable(found)
    yield from _groups(found)
    yield from _not_implementable(found)
    yield from _placement(found)
    for line in found.warnings:
        yield text(f"warning: {line}", "yellow")


def _counts(found: ModelStudy) -> Iterator[RenderableType]:
    seen = int(found.implementable.detectable.sum())
    promised = int(found.structural.detectable.sum())
    rows = [
        ("equations", len(found.system.equations), "measurements and limits among them"),
        ("unknowns", len(found.system.unknowns), ""),
        ("faults", len(found.system.faults), ""),
        ("redundancy", found.redundancy, "of the overdetermined part"),
        ("graph components", found.graph_components, "of the overdetermined part"),
        ("MSO", _count(found.mso), "minimal overdetermined sets"),
        ("MTES", _count(found.mtes), "minimal test supports"),
        (
            "residual generators",
            len(found.bank.generators),
            "that implement an MTES" if found.bank.listed else "selected",
        ),
        ("  restricted", _count(found.restricted), "with no non-invertible edge matched"),
        ("cross-checks", _count(found.cross_checks), "that the default policy adds"),
        ("detectable", seen, f"by structure alone {promised}"),
    ]
    made = table("", "", "")
    made.show_header = False
    made.columns[1].justify = "right"
    for name, value, note in rows:
        made.add_row(text(name), text(value), text(note, "dim"))
    yield text("")
    yield made


def _count(value: int | None) -> str:
    return "too many" if value is None else str(value)


def _undetectable(found: ModelStudy) -> Iterator[RenderableType]:
    reasons = why_undetectable(found)
    yield heading(f"{plural(len(reasons), 'fault')} cannot be detected")
    if not reasons:
        return
    by_reason: dict[str, list[str]] = {}
    for fault, reason in reasons.items():
        by_reason.setdefault(reason, []).append(fault)
    made = table("fault", "why")
    for reason, faults in by_reason.items():
        made.add_row(text(shortened(faults, 8)), text(reason))
    yield made


def why_undetectable(found: ModelStudy) -> Mapping[str, str]:
    """Return for every undetectable fault why no residual generator sees it."""
    system = found.system
    model = system.structure()
    under = {model.equations[e] for e in structure.decompose(model).under.equations}
    result = {}
    for place, fault in enumerate(system.faults):
        if found.implementable.detectable[place]:
            continue
        if found.structural.detectable[place]:
            sets = [s for s in found.bank.not_implementable if fault.name in s.faults]
            why = (
                f"no test that holds it can be implemented: {sets[0].why}"
                if sets
                else ("no minimal test holds it")
            )
        else:
            equation = system.equations[fault.equation]
            known = {*system.inputs, *_determined_without(model, equation.name)}
            unsaid = [name for name in equation.edges if name not in known]
            names = ", ".join(unsaid or equation.edges)
            short = "more unknowns than equations" if equation.name in under else "nothing to spare"
            why = f"nothing else says what {names} must be ({short})"
        result[fault.name] = clean(why)
    return result


def _determined_without(model: structure.Model, name: str) -> set[str]:
    """Return the unknowns that the other equations of a model determine."""
    rest = structure.submodel(model, [e for e, one in enumerate(model.equations) if one != name])
    parts = structure.decompose(rest)
    return {rest.unknowns[u] for u in (*parts.over.unknowns, *parts.just.unknowns)}


def _groups(found: ModelStudy) -> Iterator[RenderableType]:
    groups = found.implementable.groups
    if not groups:
        yield heading("Every detectable fault can be told from every other")
        return
    yield heading(f"{plural(len(groups), 'group')} of faults that cannot be told apart")
    made = table("faults", "why", "a sensor would do of")
    for group in groups:
        why, sensors = why_not_told(found, group)
        made.add_row(
            text(shortened(group, 12)), text(why), text(shortened(sensors, 6) if sensors else "–")
        )
    yield made


def why_not_told(found: ModelStudy, group: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return why the faults of a group hang together, and the sensors that would part two of them.

    Said of the first two of them that no implementable test tells apart.
    """
    place = {fault.name: i for i, fault in enumerate(found.system.faults)}
    apart, promised = found.implementable.matrix, found.structural.matrix
    pairs = [(f, g) for f in group for g in group if f != g]
    first = next((f, g) for f, g in pairs if not apart[place[f], place[g]])
    if promised[place[first[0]], place[first[1]]]:
        why = f"{first[0]} could be told from {first[1]}, but by no test that can be implemented"
        return clean(why), ()
    model = found.system.structure(trusting=False)
    reason = explain(model, *first)
    return clean(reason.because), tuple(clean(model.unknowns[u]) for u in reason.sensors)


def _placement(found: ModelStudy) -> Iterator[RenderableType]:
    placement = found.placement
    if placement is None:
        return
    what = "message" if placement.kind == "message" else "sensor of a variable"
    if not placement.gains:
        yield heading(f"No further {what} would show more, by structure alone")
        return
    yield heading(f"What one further {what} would show, by structure alone")
    made = table(placement.kind, "then detectable", "then told apart")
    for gain in placement.gains[:MOST_GAINS]:
        seen = set(gain.detectable)
        pairs = [f"{f} from {g}" for f, g in gain.isolable if f not in seen]
        made.add_row(
            text(clean(f"{gain.name} ({gain.setting})" if gain.setting else gain.name)),
            text(shortened([*map(clean, gain.detectable)], 4) if seen else "–"),
            text(shortened([*map(clean, pairs)], 4) if pairs else "–"),
        )
    yield made
    if len(placement.gains) > MOST_GAINS:
        yield text(f"  and {len(placement.gains) - MOST_GAINS} more", "dim")
    if placement.sets is not None and len(placement.candidates) > 1:
        ways = " or ".join(" with ".join(map(clean, names)) for names in placement.sets[:MOST_SETS])
        more = f" or {len(placement.sets) - MOST_SETS} more" * (len(placement.sets) > MOST_SETS)
        n = len(placement.candidates)
        whole = f"the {n} absent messages" if placement.kind == "message" else f"{n} such sensors"
        yield text(f"  all that {whole} add: {ways}{more}")


def _not_implementable(found: ModelStudy) -> Iterator[RenderableType]:
    refused = found.bank.not_implementable
    if not refused:
        return
    reasons = Counter((item.reason.value, item.why) for item in refused)
    name = "MTES" if found.bank.listed else "selected set"
    many = "MTES" if found.bank.listed else "selected sets"
    yield heading(f"{plural(len(refused), name, many)} without a residual generator")
    made = table("count", "reason", "why")
    made.columns[0].justify = "right"
    ordered = sorted(reasons.items(), key=lambda item: (-item[1], item[0]))
    for (reason, why), count in ordered[:MOST_REASONS]:
        made.add_row(text(count), text(reason), text(why))
    yield made
    if len(ordered) > MOST_REASONS:
        yield text(f"  and {plural(len(ordered) - MOST_REASONS, 'further reason')}", "dim")
