"""What can a model show with given telemetry? What ``fdi structure --json`` says.

In: a system with its bank of MTES. Out: plain values as ``interfaces`` promises them: counts,
detectability, isolability by the implementable generators and by structure alone.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, Final

from fdi import structure
from fdi.diagnosis import Isolability
from fdi.diagnosis.isolability import implementable_isolability, structural_isolability
from fdi.errors import UsageError
from fdi.model import Airframe, System
from fdi.model.placement import Placement
from fdi.residuals import Bank
from fdi.residuals.cache import cached_bank
from fdi.residuals.sets import MAX_CANDIDATES

SCHEMA_VERSION: Final = 1
MSO_LIMIT: Final = 2000
"""More MSO sets in a graph component are not counted: their number grows exponentially, and 2,000
of a quadcopter's largest component take a second."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelStudy:
    """What a model can show with given telemetry.

    Attributes
    ----------
    bank : Bank
        Of the MTES alone, as all counts are; where they are too many, of selected tests.
    mso, cross_checks : int or None
        How many MSO sets there are, and how many generators the default policy adds; None where
        there are too many to count.
    log_name : str or None
        The log whose channels count as present; None: all do.
    placement : Placement or None
        Which further telemetry would show more, where that was asked.
    """

    airframe: Airframe
    system: System
    bank: Bank
    implementable: Isolability
    structural: Isolability
    redundancy: int
    graph_components: int
    mso: int | None
    cross_checks: int | None
    log_name: str | None
    placement: Placement | None = None

    @property
    def mtes(self) -> int | None:
        """Return how many MTES there are, implementable or not; None if too many to list."""
        if not self.bank.listed:
            return None
        return len(self.bank.generators) + len(self.bank.not_implementable)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what of the model could not be used, and where not all test sets are listed."""
        return (*self.system.warnings, *self.bank.notes)

    @property
    def restricted(self) -> int | None:
        """Return how many generators match no non-invertible edge; None if not all are listed."""
        if not self.bank.listed:
            return None
        return sum(generator.restricted for generator in self.bank.generators)


def study(
    airframe: Airframe,
    system: System,
    log_name: str | None = None,
    placement: Placement | None = None,
    *,
    integrate: bool = False,
) -> ModelStudy:
    """Return what a model can show with the telemetry that a system stands for."""
    bank, cross_checks = _bank(system, integrate=integrate)
    model = system.structure()
    return ModelStudy(
        airframe=airframe,
        system=system,
        bank=bank,
        implementable=implementable_isolability(bank),
        structural=structural_isolability(system),
        redundancy=structure.decompose(model).redundancy,
        graph_components=len(structure.graph_components(model)),
        mso=_count_mso(model),
        cross_checks=cross_checks,
        log_name=log_name,
        placement=placement,
    )


def _count_mso(model: structure.Model) -> int | None:
    total = 0
    components = structure.graph_components(model)
    for component in sorted(components, key=lambda part: -part.redundancy):
        part = structure.submodel(model, component.equations)
        if structure.count_bound(part) > MAX_CANDIDATES:
            return None
        try:
            total += sum(1 for _ in structure.mso_sets(part, limit=MSO_LIMIT))
        except UsageError:
            return None
    return total


def _bank(system: System, *, integrate: bool) -> tuple[Bank, int | None]:
    """Return the bank of MTES, and how many generators the cross-checks add to it.

    The default policy's bank holds the MTES first, and a former analysis may have kept it.
    """
    whole = cached_bank(system, "mtes+cross_checks", integrate=integrate)
    own = tuple(g for g in whole.generators if g.origin != "cross_check")
    refused = tuple(r for r in whole.not_implementable if r.origin != "cross_check")
    bank = Bank(system, whole.nodes, own, refused, whole.listed, whole.notes)
    return bank, len(whole.generators) - len(own) if whole.listed else None


def model_document(found: ModelStudy) -> dict[str, Any]:
    """Return what a model can show as plain values."""
    refused = Counter(item.reason.value for item in found.bank.not_implementable)
    return {
        "schema_version": SCHEMA_VERSION,
        "model": {
            "name": found.airframe.name,
            "sha256": found.airframe.sha256,
            "files": model_files(found.airframe),
            "description": found.airframe.description,
            "log": found.log_name,
        },
        "structure": {
            "equations": len(found.system.equations),
            "unknowns": len(found.system.unknowns),
            "faults": len(found.system.faults),
            "redundancy": found.redundancy,
            "graph_components": found.graph_components,
            "residual_generators": len(found.bank.generators),
            **isolability_rows(found.implementable),
            "structural": isolability_rows(found.structural),
            "mtes": found.mtes,
            "mso": found.mso,
            "restricted_generators": found.restricted,
            "cross_checks": found.cross_checks,
            "not_implementable": dict(sorted(refused.items())),
        },
        **({} if found.placement is None else {"placement": _placement(found.placement)}),
        "warnings": list(found.warnings),
    }


def model_files(airframe: Airframe) -> list[dict[str, Any]]:
    """Return the files that a model was read from."""
    return [
        {"name": file.name, "sha256": file.sha256, "shipped": file.shipped}
        for file in airframe.files
    ]


def isolability_rows(value: Isolability) -> dict[str, Any]:
    """Return what can be seen and told apart, as strings of 0 and 1 per fault."""
    names = list(value.faults)
    return {
        "detectable": [n for n, seen in zip(names, value.detectable, strict=True) if seen],
        "undetectable": [n for n, seen in zip(names, value.detectable, strict=True) if not seen],
        "isolability": {
            "faults": names,
            "rows": ["".join("1" if cell else "0" for cell in row) for row in value.matrix],
        },
        "not_isolable_groups": [list(group) for group in value.groups],
    }


def _placement(placement: Placement) -> dict[str, Any]:
    return {
        "candidates": list(placement.candidates),
        "kind": placement.kind,
        "gains": [
            {
                placement.kind: gain.name,
                **({"setting": gain.setting} if gain.setting else {}),
                "detectable": list(gain.detectable),
                "isolable": [list(pair) for pair in gain.isolable],
            }
            for gain in placement.gains
        ],
        "sets": None if placement.sets is None else [list(names) for names in placement.sets],
    }
