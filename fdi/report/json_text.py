"""How is a document written as JSON, the same byte for byte?

In: plain values. Out: text that a person can read and ``diff`` compares well: one line a key, lists
of plain values on one line, lists of objects one entry a line. ASCII only, so that it passes every
terminal and file system. A number that is not known is null; one that is not finite is a defect and
raises.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, Final

FLAT_DEPTH: Final = 3
"""Objects nested deeper stay on one line."""


def number(value: float | None) -> float | None:
    """Return a finite number rounded to nine significant digits, or None."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.9g}")


def json_text(document: Mapping[str, Any]) -> str:
    """Return a document as JSON with a line feed at its end.

    Raises
    ------
    ValueError
        A number is not finite.

    Examples
    --------
    >>> print(json_text({"a": [1, 2], "b": [{"c": None}]}), end="")
    {
      "a": [1, 2],
      "b": [
        {"c": null}
      ]
    }
    """
    return _text(document, 0) + "\n"


def _text(value: Any, depth: int) -> str:
    pad, end = "  " * (depth + 1), "\n" + "  " * depth
    if isinstance(value, Mapping) and value and depth < FLAT_DEPTH:
        inner = [f"{pad}{json.dumps(key)}: {_text(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner) + end + "}"
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return "[\n" + ",\n".join(pad + _flat(item) for item in value) + end + "]"
    return _flat(value)


def _flat(value: Any) -> str:
    return json.dumps(value, allow_nan=False, separators=(", ", ": "))
