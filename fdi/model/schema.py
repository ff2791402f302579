"""What shape has an airframe file? The spec of ``format: 1``, checked entry by entry.

Only shape is checked here (which keys, which types); what the entries mean together is checked in
``load.py``. Every problem comes with its path, which the YAML reader turns into a line.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
)

from fdi.model.definitions import SECTIONS
from fdi.model.parts import GROUPS

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=80)]
Quantity = float | str
"""A number in the variable's unit, or a number with a unit: ``0.3 m/s``."""
Clause = Annotated[str, StringConstraints(pattern=r"^[^_<>=\n]{0,69}[^_<>=\n.]$")]
"""What is so where a statement is violated, to stand behind the name of a component."""
Amount = Annotated[str, StringConstraints(pattern=r"^[^#_<>=\n]{0,60}#[^#_<>=\n]{0,60}$")]
"""A phrase in which # stands for a quantity."""
FrameFactor = Annotated[str, StringConstraints(pattern=r"^(roll|pitch|yaw)_([1-9]|1[0-2])$")]
"""A factor of a motor: ``roll_3``."""


def _known_group(value: str) -> str:
    if value not in GROUPS:
        raise ValueError(f"no group {value!r}; there are {', '.join(GROUPS)}")
    return value


Group = Annotated[str, AfterValidator(_known_group)]


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid")


def _text_entry(value: Any) -> Any:
    """Return an equation that is written as its text alone as an entry."""
    return {"text": value} if isinstance(value, str) else value


def _value_entry(value: Any) -> Any:
    """Return an amount that is written as its value alone as an entry."""
    return {"value": value} if isinstance(value, str) else value


def _one_or_many(value: Any) -> Any:
    """Return one entry as a list."""
    return value if isinstance(value, list) else [value]


class ComponentEntry(_Entry):
    """A component; ``name`` is what a person calls it."""

    name: Clause | None = None
    group: Group = "other"
    description: str = ""
    affects: list[Name] = []
    computed: bool = False
    ends_log: bool = False
    records: bool = False
    part_of: Name | None = None


class VariableEntry(_Entry):
    """A variable."""

    unit: str
    domain: tuple[float | None, float | None] = (None, None)
    circular: bool = False
    description: str = ""


class LogParameter(_Entry):
    """Where a parameter stands in the log: its name there, or its names over firmware versions."""

    name: str | list[str]
    scale: float = 1.0
    unset: list[float] = []
    autopilot: Literal["ardupilot", "px4"] | None = None
    unless: list[str] = []


class Identify(_Entry):
    """A parameter to identify from flights: so that a variable is zero at the beginning."""

    prior: float
    bounds: tuple[float, float]
    zero: Name


class ParameterEntry(_Entry):
    """A parameter: a value, or what to identify."""

    unit: str
    value: float | None = None
    source: str = ""
    log: Annotated[list[LogParameter], BeforeValidator(_one_or_many)] = []
    identify: Identify | None = None
    world: Literal["magnetic_declination", "magnetic_horizontal", "magnetic_strength"] | None = None
    frame: FrameFactor | None = None
    description: str = ""


class AmountEntry(_Entry):
    """A quantity that a person can check, and where it is one."""

    value: str
    when: str | None = None
    least: Quantity = 0.0


class EquationEntry(_Entry):
    """An equation or equality."""

    text: str
    when: str | None = None
    solves: list[Name] | None = None
    cost: float = Field(default=1.0, gt=0)
    fault: str | None = None
    component: Name | None = None
    suspects: list[Name] = []
    tolerance: Quantity | None = None
    window: Quantity | None = None
    offset: Quantity = 0.0
    side: Literal["", "above", "below"] = ""
    swings: Annotated[list[Quantity], BeforeValidator(_one_or_many)] = []
    error: Annotated[list[str], BeforeValidator(_one_or_many)] = []
    supports: bool = False
    steady: bool = False
    always: bool = False
    taught: bool = False
    command: bool = False
    says: Clause | None = None
    amounts: dict[Amount, Annotated[AmountEntry, BeforeValidator(_value_entry)]] = {}


class LimitEntry(_Entry):
    """A limit."""

    variable: Name
    min: float | str | None = None
    max: float | str | None = None
    component: Name | None = None
    suspects: list[Name] = []
    when: str | None = None
    solves: list[Name] | None = None
    supports: bool = False
    always: bool = False
    command: bool = False
    elapsed: bool = False
    says: Clause | None = None


class FieldEntry(_Entry):
    """A field of a message that shows a variable."""

    variable: Name
    accuracy: Quantity | None = None
    jitter: Quantity | None = None
    offset: Quantity = 0.0
    latency: Quantity | None = None
    reported: str | None = None
    value: str | None = None
    when: str | None = None
    raw: bool = False
    freeze: Quantity | None = None
    stirred: dict[str, Quantity] = {}
    component: Name | None = None
    group: Group | None = None


class MeasurementEntry(_Entry):
    """A message of the log."""

    fields: dict[str, FieldEntry]
    component: Name | None = None
    group: Group | None = None
    latency: Quantity = 0.0
    latency_accuracy: Quantity = 0.0
    latency_told: Quantity | None = None
    when: str | None = None
    made_by: str = ""
    description: str = ""


def _known_section(value: str) -> str:
    if value not in SECTIONS:
        raise ValueError(f"nothing to remove from; there are {', '.join(SECTIONS)}")
    return value


Section = Annotated[str, AfterValidator(_known_section)]
Written = Annotated[EquationEntry, BeforeValidator(_text_entry)]


class AirframeFile(_Entry):
    """A whole file."""

    format: Literal[1]
    name: Name
    description: str = ""
    vehicles: list[str] = []
    include: list[str] = []
    extends: str | None = None
    remove: dict[Section, list[str]] = {}
    components: dict[Name, ComponentEntry] = {}
    variables: dict[Name, VariableEntry] = {}
    parameters: dict[Name, ParameterEntry] = {}
    equations: dict[Name, Written] = {}
    limits: dict[Name, LimitEntry] = {}
    equalities: dict[Name, Written] = {}
    inputs: dict[str, MeasurementEntry] = {}
    measurements: dict[str, MeasurementEntry] = {}
