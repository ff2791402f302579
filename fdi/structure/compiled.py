"""Finds the minimal sets of one graph component in compiled code, where many of them are expected.

In: rows (one per PSO class), their sets of equations, which of them may be removed. Out: the sets
that ``flats.py`` gives for the same space, in the same order, about thirty times faster. The method
is the same too: random entries modulo 2^61 - 1, a basis of the left null space, removal as
projection, and lines through points of a plane where redundancy 3 is left. Only the basis differs,
and nothing that is returned depends on it.

Compiled code cannot be interrupted, so it works in portions of about ``WORK`` multiplications, some
hundredths of a second, and hands over what it has: basis, descent and planes can all be left in the
middle. How much memory it takes is known beforehand, see :func:`fdi.structure.search.room`.

Needs numba (extra ``fast``). It compiles on the first use after an installation, which takes some
seconds, and keeps the machine code beside this file; a later process loads it in about 0.7 s. So
this module is imported by ``search.py`` alone, inside a function, when that pays.

The trap: signed and unsigned numbers in one expression become floats in compiled code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from fdi.structure.field import P as PRIME
from fdi.structure.incidence import Rows

BUFFER = 1 << 14  # sets found at most before they are handed over
WORK = 10_000_000  # multiplications in one go: about 0.03 s, so that a caller can stop
BLOCK = 64  # points of a plane whose slopes are computed together
PASSIVE, ALLOWED, FORBIDDEN = 0, 1, 2  # kinds of cells; where cells are merged the highest holds

Number = np.uint64  # modulo P
Numbers = NDArray[np.uint64]
Words = NDArray[np.uint64]
Integers = NDArray[np.int64]

P = np.uint64(PRIME)
ZERO, ONE, TWO = np.uint64(0), np.uint64(1), np.uint64(2)


class _Nodes(NamedTuple):
    """Is the path from the root of the search to a node, the depth being the first index.

    Cells that became zero are left out: what belongs to the k-th cell of a node stands at [d, k].
    """

    vectors: Any  # (depth, phi, m) Numbers; vectors[d, r, k]
    cells: Any  # (depth, m) Integers; which row of the model
    kinds: Any  # (depth, m) Integers
    sizes: Integers  # (depth,) number of cells
    allowed: Integers  # (depth,) number of those that may still be removed
    kept: Integers  # (m,) room


class _Points(NamedTuple):
    """Are the cells of a node with three vectors as points of a plane, proportional ones merged.

    Points that may be removed come first, then passive ones, then those that must stay.
    """

    x: Numbers  # (m,)
    y: Numbers  # (m,) different for different points
    words: Any  # (m, n_words) Words
    everything: Words  # (n_words,) all of them
    rank: Integers  # (m,) room, as are the next three
    merged: Integers
    scale: Numbers
    prefixes: Numbers


class _Pairs(NamedTuple):
    """Are the slopes between any point, the first index, and those of a block."""

    slopes: Any  # (m, BLOCK) Numbers
    differences: Any
    running: Numbers  # (BLOCK,)
    prefixes: Numbers


class _Lines(NamedTuple):
    """Are the lines through one point, and the pairs of points whose line was found before."""

    words: Any  # (n_chosen, n_words) Words
    last: Integers  # (n_chosen,) last point on the line, -1 when the line must stay
    previous: Integers  # (n_chosen,) point before this one on its line, or -1
    covered: Any  # (n_chosen, n_chosen) bool


class _Table(NamedTuple):
    """Is a hash table of numbers; slots with an old stamp are free, so it is emptied by counting.

    Its keys are random already: their lowest bits say where to look.
    """

    keys: Numbers
    stamps: Integers
    values: Integers
    clock: Integers  # (1,)


class _State(NamedTuple):
    """Is a search that was interrupted: where, and what it knows.

    ``place`` is the depth (-1 at the end); the next point of the plane there (-1 when it is not yet
    laid out); its points, those that may be removed, and those that may go.
    """

    place: Integers  # (5,)
    nodes: _Nodes
    points: _Points
    pairs: _Pairs
    lines: _Lines
    table: _Table


def minimal_sets(rows: Rows, sets: Sequence[int], may_go: Sequence[bool]) -> Iterator[list[int]]:
    """Yield the minimal sets of one graph component of redundancy 3 or more, some at a time.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each of the m rows; all overdetermined, no two equivalent.
    sets : sequence of int
        For each row its equations, as a bit set.
    may_go : sequence of bool
        Which rows may be chosen for removal.

    Yields
    ------
    list of int
        Sets of equations, as from :func:`fdi.structure.flats.minimal_sets`.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section V (order of removal);
    Krysander, Åslund, Frisk, DX-10, 2010 (MTES).

    Examples
    --------
    >>> [s for sets in minimal_sets([[0]] * 4, [1, 2, 4, 8], [True] * 4) for s in sets]
    [12, 10, 6, 9, 5, 3]
    """
    order = _elimination_order(rows)
    starts = np.cumsum([0, *map(len, rows)], dtype=np.int64)
    columns = np.array([order[unknown] for row in rows for unknown in row], dtype=np.int64)
    n_bytes = 8 * -(-max(sets).bit_length() // 64)
    packed = b"".join(some.to_bytes(n_bytes, "little") for some in sets)
    words = np.frombuffer(packed, dtype="<u8").astype(np.uint64).reshape(-1, n_bytes // 8)
    m, n = len(rows), len(order)
    table, left = _entries(starts, columns, n), np.ones(m, dtype=np.bool_)
    column = 0
    while column < n:
        column = _eliminate(table, left, column, n)
        yield []  # gives the caller a chance to stop
    basis = np.zeros((m - n, m), dtype=np.uint64)
    for r in range(m - n):
        _mix(table, left, n, r, basis)
        yield []
    del table
    state = _begin(basis, may_go, words.shape[1])
    out = np.empty((max(BUFFER, m), words.shape[1]), dtype=np.uint64)
    while state.place[0] >= 0:
        yield _integers(out[: _go_on(state, words, out)])


def _elimination_order(rows: Rows) -> dict[int, int]:
    """Return which unknown is eliminated when: those in the fewest rows first."""
    count: dict[int, int] = {}
    for row in rows:
        for unknown in row:
            count[unknown] = count.get(unknown, 0) + 1
    return {u: k for k, u in enumerate(sorted(count, key=lambda u: (count[u], u)))}


def _integers(words: Words) -> list[int]:
    """Return each row of words as one integer, the first word lowest."""
    n = words.shape[1]
    if n == 1:
        numbers: list[int] = words[:, 0].tolist()
        return numbers
    texts = words.astype("<u8").view(f"S{8 * n}")[:, 0].tolist()  # zeros at the end are cut off
    return [int.from_bytes(text, "little") for text in texts]


def _begin(basis: Any, may_go: Sequence[bool], n_words: int) -> _State:
    """Return the state of a search that is at its root, with room for what it computes."""
    phi, m = basis.shape
    depth, n_chosen = phi - 2, sum(may_go)
    nodes = _Nodes(
        np.empty((depth, phi, m), dtype=np.uint64),
        np.empty((depth, m), dtype=np.int64),
        np.empty((depth, m), dtype=np.int64),
        np.empty(depth, dtype=np.int64),
        np.empty(depth, dtype=np.int64),
        np.empty(m, dtype=np.int64),
    )
    nodes.vectors[0], nodes.cells[0], nodes.kinds[0] = basis, range(m), may_go
    nodes.sizes[0], nodes.allowed[0] = m, n_chosen
    numbers, integers = np.empty((4, m), dtype=np.uint64), np.empty((2, m), dtype=np.int64)
    words = np.empty((1 + m, n_words), dtype=np.uint64)
    points = _Points(
        numbers[0],
        numbers[1],
        words[1:],
        words[0],
        integers[0],
        integers[1],
        numbers[2],
        numbers[3],
    )
    between, along = np.empty((2, m, BLOCK), np.uint64), np.empty((2, BLOCK), np.uint64)
    pairs = _Pairs(between[0], between[1], along[0], along[1])
    ends = np.empty((2, n_chosen), dtype=np.int64)
    covered = np.empty((n_chosen, n_chosen), dtype=np.bool_)
    lines = _Lines(np.empty((n_chosen, n_words), dtype=np.uint64), ends[0], ends[1], covered)
    slots = 1 << (3 * m).bit_length()  # at most a third is filled
    table = _Table(
        np.empty(slots, dtype=np.uint64),
        np.zeros(slots, dtype=np.int64),
        np.empty(slots, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    place = np.array([0, -1, 0, 0, 0], dtype=np.int64)
    return _State(place, nodes, points, pairs, lines, table)


@intrinsic
def _times(typing_context: Any, a: Any, b: Any) -> Any:
    """Return a * b modulo P; the product is 128 bits wide, which numba itself does not offer."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        wide, narrow = ir.IntType(128), ir.IntType(64)
        left, right = (builder.zext(argument, wide) for argument in arguments)
        product = builder.mul(left, right)
        low = builder.trunc(builder.and_(product, ir.Constant(wide, PRIME)), narrow)
        high = builder.trunc(builder.lshr(product, ir.Constant(wide, 61)), narrow)
        total = builder.add(low, high)  # 2^61 is 1 modulo P
        reduced = builder.sub(total, ir.Constant(narrow, PRIME))
        too_large = builder.icmp_unsigned(">=", total, ir.Constant(narrow, PRIME))
        return builder.select(too_large, reduced, total)

    return types.uint64(types.uint64, types.uint64), code


