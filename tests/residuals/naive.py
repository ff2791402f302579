"""The published rules of validity, word by word, over every matching of a small set."""

from itertools import permutations

import networkx as nx

DIFFERENTIAL = ("derivative", "integral")


def matchings(equations):
    """Every complete matching of the unknowns, {equation: unknown}; integral edges left out."""
    unknowns = sorted({name for equation in equations for name in equation.edges})
    for chosen in permutations(range(len(equations)), len(unknowns)):
        pairs = dict(zip(chosen, unknowns, strict=True))
        kinds = [equations[i].edges.get(name) for i, name in pairs.items()]
        if None not in kinds and "integral" not in kinds:
            yield pairs


def is_valid(equations, pairs):
    kind = {i: equations[i].edges[name] for i, name in pairs.items()}
    graph = nx.DiGraph()
    graph.add_nodes_from(pairs)
    graph.add_edges_from(
        (i, j) for i, name in pairs.items() for j in pairs if i != j and name in equations[j].edges
    )
    algebraic = graph.subgraph([i for i in pairs if kind[i] not in DIFFERENTIAL])
    loops = [part for part in nx.strongly_connected_components(algebraic) if len(part) > 1]
    in_loop = {i for part in loops for i in part}
    for part in nx.strongly_connected_components(graph):
        # contracting the algebraic loops, what is left of this part decides whether it is dynamic
        inner = {frozenset(loop) for loop in loops if loop <= part}
        contracted = len(part) - sum(len(loop) - 1 for loop in inner)
        if contracted > 1:
            if any(kind[i] == "fixed" and i not in in_loop for i in part):
                return False
            if any(kind[i] == "derivative" for i in part):
                return False
        elif any(kind[i] == "fixed" and i not in in_loop for i in part):
            return False
    return True


def cost(equations, pairs):
    weight = {"derivative": 100.0, "integral": 100.0}
    return sum(
        equations[i].cost * weight.get(equations[i].edges[name], 1.0) for i, name in pairs.items()
    )


def is_restricted(equations, pairs):
    return all(equations[i].edges[name] != "fixed" for i, name in pairs.items())
