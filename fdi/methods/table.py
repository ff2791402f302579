"""Which methods give columns to an analysis? One table.

In: names. Out: the methods. A method is added here, and what its columns say of whom in a model
file of the same name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final

from fdi.errors import UsageError
from fdi.methods.columns import Method
from fdi.methods.estimator.columns import ESTIMATOR
from fdi.methods.heading.columns import HEADING
from fdi.methods.observer.columns import OBSERVER
from fdi.methods.response import RESPONSE
from fdi.methods.voting.columns import VOTING

METHODS: Final[Mapping[str, Method]] = MappingProxyType(
    {method.name: method for method in (ESTIMATOR, HEADING, OBSERVER, RESPONSE, VOTING)}
)


def methods_of(names: Iterable[str]) -> tuple[Method, ...]:
    """Return the methods of some names, each once, in the order of the table.

    Raises
    ------
    UsageError
        There is no method of a name.
    """
    wanted = set(names)
    unknown = sorted(wanted - set(METHODS))
    if unknown:
        raise UsageError(
            f"there is no method {', '.join(unknown)}", hint=f"there are {', '.join(METHODS)}"
        )
    return tuple(method for name, method in METHODS.items() if name in wanted)
