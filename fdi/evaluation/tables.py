"""How are the figures of an evaluation told? As text in Markdown tables, and as plain values.

In: an `Evaluation`. Out: the tables of `fdi evaluate`, which the docs quote unchanged, and the tree
of its `--json`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from fdi.evaluation.calibration import reliability
from fdi.evaluation.run import Evaluation
from fdi.evaluation.score import Score
from fdi.evaluation.totals import Rate, Totals, constant_answer, groups, totals
from fdi.report.words import clean

SCHEMA_VERSION: Final = 1
_HEAD: Final = (
    "flights",
    "detected",
    "named first",
    "in three",
    "timely",
    "delay s",
    "healthy clean",
    "false",
    "false/h",
)


def evaluation_document(found: Evaluation) -> dict[str, Any]:
    """Return an evaluation as plain values; numbers are finite or null."""
    constant = constant_answer(found.scores)
    return {
        "schema_version": SCHEMA_VERSION,
        "totals": _plain(totals(found.scores)),
        "constant_answer": None
        if constant is None
        else {"component": constant[0], "onset_s": constant[1], **_plain(constant[2])},
        "groups": {
            kind: {name: _plain(totals(own)) for name, own in parts.items()}
            for kind, parts in groups(found.scores).items()
        },
        "reliability": [
            {"from": b.low, "to": b.high, "mean": b.mean, "right": b.right.hits, "of": b.right.of}
            for b in reliability(found)
        ],
        "flights": [_flight(one) for one in found.scores],
    }


def _plain(value: Totals) -> dict[str, Any]:
    return {
        "flights": value.flights,
        **{
            name: _rate(getattr(value, name))
            for name in ("detected", "named", "in_three", "timely", "clean")
        },
        "delay_s": value.delay,
        "false": value.false,
        "false_healthy": value.false_healthy,
        "healthy_hours": round(value.healthy_hours, 4),
        "false_per_hour": value.false_per_hour,
        "errors": value.errors,
    }


def _rate(value: Rate) -> dict[str, Any]:
    return {"hits": value.hits, "of": value.of, "share": value.share, "interval": value.interval}


def _flight(one: Score) -> dict[str, Any]:
    return {
        "log": one.label.key,
        "faults": [{"component": f.component, "onset_s": f.onset} for f in one.label.faults],
        "accused": [{"component": name, "onset_s": onset} for name, onset in one.accused],
        "detected": one.detected,
        "named": one.named,
        "in_three": one.in_three,
        "timely": one.timely,
        "delay_s": one.delay,
        "false": list(one.false),
        "airborne_s": one.airborne_s,
        "error": one.error,
    }


def evaluation_text(found: Evaluation) -> str:
    """Return the tables: totals beside a constant answer, groups, and every flight that failed."""
    return "\n".join(_lines(found)) + "\n"


def _lines(found: Evaluation) -> Iterator[str]:
    yield from _table("all", _totals_rows(found.scores))
    for kind, parts in groups(found.scores).items():
        yield ""
        yield from _table(kind, {name: totals(own) for name, own in parts.items()})
    bins = reliability(found)
    if bins:
        yield ""
        yield "| confidence | mean | right | of | share |"
        yield "| --- | --- | --- | --- | --- |"
        for b in bins:
            share = f"{b.right.hits} | {b.right.of} | {_share(b.right)}"
            yield f"| {b.low:.1f} to {b.high:.1f} | {b.mean:.2f} | {share} |"
    yield ""
    yield "| flight | what failed | accused | |"
    yield "| --- | --- | --- | --- |"
    for one in found.scores:
        why = _why(one)
        if why:
            failed = ", ".join(f"{f.component} {f.onset:.1f}" for f in one.label.faults)
            said = ", ".join(f"{name} {onset:.1f}" for name, onset in one.accused[:4])
            yield f"| {clean(one.label.key)} | {failed or '–'} | {said or '–'} | {why} |"


def _totals_rows(scores: Sequence[Score]) -> dict[str, Totals]:
    rows = {"fdi": totals(scores)}
    constant = constant_answer(scores)
    if constant is not None:
        component, onset, value = constant
        rows[f"always {component} at {onset:.0f} s"] = value
    return rows


def _table(kind: str, rows: Mapping[str, Totals]) -> Iterator[str]:
    yield f"| {kind} | {' | '.join(_HEAD)} |"
    yield "| --- " * (len(_HEAD) + 1) + "|"
    for name, value in rows.items():
        cells = [
            str(value.flights),
            *(_share(r) for r in (value.detected, value.named, value.in_three, value.timely)),
            "–" if value.delay is None else f"{value.delay:.1f}",
            _share(value.clean),
            str(value.false),
            "–" if value.false_per_hour is None else f"{value.false_per_hour:.2f}",
        ]
        yield f"| {clean(name)} | {' | '.join(cells)} |"


def _share(rate: Rate) -> str:
    if rate.share is None:
        return "–"
    low, high = rate.interval
    return f"{rate.hits}/{rate.of} {rate.share:.0%} ({low:.0%}..{high:.0%})"


def _why(one: Score) -> str:
    """Return what is wrong with the answer on a flight, "" where nothing is."""
    if one.error is not None:
        return f"error: {clean(one.error)[:120]}"
    found = [f"false: {', '.join(one.false)}"] if one.false else []
    if one.is_faulty and not one.detected:
        found.append("missed")
    elif one.is_faulty and not one.named:
        found.append("not named first" if one.in_three else "not named")
    elif one.is_faulty and not one.timely:
        found.append("not timely")
    return ", ".join(found)
