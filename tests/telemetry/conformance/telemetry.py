"""Do the columns of a telemetry log hold what pymavlink decodes?

pymavlink's file reader says which frames there are. Where it loses intact ones (it does where
MAVLink 1 and 2 are mixed) its decoder, which checks the checksum, is given them one by one.
"""

from __future__ import annotations

import json
import os
from collections import Counter, defaultdict
from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.telemetry import Log, Message, read
from fdi.telemetry.log import Source
from fdi.units import Conversion, si

from .comparison import Comparison

Frames = list[tuple[bytes, Any]]
TABLE: Final = (
    Path(__file__).resolve().parents[3].parent / "shared" / "telemetry" / "fields_units.json"
)
_SENTINELS: Final = {0.0, -1.0, -180.0}  # -180: WIND.direction without an estimate
_NO_FIX: Final = 9999.0  # dilution of precision 99.99
_SPELLED: Final = {"m/s2": "m/s/s", "A.s": "mAh", "m/s down": "m/s", "1": ""}


def compare_telemetry(path: Path) -> Comparison:
    """Return what the comparison of a telemetry log found."""
    found = Comparison(path.name, "tlog")
    frames = _frames(path, found)
    found.records = len(frames)
    by_system: dict[int, Frames] = defaultdict(list)
    for frame in frames:
        by_system[frame[1].get_srcSystem()].append(frame)
    log = read(path)
    said = {s.system for s in log.sources}
    found.demand(said == set(by_system), f"systems: {sorted(said)} for {sorted(by_system)}")
    for system, own in sorted(by_system.items()):
        chosen = read(path, system=system)
        source = next(s for s in chosen.sources if s.chosen)
        _compare_system(chosen, source, own, found)
    return found


def _frames(path: Path, found: Comparison) -> Frames:
    """Return every intact frame, in the order of the file."""
    os.environ["MAVLINK20"] = "1"  # else definitions without extension fields, up to the first v2
    mavutil.set_dialect("ardupilotmega")
    stream: Frames = []
    reader = mavutil.mavlogfile(str(path))
    while (message := reader.recv_msg()) is not None:
        if message.get_type() != "BAD_DATA" and not message.get_type().startswith("UNKNOWN"):
            stream.append((bytes(message.get_msgbuf()), message))
    decoded = defaultdict(list)
    for frame, message in stream:
        decoded[frame].append(message)
    whole: Frames = []
    lost = 0
    for frame in _walk(path.read_bytes()):
        if decoded[frame]:
            whole.append((frame, decoded[frame].pop(0)))
        else:
            whole.append((frame, mav.MAVLink(None).decode(bytearray(frame))))
            lost += 1
    versions = {frame[0] for frame, _ in whole}
    if lost and found.demand(len(versions) == 2, f"pymavlink lacks {lost} intact frames"):
        found.explained["lost_mixed"] += lost
    rest = Counter({frame: len(left) for frame, left in decoded.items() if left})
    for frame, message in stream:  # behind damage, where the walk by length ended
        if rest[frame]:
            rest[frame] -= 1
            whole.append((frame, message))
    return whole


def _walk(data: bytes) -> Iterator[bytes]:
    """Yield the known frames from the first byte on, by their lengths, up to the first break."""
    at = 0
    while at + 16 <= len(data):
        is_v2 = data[at + 8] == 0xFD
        if not is_v2 and data[at + 8] != 0xFE:
            return
        size = data[at + 9] + (12 if is_v2 else 8) + (13 if is_v2 and data[at + 10] & 1 else 0)
        frame = data[at + 8 : at + 8 + size]
        number = int.from_bytes(frame[7:10], "little") if is_v2 else frame[5]
        known = mav.mavlink_map.get(number)
        if len(frame) < size or known is None:
            return
        covered = frame[1 : -15 if is_v2 and frame[2] & 1 else -2]
        check = mav.x25crc(covered + bytes([known.crc_extra])).crc
        if check != int.from_bytes(frame[1 + len(covered) : 3 + len(covered)], "little"):
            return
        yield frame
        at += 8 + size


