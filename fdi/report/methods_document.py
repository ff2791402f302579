"""What do methods beside the model's tests show? A part of analysis.json.

In: an analysis. Out: of every method its columns with the residual that holds each, whether the
method points to the same components as the analysis does, and what else it found, in sentences.
"""

from __future__ import annotations

from typing import Any

from fdi.methods.estimator.columns import ESTIMATOR
from fdi.report.json_text import number
from fdi.result import Analysis


def methods_document(analysis: Analysis) -> dict[str, Any]:
    """Return the part ``methods``, by the methods' names."""
    names = dict.fromkeys(filter(None, analysis.bank.methods()))
    if analysis.estimator is not None:
        names[ESTIMATOR.name] = None
    return {name: _method(name, analysis) for name in names}


def _method(name: str, analysis: Analysis) -> dict[str, Any]:
    bank, system = analysis.bank, analysis.system
    health = analysis.estimator if name == ESTIMATOR.name else None
    noticed = health.findings if health is not None else ()
    flight = health.flight if health is not None else None
    columns = []
    for generator, made_by in zip(bank.generators, bank.methods(), strict=True):
        if made_by != name:
            continue
        statement = system.equations[generator.residual]
        columns += [
            {
                "id": str(measured.channel),
                "unit": system.variables[measured.variable].unit,
                "component": statement.component,
                "suspects": list(statement.suspects),
                "residual": generator.id,
            }
            for number in generator.equations
            if (measured := system.equations[number].measurement) and measured.made_by == name
        ]
    return {
        "columns": columns,
        "agreements": [
            {"flight": one.flight, "rank": one.rank, "agrees": one.agrees, "text": one.text}
            for one in analysis.diagnosis.methods
            if one.method == name
        ],
        "findings": [
            {
                "flight": flight,
                "kind": one.kind,
                "t_s": number(one.t),
                "until_s": number(one.end),
                "text": one.text,
                "is_consequence": one.is_late,
            }
            for one in noticed
        ],
    }
