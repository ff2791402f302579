"""Decides what searches a graph component for its minimal sets: Python, or compiled code.

In: the rows of a component, one per PSO class, their sets of equations, which may be removed. Out:
lists of minimal sets, the same ones in the same order whichever searched; some are empty, so that a
caller can stop. Compiled code needs the extra ``fast`` and costs about 0.7 s to load. So Python
starts, and hands over when it has taken as long itself: no estimate of the work is needed, and no
call takes much more than twice the better choice. Once loaded, compiled code is used at once.

Two searches are in Python: by vectors (``flats.py``), faster per set, and by alternating paths
(``paths.py``), which needs no basis and next to no memory and so gives the first set of a large
component at once. What the vectors would take is known beforehand, see :func:`room`; beyond
``ROOM`` the paths search alone.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from time import perf_counter
from types import ModuleType

from fdi.errors import UsageError
from fdi.structure import flats, paths
from fdi.structure.dual import null_space
from fdi.structure.field import WIDTH
from fdi.structure.flats import Space
from fdi.structure.incidence import Rows

COMPILED = "fdi.structure.compiled"
PATIENCE = 0.7
"""Seconds of search in Python before compiled code is loaded, which takes about as long."""
LARGE = 600
"""Rows up to which Python searches by vectors: their basis takes 0.5 s for 600 rows and 5 s for
1,200, the first set by paths 0.02 s; sets by vectors come two to five times faster."""
ROOM = 100 << 20
"""Bytes that vectors may take. At 4,000 equations and redundancy 120 they would take 400 MB, and
find 30 sets in 5 s where paths, which see when a branch is dead, find 200."""


def search(
    rows: Rows, sets: Sequence[int], may_go: Sequence[bool], compiled: bool | None = None
) -> Iterator[list[int]]:
    """Yield the minimal sets of a graph component, some at a time.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each of the m rows; all overdetermined, no two equivalent.
    sets : sequence of int
        For each row its equations, as a bit set.
    may_go : sequence of bool
        Which rows may be chosen for removal.
    compiled : bool, optional
        Whether compiled code searches; by default when it pays.

    Yields
    ------
    list of int
        Sets of equations; the lists differ with who searches, their concatenation does not.

    Raises
    ------
    UsageError
        When compiled code is asked for and numba is not installed.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008; the handing over is the rule of
    Karlin, Manasse, Rudolph, Sleator, Algorithmica 3, 1988 ("competitive snoopy caching").

    Examples
    --------
    >>> [s for sets in search([[0], [0], [0]], [1, 2, 4], [True, True, False]) for s in sets]
    [6, 5]
    """
    redundancy = len(rows) - len({unknown for row in rows for unknown in row})
    everything = sum(sets)
    if redundancy == 1:
        yield [everything]
    elif redundancy == 2:  # one class removed leaves one that is minimal
        yield [everything ^ some for some, may in zip(sets, may_go, strict=True) if may]
    elif compiled or (compiled is None and _is_loaded() and room(rows, sets) <= ROOM):
        yield from _loaded().minimal_sets(rows, sets, may_go)
    else:
        fits = room(rows, sets) <= ROOM
        by_vectors = fits and len(rows) <= LARGE
        found = (_by_vectors if by_vectors else paths.minimal_sets)(rows, sets, may_go)
        if compiled is False or not fits:
            yield from found
        else:
            yield from _handed_over(found, rows, sets, may_go)


def room(rows: Rows, sets: Sequence[int]) -> int:
    """Return how many bytes the search of a component by vectors takes at most.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each of the m rows.
    sets : sequence of int
        For each row its equations, as a bit set.

    Returns
    -------
    int
        For the basis, the path from the root of the search, one plane, and what is handed over at
        once by compiled code; not for the sets that a caller keeps.

    References
    ----------
    As :func:`search`.

    Examples
    --------
    >>> room([[0]] * 4, [1, 2, 4, 8]) < 2 << 20
    True
    """
    m, n = len(rows), len({unknown for row in rows for unknown in row})
    phi, n_words = m - n, -(-max(sets).bit_length() // 64)
    path = max(phi - 2, 0) * (phi + 2) * m
    handed_over = max(1 << 14, m) * n_words
    return 8 * (m * (n + m) + 2 * phi * m + path + m * (144 + m // 8 + 3 * n_words) + handed_over)


def _by_vectors(rows: Rows, sets: Sequence[int], may_go: Sequence[bool]) -> Iterator[list[int]]:
    chosen = sum(1 << WIDTH * k for k, may in enumerate(may_go) if may)
    yield from flats.minimal_sets(Space(tuple(null_space(rows)), tuple(sets), chosen))


def _is_loaded() -> bool:
    return sys.modules.get(COMPILED) is not None


def _handed_over(
    found: Iterator[list[int]], rows: Rows, sets: Sequence[int], may_go: Sequence[bool]
) -> Iterator[list[int]]:
    """Yield what Python finds while its patience lasts, and the rest from compiled code."""
    count, taken = 0, 0.0
    while taken < PATIENCE:
        start = perf_counter()
        batch = next(found, None)
        taken += perf_counter() - start  # what the caller does with it is not counted
        if batch is None:
            return
        count += len(batch)
        yield batch
    try:
        code = _loaded()
    except UsageError:  # the extra is not installed: Python goes on
        yield from found
        return
    for batch in code.minimal_sets(rows, sets, may_go):
        yield batch[count:]
        count = max(0, count - len(batch))


def _loaded() -> ModuleType:
    try:
        return import_module(COMPILED)
    except (ImportError, RuntimeError) as error:  # the latter: nowhere to keep the machine code
        raise UsageError(
            f"compiled code cannot be used: {error}", hint="pip install 'uav-fdi[fast]'"
        ) from error
