"""In what unit is each field of a ULog topic, and when is it unknown?

In: topic, field, type and the firmware's release. Out: what a `Column` needs. A ULog states no
units: they stand in ``data/units_ulog.json``, by topic and field, and else by the end of the
field's name (``vel_m_s``). What neither knows has no unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fdi.telemetry.catalogue import data_table
from fdi.units import Conversion, si

Release = tuple[int, int]


@dataclass(frozen=True, slots=True)
class FieldMeaning:
    """How a field becomes SI, which raw values mean unknown, and the flag that must be set.

    ``is_discrete``: a code, a count or a text.
    """

    conversion: Conversion
    invalid: tuple[float, ...]
    flag: str | None
    is_discrete: bool


@cache
def field_meaning(topic: str, name: str, plain: str, dtype: str, release: Release) -> FieldMeaning:
    """Return what a field of a topic means.

    Parameters
    ----------
    topic, name, plain : str
        ``name`` is the flattened field, ``plain`` the same without indices.
    dtype : str
        As stored.
    release : (int, int)
        Of the firmware, (0, 0) where it is not known: such firmware is old.

    Examples
    --------
    >>> field_meaning("sensor_baro", "pressure", "pressure", "<f4", (1, 12)).conversion
    Conversion(unit='Pa', scale=100.0, offset=0.0)
    """
    table = data_table("units_ulog")
    known = table["same"].get(topic, topic)
    unit = _stated(known, name) or _stated(known, plain)
    if unit is None:
        unit = _by_ending(plain)
    older = table["older"].get(f"{known}.{plain}")
    if older is not None and release < tuple(older["before"]):
        unit = older["unit"]
    if dtype == "<f4":
        unit = table["float"].get(f"{known}.{plain}", unit)
    flags = table["unknown_unless"].get(known, {})
    flag = next((flag for flag, fields in flags.items() if plain in fields), None)
    invalid = tuple(table["invalid"].get(f"{known}.{plain}", ()))
    kind, conversion = np.dtype(dtype).kind, si(unit)
    is_discrete = kind == "S" or (kind in "iu" and conversion == Conversion(""))
    return FieldMeaning(conversion, invalid, flag, is_discrete)


@cache
def _units_of(topic: str) -> dict[str, str]:
    stated = data_table("units_ulog")["topics"].get(topic, {})
    return {field: unit for unit, fields in stated.items() for field in fields}


def _stated(topic: str, name: str) -> str | None:
    units = _units_of(topic)
    return units.get(name) or units.get(name.rpartition(".")[2])


def _by_ending(plain: str) -> str:
    for ending, unit in data_table("units_ulog")["endings"]:
        if plain.endswith(ending):
            return str(unit)
    return ""
