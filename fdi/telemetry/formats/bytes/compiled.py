"""Which loops over bytes run as compiled code, and when is that worth it?

A kernel is a plain function over arrays, in the part of Python that numba compiles. It says
the same as the numpy code that it stands in for, byte by byte; tests hold both against each other.
`compiled` returns it as machine code, or None: then the numpy code does the work. That is so
without numba (extra ``fast``), and for small files: importing numba and loading the kept machine
code costs 0.4 s, as much as reading 50 MB with numpy alone.

The environment variable ``FDI_FAST`` decides otherwise: 0 never, 1 for files of every size.

The traps: a kernel sees no other kernel (what it calls would not be compiled), and an index that
numba takes as signed costs a test for a negative one at every access: count in np.uint64.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_WORTH_BYTES: Final = 40_000_000
"""Loading numba and its kept machine code takes 0.5 s of CPU; numpy alone falls behind by as much
at about 60 MB of telemetry and at more of a DataFlash log."""
_SWITCH: Final = "FDI_FAST"


def compiled(kernel: Kernel, size: int) -> Kernel | None:
    """Return the kernel as machine code, None where numpy is to do the work.

    Parameters
    ----------
    kernel : function
        Of a format's ``kernels.py``.
    size : int
        Bytes of the file that it is to walk.

    Notes
    -----
    The machine code is kept beside the kernel's file, or in the user's cache where that cannot be
    written.
    """
    wanted = os.environ.get(_SWITCH, "")
    if wanted == "0" or (size < _WORTH_BYTES and wanted != "1"):
        return None
    made: Kernel | None = _machine_code(kernel)
    return made


@cache
def _machine_code(kernel: Callable[..., Any]) -> Any:
    try:
        import numba
    except ImportError:  # not installed, or not for this numpy
        return None
    try:
        return numba.njit(cache=True, nogil=True)(kernel)
    except RuntimeError:  # no folder to keep it in
        return numba.njit(nogil=True)(kernel)
