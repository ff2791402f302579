"""Who is neither accused nor cleared, and who could not be tested at all?

In: alarms, the bank, who is named or cleared. Out: `Open`, components with tests that ran, each
with the alarm that concerns it or what keeps it from being cleared; `NotTestable`, those that this
telemetry cannot show, each with what keeps it from doing so.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.alarms import UNKNOWN
from fdi.diagnosis.clearing import (
    KNOWN_SHARE,
    LAST_S,
    Quiet,
    ended_well,
    faults_by_component,
    quiet_tests,
    said_faults,
    unpowered,
)
from fdi.diagnosis.concerns import Concerns, concerns
from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.straying import Strays, strays, violated_from_start
from fdi.diagnosis.values import Isolability, NotTestable, Open
from fdi.model.expression import symbols
from fdi.residuals import Bank

ONLY_ACCUSE: Final = "only tests that can accuse, never clear"
FOLLOWED: Final = (
    "only tests whose other side may follow a lasting error, so that their silence clears nobody"
)
NO_SIZE: Final = "no size can be stated from which on every fault would have shown"
_WAITING: Final = {
    "wing_borne": "on wings only, which never carried it for long",
    "rotor_borne": "on rotors only, which never carried it for long",
    "aloft": "clear of the magnetic fields of the ground only, 2.5 m above it",
}


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
    left, tests = strays(alarms), quiet_tests(alarms)
    beyond = (left.raised | left.lasted).any(axis=1)
    # a moment keeps nobody from being cleared unless it speaks against somebody: at the end
    beyond |= tests.against & left.moments.any(axis=1)
    result = []
    for name in bank.system.components:
        if name in told or name == "outside_model":
            continue
        rows = [row for row in range(len(alarms.state)) if name in whom.of(row)]
        ran = [row for row in rows if (alarms.state[row] != UNKNOWN).any()]
        hot = [row for row in ran if beyond[row]]
        why = _left(name, hot, left, alarms) if hot else _all_along(name, alarms)
        why = why or _why(name, ran, tests, alarms, whom)
        result.append(Open(name, why))
    return tuple(result)


def _left(name: str, hot: list[int], left: Strays, alarms: Alarms) -> str:
    """Return which test that concerns a component left health, how, and from when on."""
    bank, t = alarms.residuals.bank, alarms.residuals.t
    ways = (
        ("an alarm concerns it", left.raised),
        ("a test left health briefly", left.lasted),
        ("a test left health for a moment", left.moments),
    )
    how, when = next((how, when) for how, when in ways if when[hot].any())
    since = {row: float(t[int(np.argmax(when[row]))]) for row in hot if when[row].any()}
    first = min(since, key=lambda row: (since[row], row))
    words = alarm_words(name, bank.generators[first], bank.system)
    more = f", and {len(hot) - 1} more" if len(hot) > 1 else ""
    return f"{how}: {words}, from {since[first]:.1f} s{more}"


def _why(name: str, ran: list[int], tests: Quiet, alarms: Alarms, whom: Concerns) -> str:
    """Return what keeps a component from being cleared whose tests stayed within health."""
    bank = alarms.residuals.bank
    if not ran:
        return "no test of it ran"
    if bank.system.components[name].ends_log and not ended_well(alarms):
        end = alarms.residuals.signals.ends[-1:]
        if any(one.is_seen and one.at < alarms.residuals.t[-1] - LAST_S for one in end):
            return "a moment's failure of it may have ended a flight that ends without a landing"
        return "it may have ended a log that ends without a landing"
    if not said_faults(name, bank, whom):
        return ONLY_ACCUSE
    if unpowered(name, bank, whom):
        return FOLLOWED
    shares = (
        (tests.rougher, "scatters more than at first", "scatter more than at first"),
        (tests.against & ~tests.rougher, *2 * ("raised an alarm on the ground",)),
        (~tests.long, *2 * (f"ran for less than {KNOWN_SHARE:.0%} of the time in the air",)),
        (~tests.able, *2 * (f"did not run in the last {LAST_S:g} s in the air",)),
    )
    for which, single, several in shares:
        many = int(which[ran].sum())
        if many:
            return f"{_share(many, len(ran))} {single if many == 1 else several}"
    return NO_SIZE


def _all_along(name: str, alarms: Alarms) -> str:
    """Return what is so of a component from the flight's beginning on, "" where nothing is."""
    bank = alarms.residuals.bank
    said = [
        alarm_words(name, bank.generators[row], bank.system)
        for row in violated_from_start(alarms)
        if bank.system.equations[bank.generators[row].residual].component == name
    ]
    return f"{'; '.join(said)}: so from the beginning of the flight on" if said else ""


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
            text = "no test of it reads a channel of this log"
        elif columns and not seen:
            faults = (system.faults[c].name.removeprefix(f"{name}.") for c in columns[:4])
            names = ", ".join(faults)
            text = f"its channels are in no test that this telemetry allows ({names})"
        elif not any((bank.incidence[:, c] & ran).any() for c in seen):
            own = np.flatnonzero(bank.incidence[:, seen].any(axis=1))
            rows = {*own.tolist(), *concerned.get(name, [])}
            text = _all_along(name, alarms) or (_waiting(alarms, rows) if flew else "")
            if not text and alarms.unfit[sorted(rows)].any():
                text = "its tests are beyond health as the flight begins, and judge nothing later"
            if not text:
                text = "its tests never had all that they need"
                text += "" if flew else ", or hold in the air only"
        else:
            continue
        result.append(NotTestable(name, text))
    return tuple(result)


def _waiting(alarms: Alarms, rows: Collection[int]) -> str:
    """Return where any of these tests would hold and the vehicle never was, "" for nothing."""
    bank, state = alarms.residuals.bank, alarms.residuals.signals.state.named()
    equations = bank.system.equations
    for flag, where in _WAITING.items():
        needed = all(
            any(
                (when := equations[i].when) is not None and flag in symbols(when)
                for i in bank.generators[row].equations
            )
            for row in rows
        )
        if rows and needed and not state[flag].any():
            return f"its tests hold {where}"
    return ""
