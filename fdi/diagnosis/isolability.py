"""Which faults can be seen and told apart: by what is implementable, and by structure alone?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fdi import structure
from fdi.diagnosis.values import Isolability
from fdi.model import System
from fdi.residuals import Bank
from fdi.structure.isolability import (
    detectable_of_signatures,
    isolability_of_signatures,
    not_isolable_groups,
)


def implementable_isolability(bank: Bank) -> Isolability:
    """Return what the residual generators of a bank can see and tell apart."""
    signatures = bank.sensitivity
    names = tuple(fault.name for fault in bank.system.faults)
    seen = detectable_of_signatures(signatures)
    matrix = isolability_of_signatures(signatures)
    return _with_groups(names, seen, matrix)


def structural_isolability(system: System) -> Isolability:
    """Return what the equations promise, whether or not a generator can be implemented."""
    model = system.structure(trusting=False)
    names = tuple(fault.name for fault in system.faults)
    place = [[fault.name for fault in model.faults].index(name) for name in names]
    seen = structure.detectable(model)[place]
    matrix = structure.isolability(model)[np.ix_(place, place)]
    return _with_groups(names, seen, matrix)


def _with_groups(
    names: tuple[str, ...], seen: NDArray[np.bool_], matrix: NDArray[np.bool_]
) -> Isolability:
    groups = tuple(tuple(names[i] for i in group) for group in not_isolable_groups(matrix, seen))
    return Isolability(names, np.asarray(seen), np.asarray(matrix), groups)
