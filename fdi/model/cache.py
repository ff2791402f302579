"""Was this very model assembled before?

In: the path of a model file. Out: the airframe that an earlier process assembled from the same
bytes, or nothing. An entry holds, beside the airframe, every place where an included file was
looked for, with the checksum of what was found there, and is used only while all of that still
holds. What is read back is checked as far as evaluation relies on it: a name that nothing defines
makes the entry foreign.

It saves the import of ruamel.yaml, pydantic and pint, and the parsing: 0.4 s of a warm run.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from fdi import store
from fdi.errors import EntryError
from fdi.model.airframe import Airframe
from fdi.model.codec import FOREIGN, decode, encode
from fdi.model.expression import symbols
from fdi.model.parts import STATES, Equation, Measurement
from fdi.model.yaml import MAX_BYTES

KIND = "airframe"
Looked = Mapping[Path, tuple[Path, str] | None]
"""Where a file was looked for: what it resolved to with its checksum, or None where none was."""


def recall(path: Path, folder: Path) -> Airframe | None:
    """Return the airframe that is kept for a model file.

    Parameters
    ----------
    path : Path
        Of the model file.
    folder : Path
        Of the shipped models, where included files are looked for as well.
    """
    key = _key(path, folder)
    text = store.fetch_text(KIND, key) if key else None
    if text is None:
        return None
    try:
        looked, airframe = _read(text)
        return airframe if _holds(looked) else None
    except FOREIGN:
        return None


@lru_cache(maxsize=4)  # a batch meets the same vehicle again and again
def _read(text: bytes) -> tuple[list[list[str]], Airframe]:
    """Return what an entry says: where files were looked for, and the airframe, checked."""
    entry = json.loads(text)
    airframe: Airframe = decode(Airframe, entry["airframe"])
    _check(airframe)
    return entry["looked"], airframe


def remember(path: Path, folder: Path, looked: Looked, airframe: Airframe) -> None:
    """Keep the airframe of a model file."""
    main = looked.get(path)
    if main is None:
        return
    entry = {
        "looked": [
            [os.path.abspath(place), *((str(found[0]), found[1]) if found else ())]
            for place, found in looked.items()
        ],
        "airframe": encode(airframe),
    }
    store.keep(KIND, _key_of(path, folder, main[1]), entry)


def _key(path: Path, folder: Path) -> str | None:
    checksum = _checksum(path)
    return _key_of(path, folder, checksum) if checksum else None


def _key_of(path: Path, folder: Path, checksum: str) -> str:
    return store.digest(os.path.abspath(path), str(folder), checksum)


def _checksum(path: Path) -> str | None:
    try:
        if not path.is_file() or path.stat().st_size > MAX_BYTES:
            return None
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None


def _holds(looked: list[list[str]]) -> bool:
    """Return whether every place still holds what it held, or still nothing."""
    for place, *found in looked:
        path = Path(place)
        if not found:
            if path.is_file():
                return False
        elif [str(path.resolve()), _checksum(path)] != found:
            return False
    return True


def _check(airframe: Airframe) -> None:
    """Raise EntryError where a name leads nowhere."""
    tables: tuple[Mapping[str, Any], ...] = (
        airframe.components,
        airframe.variables,
        airframe.parameters,
    )
    if any(value.name != name for table in tables for name, value in table.items()):
        raise EntryError("an entry under another name")
    known = {*airframe.variables, *airframe.parameters}
    for equation in airframe.equations:
        _check_equation(equation, known, airframe)
    for measurement in airframe.measurements:
        _check_measurement(measurement, airframe)


def _check_equation(equation: Equation, known: set[str], airframe: Airframe) -> None:
    used = {*symbols(equation.left), *symbols(equation.right)}
    used.update(name for error in (*equation.errors, *equation.swings) for name in symbols(error))
    condition = symbols(equation.when) if equation.when else ()
    strangers = (used | (equation.solves or frozenset())) - known
    strangers |= set(condition) - known - STATES
    if strangers or (equation.component and equation.component not in airframe.components):
        raise EntryError(f"{equation.name}: a name that nothing defines")


def _check_measurement(measurement: Measurement, airframe: Airframe) -> None:
    if (
        measurement.variable not in airframe.variables
        or measurement.component not in airframe.components
    ):
        raise EntryError(f"{measurement.channel}: a name that nothing defines")
