"""Represents a structure by vectors: the combinations of rows in which all unknowns vanish.

In: rows (here one per PSO class) in which only the rows' unknowns matter. Out: a basis of the left
null space of the incidence matrix with random entries in place of the ones. Cell k of every basis
vector belongs to row k. Then, for a set M of rows, all of them overdetermined,

- redundancy of M = dimension of the space;
- an MSO set is the support of a vector that is zero in as many independent cells as possible;
- removing row k = restricting the space to vectors that are zero in cell k, see :func:`without`;
- rows are equivalent when their cells are proportional in all vectors.

Random entries make an accidental zero possible. With at most 10^7 comparisons of polynomials of
degree below 10^3 over 2^61 - 1 elements its probability is below 10^-8 for a whole run. The entries
come from a fixed seed, so that equal input gives equal output.
"""

from __future__ import annotations

from random import Random

from fdi.structure.field import WIDTH, WORD, P, fold, ones
from fdi.structure.incidence import Rows

SEED = 20081  # any number; fixed so that results repeat
TERMS = 16  # products of nearly reduced numbers that are added before a reduction (limit 31)


def null_space(rows: Rows) -> list[int]:
    """Return a random basis of the left null space of a generic matrix with these rows.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each of the m rows; every row overdetermined, so that the matrix has full
        column rank n.

    Returns
    -------
    list of int
        m - n packed vectors of m cells, nearly reduced. Every one of them is zero in a cell only
        if all are: the basis is generic, so any vector can serve as pivot.

    Notes
    -----
    Gaussian elimination of the unknowns, fewest rows first; the cell of the unknown that is
    eliminated next is always the highest one, so that vectors get shorter.

    References
    ----------
    Lovász, "On determinants, matchings, and random algorithms", 1979 (random entries);
    Schwartz, J. ACM 27(4), 1980 (probability of an accidental zero).

    Examples
    --------
    >>> from fdi.structure.field import nonzero
    >>> [hex(nonzero(v, ones(2))) for v in null_space(((0,), (0,)))]
    ['0x100000000000000000000000000000001']
    """
    m = len(rows)
    random = Random(SEED)
    holders: dict[int, set[int]] = {}
    for k, row in enumerate(rows):
        for unknown in row:
            holders.setdefault(unknown, set()).add(k)
    order = sorted(holders, key=lambda unknown: (len(holders[unknown]), unknown))
    cell_of = {unknown: m + len(order) - 1 - i for i, unknown in enumerate(order)}
    vectors = {k: 1 << WIDTH * k for k in range(m)}
    for k, row in enumerate(rows):
        for unknown in row:
            vectors[k] |= random.randrange(1, P) << WIDTH * cell_of[unknown]
    unknowns_of = [set(row) for row in rows]
    for unknown in order:
        _eliminate(unknown, cell_of[unknown], vectors, holders, unknowns_of)
    return _mixed(list(vectors.values()), m, random)


def without(vectors: list[int], cell: int, ones_mask: int) -> list[int]:
    """Return a basis of those vectors of the space that are zero in one cell.

    Parameters
    ----------
    vectors : list of int
        A generic basis with a non-zero value in that cell.
    cell : int
        Position of the cell's lowest bit.
    ones_mask : int
        Mask of all cells.

    Returns
    -------
    list of int
        One vector fewer, generic again.

    References
    ----------
    Oxley, "Matroid Theory", 2nd ed. 2011, section 3.1 (contraction).

    Examples
    --------
    >>> from fdi.structure.field import nonzero
    >>> (smaller,) = without([1 + (2 << 128), 1 + (5 << 128)], 0, ones(2))
    >>> nonzero(smaller, ones(2)) == 1 << 128
    True
    """
    last = vectors[-1]
    pivot = ((last >> cell) & WORD) % P
    low = ones_mask * P
    high = (ones_mask << 67) - ones_mask
    result = []
    for vector in vectors[:-1]:
        # The body of field.fold, written out: this line is the inner loop of the search.
        sum_ = vector * pivot + last * (P - ((vector >> cell) & WORD) % P)
        sum_ = (sum_ & low) + ((sum_ >> 61) & high)
        result.append((sum_ & low) + ((sum_ >> 61) & high))
    return result


def _eliminate(
    unknown: int,
    cell: int,
    vectors: dict[int, int],
    holders: dict[int, set[int]],
    unknowns_of: list[set[int]],
) -> None:
    """Remove an unknown and, as the pivot, the shortest vector that contains it."""
    shift = WIDTH * cell
    values = {}
    for k in sorted(holders.pop(unknown)):
        unknowns_of[k].discard(unknown)
        if value := (vectors[k] >> shift) % P:  # may have cancelled out
            values[k] = value
    pivot = min(values, key=lambda k: (len(unknowns_of[k]), k))
    scale = values.pop(pivot)
    vector = vectors.pop(pivot)
    spread = unknowns_of[pivot]
    for other in spread:
        holders[other].discard(pivot)
        holders[other].update(values)
    rest = ones(cell)
    for k, value in values.items():
        vectors[k] = fold(vectors[k] * scale + vector * (P - value), rest)
        unknowns_of[k] |= spread


def _mixed(vectors: list[int], m: int, random: Random) -> list[int]:
    """Return as many random combinations of the vectors, which are a generic basis."""
    all_cells = ones(m)
    mixed = []
    for _ in vectors:
        total = 0
        for start in range(0, len(vectors), TERMS):
            for vector in vectors[start : start + TERMS]:
                total += vector * random.randrange(1, P)
            total = fold(total, all_cells)
        mixed.append(total)
    return mixed
