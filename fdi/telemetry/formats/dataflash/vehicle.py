"""Which vehicle recorded a DataFlash log, also one that has lost its head?

In: the greeting, the parameters and the tables. Out: the vehicle's name by its firmware;
`frame_of` knows the frame. The greeting says it; without it the parameters that one firmware alone
has; without these the records of the controller of height, and the outputs: a copter's motors rest
at the lower end of their range, and a submarine's in the middle.

Sources: the names in ArduPilot's Parameters.cpp and Log.cpp of each vehicle.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import takewhile
from typing import Final

import numpy as np

from fdi.telemetry.formats.dataflash.tables import Tables, columns

_MAKERS: Final = {
    **{"ArduCopter": "quad", "ArduPlane": "plane", "ArduRover": "rover", "Rover": "rover"},
    **{"ArduSub": "sub", "APM:Copter": "quad", "APM:Plane": "plane", "APM:Rover": "rover"},
}
_OWN_PARAMETERS: Final = {
    **{"JS_GAIN_DEFAULT": "sub", "RLL2SRV_TCONST": "plane", "ATC_STR_RAT_P": "rover"},
    **{"ATC_RAT_RLL_P": "quad", "RATE_RLL_P": "quad", "MOT_SPIN_ARM": "quad"},
}
"""In this order: submarines have the copters' controllers of rates."""
_OWN_FIELDS: Final = {"NavRoll": "plane", "ABst": "quad", "AngBst": "quad"}
"""Of ``CTUN``."""
_OF_MOTORS: Final = {6: "hexa", 8: "octa"}
_SWASHPLATE: Final = "H_SWASH_TYPE"
_OUTPUTS: Final = ("C{}", "Chan{}", "Ch{}")
_STIRS: Final = 0.6
"""Of the changes of the output that changes most, in the first records. Chosen with these flights
in sight: of 95 copters whose head was left out 82 are known, 13 not, none is taken for another one
(``benchmarks/headless.py``); with 0.5 the same, with 0.7 81."""
_FIRST: Final = 100
"""Records, some 10 s: before a motor that fails in view."""
_PULSES_US: Final = (900.0, 2100.0)
_LOWER_END_US: Final = 1300
"""Above what motors rest at (900 to 1200 us), below the middle of a range."""


def vehicle_of(firmware: str | None, values: Mapping[str, float], tables: Tables) -> str:
    """Return the vehicle's name; ``other`` where nothing tells it."""
    kind = _MAKERS.get((firmware or "").split(" ")[0])
    if kind is None:
        kind = next((one for name, one in _OWN_PARAMETERS.items() if name in values), None)
    if kind is None and not values:
        return _by_records(tables)
    if kind == "quad":
        if "FRAME_CLASS" not in values and _SWASHPLATE in values:
            return "helicopter"
        return _OF_MOTORS.get(_motors(tables), "quad")
    if kind == "plane" and values.get("Q_ENABLE", 0) > 0:
        return "vtol"
    return kind or "other"


def _by_records(tables: Tables) -> str:
    """Return the vehicle's name by what its firmware records, where it left no name."""
    fields = {field.name for table in tables if table.layout.name == "CTUN"
              for field in table.layout.fields}  # fmt: skip
    kind = next((one for name, one in _OWN_FIELDS.items() if name in fields), "other")
    if kind != "quad":
        return kind
    count = _driven(tables) or (_stirred(tables) if _is_up(tables) else 0)
    return {4: "quad", **_OF_MOTORS}.get(count, "other")


def _motors(tables: Tables) -> int:
    """Return how many motors the records of old firmware have, built for one kind of frame."""
    for _, (names, labels) in columns(tables, "FMT", "Name", "Columns"):
        for row in np.flatnonzero(names == "MOT").tolist():
            return str(labels[row]).count("Mot")
    return 0


def _driven(tables: Tables) -> int:
    """Return how many outputs, from the first on, begin at the lower end and leave it."""
    return sum(1 for _ in takewhile(bool, (_is_motor(tables, number) for number in range(1, 9))))


def _is_up(tables: Tables) -> bool:
    """Return whether it is above its home for the most: a submarine is below."""
    heights = [np.median(told) for _, (told,) in columns(tables, "CTUN", "Alt") if told.size]
    return bool(heights) and min(heights) > 0


def _stirred(tables: Tables) -> int:
    """Return how many motors outputs show that fly from the first record on; 0 for unknown.

    A controller of rates gives each of them something else at nearly every record, a servo less
    often.
    """
    shares = np.array([_changes(tables, number) for number in range(1, 9)])
    active = shares > 0
    active &= shares >= _STIRS * shares.max()
    last = int(np.flatnonzero(active)[-1]) + 1 if active.any() else 0
    return last if np.count_nonzero(active) >= last - 1 else 0  # one may have failed


def _changes(tables: Tables, number: int) -> float:
    """Return at which share of its records an output changes, 0 for none that gives pulses."""
    for name in _OUTPUTS:
        for _, (told,) in columns(tables, "RCOU", name.format(number)):
            given = told[:_FIRST]
            middle = float(np.median(given)) if given.size > 1 else 0.0
            gives = _PULSES_US[0] <= middle <= _PULSES_US[1]
            return float(np.mean(np.diff(given) != 0)) if gives else 0.0
    return 0.0


def _is_motor(tables: Tables, number: int) -> bool:
    for name in _OUTPUTS:
        for _, (told,) in columns(tables, "RCOU", name.format(number)):
            given = told[told > 0]
            return bool(given.size and given[0] < _LOWER_END_US < given.max())
    return False
