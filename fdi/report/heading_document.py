"""What does ``fdi heading --json`` say?

In: a log, its `HeadingCheck` and, where there is one, a `Recovery`. Out: plain values. Numbers are
finite or null. The JSON Schema is ``heading.schema.json`` beside this file.
"""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

import numpy as np

from fdi import __version__
from fdi.methods.heading import COMPONENTS, HeadingCheck, Recovery
from fdi.methods.heading.increments import GATE, Pair
from fdi.methods.heading.sources import Source
from fdi.report.json_text import number
from fdi.report.log_document import log_facts
from fdi.telemetry import Log

SCHEMA_VERSION: Final = 1


def heading_document(log: Log, check: HeadingCheck, recovery: Recovery | None) -> dict[str, Any]:
    """Return a cross-check of headings as plain values."""
    ride, accused = check.ride, check.accused
    counts = Counter(check.verdicts)
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": log_facts(log),
        "flight": ride.flight,
        "air_s": [number(t) for t in ride.air],
        "cycle_s": number(ride.cycle),
        "accused": None if accused is None else COMPONENTS[accused.block],
        "named": [
            {
                "block": one.block,
                "component": COMPONENTS[one.block],
                "start_s": number(one.start),
                "end_s": number(one.end),
                "by": list(one.by),
                "is_late": one.is_late,
            }
            for one in check.named
        ],
        "without_fix_s": [[number(t) for t in span] for span in ride.lost["satellite"]],
        "without_compass_s": [[number(t) for t in span] for span in ride.lost["magnetometer"]],
        "verdicts": {name or "not known": counts[name] for name in sorted(counts)},
        "open_to": sorted(set().union(*check.possible)),
        "sources": [_source(one) for one in check.sources.values()],
        "pairs": [_pair(one) for one in check.pairs],
        "recovery": None if recovery is None else _recovery(recovery),
    }


def _source(one: Source) -> dict[str, Any]:
    known = np.isfinite(one.heading)
    sigma = float(np.degrees(np.median(one.sigma[known]))) if known.any() else None
    return {
        "name": one.name,
        "known": number(float(known.mean())),
        "sigma_deg": number(sigma),
        "absent": one.absent,
    }


def _pair(one: Pair) -> dict[str, Any]:
    known = one.disagrees
    apart = np.abs(one.off) / one.sigma
    any_known = bool(np.isfinite(apart).any())
    return {
        "name": one.name,
        "kind": one.kind,
        "gate": number(GATE),
        "largest": number(float(np.nanmax(apart))) if any_known else None,
        "disagrees": number(float(np.nanmean(known))) if any_known else None,
    }


def _recovery(one: Recovery) -> dict[str, Any]:
    return {
        "block": one.block,
        "start_s": number(one.start),
        "end_s": number(one.end),
        "ended": one.ended,
        "samples": int(one.t.size),
        "methods": sorted(set(one.method)),
        "columns": ["t_s", "method", *one.columns],
        "largest_sigma": {
            name: number(float(values.max()))
            for name, values in one.columns.items()
            if name.startswith("sigma_")
        },
    }
