"""How are the figures of an evaluation told? As text in Markdown tables, and as plain values.

In: an `Evaluation`. Out: the tables of `fdi evaluate`, which the docs quote unchanged, and the tree
of its `--json`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from fdi.evaluation.calibration import (
    Judged,
    brier,
    brier_of_constant,
    calibration_error,
    reliability,
    stated,
)
from fdi.evaluation.run import Evaluation
from fdi.evaluation.score import Score
from fdi.evaluation.totals import (
    Constant,
    Rate,
    Totals,
    constant_answer,
    groups,
    plain,
    totals,
    totals_of,
)
from fdi.evaluation.unseen_tables import out_of_sample, unseen_document, unseen_lines
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
    "wrong",
    "cleared wrongly",
    "without command evidence",
    "constant answer",
)


def evaluation_document(found: Evaluation) -> dict[str, Any]:
    """Return an evaluation as plain values; numbers are finite or null."""
    constant = constant_answer(found.scores)
    pairs = stated(found)
    return {
        "schema_version": SCHEMA_VERSION,
        "totals": _plain(totals(found.scores)),
        "constant_answer": _constant(constant, found.scores),
        "groups": {
            kind: {
                name: {**_plain(totals(own)), "constant_answer": _constant(constant, own)}
                for name, own in parts.items()
            }
            for kind, parts in groups(found.scores).items()
        },
        "reliability": [
            {"from": b.low, "to": b.high, "mean": b.mean, "right": b.right.hits, "of": b.right.of}
            for b in reliability(pairs)
        ],
        "brier": brier(pairs),
        "brier_of_constant": brier_of_constant(pairs),
        "calibration_error": calibration_error(pairs),
        "out_of_sample": unseen_document(out_of_sample(found.flown)),
        "flights": [_flight(one) for one in found.scores],
    }


def _constant(constant: Constant | None, scores: Sequence[Score]) -> dict[str, Any] | None:
    if constant is None:
        return None
    own = _plain(totals_of(constant, scores))
    return {"component": constant.component, "onset_s": constant.onset, **own}


def _plain(value: Totals) -> dict[str, Any]:
    return {
        "flights": value.flights,
        **{
            name: _rate(getattr(value, name))
            for name in ("detected", "named", "in_three", "timely", "clean")
        },
        "delay_s": value.delay,
        "false": value.false,
        "wrong": value.wrong,
        "cleared_wrongly": value.cleared,
        "without_commands": {
            "named": _rate(value.bare_named),
            "timely": _rate(value.bare_timely),
        },
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
        "wrong": list(one.wrong),
        "cleared_wrongly": list(one.cleared),
        "without_commands": one.bare
        and {"named": one.bare.named, "timely": one.bare.timely, "wrong": list(one.bare.wrong)},
        "fate": one.fate,
        "airborne_s": one.airborne_s,
        "error": one.error,
    }


def evaluation_text(found: Evaluation) -> str:
    """Return the tables: totals beside a constant answer, groups, and every flight that failed."""
    constant = constant_answer(found.scores)
    parts = [_table("selection", {"all": found.scores}, constant)]
    unseen = "\n".join(unseen_lines(out_of_sample(found.flown)))
    parts += [_table(kind, own, constant) for kind, own in groups(found.scores).items()]
    parts += [reliability_lines(stated(found)), _fates(found.scores), _failures(found.scores)]
    told = ["\n".join(lines) for part in parts if (lines := list(part))]
    if constant is not None:
        told.insert(1, _legend(constant))
    told.insert(0, unseen)
    told.insert(1, "By the weights that the package holds, in sample for flights that taught them:")
    return "\n\n".join(told) + "\n"


def _legend(constant: Constant) -> str:
    name, onset = clean(constant.component), constant.onset
    return f"Constant answer: always {name} at {onset:.0f} s; detected, named first, timely."


def _table(
    kind: str, rows: Mapping[str, Sequence[Score]], constant: Constant | None
) -> Iterator[str]:
    yield f"| {kind} | {' | '.join(_HEAD)} |"
    yield "| --- " * (len(_HEAD) + 1) + "|"
    for name, own in rows.items():
        value = totals(own)
        cells = [
            str(value.flights),
            *(_share(r) for r in (value.detected, value.named, value.in_three, value.timely)),
            "–" if value.delay is None else f"{value.delay:.1f}",
            _share(value.clean),
            str(value.false),
            "–" if value.false_per_hour is None else f"{value.false_per_hour:.2f}",
            str(value.wrong),
            str(value.cleared),
            _share(value.bare_named),
            "–" if constant is None else _shares(totals_of(constant, own)),
        ]
        yield f"| {clean(name)} | {' | '.join(cells)} |"


def _shares(value: Totals) -> str:
    """Return what of the faults is detected, named and timely, without intervals."""
    shares = [rate.share for rate in (value.detected, value.named, value.timely)]
    return "–" if None in shares else ", ".join(f"{share:.0%}" for share in shares)


def reliability_lines(pairs: Judged) -> Iterator[str]:
    """Yield the table of confidence against rightness, and its two figures."""
    bins = reliability(pairs)
    if not bins:
        return
    yield "| confidence | mean | right | of | share |"
    yield "| --- | --- | --- | --- | --- |"
    for b in bins:
        share = f"{b.right.hits} | {b.right.of} | {_share(b.right)}"
        yield f"| {b.low:.2f} to {b.high:.2f} | {b.mean:.2f} | {share} |"
    yield ""
    constant = f"a constant answer has {brier_of_constant(pairs):.3f}"
    error = f"calibration error {calibration_error(pairs):.3f}"
    yield f"Brier score {brier(pairs):.3f} ({constant}), {error}."


def _fates(scores: Sequence[Score]) -> Iterator[str]:
    """Yield what became of the components that failed and were not named, by component and kind."""
    left = [one for one in scores if one.is_faulty and not one.named]
    counts = Counter((_failed(one), "error" if one.error else one.fate) for one in left)
    fates = sorted({fate for _, fate in counts})
    if left:
        yield f"| not named first | flights | {' | '.join(fates)} |"
        yield "| --- " * (len(fates) + 2) + "|"
    for name in sorted({name for name, _ in counts}):
        own = [counts[name, fate] for fate in fates]
        yield f"| {clean(name)} | {sum(own)} | {' | '.join(str(n or '') for n in own)} |"


def _failed(one: Score) -> str:
    return ", ".join(dict.fromkeys(f"{plain(f.component)} {f.kind}" for f in one.label.faults))


def _failures(scores: Sequence[Score]) -> Iterator[str]:
    """Yield every flight with a wrong, late or missing answer."""
    yield "| flight | what failed | accused | what is wrong |"
    yield "| --- | --- | --- | --- |"
    for one in scores:
        why = _why(one)
        if why:
            failed = ", ".join(f"{f.component} {f.onset:.1f} {f.kind}" for f in one.label.faults)
            said = ", ".join(f"{name} {onset:.1f}" for name, onset in one.accused[:4])
            yield f"| {clean(one.label.key)} | {clean(failed) or '–'} | {said or '–'} | {why} |"


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
    if set(one.wrong) - set(one.false):
        found.append(f"wrong: {', '.join(n for n in one.wrong if n not in one.false)}")
    if one.cleared:
        found.append(f"cleared: {', '.join(one.cleared)}")
    if one.is_faulty and not one.named:
        missed = "not named" if one.detected else "missed"
        found.append("not named first" if one.in_three else f"{missed}: {one.fate}")
    elif one.is_faulty and not one.timely:
        found.append("not timely")
    return ", ".join(found)
