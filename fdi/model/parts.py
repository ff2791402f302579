"""What is an airframe made of? Variables, parameters, equations, measurements and components.

These values know no file syntax: ``load.py`` reads them from YAML, a test may build them by hand.
Every quantity is a float in the unit of the variable it belongs to; texts have become expressions.
"""

from __future__ import annotations

import re
from collections.abc import Container
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

from fdi.model.expression import CONSTANTS, NOISE, SAMPLED, Apply, Expression, symbols, walk
from fdi.telemetry import Channel

STATES: Final = frozenset(
    {
        "armed",
        "airborne",
        "mode",
        "phase",
        "controls_attitude",
        "controls_height",
        "wing_borne",
        "rotor_borne",
        "standing",
        "aloft",
        "step",
    }
)
"""What every condition knows: the flight state, and the time between two samples, s."""
MEASURED: Final = "measured"
"""A channel's value in its measurement equation."""
SLOPE: Final = "slope_of_state"
"""The derivative that was computed, in the residual of ``y = der(x)``."""
RESERVED: Final = STATES | {MEASURED, SLOPE, *CONSTANTS}
"""Names that a model cannot give to anything of its own."""
STILL: Final = ":still"
RECENT: Final = ":recent"
OVER: Final = ":over"
SILENT: Final = ":silent"
"""Behind a field: not its value, but how long it has not changed, s; its mean over the last
seconds; what ``value`` makes of a while of records, with a label (``:over_60``) where a field has
several; how long its message has been silent, s."""
_OVER: Final = re.compile(rf"{OVER}(_\w+)?$")


def is_over(field: str) -> bool:
    """Return whether a field's name stands for what a value makes of a while of records."""
    return bool(_OVER.search(field))


def without_over(channel: str) -> str:
    """Return the channel that a value makes something of."""
    return _OVER.sub("", channel)


Side = Literal["", "above", "below"]


class Kind(StrEnum):
    """What an equation states, which decides how it may be used."""

    RELATION = "equation"  # physics, geometry: can be solved for what it determines
    LIMIT = "limit"  # a quantity stays between bounds: never solved, no redundancy for cross-checks
    EQUALITY = "equality"  # a quantity stays at a value within a tolerance
    MEASUREMENT = "measurement"  # a channel of the log shows a variable; brings a fault
    INPUT = "input"  # likewise, but known and trusted


GROUPS: Final = (
    "sensor",
    "navigation",
    "autopilot",
    "os",
    "power",
    "link",
    "propulsion",
    "airframe",
    "other",
)
"""Of components and faults; what is not listed anywhere is of the last."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A file that a model was read from: its path in its folder, and whether it is shipped."""

    name: str
    sha256: str
    shipped: bool


@dataclass(frozen=True, slots=True)
class Component:
    """What a person replaces or tunes.

    ``affects`` names components that its failure disturbs. A ``computed`` one has no parts that
    break: what it says follows from others, which are asked first. ``title`` is what a person calls
    it, ``place`` where on the airframe it sits, as far as a log tells. What ``ends_log`` takes the
    recorder with it: a log that ends in the air cannot speak for it. What ``records`` makes the
    log: its failure is a gap of the recording, and by itself none of the vehicle. ``part_of`` names
    the component of which it is one part: who accuses both means the part.
    """

    name: str
    group: str = "other"
    description: str = ""
    affects: tuple[str, ...] = ()
    computed: bool = False
    title: str = ""
    place: str = ""
    ends_log: bool = False
    records: bool = False
    part_of: str = ""


@dataclass(frozen=True, slots=True)
class Variable:
    """A quantity of the model, bounded by ``low`` and ``high``; a circular one is an angle."""

    name: str
    unit: str
    low: float | None = None
    high: float | None = None
    circular: bool = False
    description: str = ""


