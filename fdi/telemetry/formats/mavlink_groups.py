"""Which frames are of which sender, and of which message?

In: the `Frames` of a file. Out: the rows of every sender's frames, and the `Payloads` of every
message of every sender. Senders and messages are numbered from 0 first: numpy sorts such small
numbers by counting, in a tenth of the time.

The compiled code puts all payloads in their places in one pass over the file. With numpy they are
gathered message by message when a field is asked for, which costs five times as much for all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import ID_LIMIT, MessageDefinition, definition
from fdi.telemetry.formats.compiled import compiled
from fdi.telemetry.formats.mavlink_columns import KEPT, Payloads
from fdi.telemetry.formats.mavlink_frames import Frames
from fdi.telemetry.formats.mavlink_kernels import number_groups, spread_payloads

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Sender = tuple[int, int]  # system, component
Groups = Mapping[tuple[int, int, int], Payloads]  # (system, component, message number)

_Part = tuple[Ints, dict[str, Any]]  # rows, and what is known of the payloads

_SENDERS: Final = 1 << 16
_FEW: Final = 8  # for so many numbers a pass for each is faster than sorting


def frames_by_sender(frames: Frames) -> dict[Sender, Ints]:
    """Return the rows of every sender's frames, in file order; senders ascending."""
    senders, place = _numbered(_sender(frames), _SENDERS)
    rows = _rows(place, senders.size)
    return {
        (code >> 8, code & 0xFF): part for code, part in zip(senders.tolist(), rows, strict=True)
    }


def group_payloads(frames: Frames) -> Groups:
    """Return the payloads per sender and message, ascending by sender and number."""
    count_on = compiled(number_groups, frames.data.size)
    if count_on is None:
        keys, group = _numbered_groups(frames)
    else:
        group = np.empty(frames.start.size, np.uint32)
        keys = count_on(frames.system, frames.component, frames.number, group)
    meanings = [_definition(key & 0xFFFF) for key in keys.tolist()]
    spread = compiled(spread_payloads, frames.data.size)
    if spread is None or frames.data.size > KEPT:
        parts: list[_Part] = [(rows, {}) for rows in _rows(group, keys.size)]
    else:
        parts = _spread(spread, frames, group, [meaning.size for meaning in meanings])
    made = {}
    for i in np.argsort(keys).tolist():
        sender = int(keys[i]) >> 16
        key = sender >> 8, sender & 0xFF, meanings[i].id
        made[key] = Payloads(meanings[i], frames, *parts[i])
    return made


def _numbered_groups(frames: Frames) -> tuple[Ints, NDArray[Any]]:
    """Return the keys of the groups (sender and message number), and the group of every frame."""
    senders, sender = _numbered(_sender(frames), _SENDERS)
    numbers, number = _numbered(frames.number, ID_LIMIT)
    both = sender.astype(np.uint32) * np.uint32(numbers.size) + number
    pairs, group = _numbered(both, senders.size * numbers.size)
    return senders[pairs // numbers.size] << 16 | numbers[pairs % numbers.size], group


def _sender(frames: Frames) -> NDArray[np.uint16]:
    return frames.system * np.uint16(256) + frames.component


def _numbered(values: NDArray[Any], limit: int) -> tuple[Ints, NDArray[Any]]:
    """Return the distinct values, ascending, and for every value which of them it is.

    The values are integers in [0, limit); the second array has the smallest type that holds it.
    """
    distinct = np.flatnonzero(np.bincount(values))
    table = np.zeros(limit, np.min_scalar_type(max(distinct.size - 1, 0)))
    table[distinct] = np.arange(distinct.size)
    return distinct, table.take(values)


def _rows(place: NDArray[Any], count: int) -> list[Ints]:
    """Return where each of the numbers 0 .. count - 1 stands, ascending."""
    if count <= _FEW:
        return [np.flatnonzero(place == number) for number in range(count)]
    order = np.argsort(place, kind="stable")
    return np.split(order, np.cumsum(np.bincount(place, minlength=count))[:-1])


def _definition(number: int) -> MessageDefinition:
    found = definition(number)
    assert found is not None  # its checksum was right
    return found


def _spread(
    spread: Callable[..., None], frames: Frames, group: NDArray[np.uint32], size: list[int]
) -> list[_Part]:
    """Return the rows and the block of payloads of every group."""
    count = np.bincount(group, minlength=len(size))
    last_row, last_byte = np.cumsum(count), np.cumsum(count * size)
    rows, flat = np.empty(last_row[-1], np.int64), np.empty(last_byte[-1], np.uint8)
    spread(
        frames.data,
        (frames.start, frames.version, frames.length, group),
        np.array(size),
        (last_row - count, last_byte - count * size),
        (rows, flat),
    )
    rows_of, bytes_of = np.split(rows, last_row[:-1]), np.split(flat, last_byte[:-1])
    blocks = [part.reshape(-1, width) for part, width in zip(bytes_of, size, strict=True)]
    return [(part, {"block": block}) for part, block in zip(rows_of, blocks, strict=True)]
