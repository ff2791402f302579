"""In which order, and in which loops, do computations depend on each other?

In: nodes and arrows. Out: strongly connected parts in topological order (Tarjan 1972), iterative
and over plain lists: many of these graphs have a dozen nodes and are built thousands of times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def strong_components(nodes: Sequence[int], arrows: Mapping[int, Sequence[int]]) -> list[list[int]]:
    """Return the strongly connected parts, sources first, each ascending.

    Parameters
    ----------
    nodes : sequence of int
    arrows : mapping of int to sequence of int
        Successors; those that are not among the nodes are ignored.

    Returns
    -------
    list of list of int

    References
    ----------
    Tarjan, SIAM J. Computing 1(2), 1972.

    Examples
    --------
    >>> strong_components([1, 2, 3], {1: [2], 2: [1, 3], 3: []})
    [[1, 2], [3]]
    """
    index = dict.fromkeys(nodes, -1)
    low: dict[int, int] = {}
    done: set[int] = set()  # nodes whose part is complete
    open_: list[int] = []
    parts: list[list[int]] = []
    for root in nodes:
        if index[root] >= 0:
            continue
        index[root] = low[root] = len(low)
        open_.append(root)
        stack = [(root, iter(arrows[root]))]
        while stack:
            node, successors = stack[-1]
            for other in successors:
                seen = index.get(other)
                if seen is None or other in done:
                    continue
                if seen < 0:
                    index[other] = low[other] = len(low)
                    open_.append(other)
                    stack.append((other, iter(arrows[other])))
                    break
                if seen < low[node]:
                    low[node] = seen
            else:
                stack.pop()
                if stack and low[node] < low[stack[-1][0]]:
                    low[stack[-1][0]] = low[node]
                if low[node] == index[node]:
                    cut = len(open_) - 1
                    while open_[cut] != node:
                        cut -= 1
                    part = sorted(open_[cut:])
                    del open_[cut:]
                    done.update(part)
                    parts.append(part)
    return parts[::-1]


def on_cycles(rows: Mapping[int, Sequence[int]]) -> set[tuple[int, int]]:
    """Return the entries that lie on a cycle of the bipartite graph of some equations.

    Parameters
    ----------
    rows : mapping of int to sequence of int
        Unknowns of each equation.

    Returns
    -------
    set of (int, int)
        Entries (equation, unknown). All others are bridges, which no loop can hold.

    References
    ----------
    Tarjan, "A note on finding the bridges of a graph", Information Processing Letters 2(6), 1974.

    Examples
    --------
    >>> sorted(on_cycles({0: (0, 1), 1: (0, 1, 2), 2: (2,)}))
    [(0, 0), (0, 1), (1, 0), (1, 1)]
    """
    holders: dict[int, list[int]] = {}
    for equation, row in rows.items():
        for unknown in row:
            holders.setdefault(unknown, []).append(~equation)
    # Unknowns are nodes 0, 1, ..., equations are nodes -1, -2, ...
    neighbours: dict[int, Sequence[int]] = {**holders, **{~e: row for e, row in rows.items()}}
    order: dict[int, int] = {}
    low: dict[int, int] = {}
    bridges: set[tuple[int, int]] = set()
    for root in neighbours:
        if root in order:
            continue
        order[root] = low[root] = len(order)
        stack = [(root, root, iter(neighbours[root]))]
        while stack:
            node, before, left = stack[-1]
            for other in left:
                if other not in order:
                    order[other] = low[other] = len(order)
                    stack.append((other, node, iter(neighbours[other])))
                    break
                if other != before:
                    low[node] = min(low[node], order[other])
            else:
                stack.pop()
                if stack:
                    low[before] = min(low[before], low[node])
                    if low[node] > order[before]:
                        bridges.add((~node, before) if node < 0 else (~before, node))
    return {(e, u) for e, row in rows.items() for u in row}.difference(bridges)
