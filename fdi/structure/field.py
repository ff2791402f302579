"""Computes with vectors over the integers modulo the prime P = 2^61 - 1, each packed in one int.

Cell k of a vector occupies bits 128 k to 128 k + 127 of a Python integer. One multiplication by a
scalar then works on all cells at once, and reduction is a shift and a mask, because the prime is a
Mersenne number. A product needs 122 bits, so cells never spill into one another. Cells are kept
below 2 P, not below P ("nearly reduced"): the value 0 may also stand there as P.

A mask of cells has the lowest bit of each chosen cell set. What the vectors mean is said in
``dual.py``.
"""

from __future__ import annotations

from collections.abc import Sequence

P = (1 << 61) - 1
WIDTH = 128
WORD = (1 << 64) - 1


def ones(n: int) -> int:
    """Return the mask of the first n cells.

    Parameters
    ----------
    n : int
        Number of cells.

    Returns
    -------
    int

    References
    ----------
    Knuth, The Art of Computer Programming 4A, 7.1.3 (words that hold several fields).

    Examples
    --------
    >>> hex(ones(2))
    '0x100000000000000000000000000000001'
    """
    return ((1 << WIDTH * n) - 1) // ((1 << WIDTH) - 1)


def fold(packed: int, ones_mask: int) -> int:
    """Return a packed vector with every cell nearly reduced.

    Parameters
    ----------
    packed : int
        Cells below 2^127.
    ones_mask : int
        Mask of all its cells, see :func:`ones`; cells beyond are cut off.

    Returns
    -------
    int

    Notes
    -----
    2^61 = 1 modulo P, so the bits above 61 are added to those below. Twice brings 2^127 below 2 P.

    References
    ----------
    Knuth, The Art of Computer Programming 2, 4.3.2 (arithmetic modulo 2^e - 1).

    Examples
    --------
    >>> fold((1 << 61) + 5, ones(1))
    6
    """
    low = ones_mask * P
    high = (ones_mask << 67) - ones_mask
    packed = (packed & low) + ((packed >> 61) & high)
    return (packed & low) + ((packed >> 61) & high)


def nonzero(packed: int, ones_mask: int) -> int:
    """Return the mask of the cells that are not zero modulo P.

    Parameters
    ----------
    packed : int
        Nearly reduced.
    ones_mask : int
        Mask of all its cells.

    Returns
    -------
    int

    References
    ----------
    Knuth, The Art of Computer Programming 4A, 7.1.3.

    Examples
    --------
    >>> nonzero(P + (7 << 128), ones(2)) == 1 << 128
    True
    """
    low = ones_mask * P
    reduced = (packed + (((packed + ones_mask) >> 61) & ones_mask)) & low  # a cell of P becomes 0
    return ((reduced + low) >> 61) & ones_mask


def cells(packed: int, n: int) -> list[int]:
    """Return the n cells of a nearly reduced vector as a list.

    Parameters
    ----------
    packed : int
    n : int

    Returns
    -------
    list of int

    References
    ----------
    Knuth, The Art of Computer Programming 4A, 7.1.3.

    Examples
    --------
    >>> cells(3 + (7 << 128), 2)
    [3, 7]
    """
    return memoryview(packed.to_bytes(16 * n, "little")).cast("Q").tolist()[::2]


def inverses(values: Sequence[int]) -> list[int]:
    """Return the inverses of non-zero numbers modulo P.

    Parameters
    ----------
    values : sequence of int
        None of them a multiple of P.

    Returns
    -------
    list of int
        Each in 1..P-1.

    Notes
    -----
    One inversion and three multiplications per number; ``pow(x, -1, P)`` for each is five times
    slower.

    References
    ----------
    Montgomery, Mathematics of Computation 48(177), 1987, section 10.3.1.

    Examples
    --------
    >>> [x * y % P for x, y in zip((2, 5), inverses((2, 5)))]
    [1, 1]
    """
    prefixes: list[int] = []
    product = 1
    for value in values:
        prefixes.append(product)
        product = product * value % P
    inverse = pow(product, -1, P)
    for i in range(len(prefixes) - 1, -1, -1):
        prefixes[i] = inverse * prefixes[i] % P
        inverse = inverse * values[i] % P
    return prefixes
