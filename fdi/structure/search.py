"""Decides what searches a graph component for its minimal sets: Python, or compiled code.

In: the rows of a component, one per PSO class, their sets of equations, which may be removed. Out:
lists of minimal sets, the same ones in the same order whichever searched. Compiled code needs the
extra ``fast`` and costs about 0.7 s to load. So Python starts, and hands over when it has taken as
long itself: no estimate of the work is needed, and no call takes much more than twice the better
choice. Once loaded, compiled code is used at once.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from itertools import islice
from time import perf_counter
from types import ModuleType

from fdi.errors import UsageError
from fdi.structure.dual import null_space
from fdi.structure.field import WIDTH
from fdi.structure.flats import Space, minimal_sets
from fdi.structure.incidence import Rows

COMPILED = "fdi.structure.compiled"
PATIENCE = 0.7
"""Seconds of search in Python before compiled code is loaded, which takes about as long."""


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
    elif compiled or (compiled is None and sys.modules.get(COMPILED) is not None):
        yield from _loaded().minimal_sets(rows, sets, may_go)
    else:
        space = Space(
            tuple(null_space(rows)),
            tuple(sets),
            sum(1 << WIDTH * k for k, may in enumerate(may_go) if may),
        )
        found = minimal_sets(space)
        if compiled is False:
            yield from found
        else:
            yield from _handed_over(found, rows, sets, may_go)


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
    rest = (one for batch in code.minimal_sets(rows, sets, may_go) for one in batch)
    yield from _chunks(islice(rest, count, None))


def _loaded() -> ModuleType:
    try:
        return import_module(COMPILED)
    except (ImportError, RuntimeError) as error:  # the latter: nowhere to keep the machine code
        raise UsageError(
            f"compiled code cannot be used: {error}", hint="pip install 'uav-fdi[fast]'"
        ) from error


def _chunks(found: Iterator[int], size: int = 4096) -> Iterator[list[int]]:
    while chunk := list(islice(found, size)):
        yield chunk