@dataclass(frozen=True, slots=True)
class Source:
    """A parameter of the log that tells a parameter of the model, times ``scale``.

    ``unset`` holds the values that mean "not set"; ``autopilot`` is the only one on which the name
    means this; ``unless`` names messages and parameters: where the log has such a message, or the
    parameter is not 0, this one does not count.
    """

    name: str
    scale: float = 1.0
    unset: tuple[float, ...] = ()
    autopilot: str | None = None
    unless: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Parameter:
    """A known constant, taken from the first of its ``sources`` in the log that is set.

    ``value`` is None where it is unknown without them. ``world`` names a quantity of the place and
    day of the flight (see ``world.py``), ``frame`` what a motor does to the vehicle: ``roll_3`` is
    the roll factor of motor 3 (see `fdi.telemetry.motors`). ``bounds`` belong to one that is
    identified from the flight, so that the variable ``zero`` is; ``value`` is what is expected.
    """

    name: str
    value: float | None
    unit: str
    source: str = ""
    sources: tuple[Source, ...] = ()
    bounds: tuple[float, float] | None = None
    zero: str = ""
    world: str | None = None
    frame: str | None = None


@dataclass(frozen=True, slots=True)
class Amount:
    """A quantity over variables and parameters, in ``unit``, and ``when`` it is one.

    In ``words`` a # stands for it. It is told of alarms that last for ``least``, s: what is brief
    is an alarm because it stands out, and would be told as too much.
    """

    words: str
    value: Expression
    unit: str
    when: Expression | None = None
    least: float = 0.0


@dataclass(frozen=True, slots=True)
class Equation:
    """A statement ``left = right`` among variables and parameters.

    Attributes
    ----------
    text : str
        As the model file has it.
    when : Expression or None
        Where the statement holds, over variables, parameters and the flight state.
    solves : frozenset of str or None
        The unknowns it can be solved for; None means that this follows from the expressions.
    cost : float
        Of matching it, against 1 for an ordinary equation.
    fault, component : str or None
        The fault the equation brings, and whom a violation concerns.
    tolerance : float
        How far the two sides may differ in health, in the unit of the equation.
    unit : str
        Of the difference of the two sides.
    suspects : tuple of str
        Further components that a violation may concern: what feeds the quantity.
    window : float
        s; a derivative is taken over at least this long, for quantities that are noisy but slow;
        a slope over just this long.
    offset : float
        A constant by which the two sides may differ in health, learned from the flight's beginning.
    side : str
        ``above`` or ``below``: only a left side that is so against the right one is a violation.
    swings : tuple of Expression
        Not empty where the constant turns with the vehicle: where its left side has turned by an
        angle since the flight's beginning, the two may differ otherwise by as much as they did
        then, and by what these were then, standard deviations in the unit of the equation,
        independent of each other.
    errors : tuple of Expression
        What its two sides may differ by otherwise than at the flight's beginning, one standard
        deviation each, independent of each other.
    supports : bool
        A violation supports an accusation, and accuses nobody by itself.
    steady : bool
        Manoeuvres do not make its two sides differ: if they begin to scatter, that is noise.
    always : bool
        Of a limit or an equality: violated from the beginning it tells a fault that was there
        before, dated by where it began on the ground, and no condition of this flight.
    taught : bool
        It holds against what earlier flights of this vehicle taught, and is asked only where this
        one departs from them, in the seconds that tell so.
    command : bool
        A violation is seen in a recorded command: it tells what was asked for, not what was done.
    elapsed : bool
        Of a limit: its variable is how long something has lasted, and a violation dates from when
        that began.
    says : str
        What is so where it is violated, a verb phrase whose subject is the component, or a whole
        clause where it concerns none.
    amounts : tuple of Amount
        What a person can check where it is violated.
    """

    name: str
    kind: Kind
    text: str
    left: Expression
    right: Expression
    when: Expression | None = None
    solves: frozenset[str] | None = None
    cost: float = 1.0
    fault: str | None = None
    component: str | None = None
    tolerance: float = 0.0
    window: float = 0.0
    offset: float = 0.0
    side: Side = ""
    swings: tuple[Expression, ...] = ()
    errors: tuple[Expression, ...] = ()
    supports: bool = False
    steady: bool = False
    always: bool = False
    taught: bool = False
    command: bool = False
    elapsed: bool = False
    says: str = ""
    unit: str = ""
    suspects: tuple[str, ...] = ()
    amounts: tuple[Amount, ...] = ()


