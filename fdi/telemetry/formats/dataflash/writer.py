"""How does a DataFlash log get other values, with every other byte as it was?

Its records have a fixed size and no checksum. Logs in text form are not written.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry.formats.change import Change, put
from fdi.telemetry.formats.dataflash.reader import tables_of
from fdi.telemetry.log import Log


def write_dataflash(log: Log, changes: Mapping[str, Change]) -> bytes:
    """Return the bytes of a log with changes, by key of the message.

    Raises
    ------
    UsageError
        A message is defined anew in the log.
    """
    data = log.data.copy()
    keep = np.ones(data.size, np.bool_)
    for key, change in changes.items():
        message = log[key]
        own = [
            table
            for table in tables_of(log.data)
            if table.layout.name == message.name and table.instance == message.instance
        ]
        if len(own) != 1 or own[0].start.size != message.stamp.size:
            raise UsageError(f"{key} is defined anew in the log, and cannot be rewritten")
        layout, start = own[0].layout, own[0].start.astype(np.int64)
        for name, (values, where) in change.values.items():
            field = layout.field(name)
            assert field is not None
            put(data, start[where] + field.offset, values[where], field.dtype)
        if change.lost is not None:
            gone = start[change.lost]
            keep[(gone[:, None] + np.arange(layout.length)).ravel()] = False
    return data[keep].tobytes()
