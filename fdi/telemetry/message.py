"""What did a log record under one message name?

`Message` holds columns; each column knows how to fetch its raw values, and is decoded when it is
asked for the first time. It is the same for every log format: a reader fills in `Column`s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.units import Conversion

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]

MOST_KEPT: Final = 1 << 18
"""Values of a column that is kept once it is decoded; of logs of gigabytes few fit into memory."""


class Column(NamedTuple):
    """How one field is read.

    Attributes
    ----------
    load : callable
        Returns the values as on the wire, (m,), one per raw record.
    conversion : Conversion
        To SI.
    invalid : tuple of float
        Raw values that mean unknown.
    blank : tuple of (field, raw value)
        Unknown where all of these hold in the record.
    absent : (m,) bool or None
        Records too short to hold the field (MAVLink 1 without its extensions).
    is_text : bool
        The values are `str`.
    is_discrete : bool
        There is nothing between two values: codes, bits, counts, texts. Between two records the
        earlier one's holds.
    range : (float, float) or None
        The least and the largest raw value that is possible: others, and what is no number, are
        unknown.
    """

    load: Callable[[], NDArray[Any]]
    conversion: Conversion
    invalid: tuple[float, ...] = ()
    blank: tuple[tuple[str, float], ...] = ()
    absent: Callable[[], NDArray[np.bool_] | None] = lambda: None
    is_text: bool = False
    range: tuple[float, float] | None = None
    is_discrete: bool = False


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Message:
    """The records of one message (of one instance of it) as columns.

    Attributes
    ----------
    name : str
    instance : int or None
        None stands for the first (instance 0, or a message without instances).
    t : (n,) float64, s
        The log's clock, repaired, strictly increasing.
    stamp : (m,) float64, s
        The recorder's stamps as they are in the file, 0 at the file's first record.
    kept : (n,) int
        Which raw records have a place in ``t``: of records with the same time the last one is kept.
    made_from : str or None
        Key of the log's own message that this one says again in MAVLink's words; None for a message
        that the log itself holds.
    """

    name: str
    instance: int | None
    t: Floats
    stamp: Floats
    kept: NDArray[np.integer[Any]]
    columns: Mapping[str, Column]
    made_from: str | None = None
    _cache: dict[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The name in `Log.messages`, e.g. ``BATTERY_STATUS[1]``."""
        return self.name if self.instance is None else f"{self.name}[{self.instance}]"

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields; an array's entries are fields of their own, ``voltages[0]``."""
        return tuple(self.columns)

    def __len__(self) -> int:
        return int(self.t.size)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __repr__(self) -> str:
        rate = (len(self) - 1) / (self.t[-1] - self.t[0]) if len(self) > 1 else 0.0
        return (
            f"<Message {self.key}: {len(self)} records, {rate:.2g} Hz, {len(self.fields)} fields>"
        )

    def _repr_html_(self) -> str:
        from html import escape

        return f"<code>{escape(repr(self))}</code>"

    def _column(self, name: str) -> Column:
        found = self.columns.get(name)
        if found is None:  # who takes a name from a person checks it before (`Log.channel`)
            raise LogError(f"{self.key} has no field {name}", hint=f"it has {self.fields}")
        return found

    def raw(self, name: str) -> NDArray[Any]:
        """Return the values as on the wire, (m,), one per raw record (as ``stamp``); read-only.

        They may lie apart in memory, as in the records.
        """
        column = self._column(name)
        if name in self._cache:
            return self._cache[name]
        values = _read_only(column.load())
        # what was made of another message is kept in SI only
        return values if self.made_from else self._kept(name, values)

    def si(self, name: str) -> Floats:
        """Return the values in SI, (n,) float64 as ``t``, NaN where unknown; text is all NaN."""
        return _read_only(self.si_of_records(name)[self.kept])

    def si_of_records(self, name: str) -> Floats:
        """Return the values in SI of every raw record, (m,) as ``stamp``."""
        key = f"{name} in SI"
        if key in self._cache:
            return self._cache[key]
        return self._kept(key, _read_only(self._convert(name)))

    def _kept(self, key: str, values: NDArray[Any]) -> NDArray[Any]:
        if values.size <= MOST_KEPT:
            self._cache[key] = values
        return values

    def glance(self, name: str) -> Floats:
        """Return what `si_of_records` returns; what is not at hand is decoded and not kept."""
        column, key = self._column(name), f"{name} in SI"
        if key in self._cache:
            return self._cache[key]
        if column.is_text:
            return np.full(self.stamp.size, np.nan)
        raw = self._cache.get(name)
        return self._in_si(column, column.load() if raw is None else raw)

    def _convert(self, name: str) -> Floats:
        column = self._column(name)
        if column.is_text:
            return np.full(self.stamp.size, np.nan)
        return self._in_si(column, self.raw(name))

    def _in_si(self, column: Column, raw: NDArray[Any]) -> Floats:
        with np.errstate(invalid="ignore", over="ignore"):
            values: Floats = raw.astype(np.float64)
            if column.conversion.scale != 1.0:
                values *= column.conversion.scale
            if column.conversion.offset:
                values += column.conversion.offset
            is_known = np.isfinite(values.sum())  # fewer passes: most columns are known throughout
        if not is_known:
            values[~np.isfinite(values)] = np.nan
        for sentinel in column.invalid:
            values[raw == sentinel] = np.nan
        if column.range is not None:
            values[is_outside(raw, column.range)] = np.nan
        if column.blank:
            is_blank = [self.raw(other) == value for other, value in column.blank]
            values[np.logical_and.reduce(is_blank)] = np.nan
        absent = column.absent()
        if absent is not None:
            values[absent] = np.nan
        return values

    def has_known(self, name: str) -> bool:
        """Return whether any value of a numeric field is known (nothing is kept in memory)."""
        column = self._column(name)
        if column.is_text or not len(self):
            return False
        return bool(np.isfinite(self.glance(name))[self.kept].any())

    def unit(self, name: str) -> str:
        """Return the SI unit of `si`, "" dimensionless; "us" for pulse widths."""
        return self._column(name).conversion.unit

    def with_conversion(self, name: str, conversion: Conversion) -> Message:
        """Return the same message with another meaning of one field's values."""
        changed = self._column(name)._replace(conversion=conversion)
        return replace(self, columns={**self.columns, name: changed}, _cache={})

    def forget(self) -> None:
        """Let go of the decoded columns; they are decoded anew when they are asked for again."""
        self._cache.clear()

    def frame(self) -> pd.DataFrame:
        """Return all fields in SI as a pandas frame with index t (s); text as it is."""
        import pandas as pd

        columns = {
            name: self.raw(name)[self.kept] if column.is_text else self.si(name)
            for name, column in self.columns.items()
        }
        return pd.DataFrame(columns, index=pd.Index(self.t, name="t"))


def is_outside(raw: NDArray[Any], limits: tuple[float, float]) -> NDArray[np.bool_]:
    """Return which raw values lie outside their limits, or are no numbers."""
    inside: NDArray[np.bool_] = (raw >= limits[0]) & (raw <= limits[1])
    return ~inside


def _read_only(values: NDArray[Any]) -> NDArray[Any]:
    values.flags.writeable = False
    return values
