"""What did the comparison of one file find, and where does one column differ?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry import Message
from fdi.units import Conversion

REASONS: Final = {
    "lost_mixed": "frames that pymavlink's file reader loses where MAVLink 1 and 2 are mixed",
    "lost_after_damage": "intact records that the reference reader loses after damage",
    "no_index": "records that the reference reader cannot name (no definition in the file)",
    "refused": "files that the reference reader cannot read at all",
    "other_component": "frames of a further component with a message that the vehicle sends too",
    "repeat": "frames that came twice within a second: the first is kept",
    "unstated": "values whose unit the file does not state: only the raw ones are compared",
    "sentinel": "values that stand for unknown",
    "pulse": "pulse widths, which stay in microseconds",
    "corrected": "values whose stated unit is wrong or missing, corrected by the table",
    "multiplier": "values with a multiplier of the file that the reference reader leaves out",
    "cut_text": "texts that the reference reader cuts at a comma",
    "padding": "bytes between the fields of a record, which hold nothing",
    "characters": "characters of texts, which the reference reader shows as numbers",
    "absent": "values that were not sent (extensions of MAVLink 1) or that a flag declares invalid",
}


@dataclass(slots=True)
class Comparison:
    """What was compared; ``explained`` counts values or records by key of `REASONS`."""

    file: str
    kind: str
    records: int = 0
    fields: int = 0
    values: int = 0
    explained: Counter[str] = field(default_factory=Counter)
    unexplained: list[str] = field(default_factory=list)

    def demand(self, is_true: bool, what: str) -> bool:
        """Note an unexplained difference unless it is true."""
        if not is_true:
            self.unexplained.append(what)
        return is_true

    def compare_raw(self, message: Message, name: str, theirs: Sequence[Any]) -> None:
        """Compare one field's raw values, record by record in the file's order."""
        self.fields += 1
        self.values += len(theirs)
        if not self.demand(name in message.columns, f"{message.key}.{name}: we lack the field"):
            return
        ours = message.raw(name)
        where = f"{message.key}.{name}"
        if not self.demand(ours.size == len(theirs), f"{where}: {ours.size} for {len(theirs)}"):
            return
        rows = differing(ours, theirs)
        if rows.size:
            first = int(rows[0])
            self.unexplained.append(
                f"{where}: {rows.size} of {ours.size} differ, record {first}: "
                f"{ours[first]!r} for {theirs[first]!r}"
            )

    def compare_si(
        self,
        message: Message,
        name: str,
        stated: Conversion,
        reason: str = "",
        sentinels: Set[float] = frozenset({0.0, -1.0}),
    ) -> None:
        """Compare one field's SI values with what its stated unit makes of the raw ones.

        ``reason`` is counted for every value where it is not empty. Unknown may be only what the
        sentinels say, or the largest value of the type.
        """
        absent = message.columns[name].absent()
        raw = message.raw(name).astype(np.float64)
        ours = message.si_of_records(name)
        unknown = np.isnan(ours) & np.isfinite(raw)
        if absent is not None:
            unknown &= ~absent
            self.explained["absent"] += int(absent.sum())
        stands_for = set(np.unique(raw[unknown]).tolist())
        strange = sorted(stands_for - sentinels - _extremes(message.raw(name).dtype))
        self.demand(not strange, f"{message.key}.{name}: {strange[:5]} taken for unknown")
        self.explained["sentinel"] += int(unknown.sum())
        known = np.isfinite(ours)
        with np.errstate(over="ignore", invalid="ignore"):
            wanted = raw * stated.scale + stated.offset
            # the offset of a temperature costs digits of a small value
            slack = 1e-12 * np.abs(wanted) + 1e-12 * abs(stated.offset)
            wrong = known & (np.abs(ours - wanted) > slack)
        if reason:
            self.explained[reason] += int(known.sum())
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            self.unexplained.append(
                f"{message.key}.{name} in SI: {int(wrong.sum())} differ, record {first}: "
                f"{ours[first]!r} {message.unit(name)} for {wanted[first]!r} {stated.unit}"
            )


def _extremes(dtype: np.dtype[Any]) -> set[float]:
    return {float(np.iinfo(dtype).max)} if dtype.kind in "iu" else set()


def differing(ours: NDArray[Any], theirs: Sequence[Any]) -> NDArray[np.intp]:
    """Return the rows in which two columns differ; NaN equals NaN, integers compare exactly."""
    is_text = len(theirs) > 0 and isinstance(theirs[0], (str, bytes))
    if is_text or ours.dtype.kind not in "f":
        pairs = zip(ours.tolist(), theirs, strict=True)
        return np.flatnonzero([mine != other for mine, other in pairs])
    other = np.asarray(theirs, np.float64)
    mine = ours.astype(np.float64)
    return np.flatnonzero((mine != other) & ~(np.isnan(mine) & np.isnan(other)))
