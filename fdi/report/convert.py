"""How does a log reach other programs? A folder with a Parquet file per message.

In: a log and a folder's path. Out: the folder: ``metadata.json`` (`log_document`, with which file
holds which message) and one file for each message, as `Message.frame` gives it: a column ``t`` (s
of the log's clock), every field in SI, text as text, unknown as null. A field whose name ends with
the unit that it was recorded in (``time_boot_ms``, ``TimeUS``, ``discharged_mah``) stays in it: a
column holds what it is called. Units, as `fdi.units.si` spells them, stand in the fields' metadata,
what the log is in the schema's.

Names come from a stranger's log: a file name is made of what is harmless in them, and never a path.
Messages are converted one after the other and forgotten, so that memory holds one at a time.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from fdi import __version__
from fdi.report.folder import fresh_folder
from fdi.report.json_text import json_text
from fdi.report.log_document import log_document
from fdi.telemetry import Log, Message
from fdi.telemetry.message import Floats
from fdi.units import unit_in_name

DOCUMENT: Final = "metadata.json"
LONGEST: Final = 64
"""Letters of a file's name before its ending; MAVLink's longest message name has 45."""
PULSE: Final = "us"
"""What widths of pulses are in."""
ROWS: Final = 1 << 18
"""Rows that are written at a time: about 30 MB of a message with 15 fields."""
_HARMLESS: Final = re.compile(r"[^A-Za-z0-9_-]+")
_RESERVED: Final = re.compile(r"con|prn|aux|nul|(com|lpt)[0-9]", re.IGNORECASE)
"""Names that are devices on Windows, whatever their ending."""

Progress = Callable[[str, float], None]


def convert(
    log: Log, out: str | Path, *, force: bool = False, progress: Progress | None = None
) -> Path:
    """Write a log into a folder of Parquet files and return the folder.

    Parameters
    ----------
    log : Log
    out : str or Path
    force : bool
        Write into a folder that is not ours; no file in it that is not ours is lost.
    progress : callable, optional
        Is told the message at hand and the share of records done.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    names = file_names(log.messages)
    known = json_text({**_document(log), "files": names})  # decodes, so before anything is let go
    total, done = sum(len(message) + 1 for message in log.messages.values()), 0
    about = {
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": {
            "name": log.name,
            "sha256": log.sha256,
            "format": log.format,
            "vehicle": log.vehicle,
            "autopilot": log.autopilot,
        },
    }
    written = (*names.values(), DOCUMENT)
    with fresh_folder(Path(out), holds="log", names=written, force=force) as fresh:
        for key, message in log.messages.items():
            if progress:
                progress(key, done / total)
            _write(fresh / names[key], message, {**about, "message": key})
            done += len(message) + 1
            for other in log.messages.values():  # a message may be made of others
                other.forget()
        (fresh / DOCUMENT).write_text(known, "ascii")
    return Path(out)


def _document(log: Log) -> dict[str, Any]:
    """Return what is known of the log, with the units of the files."""
    document = log_document(log)
    for told in document["messages"]:
        message = log.messages[told["name"]]
        for name, unit in told["fields"].items():
            told["fields"][name] = None if unit is None else unit_of(message, name)
    return document


def unit_of(message: Message, name: str) -> str:
    """Return the unit of a numeric field in its file."""
    unit = message.unit(name)
    if unit == PULSE:  # alone it is a time, also to whoever reads the file again
        return f"{PULSE} (pulse)"
    return unit_in_name(name, message.columns[name].conversion) or unit


def _values(message: Message, name: str) -> Floats:
    """Return a numeric field as it is written, (n,); NaN where unknown."""
    values = message.si(name)
    if not unit_in_name(name, message.columns[name].conversion):
        return values
    recorded = message.raw(name)[message.kept].astype(np.float64)
    return np.where(np.isnan(values), np.nan, recorded)


def file_names(keys: Iterable[str]) -> dict[str, str]:
    """Return a file name for every message: harmless everywhere, no two alike in any case.

    Examples
    --------
    >>> file_names(["BARO", "BARO[1]", "baro", "../x", "NUL"])
    ... # doctest: +NORMALIZE_WHITESPACE
    {'BARO': 'BARO.parquet', 'BARO[1]': 'BARO_1.parquet', 'baro': 'baro-2.parquet',
     '../x': 'x.parquet', 'NUL': 'NUL_.parquet'}
    """
    names: dict[str, str] = {}
    taken: set[str] = set()
    for key in keys:
        stem = _HARMLESS.sub("_", key).strip("_")[:LONGEST] or "message"
        stem = f"{stem}_" if _RESERVED.fullmatch(stem) else stem
        name, number = stem, 1
        while name.lower() in taken:
            number += 1
            name = f"{stem}-{number}"
        taken.add(name.lower())
        names[key] = f"{name}.parquet"
    return names


def _write(path: Path, message: Message, about: dict[str, Any]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    names = _column_names(message)
    fields = [pa.field("t", pa.float64(), metadata={"unit": "s"})]
    columns = [pa.array(message.t)]
    for name, column in message.columns.items():
        told = (
            {"field": name} if column.is_text else {"field": name, "unit": unit_of(message, name)}
        )
        if column.is_text:
            texts = (str(text) for text in message.raw(name)[message.kept])
            whole = [text.encode("utf-8", "replace").decode() for text in texts]
            columns.append(pa.array(whole, pa.string()))
        else:
            columns.append(pa.array(_values(message, name), pa.float64(), from_pandas=True))
        fields.append(pa.field(names[name], columns[-1].type, metadata=told))
        message.forget()
    metadata = {**_for_pandas(message, names), b"fdi": json.dumps(about).encode()}
    table = pa.Table.from_arrays(columns, schema=pa.schema(fields, metadata=metadata))
    with path.open("xb") as file:
        pq.write_table(table, file, compression="zstd", row_group_size=ROWS)


def _column_names(message: Message) -> dict[str, str]:
    """Return the name of every field's column: its own, unless that is the time's."""
    other = "t_"
    while other in message:
        other += "_"
    return {field: other if field == "t" else field for field in message.fields}


def _for_pandas(message: Message, names: Mapping[str, str]) -> dict[bytes, bytes]:
    """Return the metadata by which pandas makes ``t`` the index again."""
    import pandas as pd
    import pyarrow as pa

    kinds = {
        names[name]: pd.Series(dtype="str" if column.is_text else "float64")
        for name, column in message.columns.items()
    }
    empty = pd.DataFrame(kinds, index=pd.Index([], dtype="float64", name="t"))
    return dict(pa.Schema.from_pandas(empty, preserve_index=True).metadata)
