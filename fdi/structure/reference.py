"""Reads reference models: JSON files of labels and incidence, with results that others computed.

In: a path. Out: the model, checked. The results that such a file holds are for tests.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fdi.errors import ModelError
from fdi.structure.incidence import Fault, Model


def load_reference(path: str | Path) -> Model:
    """Return the model of a reference file.

    Parameters
    ----------
    path : str or Path
        JSON with ``equations`` and ``unknowns`` (labels), ``incidence`` (``[equation, unknown,
        kind]``, indices from 0; kind ``"d"`` and ``"i"`` mark derivative and state of a
        differential constraint, ``"x"`` all else), ``faults`` (``{"name": ..., "equation": ...}``;
        entries with one name are one fault in several equations) and, optionally, ``nonsolvable``
        (``[equation, unknown]``).

    Returns
    -------
    Model
        Faults in order of the first occurrence of their names.

    Raises
    ------
    ModelError
        When the file cannot be read or is no such model.

    References
    ----------
    Frisk, Krysander, Jung, IFAC-PapersOnLine 50(1), 2017 (structural models of the toolbox of
    record, whose incidence matrices hold 1, 2 and 3 for the three kinds).

    Examples
    --------
    >>> load_reference("missing.json")
    Traceback (most recent call last):
    ...
    fdi.errors.ModelError: missing.json: cannot be read: No such file or directory
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except ValueError as error:
        raise ModelError(f"is not JSON: {error}", where=str(path)) from error
    try:
        return _from_reference(data)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        raise ModelError(
            f"is not a reference model: {type(error).__name__}: {error}", where=str(path)
        ) from error
    except ModelError as error:
        raise ModelError(error.message, where=str(path)) from error


def _from_reference(data: dict[str, Any]) -> Model:
    rows: list[list[int]] = [[] for _ in data["equations"]]
    for equation, unknown, _ in data["incidence"]:
        rows[equation].append(unknown)
    equations_of: dict[str, list[int]] = {}
    for fault in data["faults"]:
        equations_of.setdefault(fault["name"], []).append(fault["equation"])
    return Model(
        tuple(data["equations"]),
        tuple(data["unknowns"]),
        tuple(tuple(row) for row in rows),
        tuple(Fault(name, tuple(where)) for name, where in equations_of.items()),
        tuple((e, u, kind) for e, u, kind in data["incidence"] if kind != "x"),
        tuple((e, u) for e, u in data.get("nonsolvable", ())),
        data["name"],
    )
