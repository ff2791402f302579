"""Is this file a table of somebody's own, and what log is in it?

A CSV (separated by commas, semicolons or tabs) whose first line names a column ``t`` or ``time``,
or a Parquet file with one: each further column is a channel (`fdi.telemetry.columns`). Units stand
behind a name in brackets, ``GPS.alt [m]``; in Parquet also in the field's metadata as ``unit``,
where `fdi convert` puts them. An empty cell is unknown.
"""

from __future__ import annotations

import io
import json
import warnings
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.columns import MESSAGE, TIME_COLUMN, log_from_columns
from fdi.telemetry.log import Log

Data = NDArray[np.uint8]

_PARQUET: Final = b"PAR1"
_LONGEST_LINE: Final = 1 << 16
"""Bytes of the first line: a table of two thousand channels stays below."""
_TIMES: Final = ("t", "time")


def is_table(data: Data) -> bool:
    """Return whether the bytes are a Parquet file or begin with the names of a table's columns."""
    if data[: len(_PARQUET)].tobytes() == _PARQUET:
        return True
    names = _header(data)
    return names is not None and any(_split(name)[0].lower() in _TIMES for name in names[1])


def read_table(path: Path, data: Data, *, system: int | None = None) -> Log:
    """Return the log; ``system`` is without meaning here.

    Raises
    ------
    LogError
        The table cannot be read, or a column of it is no channel.
    """
    message = MESSAGE
    stated: dict[str, str] = {}
    if data[: len(_PARQUET)].tobytes() == _PARQUET:
        frame, stated, message = _parquet(path, data)
    else:
        frame = _text(path, data)
    columns, units = {}, {}
    for place, label in enumerate(frame.columns):
        name, unit = _split(str(label))
        name = TIME_COLUMN if name.lower() in _TIMES else name
        if name in columns:
            raise LogError(f"has two columns {name!r}", where=path.name)
        columns[name] = frame.iloc[:, place]
        if unit or str(label) in stated:
            units[name] = unit or stated[str(label)]
    return log_from_columns(columns, units, name=str(path), message=message, data=data)


def _header(data: Data) -> tuple[str, list[str]] | None:
    """Return what separates the columns of a text, and their names; None where it is no text."""
    line, newline, _ = data[:_LONGEST_LINE].tobytes().partition(b"\n")
    if not newline:
        return None
    try:
        text = line.decode("utf-8-sig").rstrip("\r")
    except UnicodeDecodeError:
        return None
    separator = max(",;\t", key=text.count)
    return separator, [name.strip().strip('"') for name in text.split(separator)]


def _text(path: Path, data: Data) -> Any:
    """Return a CSV as a frame, its columns named as they are in the file."""
    import pandas as pd

    found = _header(data)
    assert found is not None  # `is_table`
    separator, names = found
    try:
        with warnings.catch_warnings():
            # a row of more cells than there are names: pandas would drop the rest of it
            warnings.simplefilter("error", pd.errors.ParserWarning)
            frame = pd.read_csv(
                io.BytesIO(data.tobytes()),
                sep=separator,
                encoding="utf-8-sig",
                index_col=False,
                header=None,
                skiprows=1,
                names=list(range(len(names))),
            )
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        reason = str(error).strip().splitlines()[0]
        raise LogError(f"is no table of numbers: {reason}", where=path.name) from None
    frame.columns = pd.Index(names)
    return frame


def _split(label: str) -> tuple[str, str]:
    """Return the name and the unit of a column.

    Examples
    --------
    >>> _split("GPS[1].alt [m]"), _split("t"), _split("DATA.p [m/s]"), _split("esc[0].rpm")
    (('GPS[1].alt', 'm'), ('t', ''), ('DATA.p', 'm/s'), ('esc[0].rpm', ''))
    """
    name, bracket, rest = label.strip().rpartition(" [")
    if bracket and rest.endswith("]"):
        return name.strip(), rest[:-1].strip()
    return label.strip(), ""


def _parquet(path: Path, data: Data) -> tuple[Any, dict[str, str], str]:
    """Return the table as a frame, the units in it, and the message of which it is."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(pa.BufferReader(data.tobytes()))
        about = json.loads((table.schema.metadata or {}).get(b"fdi", b"{}"))
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).strip().splitlines()[0]
        raise LogError(f"is no readable Parquet file: {reason}", where=path.name) from None
    numbers = [
        field.name
        for field in table.schema
        if pa.types.is_floating(field.type)
        or pa.types.is_integer(field.type)
        or pa.types.is_boolean(field.type)
    ]
    units = {
        field.name: field.metadata[b"unit"].decode()
        for field in table.schema
        if field.metadata and b"unit" in field.metadata
    }
    frame = table.select(numbers).to_pandas(ignore_metadata=True)
    message = about.get("message", MESSAGE) if isinstance(about, dict) else MESSAGE
    return frame, units, str(message)
