"""What does an alarm mean in a pilot's words?

In: a residual that left health, and the component that is said to have failed. Out: one clause
whose subject is that component: what the model says of the statement that is violated
(``says:``), or that it shows something else than the other parts do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fdi.diagnosis.concerns import concerns
from fdi.model.naming import component_words, inside

if TYPE_CHECKING:
    from fdi.model import System
    from fdi.model.parts import Component, Measurement, Variable
    from fdi.model.system import SystemEquation
    from fdi.residuals.bank import Bank, Generator


def channel_words(measurement: Measurement, variables: Mapping[str, Variable]) -> str:
    """Return what a channel shows, by the description of its variable.

    Examples
    --------
    >>> from fdi.model.parts import Measurement, Variable
    >>> from fdi.telemetry import Channel
    >>> channel = Channel.parse("GPS_RAW_INT.vel")
    >>> speed = Measurement(channel, "v_ground", "gps", "sensor")
    >>> channel_words(speed, {"v_ground": Variable("v_ground", "m/s")})
    'v ground'
    >>> channel_words(speed, {"v_ground": Variable("v_ground", "m/s", description="ground speed")})
    'ground speed'
    """
    described = variables[measurement.variable].description
    return described or measurement.variable.replace("_", " ").strip()


def alarm_words(component: str, generator: Generator, system: System) -> str:
    """Return what an alarm of a residual says of a component, with its name, without a full stop.

    Parameters
    ----------
    component : str
        One that the residual concerns.
    """
    subject = component_words(component, system.components)
    clause, is_verb = _clause(component, generator, system)
    return f"{subject} {clause}" if is_verb else f"{subject}: {clause}"


def alarm_sentences(bank: Bank) -> tuple[str, ...]:
    """Return what an alarm of each residual of a bank means, where nobody is accused for it.

    The subject is whom the residual concerns first, or what it states where it concerns nobody.
    """
    whom, system = concerns(bank), bank.system
    said = []
    for row, generator in enumerate(bank.generators):
        names = whom.in_order(row)
        about = names[0] if names else system.equations[generator.residual].name
        said.append(alarm_words(about, generator, system))
    return tuple(said)


def alarm_clause(component: str, generator: Generator, system: System) -> str:
    """Return the same where the component was named before: ``it ...``.

    Parameters
    ----------
    component : str
        One that the residual concerns.
    """
    clause, is_verb = _clause(component, generator, system)
    return f"it {clause}" if is_verb else clause


def alarm_fact(component: str, generator: Generator, system: System) -> str:
    """Return what an alarm states, as the clause behind a "that" or a "whether".

    Parameters
    ----------
    component : str
        One that the residual concerns.
    """
    clause, is_verb = _clause(component, generator, system)
    return f"{the_part(component, system.components)} {clause}" if is_verb else clause


def the_part(component: str, components: Mapping[str, Component]) -> str:
    """Return what a person calls a component inside a sentence, with its article.

    Examples
    --------
    >>> the_part("compass", {}), the_part("motor_2", {})
    ('the compass', 'motor 2')
    """
    words = inside(component_words(component, components))
    return words if any(letter.isdigit() for letter in words) else f"the {words}"


def telling_clause(component: str, tests: Sequence[str], bank: Bank) -> str:
    """Return the clause of the first of several tests that says what the component itself does.

    That tells more than that two others do not fit; the first test's where none does, and ""
    where the bank has none of them.

    Parameters
    ----------
    component : str
    tests : sequence of str
        Ids of residual generators, the more telling first.
    bank : Bank
    """
    by_id = {generator.id: generator for generator in bank.generators}
    known = [by_id[name] for name in tests if name in by_id]
    clauses = [alarm_clause(component, generator, bank.system) for generator in known]
    own = [clause for clause in clauses if clause.startswith("it ")]
    says_what = [clause for clause in own if not clause.startswith("it does not fit ")]
    return next(iter(says_what or own or clauses), "")


def _clause(component: str, generator: Generator, system: System) -> tuple[str, bool]:
    """Return what an alarm says, and whether it is a verb phrase with the component as subject.

    What the model says of a statement of this component comes first, the one that is left over
    before those it is computed with; then what the component's own channels show; then what is
    said of the whole.
    """
    equations = [system.equations[generator.residual]]
    equations += [system.equations[i] for i in generator.equations if i != generator.residual]
    for equation in equations:
        if equation.says and equation.component == component:
            return equation.says, True
    own = [
        e.measurement
        for e in equations
        if e.measurement
        and not (e.measurement.trusted or e.measurement.made_by)
        and e.component == component
    ]
    others = _others(component, equations, system)
    if own and others:
        return f"shows another {channel_words(own[0], system.variables)} than {others}", True
    for equation in equations:
        if equation.says and equation.component is None:
            return equation.says, False
    if len(own) > 1:
        return f"contradicts itself in {channel_words(own[0], system.variables)}", True
    return f"does not fit {others or 'what else is recorded'}", True


def _others(component: str, equations: list[SystemEquation], system: System) -> str:
    """Return the other parts that a residual compares, at most two, with articles."""
    names = dict.fromkeys(
        e.component
        for e in equations
        if e.component not in (None, component, "outside_model")
        and not (e.measurement and e.measurement.trusted)
    )
    words = [inside(component_words(name, system.components)) for name in names if name]
    return " and ".join(f"the {word}" for word in words[:2])
