"""How did a top event come about? The value of a fault tree, and the path through it.

A node says in words what would have to be true, from when to when it was, and how the log knows.
Unknown is a value: a node without ``spans`` could not be seen in this log. A gate joins its
children as the autopilot's rule does; where the log tells the gate's own state, that is taken, and
the children explain it. They need not: a cause may lie between two records, or be none of them.
`unexplained` and `without_effect` say where the log contradicts the rule.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from fdi.methods.estimator.spans import Span, within

Gate = Literal["any", "all", "two", "event"]


@dataclass(frozen=True, slots=True)
class Node:
    """One node of a fault tree.

    Attributes
    ----------
    name : str
        What is true, for a person.
    spans : tuple of (from, to), s, or None
        When it was true; None: not in this log.
    because : str
        The channel, threshold or rule by which that is known, or why it is not.
    gate : str
        ``any`` (OR), ``all`` (AND), ``two`` (at least two) of its children; ``event`` has none.
    children : tuple of Node
    resolution : float
        s between the records by which it is known: its beginning is that uncertain.
    """

    name: str
    spans: tuple[Span, ...] | None
    because: str = ""
    gate: Gate = "event"
    children: tuple[Node, ...] = ()
    resolution: float = 0.0

    @property
    def since(self) -> float | None:
        """When it first became true, s; None: never, or not known."""
        return self.spans[0][0] if self.spans else None


def any_of(name: str, children: Sequence[Node], because: str = "") -> Node:
    """Return the node that is true while any child is; unknown where no child is known."""
    known = [child for child in children if child.spans is not None]
    spans = joined([span for child in known for span in child.spans or ()]) if known else None
    step = max((child.resolution for child in known), default=0.0)
    return Node(name, spans, because, "any", tuple(children), step)


def all_of(name: str, children: Sequence[Node], because: str = "") -> Node:
    """Return the node that is true while all children are; unknown where one is not known."""
    spans: tuple[Span, ...] | None = None
    if children and all(child.spans is not None for child in children):
        spans = children[0].spans or ()
        for child in children[1:]:
            spans = tuple(part for span in child.spans or () for part in within(spans, span))
        spans = tuple(sorted(spans))
    step = max((child.resolution for child in children), default=0.0)
    return Node(name, spans, because, "all", tuple(children), step)


def joined(spans: Sequence[Span]) -> tuple[Span, ...]:
    """Return the union of spans, sorted."""
    made: list[Span] = []
    for low, high in sorted(spans):
        if made and low <= made[-1][1]:
            made[-1] = (made[-1][0], max(made[-1][1], high))
        else:
            made.append((low, high))
    return tuple(made)


def cut(node: Node, window: Span) -> Node:
    """Return the tree with nothing outside a window: what was wrong before arming is no failure."""
    spans = None if node.spans is None else within(node.spans, window)
    return replace(node, spans=spans, children=tuple(cut(child, window) for child in node.children))


def path(top: Node) -> tuple[Node, ...]:
    """Return the nodes that led to the top event, the cause first; empty where it never came.

    At each gate it is the child that was true when the gate became true and whose beginning is
    nearest: the last straw of an OR, the last condition of an AND. Beginnings are compared no
    finer than the records tell them.
    """
    if top.since is None:
        return ()
    return (*_below(top, top.since), top)


def unexplained(node: Node) -> tuple[Span, ...]:
    """Return when an OR became true by the log's own word, and none of its children was true.

    Beginnings are compared no finer than the records tell them. Empty where the gate is computed
    from its children, and where there are none.
    """
    if node.gate != "any" or not node.children:
        return ()
    parts = [(child, span) for child in node.children for span in child.spans or ()]
    return tuple(
        (low, high)
        for low, high in node.spans or ()
        if not any(_holds_at(child, span, low, node.resolution) for child, span in parts)
    )


def without_effect(node: Node, child: Node) -> tuple[Span, ...]:
    """Return when a child of an OR became true, and the log says that the gate was not.

    Then the child alone is not enough for the gate, whatever the rule says. Empty where the gate
    is not known.
    """
    if node.gate != "any" or node.spans is None:
        return ()
    return tuple(
        (low, high)
        for low, high in child.spans or ()
        if not any(
            start <= high + child.resolution + node.resolution
            and end >= low - child.resolution - node.resolution
            for start, end in node.spans
        )
    )


def _holds_at(child: Node, span: Span, t: float, resolution: float) -> bool:
    slack = child.resolution + resolution
    return span[0] <= t + slack and span[1] >= t - slack


def _below(node: Node, t: float) -> tuple[Node, ...]:
    candidates = [
        (abs(low - t), child, (low, high))
        for child in node.children
        for low, high in child.spans or ()
        if _holds_at(child, (low, high), t, node.resolution)
    ]
    if not candidates:
        return ()
    _, child, span = min(candidates, key=lambda one: one[0])
    return (*_below(child, span[0]), replace(child, spans=(span,)))


def walk(top: Node) -> Iterator[tuple[Node, int, bool]]:
    """Yield a tree's nodes from the top, with their depths, and whether one stands there again.

    A branch that several nodes share is walked once: below a repeated node there is nothing.
    """
    seen: set[tuple[str, tuple[Span, ...] | None]] = set()
    below: list[tuple[Node, int]] = [(top, 0)]
    while below:
        node, depth = below.pop()
        key = node.name, node.spans
        is_again = bool(node.children) and key in seen
        yield node, depth, is_again
        seen.add(key)
        if not is_again:
            below.extend((child, depth + 1) for child in reversed(node.children))


def first_path(top: Node) -> tuple[Node, ...]:
    """Return the path to the top event, or to the highest node that came about without it."""
    if top.since is not None:
        return path(top)
    found = [p for p in map(first_path, top.children) if p]
    return min(found, key=lambda p: p[-1].since or 0.0, default=())
