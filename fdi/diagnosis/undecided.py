"""Who is neither accused nor cleared, and who could not be tested at all?

In: alarms, the bank, who is named or cleared. Out: `Open`, components with tests that ran, each
with the alarm that concerns it or what keeps it from being cleared; `NotTestable`, those that this
telemetry cannot show, each with what keeps it from doing so.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED, UNKNOWN
from fdi.diagnosis.clearing import ended_well, faults_by_component, quiet_tests
from fdi.diagnosis.concerns import concerns
from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.values import Isolability, NotTestable, Open
from fdi.model.expression import symbols
from fdi.residuals import Bank
from fdi.telemetry.airtime import when_in_air

_CARRIERS: Final = {"wing_borne": "wings", "rotor_borne": "rotors"}


def left_open(alarms: Alarms, told: Collection[str]) -> tuple[Open, ...]:
    """Return the components of which nothing is said yet though a test of them ran.

    Parameters
    ----------
    alarms : Alarms
    told : collection of str
        Components that are accused, consequences, ruled out or not testable.
    """
    bank = alarms.residuals.bank
    whom = concerns(bank)
    flying = when_in_air(alarms.residuals.signals)
    beyond = alarms.alarm | (alarms.state == TRIGGERED)
    beyond[:, ~flying] = False
    able, against = quiet_tests(alarms)
    result = []
    for name in bank.system.components:
        if name in told or name == "outside_model":
            continue
        rows = [row for row in range(len(alarms.state)) if name in whom.of(row)]
        ran = [row for row in rows if (alarms.state[row] != UNKNOWN).any()]
        hot = [row for row in ran if beyond[row].any()]
        result.append(Open(name, _why(name, ran, hot, (able, against), alarms)))
    return tuple(result)


def _why(
    name: str,
    ran: list[int],
    hot: list[int],
    tests: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    alarms: Alarms,
) -> str:
    """Return what keeps a component from being cleared, in words."""
    bank = alarms.residuals.bank
    if hot:
        first = min(hot, key=lambda row: (not alarms.alarm[row].any(), _since(alarms, row), row))
        words = alarm_words(name, bank.generators[first], bank.system)
        how = "an alarm concerns it" if alarms.alarm[first].any() else "a test left health briefly"
        more = f", and {len(hot) - 1} more" if len(hot) > 1 else ""
        return f"{how}: {words}, from {_since(alarms, first):.1f} s{more}"
    if not ran:
        return "no test of it ran"
    if bank.system.components[name].ends_log and not ended_well(alarms):
        return "it may have ended a log that ends without a landing"
    able, against = tests
    if against[ran].any():
        many = int(against[ran].sum())
        said = f"{_share(many, len(ran))} {'scatters' if many == 1 else 'scatter'}"
        return f"{said} more than at first, or raised an alarm on the ground"
    if not able[ran].all():
        many = int((~able[ran]).sum())
        return f"{_share(many, len(ran))} did not run all the way to the end"
    return "its tests do not say how small a fault of it they would show"


def _share(many: int, of: int) -> str:
    """Return how many of a part's tests, as the subject of a sentence.

    Examples
    --------
    >>> _share(1, 1), _share(2, 3), _share(3, 3)
    ('its only test', '2 of its 3 tests', 'all its 3 tests')
    """
    if of == 1:
        return "its only test"
    return f"all its {of} tests" if many == of else f"{many} of its {of} tests"


def _since(alarms: Alarms, row: int) -> float:
    raised = alarms.alarm[row] if alarms.alarm[row].any() else alarms.state[row] == TRIGGERED
    return float(alarms.residuals.t[int(np.argmax(raised))])


def not_testable(
    alarms: Alarms, bank: Bank, implementable: Isolability, *, flew: bool
) -> tuple[NotTestable, ...]:
    """Return the components that this telemetry cannot show, each with the reason.

    Parameters
    ----------
    alarms : Alarms
    bank : Bank
    implementable : Isolability
        By the residual generators.
    flew : bool
        Whether the vehicle was seen to fly.
    """
    system = bank.system
    present = faults_by_component(bank)
    ran = (alarms.state != UNKNOWN).any(axis=1)
    concerned: dict[str, list[int]] = {}
    for row, generator in enumerate(bank.generators):
        name = system.equations[generator.residual].component
        if name is not None:
            concerned.setdefault(name, []).append(row)
    result = []
    for name in system.components:
        columns = [column for column, _ in present.get(name, [])]
        seen = [c for c in columns if implementable.detectable[c]]
        if name == "outside_model" or (not columns and ran[concerned.get(name, [])].any()):
            continue
        if not columns and name not in concerned:
            text = "no channel in this log shows it"
        elif columns and not seen:
            names = ", ".join(system.faults[c].name for c in columns[:4])
            text = f"its channels are in no test that this telemetry allows ({names})"
        elif not any((bank.incidence[:, c] & ran).any() for c in seen):
            own = np.flatnonzero(bank.incidence[:, seen].any(axis=1))
            text = _waiting(alarms, {*own.tolist(), *concerned.get(name, [])}) if flew else ""
            text = text or "its tests never had all that they need"
            text += "" if flew else ", or hold in the air only"
        else:
            continue
        result.append(NotTestable(name, text))
    return tuple(result)


def _waiting(alarms: Alarms, rows: Collection[int]) -> str:
    """Return what had to carry the vehicle for any of these tests and never did, "" for nothing."""
    bank, state = alarms.residuals.bank, alarms.residuals.signals.state.named()
    equations = bank.system.equations
    for flag, carrier in _CARRIERS.items():
        needed = all(
            any(
                (when := equations[i].when) is not None and flag in symbols(when)
                for i in bank.generators[row].equations
            )
            for row in rows
        )
        if rows and needed and not state[flag].any():
            return f"its tests hold on {carrier} only, which never carried it for long"
    return ""