def _compare_system(log: Log, source: Source, frames: Frames, found: Comparison) -> None:
    components: dict[str, set[int]] = defaultdict(set)
    for _, message in frames:
        components[message.get_type()].add(message.get_srcComponent())
    groups: dict[str, Frames] = defaultdict(list)
    for frame, message in frames:
        sent_by = components[message.get_type()]
        taken = source.component if source.component in sent_by else min(sent_by)
        if message.get_srcComponent() != taken:
            found.explained["other_component"] += 1
            continue
        instance = getattr(message, message._instance_field or "", 0)
        key = message.get_type()
        groups[f"{key}[{instance}]" if isinstance(instance, int) and instance else key].append(
            (frame, message)
        )
    for key, rows in sorted(groups.items()):
        if found.demand(key in log, f"system {source.system}: we lack {key}, {len(rows)} records"):
            ours = log[key]
            kept = _without_repeats(rows, ours.stamp.size)
            found.explained["repeat"] += len(rows) - len(kept)
            _compare_message(ours, [message for _, message in kept], found)


def _without_repeats(rows: Frames, count: int) -> Frames:
    """Return the frames without those that repeat an earlier one, if that makes the count."""
    if len(rows) == count:
        return rows
    last: dict[bytes, float] = {}
    kept = []
    for frame, message in rows:
        stamp = message._timestamp if hasattr(message, "_timestamp") else 0.0
        if frame not in last or not abs(stamp - last[frame]) < 1:
            kept.append((frame, message))
        last[frame] = stamp
    return kept


def _compare_message(ours: Message, theirs: list[Any], found: Comparison) -> None:
    meaning = type(theirs[0])
    for field in theirs[0].get_fieldnames():
        values = [getattr(message, field) for message in theirs]
        stated = si(meaning.fieldunits_by_name.get(field, ""))
        if isinstance(values[0], (list, tuple)):
            columns = {
                f"{field}[{k}]": column for k, column in enumerate(zip(*values, strict=True))
            }
        else:
            columns = {field: values}
        for name, column in columns.items():
            found.compare_raw(ours, name, column)
            if name in ours.columns and not ours.columns[name].is_text:
                _compare_meaning(ours, name, field, stated, found)


def _compare_meaning(
    ours: Message, name: str, field: str, stated: Conversion, found: Comparison
) -> None:
    mine = ours.columns[name].conversion
    listed = _corrections(f"{ours.name}.{field}")
    sentinels = {value for row in listed for value in row.invalid} | _SENTINELS
    if field in ("eph", "epv"):
        sentinels.add(_NO_FIX)
    if mine == stated:
        found.compare_si(ours, name, stated, "", sentinels)
    elif mine == Conversion("us") and field.endswith("_raw"):
        found.compare_si(ours, name, mine, "pulse", sentinels)
    else:
        fitting = [row.conversion for row in listed if row.conversion.scale == mine.scale]
        found.compare_si(ours, name, [*fitting, stated][0], "corrected", sentinels)


class _Correction(NamedTuple):
    """A row of the table: what a field is in SI, and which raw values mean unknown."""

    conversion: Conversion
    invalid: tuple[float, ...]


@cache
def _table() -> list[dict[str, Any]]:
    return list(json.loads(TABLE.read_text("utf-8"))["fields"])


@cache
def _corrections(channel: str) -> list[_Correction]:
    """Return what the table of wrong and silent units says of a field."""
    made = []
    for row in _table():
        message, _, fields = row["field"].partition(".")
        patterns = [f"{message}.{f.strip()}" for f in fields.split(",")]
        if any(fnmatchcase(channel, pattern) for pattern in patterns):
            unit = si(_SPELLED.get(str(row["unit"]), str(row["unit"])))
            scale = float(row["scale"]) if row["scale"] not in (None, "none") else 1.0
            conversion = Conversion(unit.unit, scale * unit.scale, unit.offset)
            made.append(_Correction(conversion, tuple(map(float, row.get("invalid") or ()))))
    return made
