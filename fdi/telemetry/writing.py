"""What are the bytes of this log with other values, in its own format?

`rewritten` takes a log and what becomes of its messages' records, and hands over to the format's
writer. Every other byte stays as it was.
"""

from __future__ import annotations

from collections.abc import Mapping

from fdi.errors import UsageError
from fdi.telemetry.formats import FORMATS
from fdi.telemetry.formats.change import Change
from fdi.telemetry.log import Log

__all__ = ["Change", "rewritten"]


def rewritten(log: Log, changes: Mapping[str, Change]) -> bytes:
    """Return the bytes of a log with changes, by key of the message.

    Raises
    ------
    UsageError
        Logs of this format, or this message of it, cannot be rewritten.
    """
    form = FORMATS.get(log.format)
    if form is None or form.write is None:
        known = ", ".join(name for name, one in FORMATS.items() if one.write is not None)
        raise UsageError(
            f"a log of format {log.format} cannot be rewritten yet",
            where=log.name,
            hint=f"those that can: {known}",
        )
    return form.write(log, changes)
