"""What does the observer say of a log, as columns that an analysis can weigh?

In: a log. Out: `Columns` at the attitude's records: of every residual its share of its own
threshold (1: it triggers), and of every motor whether the signs of the rates name it as weak (1 or
0). It takes a step a record, so it is not cheap, and no policy that is shipped asks for it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.methods.columns import Columns, Method
from fdi.methods.observer.observation import Observation, observe
from fdi.methods.observer.states import RESIDUALS
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

SOURCE: Final = "ATTITUDE"


def observer_columns(log: Log) -> Columns | str:
    """Return what the observer says of every flight of a log, or why it says nothing."""
    seen: list[Observation] = []
    why = "no flight is long enough"
    for number in range(len(log.flights)):
        try:
            seen.append(observe(log, flight=number))
        except LogError as error:
            why = error.message if error.message.startswith("the ") else f"the log {error.message}"
    if not seen:
        return why
    parts = [_of_flight(one) for one in seen]
    values = {name: np.concatenate([own[name] for own in parts]) for name in parts[0]}
    return Columns(np.concatenate([one.rows.t for one in seen]), values, SOURCE, {})


OBSERVER: Final = Method("observer", observer_columns)


def _of_flight(seen: Observation) -> dict[str, Floats]:
    t = seen.rows.t
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = np.abs(seen.off) / seen.threshold
    known = np.isfinite(shares[RESIDUALS.index("r")])
    weak = {f"motor_{one.number}": np.where(known, 0.0, np.nan) for one in seen.rows.motors}
    for motor in seen.motors:
        inside = (t >= motor.start) & (t <= motor.end) & known
        weak[f"motor_{motor.number}"][inside] = 1.0
    return {**dict(zip(RESIDUALS, shares, strict=True)), **weak}
