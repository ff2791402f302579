"""What is known about these flights? The labels file.

In: a JSON file (``labels.json``). Out: a `Label` per flight, in the file's order. Further keys are
ignored; all problems of a file are reported together.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from fdi.errors import ModelError, UsageError
from fdi.shown import Shown

RAMP: Final = "ramp"
"""The kind of a slow fault; every other kind counts as a step."""


@dataclass(frozen=True, slots=True)
class Fault(Shown):
    """What failed, from ``onset`` to ``end`` (None: until the log ends), s of the log's clock."""

    component: str
    kind: str
    onset: float
    end: float | None = None

    @property
    def is_slow(self) -> bool:
        """Whether it grows from nothing."""
        return self.kind == RAMP


@dataclass(frozen=True, slots=True)
class Label(Shown):
    """What is known about one flight.

    Attributes
    ----------
    key : str
        The log's path relative to the labels file.
    use : str
        ``diagnosis``: scored; ``reading``: for readers only.
    accept : tuple of str
        Further components that are a right answer.
    evaluate_until : float or None
        s; nothing that begins later counts. None: to the end of the log.
    source : str
        The labels file, as it was named.
    provenance : str
        Where the log is from: a repository and the path in it.
    """

    key: str
    path: Path
    vehicle: str
    origin: str
    use: str
    faults: tuple[Fault, ...]
    accept: frozenset[str]
    evaluate_until: float | None
    source: str = ""
    provenance: str = ""

    @property
    def onset(self) -> float | None:
        """When the first fault begins, s; None on a healthy flight."""
        return min((fault.onset for fault in self.faults), default=None)


def load_labels(path: str | Path) -> tuple[Label, ...]:
    """Return the labels of a file.

    Raises
    ------
    ModelError
        It cannot be read, is no JSON, or says something that a label cannot say.
    """
    where = Path(path)
    try:
        tree = json.loads(where.read_text("utf-8"))
    except OSError as error:
        raise ModelError(f"cannot be read: {error.strerror or error}", where=str(path)) from error
    except (ValueError, RecursionError) as error:
        raise ModelError(f"is no JSON: {error}", where=where.name) from error
    return tuple(
        Label(
            key,
            where.parent / key,
            spec.vehicle,
            spec.origin,
            spec.use,
            tuple(Fault(f.component, f.kind, f.onset, f.end) for f in spec.faults),
            frozenset(spec.accept),
            spec.evaluate_until,
            str(path),
            spec.source,
        )
        for key, spec in _checked(tree, where.name).items()
    )


def select(labels: Sequence[Label], patterns: Sequence[str]) -> tuple[Label, ...]:
    """Return the labels whose key is like one of the patterns; all of them without any.

    Raises
    ------
    UsageError
        A pattern is like none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(label.key, pattern) for label in labels):
            raise UsageError(f"no flight in the labels is like {pattern!r}")
    if not patterns:
        return tuple(labels)
    return tuple(one for one in labels if any(fnmatchcase(one.key, p) for p in patterns))


def _checked(tree: Any, name: str) -> dict[str, Any]:
    from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

    number = Annotated[float, Field(allow_inf_nan=False)]

    class FaultEntry(BaseModel):
        model_config = ConfigDict(frozen=True)
        component: str = Field(min_length=1)
        kind: str
        onset: number
        end: number | None = None

    class LabelEntry(BaseModel):
        model_config = ConfigDict(frozen=True)
        vehicle: str
        origin: str = "recorded"
        source: str = ""
        use: Literal["diagnosis", "reading"] = "diagnosis"
        faults: list[FaultEntry]
        accept: list[str] = []
        evaluate_until: number | None = None

    class LabelsFile(BaseModel):
        flights: dict[str, LabelEntry]

    try:
        found = TypeAdapter(LabelsFile).validate_python(tree)
    except ValidationError as error:
        problems = [
            f"{name}: {': '.join(str(part) for part in item['loc'])}: {item['msg']}"
            for item in error.errors(include_url=False)
        ]
        raise ModelError.of(problems) from None
    return dict(found.flights)
