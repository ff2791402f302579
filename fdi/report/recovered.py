"""How does a recovered block reach other programs? One table, CSV or Parquet.

In: a `Recovery`. Out: a file with a row a sample: ``t_s`` (s of the log's clock), ``method``, and
columns that have their unit in their name. The file appears whole or not at all.
"""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import Final

from fdi.errors import OutputError, UsageError
from fdi.methods.heading import Recovery
from fdi.report.folder import write_file

ENDINGS: Final = (".parquet", ".csv")


def check_file(path: Path, *, force: bool) -> None:
    """Refuse what could not be written later.

    Raises
    ------
    UsageError
        The name ends in no known format.
    OutputError
        There is a file already, or no folder to put it into.
    """
    if path.suffix.lower() not in ENDINGS:
        raise UsageError(f"{path.name} ends in neither of {', '.join(ENDINGS)}")
    if os.path.lexists(path) and not force:
        raise OutputError(
            "is there already", where=str(path), hint="name another file, or give --force"
        )
    if not path.parent.is_dir():
        raise OutputError("is no folder", where=str(path.parent))


def write_recovered(recovery: Recovery, path: Path, *, force: bool = False) -> Path:
    """Write a recovery into a file and return its path.

    Raises
    ------
    UsageError
        The name ends in no known format.
    OutputError
        There is a file already, or it cannot be written.
    """
    check_file(path, force=force)
    write_file(path, _bytes(recovery, path.suffix.lower()))
    return path


def _bytes(recovery: Recovery, ending: str) -> bytes:
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet as pq

    columns = {"t_s": recovery.t, "method": list(recovery.method), **recovery.columns}
    about = {b"fdi": f"{recovery.block} since {recovery.start:.6f} s".encode()}
    table = pa.table(columns).replace_schema_metadata(about)
    buffer = BytesIO()
    if ending == ".csv":
        pyarrow.csv.write_csv(table, buffer)
    else:
        pq.write_table(table, buffer, compression="zstd")
    return buffer.getvalue()