@njit
def _minus(a: Number, b: Number) -> Number:
    return a - b if a >= b else a + P - b


@njit
def _inverse(a: Number) -> Number:
    """Return 1 / a modulo P, which is a to the power P - 2."""
    result, square, exponent = ONE, a, P - TWO
    while exponent > ZERO:
        if exponent & ONE:
            result = _times(result, square)
        square = _times(square, square)
        exponent >>= ONE
    return result


@njit
def _invert(values: Numbers, n: int, prefixes: Numbers) -> None:
    """Put the inverses in place of the first n values, none of them zero (Montgomery 1987)."""
    product = ONE
    for i in range(n):
        prefixes[i] = product
        product = _times(product, values[i])
    rest = _inverse(product)
    for i in range(n - 1, -1, -1):
        own = _times(rest, prefixes[i])
        rest = _times(rest, values[i])
        values[i] = own


@njit
def _entry(counter: Number) -> Number:
    """Return a number in 1..P-1 as good as random (splitmix64: Steele, Lea, Flood, 2014)."""
    z = counter * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (z ^ (z >> np.uint64(31))) % (P - ONE) + ONE


@njit(cache=True)
def _entries(starts: Integers, columns: Integers, n: int) -> Any:
    """Return m rows, (m, n + m), of random entries and of what each row is combined from.

    Row i has entries in ``columns[starts[i] : starts[i + 1]]`` and a one in column n + i.
    """
    m = len(starts) - 1
    table = np.zeros((m, n + m), dtype=np.uint64)
    counter = ONE
    for i in range(m):
        for k in range(starts[i], starts[i + 1]):
            table[i, columns[k]] = _entry(counter)
            counter += ONE
        table[i, n + i] = ONE
    return table


