"""Do the entries of a model file make sense together, and which airframe do they make?

In: the definitions that ``load.py`` collected. Out: the airframe, or one ``ModelError`` with every
problem: a name that nothing defines, units that do not fit, a variable that no equation holds, a
fault that two equations bring, an expression that is not one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, TypeGuard

from fdi.errors import FdiError, ModelError
from fdi.model.airframe import Airframe
from fdi.model.dimensions import Dimension, dimension, dimension_of, misfit, quantity, spell
from fdi.model.expression import (
    NOISE,
    OVER_A_WHILE,
    OVER_RECORDS,
    OVER_TIME,
    REGRESSED,
    SAMPLED,
    Apply,
    Expression,
    Number,
    Symbol,
    parse,
    parse_equation,
    symbols,
    walk,
)
from fdi.model.members import members, slips
from fdi.model.parts import (
    OVER,
    RECENT,
    RESERVED,
    SILENT,
    STATES,
    STILL,
    Amount,
    Equation,
    Kind,
    Measurement,
    Parameter,
    Source,
    Variable,
    is_over,
)
from fdi.telemetry import Channel
from fdi.units import si_units

if TYPE_CHECKING:
    from fdi.model.definitions import Definition, Definitions
    from fdi.model.schema import AirframeFile, AmountEntry, Identify, LogParameter


_WINDOWED: Final = {
    "der": "y = der(x)",
    "slope": "y = slope(v, u)",
    "jump": "y = jump(v, u, w, x)",
}
_QUANTITY: Final = re.compile(r"[-+.\d]+(e[-+]?\d+)?( +[A-Za-z].*)?")
_SUFFIX: Final = re.compile(rf"({STILL}|{RECENT}|{OVER}(_\w+)?|{SILENT})$")

ONE_COLUMN: Final = ("accuracy", "jitter", "latency", "value", "when", "raw", "reported")
"""What a channel has once, however many variables it shows."""


@dataclass(slots=True)
class _Draft:
    """What has been read so far, and what was wrong with it."""

    found: Definitions
    units: dict[str, Dimension | None] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    parameters: dict[str, float] = field(default_factory=dict)  # their own values
    faults: dict[str, str] = field(default_factory=dict)
    watched: dict[str, Equation] = field(default_factory=dict)  # by the variable of the stillness
    columns: dict[Channel, tuple[Measurement, str]] = field(default_factory=dict)

    @contextmanager
    def reporting(self, definition: Definition, *part: str) -> Iterator[None]:
        """Turn what is wrong with a part of an entry into a problem with file and line."""
        try:
            yield
        except FdiError as error:
            name = ".".join(str(p) for p in (*definition.place, *part))
            self.found.problems.append(f"{definition.at(*part)}: {name}: {error}")

    def items(self, section: str) -> Iterator[tuple[str, Definition]]:
        for name, definition in self.found.sections[section].items():
            yield name.partition("#")[0], definition

    def bring_fault(self, name: str, definition: Definition, *part: str) -> None:
        if name in self.faults:
            raise ModelError(f"the fault {name!r} is brought twice, first at {self.faults[name]}")
        self.faults[name] = definition.at(*part)

    def check_column(self, made: Measurement, definition: Definition, *part: str) -> None:
        """Raise ModelError where a channel is said to be something else elsewhere.

        A channel may show several variables, as an input and as a measurement; it is one column
        with one accuracy all the same.
        """
        first, where = self.columns.setdefault(made.channel, (made, definition.at(*part)))
        other = [name for name in ONE_COLUMN if getattr(first, name) != getattr(made, name)]
        if other:
            raise ModelError(f"{made.channel} has another {' and '.join(other)} at {where}")

    def check_names(self, expression: Expression, extra: frozenset[str] = frozenset()) -> None:
        unknown = [n for n in symbols(expression) if n not in self.units and n not in extra]
        if unknown:
            names = ", ".join(repr(name) for name in unknown)
            raise ModelError(f"unknown symbol {names}")
        self.used.update(symbols(expression))


def assemble(main: AirframeFile, found: Definitions) -> Airframe:
    """Return the airframe that the definitions make.

    Raises
    ------
    ModelError
        Something is wrong; all problems are reported together.
    """
    draft = _Draft(found)
    variables = {
        name: v for name, d in draft.items("variables") if (v := _variable(name, d, draft))
    }
    parameters = {
        name: p for name, d in draft.items("parameters") if (p := _parameter(name, d, draft))
    }
    draft.parameters |= {n: p.value for n, p in parameters.items() if p.value is not None}
    equations: list[Equation] = []
    for kind, section in ((Kind.RELATION, "equations"), (Kind.EQUALITY, "equalities")):
        made = [_equation(name, kind, d, draft) for name, d in draft.items(section)]
        if section == "equalities":
            made = [_limit(name, d, draft) for name, d in draft.items("limits")] + made
        equations += [equation for equation in made if equation]
    measurements = [
        measurement
        for section in ("inputs", "measurements")
        for name, d in draft.items(section)
        for measurement in _message(name, d, section == "inputs", draft)
    ]
    equations += draft.watched.values()
    variables |= {
        name: Variable(name, "s", low=0.0, description=f"how long: {limit.name}")
        for name, limit in draft.watched.items()
    }
    for name, definition in draft.items("variables"):
        if name in variables and name not in draft.used:
            found.problems.append(f"{definition.at()}: variable {name!r} is in no equation")
    for name, definition in draft.items("parameters"):
        if definition.entry.identify is not None and name not in draft.used:
            found.problems.append(
                f"{definition.at()}: parameter {name!r} is identified, and in no equation"
            )
    if found.problems:
        raise ModelError.of(found.problems)
    return Airframe(
        name=main.name,
        description=main.description,
        vehicles=tuple(main.vehicles),
        components=members(found, equations, measurements),
        variables=variables,
        parameters=parameters,
        equations=tuple(equations),
        measurements=tuple(measurements),
        sha256=found.digest.hexdigest(),
        units=_units(variables),
        files=tuple(found.files),
        warnings=(*found.warnings, *slips(found)),
    )


def _units(variables: Mapping[str, Variable]) -> dict[str, Dimension]:
    """Return the dimensions that comparing a log's units with the model's will ask for."""
    units = {}
    for text in sorted({*(v.unit for v in variables.values()), *si_units()}):
        with suppress(ModelError):  # a log may have a unit that is none of physics
            units[text] = dimension(text)
    return units


def _variable(name: str, definition: Definition, draft: _Draft) -> Variable | None:
    entry = definition.entry
    with draft.reporting(definition):
        if name in RESERVED:
            raise ModelError(f"{name!r} has a meaning of its own in every model")
        draft.units[name] = None  # a wrong unit is one problem, not one for every use of the name
        draft.units[name] = dimension(entry.unit)
        low, high = entry.domain
        if low is not None and high is not None and low >= high:
            raise ModelError(f"the domain [{low:g}, {high:g}] is empty")
        return Variable(name, entry.unit, low, high, entry.circular, entry.description)
    return None


def _parameter(name: str, definition: Definition, draft: _Draft) -> Parameter | None:
    entry = definition.entry
    with draft.reporting(definition):
        if name in draft.units or name in RESERVED:
            raise ModelError(f"{name!r} is a variable already, or has a meaning of its own")
        draft.units[name] = None
        draft.units[name] = dimension(entry.unit)
        value = entry.value if entry.identify is None else entry.identify.prior
        if value is None and not entry.log and not entry.frame:
            raise ModelError("has neither a value nor anything to identify, nor is it in the log")
        if entry.frame and (entry.log or entry.world or entry.identify):
            raise ModelError("is told by the frame, and by nothing else but a value")
        return Parameter(
            name,
            value,
            entry.unit,
            entry.source,
            tuple(_sources(entry.log)),
            *_identified(entry.identify, draft),
            entry.world,
            entry.frame,
        )
    return None


def _identified(entry: Identify | None, draft: _Draft) -> tuple[tuple[float, float] | None, str]:
    """Return between which bounds a parameter is identified, and which variable is then zero."""
    if entry is None:
        return None, ""
    low, high = entry.bounds
    if not low <= entry.prior <= high or low == high:
        raise ModelError(f"the prior {entry.prior:g} is not within the bounds [{low:g}, {high:g}]")
    if entry.zero not in dict(draft.items("variables")):
        raise ModelError(f"unknown variable {entry.zero!r}")
    return entry.bounds, entry.zero


def _sources(entries: Iterable[LogParameter]) -> Iterator[Source]:
    for one in entries:
        for name in [one.name] if isinstance(one.name, str) else one.name:
            yield Source(name, one.scale, tuple(one.unset), one.autopilot, tuple(one.unless))


def _equation(name: str, kind: Kind, definition: Definition, draft: _Draft) -> Equation | None:
    entry = definition.entry
    with draft.reporting(definition):
        left, right = parse_equation(entry.text, draft.found.functions)
        draft.check_names(left)
        draft.check_names(right)
        _check_windowed(left, right, definition)
        unit = _check_units(left, right, draft)
        tolerance = quantity(entry.tolerance, unit) if entry.tolerance is not None else 0.0
        solves = None if entry.solves is None else frozenset(entry.solves)
        if entry.side:  # solved for something it would be no residual, and the side not known
            solves = frozenset()
        strangers = (solves or frozenset()) - set(symbols(left)) - set(symbols(right))
        if strangers:
            raise ModelError(f"solves {', '.join(sorted(strangers))}, which it does not hold")
        if entry.swings and not (
            isinstance(left, Symbol) and entry.offset and unit == dimension("rad")
        ):
            raise ModelError("swings needs an offset and one angle on the left")
        if entry.fault:
            draft.bring_fault(entry.fault, definition, "fault")
        return Equation(
            name,
            kind,
            entry.text,
            left,
            right,
            when=_condition(entry.when, draft),
            solves=solves,
            cost=entry.cost,
            fault=entry.fault,
            component=entry.component or (entry.fault and "outside_model") or None,
            tolerance=tolerance,
            window=quantity(entry.window or 0.0, dimension("s")),
            offset=quantity(entry.offset, unit),
            side=entry.side,
            swings=tuple(_swing(one, left, unit, definition, draft) for one in entry.swings),
            errors=tuple(_error(text, left, definition, draft) for text in entry.error),
            supports=entry.supports,
            steady=entry.steady,
            always=entry.always,
            taught=entry.taught,
            command=entry.command,
            says=entry.says or "",
            suspects=tuple(entry.suspects),
            unit=spell(unit),
            amounts=tuple(_amounts(entry.amounts, draft)),
        )
    return None


def _error(text: str, left: Expression, definition: Definition, draft: _Draft) -> Expression:
    """Return an error that depends on how the vehicle flies."""
    value = parse(text, functions=draft.found.functions)
    draft.check_names(value)
    _check_windowed(value, value, definition)
    _check_units(left, value, draft)
    return value


def _swing(
    entry: float | str, left: Expression, unit: Dimension, definition: Definition, draft: _Draft
) -> Expression:
    """Return what a constant swings by: a quantity, or an expression that the flight tells."""
    if re.fullmatch(_QUANTITY, str(entry)):
        return Number(quantity(entry, unit))
    return _error(str(entry), left, definition, draft)


def _amounts(entries: Mapping[str, AmountEntry], draft: _Draft) -> Iterator[Amount]:
    """Yield what a person can check of a statement."""
    for words, entry in entries.items():
        value = parse(entry.value, functions=draft.found.functions)
        draft.check_names(value)
        unit = dimension_of(value, draft.units) or Dimension(1.0, (), "1")
        least = quantity(entry.least, dimension("s"))
        yield Amount(words, value, spell(unit), _condition(entry.when, draft), least)


def _limit(name: str, definition: Definition, draft: _Draft) -> Equation | None:
    entry = definition.entry
    with draft.reporting(definition):
        if entry.variable not in draft.units:
            raise ModelError(f"unknown symbol {entry.variable!r}")
        variable: Expression = Symbol(entry.variable)
        terms: list[Expression] = []
        text = entry.variable
        for bound, sign in ((entry.min, 1), (entry.max, -1)):
            if bound is None:
                continue
            value = parse(bound) if isinstance(bound, str) else Number(float(bound))
            draft.check_names(value)
            terms.append(Apply("-", (value, variable) if sign > 0 else (variable, value)))
            text = f"{bound} <= {text}" if sign > 0 else f"{text} <= {bound}"
        if not terms:
            raise ModelError("has neither a min nor a max")
        excess = Apply("max", (*terms, Number(0.0)))
        unit = dimension_of(excess, draft.units) or Dimension(1.0, (), "1")
        draft.used.add(entry.variable)
        return Equation(
            name,
            Kind.LIMIT,
            text,
            excess,
            Number(0.0),
            when=_condition(entry.when, draft),
            solves=frozenset(entry.solves or ()),
            component=entry.component,
            suspects=tuple(entry.suspects),
            supports=entry.supports,
            always=entry.always,
            command=entry.command,
            elapsed=entry.elapsed,
            says=entry.says or "",
            unit=spell(unit),
        )
    return None


def _condition(text: str | None, draft: _Draft) -> Expression | None:
    if text is None:
        return None
    condition = parse(text, condition=True, functions=draft.found.functions)
    draft.check_names(condition, STATES)
    dimension_of(condition, draft.units)
    return condition


def _check_windowed(left: Expression, right: Expression, definition: Definition) -> None:
    for operator, form in _WINDOWED.items():
        uses = [n for side in (left, right) for n in walk(side) if _applies(n, operator)]
        if not uses:
            continue
        alone = isinstance(left, Symbol) and uses == [right] and isinstance(right, Apply)
        if not (alone and all(isinstance(a, Symbol) for a in uses[0].arguments)):
            call = form.partition(" = ")[2]
            raise ModelError(f"{call} stands alone on the right of '{form}', of variables")
        if operator in REGRESSED and len(uses[0].arguments) % 2:
            raise ModelError(f"{operator}(v, u) takes pairs: what follows, and what it follows")
        if operator in REGRESSED and not (definition.entry.window and definition.entry.tolerance):
            text = f"{operator}(v, u) needs a window, and the tolerance to which it is known"
            raise ModelError(text)


def _applies(node: Expression, operator: str) -> TypeGuard[Apply]:
    return isinstance(node, Apply) and node.operator == operator


def _check_units(left: Expression, right: Expression, draft: _Draft) -> Dimension:
    sides = [dimension_of(side, draft.units) for side in (left, right)]
    if sides[0] and sides[1] and not sides[0].fits(sides[1]):
        raise ModelError(f"unit mismatch: {misfit(left, sides[0], right, sides[1])}")
    return sides[0] or sides[1] or Dimension(1.0, (), "1")


def _message(
    name: str, definition: Definition, trusted: bool, draft: _Draft
) -> Iterator[Measurement]:
    entry = definition.entry
    for field_name, item in entry.fields.items():
        part = ("fields", field_name)
        with draft.reporting(definition, *part):
            separator = "/" if name.isdigit() else "."
            bare = re.sub(_SUFFIX, "", field_name)
            channel = Channel.parse(f"{name}{separator}{bare}")
            if item.variable not in draft.units:
                raise ModelError(f"unknown symbol {item.variable!r}")
            draft.used.add(item.variable)
            if not trusted:
                draft.bring_fault(str(channel), definition, *part)
            unit = draft.units[item.variable]
            if unit is None:
                continue
            made = _measurement(channel, entry, item, trusted, unit, draft)
            _check_over_time(made, over=is_over(field_name))
            if bare == field_name:
                draft.check_column(made, definition, *part)
            if field_name.endswith(SILENT):
                yield _silent(made)
                continue
            if field_name.endswith(STILL):
                yield _stillness(made, item.variable, made.accuracy)
                continue
            if field_name.endswith(RECENT):
                yield _recent(made)
                continue
            if is_over(field_name):
                over = _over(made, field_name)
                draft.check_column(over, definition, *part)
                yield over
                continue
            yield replace(made, stirred=())
            if item.freeze is not None:
                watched = _watched(made, quantity(item.freeze, dimension("s")), draft)
                yield _stillness(made, watched)


def _check_over_time(of: Measurement, *, over: bool) -> None:
    """Raise ModelError where what is of a while stands elsewhere, or does not stand there."""
    used: dict[str, set[str]] = {}
    for name, part in (("value", of.value), ("when", of.when), ("reported", of.reported)):
        nodes = walk(part) if part is not None else ()
        used[name] = {node.operator for node in nodes if isinstance(node, Apply)} & OVER_TIME
    allowed = OVER_RECORDS if over else OVER_RECORDS - OVER_A_WHILE
    for name in sorted(used["value"] - allowed):
        place = "equations" if name not in OVER_RECORDS else f"the value of FIELD{OVER}"
        raise ModelError(f"{name}(...) is for {place}")
    told = {SAMPLED} if over else {NOISE}
    for name in sorted(used["when"] | used["reported"] - told):
        raise ModelError(f"{name}(...) cannot stand in a condition or in what is reported")
    if SAMPLED in used["value"]:
        raise ModelError(f"{SAMPLED}(...) tells an accuracy: it is for what is reported")
    if over and not used["value"] & OVER_A_WHILE:
        raise ModelError("needs a value with change(x, seconds) or integral(x, seconds)")


def _watched(of: Measurement, longest: float, draft: _Draft) -> str:
    """Note the limit on how long a channel may stand still, and return its variable."""
    name = re.sub(r"\W+", "_", f"still_{of.channel}")
    if longest <= 0:
        raise ModelError(f"freeze is {longest:g} s, must be positive")
    draft.watched[name] = Equation(
        f"{of.channel}:frozen",
        Kind.LIMIT,
        f"{of.channel} changes within {longest:g} s",
        Apply("max", (Apply("-", (Symbol(name), Number(longest))), Number(0.0))),
        Number(0.0),
        when=parse("airborne and phase != 'landing'", condition=True),  # at rest all stand still
        solves=frozenset(),
        fault=f"{of.channel}:frozen",
        component=of.component,
        elapsed=True,
        says="keeps showing the very same value in flight",
        unit="s",
    )
    return name


def _stillness(of: Measurement, variable: str, accuracy: float | None = None) -> Measurement:
    """Return how long a channel has stood still as an input."""
    return Measurement(
        Channel(of.channel.message, of.channel.field + STILL, of.channel.instance),
        variable,
        of.component,
        of.group,
        accuracy=accuracy,
        value=Apply("still", (of.value or Symbol(of.channel.field),)),
        when=of.when,
        raw=of.raw,
        trusted=True,
        stillness=True,
        stirred=of.stirred,
    )


def _recent(of: Measurement) -> Measurement:
    """Return the mean of a channel over its last seconds as an input."""
    return replace(
        of,
        channel=Channel(of.channel.message, of.channel.field + RECENT, of.channel.instance),
        value=Apply("recent", (of.value or Symbol(of.channel.field),)),
        trusted=True,
    )


def _over(of: Measurement, name: str) -> Measurement:
    """Return what a value makes of the records of a while as an input."""
    return replace(of, channel=Channel(of.channel.message, name, of.channel.instance), trusted=True)


def _silent(of: Measurement) -> Measurement:
    """Return how long a channel's message has been silent as an input."""
    return replace(
        of,
        channel=Channel(of.channel.message, of.channel.field + SILENT, of.channel.instance),
        value=Number(0.0),  # when its records came counts, not what they say
        when=None,
        trusted=True,
        stillness=True,
        silence=True,
    )


