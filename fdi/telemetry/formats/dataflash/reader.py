"""What does an ArduPilot DataFlash log (`.bin`) hold?

In: the bytes of the file. Out: a `Log`. Layouts and units come from `layouts`, records from
`records`, columns from `tables`; `log` puts the log together, for text logs too.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from fdi.errors import LogError
from fdi.telemetry.formats.bounds import SINGLE
from fdi.telemetry.formats.dataflash.layouts import FMT, Bytes
from fdi.telemetry.formats.dataflash.log import Finding, by_instance, make_log
from fdi.telemetry.formats.dataflash.records import Records, all_records, is_mostly_records
from fdi.telemetry.formats.dataflash.tables import Blocks, Table, Tables
from fdi.telemetry.log import Log

_HEAD: Final = b"\xa3\x95\x80"
_SNIFF: Final = 1 << 20  # bytes looked at when the format is in question


def is_dataflash(data: Bytes) -> bool:
    """Return whether the bytes hold DataFlash records."""
    if data[:3].tobytes() == _HEAD:
        return True
    return is_mostly_records(data[:_SNIFF])


def read_dataflash(path: Path, data: Bytes, *, system: int | None = None) -> Log:
    """Return the log; ``system`` is without meaning here, the file is of one vehicle.

    Raises
    ------
    LogError
        There is no record in it.
    """
    if data[:3].tobytes() == _HEAD and data[9:25].tobytes().endswith(b" "):
        raise LogError(
            "is a PX4 sdlog2 log (.px4log), which this version does not read",
            where=path.name,
            hint="give a .tlog, an ArduPilot .bin or a PX4 .ulg",
        )
    records = all_records(data)
    tables = _tables(data, records)
    if not any(table.layout.fields and table.layout.number != FMT for table in tables):
        raise LogError("is a DataFlash log without a record of data", where=path.name)
    findings = [*_damage(records), *definition_findings(tables)]
    return make_log(path, "dataflash", data, tables, findings)


def tables_of(data: Bytes) -> list[Table]:
    """Return where the records of every message and instance are, for who rewrites them."""
    return by_instance(_tables(data, all_records(data)))


def _tables(data: Bytes, records: Records) -> list[Table]:
    source = Blocks(data, records)
    return [
        Table(one, start, source)
        for one, start in zip(records.layouts, records.starts, strict=True)
        if start.size
    ]


def _damage(records: Records) -> Iterator[Finding]:
    """Yield what lies between the records, with offsets and byte counts."""
    lost = records.lost.tolist()
    if records.is_cut:
        low, high = lost.pop()
        text = f"the file ends in the middle of a record: {high - low} bytes at byte {low}"
        yield Finding("truncated", low, low, high - low, text)
    if len(lost) > SINGLE:
        total, (first, _), (last, _) = sum(high - low for low, high in lost), lost[0], lost[-1]
        text = f"bytes that belong to no record: {len(lost)} places, {total} bytes in all, first "
        text += f"at byte {first}, last at byte {last}"
        yield Finding("lost_bytes", first, last, total, text)
        return
    for low, high in lost:
        text = f"bytes that belong to no record: {high - low} bytes at byte {low}"
        yield Finding("lost_bytes", low, low, high - low, text)


def definition_findings(tables: Tables) -> Iterator[Finding]:
    """Yield which definitions were missing or changed."""
    known = [table for table in tables if table.layout.is_known]
    if known:
        names = ", ".join(table.layout.name for table in known)
        count = sum(table.start.size for table in known)
        text = f"{count} records of types that the file does not define, read as known firmware "
        text += f"writes them: {names}"
        yield Finding("repaired", None, None, count, text)
    for table in tables:
        one, first, count = table.layout, int(table.start[0]), int(table.start.size)
        if not one.fields:
            text = f"{count} records of type {one.number}, {one.length} bytes each, first at byte "
            text += f"{first}: neither the file nor known firmware says what they hold"
            yield Finding("unknown_message", first, int(table.start[-1]), count, text)
        if one.renamed:
            text = f"{len(one.renamed)} labels of {one.name} are no names, or not the only ones of "
            text += f"that name: read as {', '.join(one.renamed[:5])}"
            yield Finding("repaired", None, None, count, text)
        if one.fields and one.since:
            text = f"{one.name} is defined anew at byte {one.since}: {count} records stand apart"
            yield Finding("repaired", None, None, count, text)
