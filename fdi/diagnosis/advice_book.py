"""What may be advised at all, and where does it come from?

In: the YAML files in ``advice/``. Out: a `Book`: for every part what tells that it is this one,
what to inspect in which order, what to record next time; the same for how a flight ended and for a
check of the set-up. Each entry names a source that anybody can read. What of it applies to a
finding, with the values of a log's parameters, is the matter of ``advising.py``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar, Final, Literal

from fdi import store
from fdi.errors import EntryError
from fdi.model.codec import FOREIGN, decode, encode
from fdi.model.parts import Component
from fdi.model.yaml import documents_in, read_document

FOLDER: Final = Path(__file__).parent / "advice"
OTHER: Final = "other"
"""The group, and the check, of what the book has no entry for."""
_NUMBERED: Final = re.compile(r"(.+?)[_ ][0-9]{1,2}")
_STRICT: Final = {"extra": "forbid"}
_KIND: Final = "advice"


@dataclass(frozen=True, slots=True)
class Source:
    """A page that anybody can read."""

    title: str
    address: str
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


@dataclass(frozen=True, slots=True)
class Wish:
    """What a parameter should be.

    Attributes
    ----------
    older : str
        Its name in older firmware.
    suggested : float or None
        None where it has to be read, and only the vehicle tells what is right.
    enough : tuple of float
        Others that do as well, or more.
    bit : int or None
        Of a mask: is to be set.
    bit_of : str
        The record for which ArduPilot's LOG_BITMASK needs a bit.
    """

    name: str
    older: str = ""
    suggested: float | None = None
    enough: tuple[float, ...] = ()
    bit: int | None = None
    bit_of: str = ""
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


@dataclass(frozen=True, slots=True)
class Entry:
    """One piece of advice; ``source`` is a key of `Book.sources`, ``on`` the one autopilot."""

    do: str
    why: str
    source: str
    on: Literal["", "ardupilot", "px4"] = ""
    parameter: Wish | None = None
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


Entries = tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """What is advised about a part, or about how a flight ended.

    Attributes
    ----------
    tell : tuple of Entry
        Shows whether it is this part, before anything is replaced.
    tests : mapping
        By the name of the model's statement that alarmed, with ``*`` and ``|``.
    kinds : mapping
        By the way in which it failed.
    check : tuple of Entry
        In any case, in this order.
    next : tuple of Entry
        What to record next time.
    """

    check: Entries
    tell: Entries = ()
    tests: Mapping[str, Entries] = field(default_factory=dict)
    kinds: Mapping[str, Entries] = field(default_factory=dict)
    next: Entries = ()
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


@dataclass(frozen=True, slots=True)
class Checked:
    """What is advised where a check of the set-up is wrong, and where it could not decide."""

    wrong: Entries
    undecided: Entries
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


@dataclass(frozen=True, slots=True)
class Rule:
    """When does a setting mean that a failsafe or check does less? As ``safety_net.yaml`` says.

    Attributes
    ----------
    parameter : str
        Its names, ``|`` between.
    is_, lacks : tuple of float
        It applies at one of these values; at none of these.
    bits : tuple of int
        It applies where one of these bits of a mask is set.
    lacks_bit : int or None
        It applies where this bit of a mask that is not 0 is missing.
    while_, unless : mapping
        Values of others that make it apply, or not.
    since, before : str
        Firmware, ``4.6``.
    """

    parameter: str
    on: Literal["ardupilot", "px4"]
    word: Literal["mistake", "risk", "note"]
    means: str
    source: str
    vehicles: tuple[str, ...] = ()
    is_: tuple[float, ...] = ()
    lacks: tuple[float, ...] = ()
    bits: tuple[int, ...] = ()
    lacks_bit: int | None = None
    while_: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    unless: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    since: str = ""
    before: str = ""
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT


@dataclass(frozen=True, slots=True)
class Book:
    """All that may be advised; ``logs`` by the format of a log that itself is the limit.

    ``net``: what of a vehicle's settings would not have helped.
    """

    sources: Mapping[str, Source] = field(default_factory=dict)
    parts: Mapping[str, Part] = field(default_factory=dict)
    groups: Mapping[str, Part] = field(default_factory=dict)
    ends: Mapping[str, Part] = field(default_factory=dict)
    checks: Mapping[str, Checked] = field(default_factory=dict)
    logs: Mapping[str, Entries] = field(default_factory=dict)
    net: Mapping[str, Rule] = field(default_factory=dict)
    __pydantic_config__: ClassVar[dict[str, str]] = _STRICT

    def group_of(self, component: str, components: Mapping[str, Component]) -> Part:
        """Return what is advised about all parts of a component's group."""
        known = components.get(component)
        return self.groups.get(known.group if known else OTHER, self.groups[OTHER])

    def part(self, component: str, components: Mapping[str, Component]) -> Part:
        """Return what is advised about a component; about its group where it has no entry.

        Parameters
        ----------
        component : str
            ``motor_4`` has the entry ``motor``.
        components : mapping of str to Component
            Those of the model.
        """
        return self.parts.get(_stem(component)) or self.group_of(component, components)

    def checked(self, name: str) -> Checked:
        """Return what is advised about a check of the set-up, ``compass 2`` as ``compass``."""
        return self.checks.get(_stem(name), self.checks[OTHER])

    def entries(self) -> Iterator[Entry]:
        """Yield every entry."""
        for part in (*self.parts.values(), *self.groups.values(), *self.ends.values()):
            lists = (part.tell, *part.tests.values(), *part.kinds.values(), part.check, part.next)
            yield from chain.from_iterable(lists)
        for check in self.checks.values():
            yield from (*check.wrong, *check.undecided)
        yield from chain.from_iterable(self.logs.values())


