"""What do a model file and its includes say, entry by entry, and where? Not yet understood."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

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
    """All entries of a file and of what it includes, by section and name, in reading order."""

    sections: dict[str, dict[str, Definition]] = field(
        default_factory=lambda: {section: {} for section in SECTIONS}
    )
    problems: list[str] = field(default_factory=list)
    digest: Any = field(default_factory=hashlib.sha256)
    looked: dict[Path, tuple[Path, str] | None] = field(default_factory=dict)
    checksums: dict[Path, str] = field(default_factory=dict)
    open_files: list[Path] = field(default_factory=list)
