"""What do a model file and its includes say, entry by entry, and where? Not yet understood."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from fdi.model.columns import Row
from fdi.model.given import Given
from fdi.model.parts import ModelFile
from fdi.model.yaml import Document, Place

SECTIONS: Final = (
    "components",
    "variables",
    "parameters",
    "equations",
    "limits",
    "equalities",
    "inputs",
    "measurements",
)


STATEMENTS: Final = ("equations", "limits", "equalities", "inputs", "measurements")
"""Where nothing refers to an entry by its name: two of one name need not mean the same."""


@dataclass(frozen=True, slots=True)
class Definition:
    """One entry of one file: what it says, and where."""

    entry: Any
    document: Document
    place: Place

    def at(self, *more: str | int) -> str:
        """Return ``file:line`` of the entry, or of a part of it."""
        return f"{self.document.name}:{self.document.line((*self.place, *more))}"


@dataclass(slots=True)
class Definitions:
    """All entries of a file and of what it includes, by section and name, in reading order.

    ``folder`` is that of the first file, ``files`` is what was read, ``rows`` are those of a file's
    ``for``, and ``taken`` those of the file that includes it, where it takes columns from there.
    ``functions`` are those that Python handed over, ``warnings`` what a person should know of it,
    ``strangers`` how many of the problems are unknown keys, beside which all else can be looked at.
    """

    folder: Path
    sections: dict[str, dict[str, Definition]] = field(
        default_factory=lambda: {section: {} for section in SECTIONS}
    )
    problems: list[str] = field(default_factory=list)
    strangers: int = 0
    warnings: list[str] = field(default_factory=list)
    digest: Any = field(default_factory=hashlib.sha256)
    looked: dict[Path, tuple[Path, str] | None] = field(default_factory=dict)
    checksums: dict[Path, str] = field(default_factory=dict)
    rows: dict[Path, Sequence[Row]] = field(default_factory=dict)
    taken: dict[Path, Sequence[Row]] = field(default_factory=dict)
    open_files: list[Path] = field(default_factory=list)
    files: list[ModelFile] = field(default_factory=list)
    functions: Mapping[str, Given] = field(default_factory=dict)

    def remove(self, section: str, name: str, among: set[tuple[str, str]]) -> bool:
        """Take out an entry, or ``MESSAGE.field`` of one; return whether it was there.

        Parameters
        ----------
        section, name : str
        among : set of (str, str)
            Sections and names that may be taken out; those that are leave it.
        """
        known = self.sections[section]
        here = [key for key in known if (section, key) in among]
        own = [key for key in here if key.partition("#")[0] == name]
        for key in own:
            del known[key]
            among.discard((section, key))
        if own or section not in ("inputs", "measurements"):
            return bool(own)
        message, _, part = name.partition(".")
        held = [
            key
            for key in here
            if key.partition("#")[0] == message and part in known[key].entry.fields
        ]
        for key in held:
            entry = known[key].entry
            fields = {field: item for field, item in entry.fields.items() if field != part}
            known[key] = replace(known[key], entry=entry.model_copy(update={"fields": fields}))
        return bool(held)