@cache
def load_book() -> Book:
    """Return the book; from the cache where the same files were read before.

    Raises
    ------
    ModelError
        A file of it is damaged.
    """
    paths = documents_in(FOLDER)
    key = store.digest(Path(__file__).read_bytes(), *(path.read_bytes() for path in paths))
    with suppress(*FOREIGN):  # a foreign entry of the cache: read anew
        return _whole(decode(Book, store.fetch(_KIND, key)))
    book = read_book(paths)
    store.keep(_KIND, key, encode(book))
    return book


def read_book(paths: Iterable[Path]) -> Book:
    """Return the book in YAML files.

    Raises
    ------
    ModelError
        A file of it is damaged.
    """
    from pydantic import TypeAdapter  # it reads slowly: 1 s, which the cache saves

    found: dict[str, dict[str, Any]] = {}
    for path in paths:
        for key, entries in read_document(path).tree.items():
            if key != "format":
                found.setdefault(key, {}).update(_each(entries))
    return _whole(TypeAdapter(Book).validate_python(found))


def _whole(book: Book) -> Book:
    """Refuse a book with a source that nobody can look up, or without the last resort."""
    named = {entry.source for entry in book.entries()} | {one.source for one in book.net.values()}
    unknown = sorted(named - set(book.sources))
    if unknown or OTHER not in book.groups or OTHER not in book.checks:
        raise EntryError(f"advice without a source: {', '.join(unknown)}")
    return book


def fits(pattern: str, name: str) -> bool:
    """Return whether a name is one of several with ``*`` between ``|``.

    Examples
    --------
    >>> fits("*_is_silent|*_stands_still", "motor_1_stands_still"), fits("mag_4", "mag_5")
    (True, False)
    """
    return any(fnmatchcase(name, one) for one in pattern.split("|"))


def _each(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return entries by one name each, where several share one: ``aileron|elevator``."""
    return {name: entry for names, entry in entries.items() for name in names.split("|")}


def _stem(name: str) -> str:
    found = _NUMBERED.fullmatch(name)
    return found[1] if found else name
