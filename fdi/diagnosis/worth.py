"""What are the probabilities worth, on which kind of flights?

In: ``worth.json`` beside this file, by ``benchmarks/worth.py``: of the accusations given at
least `AT_LEAST` on flights that the weights were not fitted to, how many were right; on those that
people flew, tests and tolerances were made with them in sight. Out: a sentence for a report. Under
a model that the weights were not fitted with nothing is known.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any, Final

from fdi.model import Airframe
from fdi.model.choose import is_shipped

FILE: Final = "worth.json"
AT_LEAST: Final = 0.9
"""What a finding says as a fact; the percentages below it are worth less."""


def worth_of(airframe: Airframe) -> str:
    """Return what is known of how far the percentages under a model can be trusted."""
    if not is_shipped(airframe):
        return (
            "The percentages are not calibrated: no flight with a known fault was judged with this "
            "model."
        )
    tried = _tried()
    simulated, recorded = (tried[kind] for kind in ("simulated", "recorded"))
    return (
        f"What the percentages are worth: of accusations given {100 * tried['at_least']:.0f} % or "
        f"more {simulated['right']} of {simulated['given']} were right on simulated flights not "
        f"seen before, and {recorded['right']} of {recorded['given']} on flights that people flew, "
        "known when it was made."
    )


@cache
def _tried() -> Any:
    return json.loads(files("fdi.diagnosis").joinpath(FILE).read_text("utf-8"))
