"""Which frames are of which sender, and of which message?

In: the `Frames` of a file. Out: the rows of every sender's frames, and the `Payloads` of every
message of every sender. Senders and messages are numbered from 0 first: numpy sorts such small
numbers by counting, in a tenth of the time.

The compiled code puts all payloads in their places in one pass over the file. With numpy they are
gathered message by message when a field is asked for, which costs five times as much for all; so
they are with a file that is too large for a second copy of it in memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import ID_LIMIT, MessageDefinition, definition
from fdi.telemetry.formats.bounds import MOST_SENDERS, left_out
from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.tlog.columns import KEPT, Payloads
from fdi.telemetry.formats.tlog.frames import Frames
from fdi.telemetry.formats.tlog.kernels import number_groups, spread_payloads, spread_values
from fdi.telemetry.quality import QualityRecord

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Sender = tuple[int, int]  # system, component
Key = tuple[int, int, int]  # system, component, message number

_SENDERS: Final = 1 << 16
_FEW: Final = 8  # for so many numbers a pass for each is faster than sorting


def frames_by_sender(frames: Frames) -> dict[Sender, Ints]:
    """Return the rows of every sender's frames, in file order; senders ascending."""
    senders, place = _numbered(_sender(frames), _SENDERS)
    rows = _rows(place, senders.size)
    return {
        (code >> 8, code & 0xFF): part for code, part in zip(senders.tolist(), rows, strict=True)
    }


def without_senders(frames: Frames, system: int | None) -> tuple[Frames, list[QualityRecord]]:
    """Return the frames of those senders that sent most, and how many others there were.

    ``system``: the one that is asked for is not left out.
    """
    sender = _sender(frames)
    count = np.bincount(sender)
    codes = np.flatnonzero(count)
    if codes.size <= MOST_SENDERS:
        return frames, []
    is_asked = codes >> 8 == (-1 if system is None else system)
    order = np.lexsort((codes, -count[codes], ~is_asked))
    is_kept = np.zeros(count.size, np.bool_)
    is_kept[codes[order[:MOST_SENDERS]]] = True
    rows = np.flatnonzero(is_kept[sender])
    others, lost = codes.size - MOST_SENDERS, sender.size - rows.size
    return frames.of(rows), list(left_out(lost, f"frames of the {others} senders that sent least"))


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """The frames of a file by sender and message.

    ``payloads``: of every group, ascending by sender and number; ``group``: (n,), which one a frame
    is in, by its place in ``keys``.
    """

    payloads: Mapping[Key, Payloads]
    keys: tuple[Key, ...]
    group: NDArray[Any]

    def of_each(self, values: Floats) -> dict[Key, Floats]:
        """Return the values (n,) of all frames group by group."""
        some = self.payloads[self.keys[0]].frames
        spread = compiled(spread_values, some.data.size)
        if spread is None:
            return {key: values[payloads.rows] for key, payloads in self.payloads.items()}
        ends = np.cumsum([self.payloads[key].rows.size for key in self.keys])
        out = np.empty(values.size)
        spread(values, self.group, np.concatenate(([0], ends[:-1])), out)
        return dict(zip(self.keys, np.split(out, ends[:-1]), strict=True))


def group_payloads(frames: Frames) -> Groups:
    """Return the frames by sender and message."""
    number = compiled(number_groups, frames.data.size)
    if number is None:
        codes, group = _numbered_groups(frames)
    else:
        group = np.empty(frames.start.size, np.uint32)
        codes = number(frames.system, frames.component, frames.number, group)
    keys = tuple((code >> 24, code >> 16 & 0xFF, code & 0xFFFF) for code in codes.tolist())
    meanings = [_definition(number) for _, _, number in keys]
    spread = compiled(spread_payloads, frames.data.size)
    if spread is None or frames.data.size > KEPT:
        rows = _rows(group, len(keys))
        made = [Payloads(meaning, frames, rows[i]) for i, meaning in enumerate(meanings)]
    else:
        made = _spread(spread, frames, group, meanings)
    return Groups(dict(sorted(zip(keys, made, strict=True))), keys, group)


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
    spread: Callable[..., None],
    frames: Frames,
    group: NDArray[np.uint32],
    meanings: list[MessageDefinition],
) -> list[Payloads]:
    """Return the payloads of every group, found already."""
    size = np.array([meaning.size for meaning in meanings])
    count = np.bincount(group, minlength=size.size)
    last_row, last_byte = np.cumsum(count), np.cumsum(count * size)
    rows, flat = np.empty(last_row[-1], np.int64), np.empty(last_byte[-1], np.uint8)
    spread(
        frames.data,
        (frames.start, frames.version, frames.length, group),
        size,
        (last_row - count, last_byte - count * size),
        (rows, flat),
    )
    rows_of, bytes_of = np.split(rows, last_row[:-1]), np.split(flat, last_byte[:-1])
    return [
        Payloads(meaning, frames, part, [block.reshape(-1, meaning.size)])
        for meaning, part, block in zip(meanings, rows_of, bytes_of, strict=True)
    ]
