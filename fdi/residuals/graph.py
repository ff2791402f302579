"""In which order, and in which loops, do computations depend on each other?

In: nodes and arrows. Out: strongly connected parts in topological order (Tarjan 1972), iterative.
``fdi.structure`` has the same graph over whole models as arrays; here the graphs have a dozen nodes
and are built thousands of times, for which plain lists are ten times faster.
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

    Examples
    --------
    >>> strong_components([1, 2, 3], {1: [2], 2: [1, 3], 3: []})
    [[1, 2], [3]]
    """
    inside = set(nodes)
    index: dict[int, int] = {}
    low: dict[int, int] = {}
    open_: list[int] = []
    parts: list[list[int]] = []
    for root in nodes:
        if root in index:
            continue
        index[root] = low[root] = len(index)
        open_.append(root)
        stack = [(root, iter(arrows[root]))]
        while stack:
            node, successors = stack[-1]
            for other in successors:
                if other not in inside:
                    continue
                if other not in index:
                    index[other] = low[other] = len(index)
                    open_.append(other)
                    stack.append((other, iter(arrows[other])))
                    break
                if other in open_:
                    low[node] = min(low[node], index[other])
            else:
                stack.pop()
                if stack:
                    low[stack[-1][0]] = min(low[stack[-1][0]], low[node])
                if low[node] == index[node]:
                    cut = open_.index(node)
                    parts.append(sorted(open_[cut:]))
                    del open_[cut:]
    return parts[::-1]
