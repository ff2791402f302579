"""What does a YAML file written by a stranger hold, and in which line?

In: a file. Out: a plain tree of dicts, lists and scalars, and the line of every entry. YAML 1.2 by
a safe loader of a kept library; anchors and aliases are refused (a 271-byte alias bomb loads in
1 ms and explodes when walked), so are duplicate keys, depths beyond 50 and files beyond 1 MB. The
node tree is walked here rather than constructed by the library: only nodes know their lines.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fdi.errors import ModelError

MAX_BYTES: Final = 1_000_000
MAX_DEPTH: Final = 50
STANDARD: Final = "tag:yaml.org,2002"

Place = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Document:
    """A YAML file as plain values, with the line (from 1) of every key and list entry."""

    name: str
    tree: dict[str, Any]
    lines: dict[Place, int]
    sha256: str

    def line(self, path: Place) -> int:
        """Return the line of an entry, or of the nearest entry that holds it."""
        for length in range(len(path), 0, -1):
            if path[:length] in self.lines:
                return self.lines[path[:length]]
        return 1


def documents_in(folder: Path) -> tuple[Path, ...]:
    """Return the YAML files of a folder, by name.

    Raises
    ------
    ModelError
        The folder cannot be read; a search by pattern would find nothing in it.
    """
    try:
        names = sorted(name for name in os.listdir(folder) if name.endswith(".yaml"))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ModelError(f"cannot be read: {reason}", where=str(folder)) from error
    return tuple(folder / name for name in names)


def read_document(path: Path, name: str | None = None) -> Document:
    """Return the document in a file.

    Raises
    ------
    ModelError
        The file cannot be read, is too large, or is not plain YAML with a mapping at the top; all
        duplicate keys are reported together.
    """
    label = name or path.name
    try:
        if not path.is_file():
            raise ModelError("is not a file" if path.exists() else "does not exist", where=label)
        if path.stat().st_size > MAX_BYTES:
            raise ModelError(f"is larger than {MAX_BYTES} bytes", where=label)
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise ModelError(f"cannot be read: {error.strerror}", where=label) from error
    except UnicodeDecodeError as error:
        raise ModelError(f"is not UTF-8 text (byte {error.start})", where=label) from None
    return parse_document(text, label)


def parse_document(text: str, name: str) -> Document:
    """Return the document in a text; see :func:`read_document`."""
    from ruamel.yaml import YAML, YAMLError

    loader = YAML(typ="safe", pure=True)
    try:
        root = loader.compose(text)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{name}:{mark.line + 1}" if mark else name
        raise ModelError(_one_line(error), where=where) from None
    except (RecursionError, ValueError) as error:
        reason = f"nested deeper than {MAX_DEPTH}" if isinstance(error, RecursionError) else error
        raise ModelError(f"is not YAML: {reason}", where=name) from None
    reader = _Reader(name)
    tree = reader.value(root, ()) if root is not None else None
    if reader.problems:
        raise ModelError.of(reader.problems)
    if not isinstance(tree, dict):
        raise ModelError("does not hold a mapping of keys to values", where=name)
    return Document(name, tree, reader.lines, hashlib.sha256(text.encode()).hexdigest())


def _one_line(error: Exception) -> str:
    problem = getattr(error, "problem", None) or str(error)
    context = getattr(error, "context", None)
    text = f"{context}: {problem}" if context else problem
    return "is not YAML: " + " ".join(str(text).split())


class _Reader:
    """Walks the node tree once; keeps lines and problems."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.lines: dict[Place, int] = {}
        self.problems: list[str] = []
        self._seen: set[int] = set()

    def problem(self, node: Any, text: str) -> None:
        self.problems.append(f"{self.name}:{node.start_mark.line + 1}: {text}")

    def value(self, node: Any, path: Place) -> Any:
        if node.anchor is not None or id(node) in self._seen:
            self.problem(node, "anchors and aliases are not allowed")
            return None
        self._seen.add(id(node))
        if len(path) > MAX_DEPTH:
            self.problem(node, f"nested deeper than {MAX_DEPTH}")
            return None
        prefix, _, tag = str(node.tag).rpartition(":")
        match type(node).__name__, tag if prefix == STANDARD else "":
            case "MappingNode", "map":
                return self._mapping(node, path)
            case "SequenceNode", "seq":
                return [self._entry(item, (*path, i)) for i, item in enumerate(node.value)]
            case "ScalarNode", ("null" | "bool" | "int" | "float" | "str" | "timestamp"):
                return _scalar(tag, node.value)
        self.problem(node, f"the tag {node.tag} is not allowed")
        return None

    def _entry(self, node: Any, path: Place) -> Any:
        self.lines[path] = node.start_mark.line + 1
        return self.value(node, path)

    def _mapping(self, node: Any, path: Place) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = key_node.value
            if not isinstance(key, str) or type(key_node).__name__ != "ScalarNode":
                self.problem(key_node, "a key must be a word")
                continue
            if key in result:
                first = self.lines[(*path, key)]
                self.problem(key_node, f"duplicate key {key!r}, first in line {first}")
                continue
            self.lines[(*path, key)] = key_node.start_mark.line + 1
            result[key] = self.value(value_node, (*path, key))
        return result


def _scalar(tag: str, text: str) -> Any:
    try:
        match tag:
            case "null":
                return None
            case "bool":
                return text.lower() == "true"
            case "int":
                digits = text.replace("_", "")
                if len(digits) > 30:
                    return float(digits)
                return int(digits, 0 if digits.lstrip("+-")[:2] in ("0x", "0o", "0b") else 10)
            case "float":
                return float(text.replace("_", "").replace(".inf", "inf").replace(".nan", "nan"))
    except ValueError:  # the library's idea of a number is wider than Python's
        return text
    return text
