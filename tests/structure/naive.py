"""Slow and obvious versions of what `fdi.structure` computes: straight from the definitions."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from types import SimpleNamespace

from residuals import naive as published_rules

from fdi.structure import Model


def rank(rows):
    """Size of a maximum matching, by trying all ways to match the first row."""
    return _rank(tuple(tuple(row) for row in rows))


@lru_cache(maxsize=100_000)
def _rank(rows):
    if not rows:
        return 0
    first, rest = rows[0], rows[1:]
    best = _rank(rest)
    if best == len(rest) and not first:
        return best
    for unknown in first:
        left = tuple(tuple(u for u in row if u != unknown) for row in rest)
        best = max(best, 1 + _rank(left))
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


def subsets(equations):
    equations = sorted(equations)
    for size in range(len(equations) + 1):
        yield from combinations(equations, size)


def unknowns(model, equations):
    return {u for e in equations for u in model.rows[e]}


def integral(model, equations):
    """The largest overdetermined set whose unknowns can all be matched, never along a derivative.

    It is the union of all such sets.
    """
    derivative = {(e, u) for e, u, kind in model.derivative if kind == "d"}
    found = set()
    for some in subsets(equations):
        rows = [tuple(u for u in model.rows[e] if (e, u) not in derivative) for e in some]
        if rank(rows) == len(unknowns(model, some)) and overdetermined(model, some) == set(some):
            found.update(some)
    return found


def derivative(model, equations):
    """What is overdetermined among the equations whose unknowns can all be computed.

    A constraint may be used when its state is computed; equations compute their unknowns together
    when these can all be matched with them.
    """
    state = {(e, u) for e, u, kind in model.derivative if kind == "i"}
    computed, before = set(), None
    while computed != before:
        before = set(computed)
        usable = [
            e for e in equations if all(u in computed for u in model.rows[e] if (e, u) in state)
        ]
        for some in subsets(usable):
            rows = [tuple(u for u in model.rows[e] if u not in computed) for e in some]
            if rank(rows) == len({u for row in rows for u in row}):
                computed |= unknowns(model, some)
    return overdetermined(model, [e for e in equations if computed.issuperset(model.rows[e])])


OVERDETERMINED = {"mixed": overdetermined, "integral": integral, "derivative": derivative}


def isolable_causally(model, causality):
    """For each fault as the one to be told from, which faults are touched without its equations."""
    everything = set(range(len(model.rows)))
    columns = [
        OVERDETERMINED[causality](model, sorted(everything.difference(fault.equations)))
        for fault in model.faults
    ]
    return [
        [i != j and not columns[j].isdisjoint(fault.equations) for j in range(len(columns))]
        for i, fault in enumerate(model.faults)
    ]


def mso(model):
    pso = all_pso(model)
    return {m for m in pso if not any(other < m for other in pso)}


def mtes(model):
    faulty = {e for fault in model.faults for e in fault.equations}
    pso = [m for m in all_pso(model) if m & faulty]
    tes = [m for m in pso if not any(m < o and o & faulty == m & faulty for o in pso)]
    return {m for m in tes if not any(other < m for other in tes)}


def without_unknown(model, unknown):
    return [tuple(u for u in row if u != unknown) for row in model.rows]


def parts(model):
    """Over, just, under as sets of (equations, unknowns): what some maximum matching can spare.

    An equation is over when the rank is the same without it, an unknown under likewise; what
    contains an underdetermined unknown is under, what an overdetermined equation contains is over.
    """
    equations, columns = range(len(model.rows)), range(len(model.unknowns))
    full = rank(model.rows)
    over = overdetermined(model, equations)
    loose = {u for u in columns if rank(without_unknown(model, u)) == full}
    under = {e for e in equations if loose.intersection(model.rows[e])}
    held = unknowns(model, over)
    just = set(equations) - over - under
    return (set(over), held), (just, set(columns) - held - loose), (under, loose)


def hall_blocks(model):
    """Equations that belong to the same square systems, of which there may be overlapping ones."""
    _, (just, columns), _ = parts(model)
    square = [
        set(some) for some in subsets(just) if len(unknowns(model, some) & columns) == len(some)
    ]
    found = {}
    for e in sorted(just):
        found.setdefault(tuple(e in some for some in square), []).append(e)
    return list(found.values())


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


def sequences(model, equations):
    """Every valid {equation: unknown} of a set by the published rules, word by word."""
    kinds = dict.fromkeys(model.nonsolvable, "fixed")
    kinds |= {(e, u): {"i": "integral", "d": "derivative"}[k] for e, u, k in model.derivative}
    rows = [
        SimpleNamespace(edges={u: kinds.get((e, u), "solvable") for u in model.rows[e]})
        for e in equations
    ]
    return [
        {equations[i]: unknown for i, unknown in pairs.items()}
        for pairs in published_rules.matchings(rows)
        if published_rules.is_valid(rows, pairs)
    ]


def purposes(model, sets, columns):
    """Which (fault, column) pairs the sets serve; a column is a set of equations to do without."""
    return {
        (i, j)
        for own in sets
        for i, fault in enumerate(model.faults)
        for j, column in enumerate(columns)
        if not own.isdisjoint(fault.equations) and own.isdisjoint(column)
    }
