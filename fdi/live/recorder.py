"""The ``.tlog`` of a link, written as it goes: whole records only, at any moment.

Every write is one system call of whole records, on a file without a buffer: whoever stops the
process finds a file that ends with a record. What a full disk cuts is taken back.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import UTC, datetime
from io import FileIO
from pathlib import Path

from fdi.errors import OutputError


@dataclass(slots=True)
class Recorder:
    """An open file; ``size``: the bytes of whole records in it."""

    path: Path
    file: FileIO
    size: int = 0

    def write(self, records: bytes) -> None:
        """Append records.

        Raises
        ------
        OutputError
            They cannot be written; the file ends with the record before them.
        """
        if not records:
            return
        try:
            written = self.file.write(records) or 0
            if written < len(records):
                raise OSError(0, "the disk is full")
        except OSError as error:
            os.ftruncate(self.file.fileno(), self.size)
            told = f"cannot be written: {error.strerror or error}"
            raise OutputError(told, where=str(self.path)) from error
        self.size += written

    def close(self) -> None:
        """Close the file; one that holds nothing goes."""
        self.file.close()
        if not self.size:
            self.path.unlink(missing_ok=True)


def record(path: Path | None) -> Recorder:
    """Return a recorder of a new file, by default named after the time in the working folder.

    Raises
    ------
    OutputError
        There is a file of that name, or none can be made.
    """
    own = path or Path(f"{datetime.now(UTC):%Y-%m-%dT%H%M%SZ}.tlog")
    try:
        return Recorder(own, FileIO(own, "xb"))
    except FileExistsError as error:
        raise OutputError("is there already, and is not written over", where=str(own)) from error
    except OSError as error:
        told = f"cannot be written: {error.strerror or error}"
        raise OutputError(told, where=str(own)) from error
