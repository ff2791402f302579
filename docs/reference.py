"""Which commands, options and fields are there? Asked of the code when the site is built.

So the pages cannot fall behind it: ``commands.md`` and ``json.md`` hold a directive where these
texts go.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from importlib.resources import files
from inspect import cleandoc
from typing import Any

import click


def commands() -> str:
    """Return all commands with their arguments and options, as Markdown."""
    from fdi.cli.commands import fdi

    lines: list[str] = []
    for name, command in fdi.commands.items():
        context = click.Context(command, info_name=f"fdi {name}")
        usage = " ".join([f"fdi {name}", *command.collect_usage_pieces(context)])
        said = cleandoc(command.help or "").replace("\b", "")
        lines += [f"## fdi {name}", "", f"`{usage}`", "", said, ""]
        options = [one for one in command.params if isinstance(one, click.Option)]
        records = (one.get_help_record(context) for one in options)
        rows = [(names, words) for names, words in filter(None, records)]
        lines += ["| option | what it does |", "| --- | --- |"]
        lines += [f"| `{_cell(names)}` | {_cell(words)} |" for names, words in rows]
        if command.epilog:
            lines += [
                "",
                f"Example: `{' '.join(command.epilog.split()).removeprefix('Example: ')}`",
            ]
        lines.append("")
    return "\n".join(lines)


def fields(schema: str) -> str:
    """Return the fields of a JSON document with their meaning, as a table in Markdown.

    Parameters
    ----------
    schema : str
        Name of a schema of `fdi.report`, such as ``analysis``.
    """
    document = json.loads(files("fdi.report").joinpath(f"{schema}.schema.json").read_text("utf-8"))
    found = list(_walk(document, ""))
    for name, node in document.get("$defs", {}).items():
        found += [(name, node), *_walk(node, name)]
    rows = [
        f"| `{path}` | {_cell(_kind(node))} | {_cell(node.get('description', ''))} |"
        for path, node in found
    ]
    return "\n".join(["| field | form | meaning |", "| --- | --- | --- |", *rows])


def _walk(node: Mapping[str, Any], path: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield every field below a node with its path; what has a name of its own is not entered."""
    node = _present(node)
    for name, own in node.get("properties", {}).items():
        place = f"{path}.{name}" if path else name
        yield place, own
        yield from _walk(own, place)
    if "items" in node:
        yield from _walk(node["items"], f"{path}[]")
    if isinstance(node.get("additionalProperties"), dict):
        yield from _walk(node["additionalProperties"], f"{path}.NAME")


def _present(node: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what a node is where it is not null."""
    others = [one for one in node.get("anyOf", ()) if one.get("type") != "null"]
    return others[0] if len(others) == 1 else node


def _kind(node: Mapping[str, Any]) -> str:
    own = _present(node)
    if "$ref" in own:
        kinds = [own["$ref"].rpartition("/")[2]]
    elif "enum" in own:
        return ", ".join("null" if one is None else str(one) for one in own["enum"])
    elif "const" in own:
        return str(own["const"])
    else:
        told = own.get("type", "any")
        kinds = [told] if isinstance(told, str) else list(told)
    if kinds == ["array"] and isinstance(own.get("items"), dict):
        kinds = [f"list of {_kind(own['items'])}"]
    return " or ".join(kinds if own is node else [*kinds, "null"])


def _cell(text: str) -> str:
    """Return text as a cell of a table holds it."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
