"""Slow and obvious versions of what `fdi.structure` computes: straight from the definitions."""

from __future__ import annotations

from itertools import combinations

from fdi.structure import Model


def rank(rows):
    """Size of a maximum matching, by trying all ways to match the first row."""
    if not rows:
        return 0
    first, rest = rows[0], rows[1:]
    best = rank(rest)
    if best == len(rest) and not first:
        return best
    for unknown in first:
        left = [tuple(u for u in row if u != unknown) for row in rest]
        best = max(best, 1 + rank(left))
        if best == len(rows):
            break
    return best


def all_pso(model):
    """Every PSO set M = M+, the empty one left out."""
    found = []
    for size in range(1, len(model.rows) + 1):
        for subset in combinations(range(len(model.rows)), size):
            if overdetermined(model, subset) == frozenset(subset):
                found.append(frozenset(subset))
    return found


def overdetermined(model, equations):
    """The equations that a maximum matching can leave out: without them the rank is the same."""
    rows = [model.rows[e] for e in equations]
    full = rank(rows)
    return frozenset(e for i, e in enumerate(equations) if rank(rows[:i] + rows[i + 1 :]) == full)


def mso(model):
    pso = all_pso(model)
    return {m for m in pso if not any(other < m for other in pso)}


def mtes(model):
    faulty = {e for fault in model.faults for e in fault.equations}
    pso = [m for m in all_pso(model) if m & faulty]
    tes = [m for m in pso if not any(m < o and o & faulty == m & faulty for o in pso)]
    return {m for m in tes if not any(other < m for other in tes)}


def classes(model):
    whole = overdetermined(model, range(len(model.rows)))
    found = {whole - overdetermined(model, sorted(whole - {equation})) for equation in whole}
    return sorted(sorted(group) for group in found)


def isolable(model, i, j):
    left = [e for e in range(len(model.rows)) if e not in model.faults[j].equations]
    over = overdetermined(model, left)
    return i != j and not over.isdisjoint(model.faults[i].equations)


def detectable(model, i):
    over = overdetermined(model, range(len(model.rows)))
    return not over.isdisjoint(model.faults[i].equations)


def groups(isolable_pairs, detected):
    """Connected groups of the relation, by joining until nothing changes."""
    found = [{i} for i, seen in enumerate(detected) if seen]
    joined = True
    while joined:
        joined = False
        for a, b in combinations(found, 2):
            if any(not (isolable_pairs[i][j] and isolable_pairs[j][i]) for i in a for j in b):
                found.remove(b)
                a |= b
                joined = True
                break
    return tuple(sorted(tuple(sorted(group)) for group in found if len(group) > 1))


def permuted(model, order):
    """The model with equation order[i] in place i."""
    place = {old: new for new, old in enumerate(order)}
    return Model(
        tuple(model.equations[i] for i in order),
        model.unknowns,
        tuple(model.rows[i] for i in order),
        tuple(type(f)(f.name, tuple(place[e] for e in f.equations)) for f in model.faults),
    )
