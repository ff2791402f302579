"""What is a residual computed from?

In: the nodes of a bank. Out: of each node those that it needs, the channels that these read, and
the faults that reach it. Nothing is declared: whatever the computation takes in is in its graph,
the channels of conditions and those that choose among several roots included.

The faults are those of the equations on the way, and those of every channel that is read, which a
model may state as a trusted input in one place and as a measurement with a fault in another: wrong
data do not know for what they are read. A column reads the fields of its message that its value and
its validity are made of; behind a slope also those by which the message reports its accuracy, since
a slope is unknown where its inputs do not determine it.

What decides how far a residual may stray (the accuracy that a message reports, the error of an
equation) is not in it, nor is the flight state, which is no channel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from fdi.model.parts import read_by
from fdi.model.system import System
from fdi.residuals.node import Node
from fdi.telemetry import Channel


def needed_for(nodes: Sequence[Node], number: int) -> list[int]:
    """Return the numbers of the nodes that a node needs, itself included, ascending."""
    return _closed(number, lambda own: nodes[own].uses)


def _behind(nodes: Sequence[Node], number: int) -> list[int]:
    """Return the numbers of the nodes that a node's value depends on, likewise."""
    return _closed(number, lambda own: nodes[own].reads)


def _closed(number: int, following: Callable[[int], Iterable[int]]) -> list[int]:
    found: set[int] = set()
    stack = [number]
    while stack:
        own = stack.pop()
        if own not in found:
            found.add(own)
            stack.extend(following(own))
    return sorted(found)


def channels_read(system: System, nodes: Sequence[Node], number: int) -> tuple[Channel, ...]:
    """Return the channels of the log that a node is computed from, each once.

    Parameters
    ----------
    system : System
    nodes : sequence of Node
        Of a bank of that system.
    number : int
        Of the node.
    """
    needed = _behind(nodes, number)
    sloped = {
        below for own in needed if nodes[own].kind == "slope" for below in _behind(nodes, own)
    }
    found: dict[Channel, None] = {}
    for own in needed:
        measurement = system.equations[nodes[own].equation].measurement
        if nodes[own].kind == "channel" and measurement is not None:
            read = read_by(measurement, system.parameters, accuracy=own in sloped)
            found.update(dict.fromkeys(read))
    return tuple(found)


def faults_reaching(
    system: System, nodes: Sequence[Node], number: int, equations: Sequence[int]
) -> frozenset[int]:
    """Return the faults that a node is sensitive to, by their places in the system.

    Parameters
    ----------
    system, nodes, number
        As of :func:`channels_read`.
    equations : sequence of int
        Those that are solved on the way: of a loop only the first is a node's.
    """
    used = {*equations, *(nodes[own].equation for own in _behind(nodes, number))}
    read = set(channels_read(system, nodes, number))
    shown = [system.equations[fault.equation].measurement for fault in system.faults]
    return frozenset(
        place
        for place, (fault, own) in enumerate(zip(system.faults, shown, strict=True))
        if fault.equation in used or (own is not None and own.channel in read)
    )
