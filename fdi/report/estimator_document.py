"""What does ``fdi estimator --json`` say?

In: a log and its `EstimatorHealth`. Out: plain values: the log, ratios with level and rises,
innovations, bits with their spans, cores, resets, trees with the path, findings, and what the log
lacks. Numbers are finite or null; null spans are a node that this log cannot show. The JSON Schema
is ``estimator.schema.json`` beside this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from fdi import __version__
from fdi.methods.estimator import EstimatorHealth
from fdi.methods.estimator.bits import Bit
from fdi.methods.estimator.innovations import Innovation
from fdi.methods.estimator.moments import Moment
from fdi.methods.estimator.ratios import GROWN, Ratio
from fdi.methods.estimator.spans import Span
from fdi.methods.estimator.tree import Node, first_path, unexplained, without_effect
from fdi.report.json_text import number
from fdi.report.log_document import log_facts
from fdi.telemetry import Log

SCHEMA_VERSION: Final = 1


def estimator_document(log: Log, health: EstimatorHealth) -> dict[str, Any]:
    """Return an estimator's health as plain values."""
    selection = health.selection
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": log_facts(log),
        "estimator": {
            "family": health.family.name,
            "records": health.family.status,
            "flight": health.flight,
            "air_s": _span(health.air),
            "armed_s": _span(health.armed),
            "upset": _moment(health.upset),
            "first_complaint": _moment(health.complaint),
            "first_symptom": _moment(health.symptom),
        },
        "findings": [
            {
                "kind": one.kind,
                "t_s": number(one.t),
                "end_s": number(one.end),
                "text": one.text,
                "source": one.source,
                "after_upset": one.is_late,
            }
            for one in health.findings
        ],
        "ratios": [_ratio(one) for one in health.ratios],
        "cores": [
            {"core": core, "ratios": [_ratio(one) for one in ratios]}
            for core, ratios in health.core_ratios
        ],
        "selection": {
            "source": selection.source,
            "changes": [
                {"t_s": number(c.t), "before": c.before, "after": c.after, "reason": c.reason}
                for c in selection.changes
            ],
            "whipsaws": _spans(selection.whipsaws),
        },
        "scores": [
            {
                "core": one.core,
                "largest": number(one.largest(health.air)),
                "reproduced": number(one.reproduced),
            }
            for one in health.scores
        ],
        "innovations": [_innovation(one) for one in health.innovations],
        "bits": [_bit(bit) for bit in health.bits.set],
        "resets": [
            {"t_s": number(one.t), "core": one.core, "state": one.state, "source": one.source}
            for one in health.resets
        ],
        "trees": [{"path": _path(top), "tree": _node(top)} for top in health.trees],
        "notes": list(health.notes),
    }


def _ratio(one: Ratio) -> dict[str, Any]:
    return {
        "quantity": one.quantity,
        "channel": one.channel,
        "level": number(one.level),
        "largest": number(one.peak),
        "largest_excess": number(one.peak_excess),
        "limit": number(GROWN),
        "rises_s": _spans(one.rises),
        "above_gate_s": _spans(one.rejected),
    }


def _bit(bit: Bit) -> dict[str, Any]:
    return {
        "kind": bit.kind,
        "name": bit.name,
        "core": bit.core,
        "source": bit.source,
        "known_since_s": number(bit.since),
        "set_s": _spans(bit.spans),
    }


def _innovation(one: Innovation) -> dict[str, Any]:
    return {
        "core": one.core,
        "channel": one.channel,
        "unit": one.unit,
        "has_variance": one.variance is not None,
        "has_ratio": one.ratio is not None,
        "level": number(one.level),
        "largest_excess": number(one.peak),
        "largest_excess_t_s": number(one.peak_t),
    }


def _node(node: Node) -> dict[str, Any]:
    return {
        "name": node.name,
        "since_s": number(node.since),
        "true_s": None if node.spans is None else _spans(node.spans),
        "resolution_s": number(node.resolution),
        "because": node.because,
        "gate": node.gate,
        "unexplained_s": _spans(unexplained(node)),
        "without_effect": [c.name for c in node.children if without_effect(node, c)],
        "children": [_node(child) for child in node.children],
    }


def _path(top: Node) -> list[dict[str, Any]]:
    return [{"name": node.name, "since_s": number(node.since)} for node in first_path(top)]


def _moment(one: Moment | None) -> dict[str, Any] | None:
    return None if one is None else {"t_s": number(one.t), "what": one.what}


def _span(span: Span) -> list[float | None]:
    return [number(span[0]), number(span[1])]


def _spans(spans: Sequence[Span]) -> list[list[float | None]]:
    return [_span(span) for span in spans]
