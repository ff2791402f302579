"""How does a method's evidence come to stand beside the sensors'?

In: a log and a `Method`. Out: the log with one more message, named as the method is, that holds the
columns which the method made. What they say of whom is stated in a model file, as for any message
(``models/shared/estimator.yaml``): unit, accuracy, latency, component and suspects there are the
facts by which a bank reads a sensor. So the same bounds and budget judge them, the same likelihood
weighs them, and a log without them is a log without that message.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fdi.telemetry import Log
from fdi.telemetry.message import Column, Floats, Message
from fdi.units import si


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """What a method makes of a log.

    Attributes
    ----------
    t : (n,) float
        s of the log's clock, strictly increasing.
    values : Mapping[str, (n,) float]
        By field, in SI; NaN where it is not known.
    units : Mapping[str, str]
        Of the fields; one that is not named has none.
    made_from : str
        The message of the log that they come from.
    """

    t: Floats
    values: Mapping[str, Floats]
    made_from: str
    units: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Method:
    """A diagnoser that gives columns.

    Attributes
    ----------
    name : str
        Of the method and of the message that holds its columns.
    make : callable
        Gives the columns of a log or, in words that follow the method's name, why there are none.
        None: nobody expects any of such a log.
    """

    name: str
    make: Callable[[Log], Columns | str | None]


def with_columns(log: Log, methods: Iterable[Method]) -> tuple[Log, tuple[str, ...]]:
    """Return a log with the columns of methods, and in words which of them give none.

    A message of that name which the log holds by itself stays as it is.

    Parameters
    ----------
    log : Log
    methods : iterable of Method
    """
    silent = []
    for method in methods:
        is_taken = method.name in log and log[method.name].made_from is None
        taken = "the log holds a message of its own that is called so"
        made = taken if is_taken else method.make(log)
        if isinstance(made, str):
            silent.append(f"the method {method.name} is not weighed: {made}")
        elif made is not None:
            log = log.with_message(_message(method.name, made))
    return log, tuple(silent)


def _message(name: str, made: Columns) -> Message:
    columns = {
        field: Column(load=lambda own=own: own, conversion=si(made.units.get(field, "")))  # type: ignore[misc]
        for field, own in made.values.items()
    }
    return Message(
        name, None, made.t, made.t, np.arange(len(made.t)), columns, made_from=made.made_from
    )