@dataclass(frozen=True, slots=True)
class Measurement:
    """A channel that shows a variable.

    Attributes
    ----------
    accuracy : float or None
        One sigma, in the variable's unit.
    jitter : float or None
        The part of it that changes from sample to sample, which is what a derivative feels; None
        means all of it.
    offset : float
        A constant difference that a healthy sensor may have, in the variable's unit.
    latency : float
        s; how late the channel shows the variable.
    late : str
        The parameter that the latency is taken from where a log is there, "" for none.
    latency_accuracy, latency_told : float
        s, one sigma of it: by itself, and where the log tells that parameter.
    reported : Expression or None
        The channel's accuracy by its own message, over its fields, in the variable's unit.
    value : Expression or None
        Over the message's fields; None means the field itself.
    when : Expression or None
        Where the channel is valid, over the message's fields and the flight state.
    raw : bool
        Whether the fields are taken as on the wire instead of in SI units.
    trusted : bool
        An input: known, brings no fault.
    stillness : bool
        How long the channel has not changed, s, instead of its value.
    stirred : tuple of (Channel, float)
        Stillness counts only where one of these has moved by so much, SI, since it began; empty:
        always.
    silence : bool
        How long its message has been silent while others go on, s, instead of its value.
    made_by : str
        The method that makes the message out of others, "" for one that logs hold themselves.
    """

    channel: Channel
    variable: str
    component: str
    group: str
    accuracy: float | None = None
    jitter: float | None = None
    offset: float = 0.0
    latency: float = 0.0
    late: str = ""
    latency_accuracy: float = 0.0
    latency_told: float = 0.0
    value: Expression | None = None
    when: Expression | None = None
    raw: bool = False
    trusted: bool = False
    reported: Expression | None = None
    stillness: bool = False
    stirred: tuple[tuple[Channel, float], ...] = ()
    silence: bool = False
    made_by: str = ""

    @property
    def is_sampled(self) -> bool:
        """Return whether what is reported is how well records stand for the while between them."""
        return _uses(self.reported, SAMPLED)

    @property
    def tells_itself(self) -> bool:
        """Return whether its accuracy is the sensor's own word, and not made of its records."""
        return self.reported is not None and not (
            self.is_sampled or self.made_by or _uses(self.reported, NOISE)
        )

    @property
    def behaviour(self) -> Literal["freeze", "loss", "noise", ""]:
        """Return by which way to fail it is read how the channel behaves; "" for what it shows."""
        if self.stillness:
            return "freeze"
        if self.silence:
            return "loss"
        return "noise" if _uses(self.value, NOISE) else ""


def _uses(expression: Expression | None, operator: str) -> bool:
    return expression is not None and any(
        isinstance(node, Apply) and node.operator == operator for node in walk(expression)
    )


def fields_of(measurement: Measurement, parameters: Container[str]) -> tuple[str, ...]:
    """Return the message fields that a measurement reads; a parameter of the model is none."""
    own = (measurement.channel.field,) if measurement.value is None else symbols(measurement.value)
    condition = symbols(measurement.when) if measurement.when else ()
    names = dict.fromkeys((*own, *condition))
    return tuple(name for name in names if name not in STATES and name not in parameters)


def read_by(
    measurement: Measurement, parameters: Container[str], *, accuracy: bool = False
) -> tuple[Channel, ...]:
    """Return the channels of the log that a measurement's column is made of.

    Parameters
    ----------
    measurement : Measurement
    parameters : container of str
        Names of the model's parameters.
    accuracy : bool
        Also those by which the message reports its accuracy.
    """
    names = dict.fromkeys(fields_of(measurement, parameters))
    if accuracy and measurement.reported is not None:
        told = symbols(measurement.reported)
        names.update(dict.fromkeys(name for name in told if name not in parameters))
    message, instance = measurement.channel.message, measurement.channel.instance
    own = tuple(Channel(message, name, instance) for name in names)
    return (*own, *(channel for channel, _ in measurement.stirred if measurement.stillness))