@njit(cache=True)
def _eliminate(table: Any, left: Any, first: int, n: int) -> int:
    """Eliminate columns in their order, each by the shortest row that is left.

    Returns the column that comes next, n at the end.
    """
    m, width, work = len(left), table.shape[1], 0
    for column in range(first, n):
        pivot, fewest = -1, width + 1
        for i in range(m):
            if left[i] and table[i, column] != ZERO:
                count = 0
                for k in range(column, width):
                    count += table[i, k] != ZERO
                if count < fewest:
                    pivot, fewest = i, count
        left[pivot] = False
        scale = _inverse(table[pivot, column])
        work += m
        for i in range(m):
            if left[i] and table[i, column] != ZERO:
                work += width - column + fewest
                factor = _times(table[i, column], scale)
                for k in range(column, width):
                    if table[pivot, k] != ZERO:
                        table[i, k] = _minus(table[i, k], _times(factor, table[pivot, k]))
        if work > WORK:
            return column + 1
    return n


@njit(cache=True)
def _mix(table: Any, left: Any, n: int, r: int, basis: Any) -> None:
    """Write a generic vector of the left null space, the r-th: a random mixture of what is left.

    The rows that are left have no entry in the first n columns any more.
    """
    m = len(left)
    counter = np.uint64(1 + r) << np.uint64(32)  # beyond those of the entries
    for i in range(m):
        if left[i]:
            factor = _entry(counter)
            counter += ONE
            for k in range(m):
                if table[i, n + k] != ZERO:
                    value = basis[r, k] + _times(factor, table[i, n + k])
                    basis[r, k] = value if value < P else value - P


@njit
def _slot(key: Number, table: _Table) -> Any:
    """Return the slot that holds a key, or the free one where it belongs."""
    mask = len(table.keys) - 1
    slot = np.int64(key) & mask
    while table.stamps[slot] == table.clock[0] and table.keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@njit
