"""How does a ULog get other values, with every other byte as it was?

Its records have a fixed size and no checksum; its flags say where parts were appended later.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry.formats.change import Change, put
from fdi.telemetry.formats.ulog.reader import appended_at, topics_of
from fdi.telemetry.log import Log


def write_ulog(log: Log, changes: Mapping[str, Change]) -> bytes:
    """Return the bytes of a log with changes, by key of the message.

    Raises
    ------
    UsageError
        A message is defined anew in the log.
    """
    data = log.data.copy()
    keep = np.ones(data.size, np.bool_)
    topics = topics_of(log.path, log.data)
    for key, change in changes.items():
        own = [topic for topic in topics if topic.key == key]
        if len(own) != 1 or own[0].at.size != log[key].stamp.size:
            raise UsageError(f"{key} is defined anew in the log, and cannot be rewritten")
        for name, (values, where) in change.values.items():
            field = own[0].layout.field(name)
            assert field is not None
            put(data, own[0].at[where] + field.offset, values[where], field.dtype)
        for first in own[0].at[change.lost].tolist() if change.lost is not None else ():
            size = 3 + int.from_bytes(data[first - 5 : first - 3].tobytes(), "little")
            keep[first - 5 : first - 5 + size] = False
    for place in appended_at(data):
        old = int.from_bytes(data[place : place + 8].tobytes(), "little")
        new = int(np.count_nonzero(keep[:old]))
        data[place : place + 8] = np.frombuffer(new.to_bytes(8, "little"), np.uint8)
    return data[keep].tobytes()
