"""How does a value of ours become a tree of JSON, and how is it read back without trust?

In: a frozen dataclass made of numbers, texts, tuples, mappings, expressions and dataclasses. Out: a
tree of JSON values, and back by the type annotations of its class. A dataclass is the list of its
fields, an expression the list of its nodes in postfix order, which needs no recursion however deep
the expression is. Reading checks every type, and every expression against the rules of the
language, so that a foreign file can neither run away nor bring a node that evaluation does not
know. What the names and numbers refer to is checked by whoever knows.

pydantic would do this too, at 60 ms for its import, which is as long as all the rest of a warm run.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from fdi.errors import EntryError
from fdi.model.expression import (
    COMPARISONS,
    FUNCTIONS,
    LOGICAL,
    NAME,
    Apply,
    Expression,
    Number,
    Symbol,
    Text,
    is_logical,
)

MAX_TOKENS: Final = 20_000
MAX_LEVELS: Final = 300
MAX_TEXT: Final = 20_000
ARITIES: Final[Mapping[str, tuple[int, int]]] = {
    **FUNCTIONS,
    **dict.fromkeys(("+", "*", "/", "**", *COMPARISONS.values()), (2, 2)),
    "-": (1, 2),
    "not": (1, 1),
    "and": (1, 1000),
    "or": (1, 1000),
}
NODES: Final = (Number, Symbol, Text, Apply)
FOREIGN: Final = (
    *(EntryError, ValueError, TypeError, KeyError, IndexError),
    *(AttributeError, OverflowError, RecursionError),
)
"""What reading a tree raises that another program wrote: such an entry counts as absent."""


def encode(value: Any) -> Any:
    """Return the tree of a value.

    Examples
    --------
    >>> from fdi.model.expression import parse
    >>> encode(parse("2*v + 1"))
    [2.0, 'v', ['*', 2], 1.0, ['+', 2]]
    """
    if isinstance(value, NODES):
        return _postfix(value)
    if isinstance(value, StrEnum):
        return value.value
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if is_dataclass(value):
        return [encode(getattr(value, field.name)) for field in fields(value)]
    if isinstance(value, tuple | list):
        return [encode(item) for item in value]
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, Mapping):
        return {str(key): encode(item) for key, item in value.items()}
    raise EntryError(f"{type(value).__name__} is not written to a cache")


def decode(kind: Any, tree: Any) -> Any:
    """Return the value of a kind (a type or an annotation) that a tree stands for.

    Raises
    ------
    EntryError
        The tree is not one of that kind.

    Examples
    --------
    >>> decode(tuple[int, ...], [1, 2])
    (1, 2)
    >>> decode(tuple[int, ...], [1, "2"])
    Traceback (most recent call last):
    fdi.errors.EntryError: not a number: '2'
    """
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return _decode_union(inner, tree)
    if origin is Literal:
        if not isinstance(tree, str) or tree not in inner:
            raise EntryError(f"not one of {inner}")
        return tree
    if origin is tuple:
        items = _list(tree)
        if inner[-1] is Ellipsis:
            return tuple(decode(inner[0], item) for item in items)
        return tuple(decode(k, item) for k, item in zip(inner, items, strict=True))
    if origin is frozenset:
        return frozenset(decode(inner[0], item) for item in _list(tree))
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(tree, dict):
            raise EntryError("not a mapping")
        return {decode(str, key): decode(inner[1], item) for key, item in tree.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        pairs = zip(_kinds(kind).items(), _list(tree), strict=True)
        return kind(**{name: decode(k, item) for (name, k), item in pairs})
    return _decode_plain(kind, tree)


def _decode_union(kinds: tuple[Any, ...], tree: Any) -> Any:
    if tree is None and types.NoneType in kinds:
        return None
    if set(NODES) <= set(kinds):
        return _from_postfix(_list(tree))
    for kind in kinds:
        if kind is not types.NoneType:
            with suppress(*FOREIGN):
                return decode(kind, tree)
    raise EntryError("not a value")


def _decode_plain(kind: Any, tree: Any) -> Any:
    if kind is bool:
        if not isinstance(tree, bool):
            raise EntryError("neither true nor false")
        return tree
    if kind in (int, float):
        if isinstance(tree, bool) or not isinstance(tree, int | kind):
            raise EntryError(f"not a number: {str(tree)[:40]!r}")
        return kind(tree)
    if not isinstance(tree, str) or len(tree) > MAX_TEXT:
        raise EntryError("not a text")
    return kind(tree)  # str, or an enumeration that refuses what it does not know


def _list(tree: Any) -> list[Any]:
    if not isinstance(tree, list):
        raise EntryError("not a list")
    return tree


@lru_cache(maxsize=64)
def _kinds(kind: type[Any]) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _postfix(expression: Expression) -> list[Any]:
    tokens: list[Any] = []
    stack: list[Expression] = [expression]
    while stack:
        node = stack.pop()
        match node:
            case Number(value):
                tokens.append(value)
            case Symbol(name):
                tokens.append(name)
            case Text(value):
                tokens.append({"text": value})
            case Apply(operator, arguments):
                tokens.append([operator, len(arguments)])
                stack.extend(arguments)
    return tokens[::-1]


def _from_postfix(tokens: list[Any]) -> Expression:
    if len(tokens) > MAX_TOKENS:
        raise EntryError(f"an expression of {len(tokens)} nodes")
    stack: list[tuple[Expression, int]] = []  # with the levels below it
    for token in tokens:
        match token:
            case bool():
                raise EntryError("not a node")
            case float() | int():
                stack.append((Number(float(token)), 0))
            case str() if NAME.match(token):
                stack.append((Symbol(token), 0))
            case {"text": str(word)} if len(word) <= MAX_TEXT:
                stack.append((Text(word), 0))
            case [str(operator), int(count)] if 0 < count <= len(stack):
                taken = stack[-count:]
                del stack[-count:]
                levels = 1 + max(level for _, level in taken)
                if levels > MAX_LEVELS:
                    raise EntryError(f"nested deeper than {MAX_LEVELS}")
                stack.append((_apply(operator, tuple(node for node, _ in taken)), levels))
            case _:
                raise EntryError("not a node")
    if len(stack) != 1 or isinstance(stack[0][0], Text):
        raise EntryError("not one expression")
    return stack[0][0]


def _apply(operator: str, arguments: tuple[Expression, ...]) -> Expression:
    """Return a node if the language has it: the rules of :func:`fdi.model.expression.parse`."""
    low, high = ARITIES.get(operator, (0, -1))
    if not low <= len(arguments) <= high:
        raise EntryError(f"{operator[:20]!r} of {len(arguments)} arguments")
    if operator in LOGICAL:
        if not all(is_logical(a) or isinstance(a, Symbol) for a in arguments):
            raise EntryError(f"{operator!r} of a quantity")
        return Apply(operator, arguments)
    if any(is_logical(a) for a in arguments):
        raise EntryError(f"{operator!r} of a condition")
    words = [place for place, a in enumerate(arguments) if isinstance(a, Text)]
    if words and (words != [1] or operator not in ("==", "!=")):
        raise EntryError(f"{operator!r} of a word")
    if operator == "**":
        exponent = arguments[1]
        if not isinstance(exponent, Number) or not math.isfinite(exponent.value):
            raise EntryError("an exponent that is not a number")
    return Apply(operator, arguments)