def _fill(slot: int, key: Number, value: int, table: _Table) -> None:
    table.keys[slot], table.stamps[slot], table.values[slot] = key, table.clock[0], value


@njit
def _child(nodes: _Nodes, depth: int) -> bool:
    """Remove the first cell that may go; return whether the node below remains to be searched.

    The cells that go with it become forbidden for later siblings in any case.
    """
    vectors, kinds, kept = nodes.vectors[depth], nodes.kinds[depth], nodes.kept
    last = nodes.vectors.shape[1] - depth - 1
    chosen = 0
    while kinds[chosen] != ALLOWED:
        chosen += 1
    pivot, factor = vectors[last, chosen], vectors[0, chosen]
    possible, size, allowed = True, 0, 0
    for i in range(nodes.sizes[depth]):
        value = _minus(_times(vectors[0, i], pivot), _times(vectors[last, i], factor))
        if value != ZERO:
            kept[size] = i
            nodes.vectors[depth + 1, 0, size] = value
            nodes.cells[depth + 1, size] = nodes.cells[depth, i]
            nodes.kinds[depth + 1, size] = kinds[i]
            allowed += kinds[i] == ALLOWED
            size += 1
        elif kinds[i] == FORBIDDEN:
            possible = False
        elif kinds[i] == ALLOWED:
            kinds[i] = FORBIDDEN
            nodes.allowed[depth] -= 1
    if not possible or allowed < last - 1:
        return False
    nodes.sizes[depth + 1], nodes.allowed[depth + 1] = size, allowed
    for r in range(1, last):
        factor = vectors[r, chosen]
        for k in range(size):
            i = kept[k]
            nodes.vectors[depth + 1, r, k] = _minus(
                _times(vectors[r, i], pivot), _times(vectors[last, i], factor)
            )
    return True


@njit
def _place(
    nodes: _Nodes, depth: int, sets: Words, points: _Points, table: _Table
) -> tuple[int, int, int]:
    """Write the points of a node with three vectors, the first of them scaled to 1 everywhere.

    Returns how many points there are, may be removed, and either that or are passive.
    """
    size, cells, kinds = nodes.sizes[depth], nodes.cells[depth], nodes.kinds[depth]
    scale, rank, slope = points.scale, points.rank, points.prefixes
    for i in range(size):
        scale[i] = nodes.vectors[depth, 0, i]
    _invert(scale, size, points.prefixes)
    table.clock[0] += 1
    n = 0
    for i in range(size):  # proportional cells are one point, in the order of the first
        slope[i] = _times(nodes.vectors[depth, 2, i], scale[i])
        slot = _slot(slope[i], table)
        if table.stamps[slot] != table.clock[0]:
            _fill(slot, slope[i], n, table)
            rank[n] = PASSIVE
            n += 1
        points.merged[i] = table.values[slot]
        rank[table.values[slot]] = max(rank[table.values[slot]], kinds[i])
    n_chosen, n_free = 0, 0
    for k in range(n):
        n_chosen += rank[k] == ALLOWED
        n_free += rank[k] != FORBIDDEN
    chosen, passive, others = 0, n_chosen, n_free
    for k in range(n):
        if rank[k] == ALLOWED:
            rank[k], chosen = chosen, chosen + 1
        elif rank[k] == PASSIVE:
            rank[k], passive = passive, passive + 1
        else:
            rank[k], others = others, others + 1
    points.words[:n] = ZERO
    points.everything[:] = ZERO
    for i in range(size):
        k = rank[points.merged[i]]
        points.y[k] = slope[i]
        points.x[k] = _times(nodes.vectors[depth, 1, i], scale[i])
        for w in range(sets.shape[1]):
            points.words[k, w] |= sets[cells[i], w]
            points.everything[w] |= sets[cells[i], w]
    return n, n_chosen, n_free


@njit
def _connect(first: int, shape: tuple[int, int, int], points: _Points, pairs: _Pairs) -> None:
    """Write the slopes from a block of points that may be removed to every later point.

    One inversion for all, in chains that do not wait for one another.
    """
    n, n_chosen, _ = shape
    size = min(BLOCK, n_chosen - first)
    x, y, slopes, running = points.x, points.y, pairs.slopes, pairs.running
    running[:size] = ONE
    for i in range(first + 1, n):
        for c in range(min(i - first, size)):
            difference = _minus(y[i], y[first + c])
            pairs.differences[i, c] = difference
            slopes[i, c] = _times(_minus(x[i], x[first + c]), running[c])
            running[c] = _times(running[c], difference)
    _invert(running, size, pairs.prefixes)
    for i in range(n - 1, first, -1):
        for c in range(min(i - first, size)):
            slopes[i, c] = _times(slopes[i, c], running[c])
            running[c] = _times(running[c], pairs.differences[i, c])


