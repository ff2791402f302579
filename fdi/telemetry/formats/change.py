"""What is to become of a message's records, and how is a number stored in a field?

In: raw numbers, as a log's own fields have them. A format's writer turns a `Change` into bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """What becomes of the raw records of a message, (m,) each as `Message.stamp`.

    ``values`` by field: raw numbers, of which those in ``where`` are written; ``lost``: records
    that are left out.
    """

    values: Mapping[str, tuple[NDArray[np.float64], Mask]]
    lost: Mask | None = None


def as_stored(raw: NDArray[np.float64], kind: np.dtype[Any]) -> NDArray[Any]:
    """Return raw numbers in the type of their field: rounded, and held at its ends."""
    if kind.kind in "iu":
        limits = np.iinfo(kind)
        # float64 does not hold the largest 64-bit numbers
        most = limits.max if kind.itemsize < 8 else np.nextafter(limits.max, 0)
        raw = np.clip(np.rint(raw), float(limits.min), float(most))
    return np.ascontiguousarray(raw.astype(kind))


def put(
    data: NDArray[np.uint8], at: NDArray[np.int64], raw: NDArray[np.float64], dtype: str
) -> None:
    """Write raw numbers, (n,), as values of a type that begin at these bytes, (n,)."""
    kind = np.dtype(dtype)
    packed = as_stored(raw, kind).view(np.uint8).reshape(-1, kind.itemsize)
    data[at[:, None] + np.arange(kind.itemsize)] = packed