def _measurement(
    channel: Channel, entry: Any, item: Any, trusted: bool, unit: Dimension, draft: _Draft
) -> Measurement:
    accuracy = None if item.accuracy is None else quantity(item.accuracy, unit)
    if accuracy is not None and accuracy <= 0:
        raise ModelError(f"accuracy is {accuracy:g}, must be positive")
    jitter = None if item.jitter is None else quantity(item.jitter, unit)
    if jitter is not None and not (accuracy and 0 < jitter <= accuracy):
        raise ModelError(f"jitter is {jitter:g}, must be positive and within the accuracy")
    latency = entry.latency if item.latency is None else item.latency
    late = latency if isinstance(latency, str) and latency in draft.parameters else ""
    seconds = dimension("s")
    own = quantity(entry.latency_accuracy, seconds)
    told = own if entry.latency_told is None else quantity(entry.latency_told, seconds)
    value = None if item.value is None else parse(item.value)
    reported = None if item.reported is None else parse(item.reported)
    if reported is not None and accuracy is None:
        raise ModelError("reported needs an accuracy to be held against")
    conditions = [parse(w, condition=True) for w in (entry.when, item.when) if w]
    return Measurement(
        channel,
        item.variable,
        component=item.component or entry.component or "outside_model",
        group=item.group or entry.group or "other",
        accuracy=accuracy,
        jitter=jitter,
        offset=quantity(item.offset, unit),
        stirred=tuple((Channel.parse(name), _in_si(moved)) for name, moved in item.stirred.items()),
        latency=draft.parameters[late] if late else quantity(latency, seconds),
        late=late,
        latency_accuracy=own,
        latency_told=told,
        value=value,
        when=_all(conditions),
        raw=item.raw,
        trusted=trusted,
        reported=reported,
        made_by=entry.made_by,
    )


def _in_si(moved: float | str) -> float:
    """Return a quantity of whatever unit it states in SI."""
    unit = dimension(str(moved).strip().partition(" ")[2] or "1")
    return quantity(moved, unit) * unit.factor


def _all(conditions: list[Expression]) -> Expression | None:
    if len(conditions) < 2:
        return conditions[0] if conditions else None
    return Apply("and", tuple(conditions))
