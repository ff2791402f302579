"""Which faults, timeouts, rejections and states of its solution did the estimator report?

In: a log and its cores. Out: `Bits`: each by name with the spans in which it is set. Where the log
has one field a bit (``estimator_status_flags``), its names are taken. A mask is read by the layout
of its firmware (``masks.json``); where that is not known the bits keep their numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.records import Core, instance, table
from fdi.methods.estimator.spans import Span, spans_of
from fdi.telemetry import Log, Message

MOST_BITS: Final = 53
"""A double holds no more of a mask exactly."""
_RELEASE: Final = re.compile(r"(\d+)\.(\d+)")
_FLAGS: Final = "estimator_status_flags"


@dataclass(frozen=True, slots=True)
class Bit:
    """One statement of an estimator about itself.

    Attributes
    ----------
    kind : str
        ``fault``, ``timeout``, ``rejected``, ``solution``, ``control``, ``GPS check failed``.
    name : str
        As the firmware calls it, or ``bit 9``.
    core : int
    source : str
        The channel.
    spans : tuple of (from, to), s
        Where it is set.
    since : float
        s, the first record of its source: before that it is not known.
    """

    kind: str
    name: str
    core: int
    source: str
    spans: tuple[Span, ...]
    since: float


@dataclass(frozen=True, slots=True)
class Mask:
    """How one mask, or topic of bits, was read: by which names, and what is not certain of them.

    ``until``: s, its last record: what comes after is not known.
    """

    source: str
    kind: str
    core: int
    names: tuple[str | None, ...]
    until: float
    doubt: str = ""


@dataclass(frozen=True, slots=True)
class Bits:
    """What the estimator said of itself: the bits that are set at least once, and the masks."""

    set: tuple[Bit, ...]
    masks: tuple[Mask, ...]

    def of(self, kind: str) -> tuple[Bit, ...]:
        """Return the bits of a kind."""
        return tuple(bit for bit in self.set if bit.kind == kind)

    def spans(self, kind: str, name: str, core: int) -> tuple[Span, ...] | None:
        """Return where a bit of a core is set; None where no mask of this log has it."""
        if not any(m.kind == kind and m.core == core and name in m.names for m in self.masks):
            return None
        own = (bit.spans for bit in self.of(kind) if bit.name == name and bit.core == core)
        return next(own, ())

    def until(self, kind: str, core: int) -> float:
        """Return the last record of a core's bits of a kind, s; -inf where there is none."""
        return max(
            (m.until for m in self.masks if (m.kind, m.core) == (kind, core)), default=-np.inf
        )


def release_of(firmware: str | None) -> tuple[int, int] | None:
    """Return major and minor of a firmware's name, None where it has none.

    Examples
    --------
    >>> release_of("PX4 1.12.0dev (00229c4f)"), release_of(None)
    ((1, 12), None)
    """
    found = _RELEASE.search(firmware or "")
    return (int(found[1]), int(found[2])) if found else None


def bits_of(log: Log, cores: Sequence[Core]) -> Bits:
    """Return the bits that are set at least once, and how each mask was read."""
    bits: list[Bit] = []
    masks: list[Mask] = []
    for core in cores:
        by_name = list(_fields(log, core))
        kinds = {mask.kind for mask, _ in by_name}
        by_mask = [one for one in _masks(log, core) if one[0].kind not in kinds]
        for mask, found in (*by_name, *by_mask):
            masks.append(mask)
            bits.extend(found)
    return Bits(tuple(bits), tuple(masks))


def _fields(log: Log, core: Core) -> Iterator[tuple[Mask, list[Bit]]]:
    """Yield the bits of the topic that has a field for each, by kind."""
    message = log.messages.get(instance(_FLAGS, core.number))
    if not core.source.startswith("estimator_status") or message is None or not len(message):
        return
    for beginning, kind in table("masks")["fields"][_FLAGS].items():
        fields = [field for field in message.fields if field.startswith(beginning)]
        names = tuple(field.removeprefix(beginning) for field in fields)
        found = []
        for field, name in zip(fields, names, strict=True):
            spans = spans_of(message.t, message.si(field) > 0)
            if spans:
                channel = f"{message.key}.{field}"
                found.append(Bit(kind, name, core.number, channel, spans, float(message.t[0])))
        if names:
            until = float(message.t[-1])
            yield Mask(message.key, kind, core.number, names, until), found


def _masks(log: Log, core: Core) -> Iterator[tuple[Mask, list[Bit]]]:
    message = log[core.source]
    for row in table("masks")["masks"]:
        name, _, field = row["field"].partition(".")
        if fnmatchcase(message.name, name) and field in message:
            names, doubt = layout(row, release_of(log.firmware))
            source, until = f"{message.key}.{field}", float(message.t[-1])
            mask = Mask(source, row["kind"], core.number, names, until, doubt)
            yield mask, list(_mask(message, field, mask))


def layout(
    row: Mapping[str, Any], release: tuple[int, int] | None
) -> tuple[tuple[str | None, ...], str]:
    """Return a mask's names by bit for a release, and what is not certain about them."""
    if not row["layouts"]:
        return (), "no layout of this mask is known: bits by number"
    if all(one["from"] == "0.0" and one["before"] is None for one in row["layouts"]):
        return tuple(row["layouts"][0]["bits"]), ""
    if release is None:
        return (), "the log does not say which firmware wrote it: bits by number"
    for one in row["layouts"]:
        ends = one["before"]
        is_before = ends is None or release < (release_of(ends) or release)
        if (release_of(one["from"]) or release) <= release and is_before:
            names = tuple(one["bits"])
            certain = one["certain"]
            if certain is None:
                return names, ""
            told = f"of release {release[0]}.{release[1]}"
            if certain:
                return names, f"bits from {certain} on {told} by number"
            return names, f"names of the bits {told} are not certain"
    return (), f"no layout for release {release[0]}.{release[1]} is known: bits by number"


def _mask(message: Message, field: str, mask: Mask) -> Iterator[Bit]:
    values = message.si(field)
    known = np.isfinite(values) & (values >= 0) & (values < 2.0**MOST_BITS)
    whole: NDArray[np.int64] = values[known].astype(np.int64)
    if not whole.size:
        return
    t = message.t[known]
    for number in range(int(np.bitwise_or.reduce(whole)).bit_length()):
        is_set = (whole >> number) & 1 > 0
        if is_set.any():
            name = mask.names[number] if number < len(mask.names) else None
            spans = spans_of(t, is_set)
            shown = name or f"bit {number}"
            yield Bit(mask.kind, shown, mask.core, mask.source, spans, float(t[0]))
