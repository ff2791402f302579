"""What do the tables of a report hold? CSV and Parquet.

In: an analysis. Out: bytes. Text cells that a spreadsheet would run as a formula are quoted by an
apostrophe; numbers carry nine significant digits.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.values import UNKNOWN
from fdi.result import Analysis

FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
"""A cell that begins so is a formula to a spreadsheet (OWASP, CSV injection)."""


def cell(value: str | float | int | None) -> str:
    """Return a value as the text of a CSV cell; unknown is empty.

    Examples
    --------
    >>> cell("=HYPERLINK(1)"), cell(-1.5), cell(None), cell("GPS_RAW_INT.alt")
    ("'=HYPERLINK(1)", '-1.5', '', 'GPS_RAW_INT.alt')
    """
    if value is None:
        return ""
    if isinstance(value, str):
        return f"'{value}" if value.startswith(FORMULA) else value
    return f"{value:.9g}" if math.isfinite(value) else ""


def csv_text(rows: Iterable[Sequence[str | float | int | None]]) -> str:
    """Return rows as CSV with line feeds."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows([cell(value) for value in row] for row in rows)
    return out.getvalue()


def fault_grid_csv(analysis: Analysis) -> str:
    """Return the fault grid: column ``t``, a column per fault with 0, 1 or nothing."""
    grid = analysis.diagnosis.grid
    said = {int(mark): "" if mark == UNKNOWN else str(mark) for mark in np.unique(grid.marks)}
    lines = [csv_text([["t", *grid.faults]])]
    for t, marks in zip(grid.t.tolist(), grid.marks.T.tolist(), strict=True):
        lines.append(",".join([cell(t), *(said[mark] for mark in marks)]) + "\n")
    return "".join(lines)


def isolability_csv(analysis: Analysis) -> str:
    """Return the matrix: 1 where the fault of the row is isolable from that of the column."""
    value = analysis.diagnosis.implementable
    matrix = value.matrix.astype(int).tolist()
    body = [[name, *row] for name, row in zip(value.faults, matrix, strict=True)]
    return csv_text([["fault", *value.faults], *body])


def residuals_parquet(analysis: Analysis) -> bytes:
    """Return the residuals, index ``t`` in s, a column per residual; metadata in the schema."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    own = _column_metadata(analysis)
    residuals = analysis.residual_values
    values = {g.id: row for g, row in zip(residuals.bank.generators, residuals.values, strict=True)}
    values["t"] = residuals.t
    schema = pa.schema(
        [pa.field(name, pa.float64(), metadata=own.get(name, {})) for name in values],
        metadata={
            b"pandas": _for_pandas(list(values)),
            b"fdi": json.dumps(
                {
                    "tool": {"name": "uav-fdi", "version": analysis.version},
                    "log": {"name": analysis.log.name, "sha256": analysis.log.sha256},
                    "model": {"name": analysis.airframe.name, "sha256": analysis.airframe.sha256},
                }
            ).encode(),
        },
    )
    out = io.BytesIO()
    arrays = [_column(column) for column in values.values()]
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), out, compression="zstd")
    return out.getvalue()


def _column(values: NDArray[np.float64]) -> Any:
    """Return a column for a table, null where it is NaN; ``pa.array`` imports pandas."""
    import pyarrow as pa

    is_known = np.packbits(~np.isnan(values), bitorder="little")
    buffers = [pa.py_buffer(part.tobytes()) for part in (is_known, values)]
    return pa.Array.from_buffers(pa.float64(), len(values), buffers)


def _for_pandas(names: Sequence[str]) -> bytes:
    """Return what makes a frame with the index ``t`` of columns of float64, as pandas writes it.

    Importing pandas for that takes longer than the rest of the table.
    """
    columns = [
        {
            "name": name,
            "field_name": name,
            "pandas_type": "float64",
            "numpy_type": "float64",
            "metadata": None,
        }
        for name in names
    ]
    return json.dumps({"index_columns": ["t"], "column_indexes": [], "columns": columns}).encode()


def _column_metadata(analysis: Analysis) -> dict[str, dict[bytes, bytes]]:
    system = analysis.system
    found: dict[str, dict[bytes, bytes]] = {"t": {b"unit": b"s"}}
    bank = analysis.bank
    for generator, signature in zip(bank.generators, bank.signature_names(), strict=True):
        unit = system.equations[generator.residual].unit
        found[generator.id] = {
            b"unit": unit.encode(),
            b"equations": json.dumps(
                [system.equations[i].name for i in generator.equations]
            ).encode(),
            b"residual_equation": system.equations[generator.residual].name.encode(),
            b"signature": json.dumps(list(signature)).encode(),
        }
    return found
