"""What does the table of many logs hold, and does a row come back from the disk as it was?

In: rows of `fdi.fleet.analyze_log`. Out: a Parquet file with a row a log, or one line of JSON a
row, and back. Both carry checksums (Parquet's of its pages; ``check`` in a line, the CRC-32 of the
line without it), so that a damaged row is told from a true one.

``accused``, ``consequences``, ``ruled_out``, ``not_testable`` and ``warnings`` are lists of text,
``findings`` and ``quality`` lists of structs, ``names`` what a person calls each component,
``timings_s`` a map. ``ended``, ``end_s``, ``end_speed`` (m/s) and ``lost_control_s`` say how the
flight ended that ended worst; ``outlook`` is what a glance should tell; ``advice`` what to do
first, in a line; ``hardware`` is what tells the vehicle from others (``hardware_kind``: ``board``,
``sensors``, ``none``); ``trends`` (SI, `fdi.trends`) and ``curves`` (height and speed in a few
samples, customary units) are what the page of a fleet shows; ``track`` (whole seconds since boot,
rad) is what tells logs of one flight, and ``same_flight_as`` the path of the first of them;
``report`` is the folder of the log's report, beside the table, or ``report_error`` why there is
none; ``fingerprint`` is what a row is known by when work is resumed.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fdi.fleet import Row

if TYPE_CHECKING:
    import pyarrow as pa

_OURS: Final = {b"tool": b"uav-fdi", b"holds": b"batch"}
_FINDING: Final = {
    "rank": "int64",
    "flight": "int64",
    "component": "string",
    "faults": ["string"],
    "kind": "string",
    "onset_s": "double",
    "onset_boot_s": "double",
    "alarm_s": "double",
    "end_s": "double",
    "confidence": "double",
    "because": [{"feature": "string", "weight": "double"}],
    "rivals": [{"component": "string", "probability": "double"}],
    "text": "string",
}
_TREND: Final = {
    "quantity": "string",
    "part": "string",
    "flight": "int64",
    "value": "double",
    "std": "double",
    "unit": "string",
}
COLUMNS: Final[dict[str, Any]] = {
    "path": "string",
    "format": "string",
    "sha256": "string",
    "bytes": "int64",
    "duration_s": "double",
    "start_utc": "string",
    "vehicle": "string",
    "autopilot": "string",
    "firmware": "string",
    "system_id": "int64",
    "hardware": "string",
    "hardware_kind": "string",
    "flights": "int64",
    "airborne_s": "double",
    "ended": "string",
    "end_s": "double",
    "end_speed": "double",
    "lost_control_s": "double",
    "model": "string",
    "policy": "string",
    "verdict": "string",
    "outlook": "string",
    "advice": "string",
    "accused": ["string"],
    "findings": [_FINDING],
    "consequences": ["string"],
    "ruled_out": ["string"],
    "not_testable": ["string"],
    "names": [{"component": "string", "name": "string"}],
    "quality": [{"kind": "string", "count": "int64", "text": "string"}],
    "safety_net": ["string"],
    "stood_out": ["string"],
    "warnings": ["string"],
    "trends": [_TREND],
    "curves": [{"name": "string", "unit": "string", "t": ["double"], "value": ["double"]}],
    "track": {"boot_s": ["int64"], "lat": ["double"], "lon": ["double"]},
    "same_flight_as": "string",
    "report": "string",
    "report_error": "string",
    "timings_s": "map",
    "seconds": "double",
    "error": "string",
    "error_kind": "string",
    "fingerprint": "string",
}


def line_of(row: Row) -> str:
    """Return a row as a line of JSON with its checksum."""
    return _text({**row, "check": _check(row)}) + "\n"


def plain_line_of(row: Row) -> str:
    """Return a row as a line of JSON for other programs: the columns of the table."""
    return _text({name: row[name] for name in COLUMNS}) + "\n"


def row_of(line: str) -> Row | None:
    """Return the row of a line; None where it is cut, damaged or of another version."""
    try:
        row = json.loads(line)
        check = row.pop("check")
    except (ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return None
    return row if row.keys() == COLUMNS.keys() and check == _check(row) else None


def _text(row: Row) -> str:
    return json.dumps(row, allow_nan=False)


def _check(row: Row) -> int:
    return zlib.crc32(_text(row).encode())


def table_of(rows: Sequence[Row]) -> bytes:
    """Return rows as the content of a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    plain = [{**row, "timings_s": list(row["timings_s"].items())} for row in rows]
    table = pa.Table.from_pylist(plain, schema=_schema().with_metadata(_OURS))
    buffer = BytesIO()
    pq.write_table(table, buffer, write_page_checksum=True)
    return buffer.getvalue()


def is_table(path: Path) -> bool:
    """Return whether a file ends as a table of ours does."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        about = pq.read_schema(path).metadata or {}
    except (OSError, ValueError, pa.ArrowException):  # a name that is no text is a ValueError
        return False
    return all(about.get(key) == value for key, value in _OURS.items())


def rows_of(path: Path) -> list[Row] | None:
    """Return the rows of a table; None where it is damaged or of another version."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path, page_checksum_verification=True)
        if not table.schema.equals(_schema()):
            return None
        rows = table.to_pylist()
    except (OSError, ValueError, pa.ArrowException):
        return None
    return [{**row, "timings_s": dict(row["timings_s"])} for row in rows]


def _schema() -> pa.Schema:
    import pyarrow as pa

    return pa.schema([(name, _type(what)) for name, what in COLUMNS.items()])


def _type(what: Any) -> pa.DataType:
    """Return the Arrow type of a column: a name, [type of a list's items], {field: type}."""
    import pyarrow as pa

    if isinstance(what, list):
        return pa.list_(_type(what[0]))
    if isinstance(what, dict):
        return pa.struct([(name, _type(inner)) for name, inner in what.items()])
    if what == "map":
        return pa.map_(pa.string(), pa.float64())
    return pa.type_for_alias(what)
