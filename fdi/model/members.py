"""Which components does a model have, and which of their names look like a slip?

In: the definitions of a model file, and what was made of them. Out: its components, listed or only
named; and a line for each name that is not listed though one much like it is, or that is suspected
though nothing in the model is about such a component.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from itertools import chain

from fdi.model.definitions import Definitions
from fdi.model.parts import Component, Equation, Measurement
from fdi.model.schema import ComponentEntry

_STATEMENTS = ("equations", "limits", "equalities")
_MESSAGES = ("measurements", "inputs")


def members(
    found: Definitions, equations: Sequence[Equation], measurements: Sequence[Measurement]
) -> dict[str, Component]:
    """Return the components that a model lists, then those that it only names."""
    listed = {
        name: Component(
            name,
            d.entry.group,
            d.entry.description,
            tuple(dict.fromkeys(_disturbed(d.entry))),
            d.entry.computed,
            d.entry.name or "",
            ends_log=d.entry.ends_log,
            records=d.entry.records,
            part_of=d.entry.part_of or "",
        )
        for name, d in found.sections["components"].items()
    }
    named = [e.component for e in equations if e.component] + [m.component for m in measurements]
    named += [name for equation in equations for name in equation.suspects]
    for name in named:
        listed.setdefault(name, Component(name))
    return listed


def _disturbed(entry: ComponentEntry) -> list[str]:
    """Return whom a component disturbs: a part, first of all, the whole."""
    return [*([entry.part_of] if entry.part_of else []), *entry.affects]


def slips(found: Definitions) -> Iterator[str]:
    """Yield what looks like a slip in the name of a component, once for each name.

    A component need not be listed, so none of this is an error; and what is affected need not be in
    every model that includes the list. Names that differ in their numbers alone are of one kind.
    """
    listed = found.sections["components"]
    if not listed:
        return
    stated = dict(chain(_stated(found), _shown(found)))
    suspected = dict(_each(found, _STATEMENTS, "suspects"))
    affected = {
        definition.entry.part_of: definition.at("part_of")
        for definition in listed.values()
        if definition.entry.part_of
    } | dict(_each(found, ("components",), "affects"))
    told: set[str] = set()
    for name, where in chain(stated.items(), suspected.items(), affected.items()):
        if name in listed or name in told:
            continue
        told.add(name)
        kind = re.sub(r"\d+", "", name)
        others = [other for other in listed if re.sub(r"\d+", "", other) != kind]
        near = get_close_matches(name, others, n=1)
        meant = f"; did you mean {near[0]}?" if near else ""
        if name in suspected and name not in stated:
            yield f"{where}: {name!r} is no component that anything else is about{meant}"
        elif near:
            yield f"{where}: the component {name!r} is not listed{meant}"


def _stated(found: Definitions) -> Iterator[tuple[str, str]]:
    """Yield whom statements are about, the first of each name last."""
    for section in _STATEMENTS:
        for definition in reversed(found.sections[section].values()):
            if definition.entry.component:
                yield definition.entry.component, definition.at("component")


def _shown(found: Definitions) -> Iterator[tuple[str, str]]:
    """Yield what messages are of, the first of each name last."""
    for section in _MESSAGES:
        for definition in reversed(found.sections[section].values()):
            entry = definition.entry
            if entry.component and not all(one.component for one in entry.fields.values()):
                yield entry.component, definition.at("component")
            for name, field in reversed(entry.fields.items()):
                if field.component:
                    yield field.component, definition.at("fields", name, "component")


def _each(found: Definitions, sections: Sequence[str], key: str) -> Iterator[tuple[str, str]]:
    """Yield the names in a list of every entry, the first of each name last."""
    for section in sections:
        for definition in reversed(found.sections[section].values()):
            for place, name in enumerate(getattr(definition.entry, key)):
                yield name, definition.at(key, place)