@njit
def _draw(
    first: int, c: int, shape: tuple[int, int, int], state: _State, out: Words, count: int
) -> int:
    """Write what is left without each new line through point c of a block; return the new count."""
    n, n_chosen, n_free = shape
    points, lines, table, slopes = state.points, state.lines, state.table, state.pairs.slopes
    k_c = c - first  # its place in the block
    n_words = out.shape[1]
    table.clock[0] += 1
    n_lines = 0
    for i in range(c + 1, n_chosen):
        if lines.covered[c, i]:
            continue
        slot = _slot(slopes[i, k_c], table)
        if table.stamps[slot] != table.clock[0]:
            _fill(slot, slopes[i, k_c], n_lines, table)
            line = n_lines
            n_lines += 1
            lines.previous[i] = -1
            lines.words[line] = points.words[i]
        else:
            line = table.values[slot]
            lines.previous[i] = lines.last[line]
            k = lines.last[line]
            while k >= 0:
                lines.covered[k, i] = True
                k = lines.previous[k]
            for w in range(n_words):
                lines.words[line, w] |= points.words[i, w]
        lines.last[line] = i
    if n_lines == 0:
        return count
    for i in range(n_chosen, n):
        slot = _slot(slopes[i, k_c], table)
        if table.stamps[slot] == table.clock[0]:
            line = table.values[slot]
            if i >= n_free:
                lines.last[line] = -1
            for w in range(n_words):
                lines.words[line, w] |= points.words[i, w]
    for line in range(n_lines):
        if lines.last[line] >= 0:
            for w in range(n_words):
                out[count, w] = points.everything[w] ^ points.words[c, w] ^ lines.words[line, w]
            count += 1
    return count


@njit
def _lay_out(state: _State, sets: Words) -> None:
    """Begin with the plane of the node where the search is."""
    place = state.place
    shape = _place(state.nodes, place[0], sets, state.points, state.table)
    place[1], place[2], place[3], place[4] = 0, shape[0], shape[1], shape[2]
    state.lines.covered[: shape[1], : shape[1]] = False


@njit
def _draw_some(state: _State, out: Words, count: int) -> tuple[int, int]:
    """Write the sets of the next points of a plane, a block at most, while ``out`` has room.

    Returns the new count and how much was done.
    """
    place, n_words, work = state.place, out.shape[1], 0
    shape = (place[2], place[3], place[4])
    c, n_chosen = place[1], shape[1]
    first = c - c % BLOCK
    if count + n_chosen - c > len(out):
        return count, 0
    if c == first:
        _connect(first, shape, state.points, state.pairs)
        work += 8 * shape[0] * min(BLOCK, n_chosen - first)
    while c < min(first + BLOCK, n_chosen - 1) and count + n_chosen - c <= len(out):
        before = count
        count = _draw(first, c, shape, state, out, count)
        work += shape[0] + n_words * (count - before + 1)
        c += 1
    place[1] = c
    return count, work


@njit(cache=True)
def _go_on(state: _State, sets: Words, out: Words) -> int:
    """Go on with a search until it ends, ``out`` may overflow or enough was done.

    Returns the number of sets. ``out`` has to hold the sets of one point, a row for each cell.
    """
    nodes, place = state.nodes, state.place
    n_vectors = nodes.vectors.shape[1]
    n_words = out.shape[1]
    count, work = 0, 0
    while place[0] >= 0 and work < WORK:
        depth = place[0]
        if place[1] < 0 and nodes.allowed[depth] < n_vectors - depth - 1:
            place[0] -= 1
        elif n_vectors - depth > 3:
            work += nodes.sizes[depth] * (n_vectors - depth)
            if _child(nodes, depth):
                place[0] += 1
        elif place[1] < 0:
            work += nodes.sizes[depth] * n_words
            _lay_out(state, sets)
        elif place[1] >= place[3] - 1:
            place[0] -= 1
            place[1] = -1
        else:
            count, done = _draw_some(state, out, count)
            if not done:
                break
            work += done
    return count
