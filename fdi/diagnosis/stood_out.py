"""What stood out in a flight, whoever is accused? Facts, and no accusations.

In: what the checks of the set-up say, alarms, a diagnosis. Out: `Fact`s: what is set up wrongly,
what strikes though it is not beyond doubt, and limits that are violated from the beginning of the
flight on, which no test can judge because they are a condition and no event. `with_facts` gives a
diagnosis that accuses nobody the fact that a pilot must read, and lets no flight look healthy whose
set-up is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from fdi.decision import Alarms
from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.straying import violated_from_start
from fdi.diagnosis.values import MOST_LETTERS, Diagnosis, Open
from fdi.diagnosis.verdict import NOBODY, UNEXPLAINED
from fdi.methods.setup import Check
from fdi.methods.setup.oscillation import NAME as OSCILLATION
from fdi.model import System
from fdi.model.naming import component_words
from fdi.shown import Shown
from fdi.telemetry.airtime import begun_in_air
from fdi.telemetry.impact import HARD_SPEED

ENDING: Final = "ending"
CARRIES: Final = ("motors", "battery", "motor limits", "thrust to weight")
"""Checks of what carries the vehicle: first."""
_ENDS_FLIGHTS: Final = (OSCILLATION, *CARRIES[1:], ENDING)
"""In the verdict even where it only strikes."""
_SENTENCE: Final = re.compile(r"(?<=[.?!]) (?=[A-Z])")


@dataclass(frozen=True, slots=True)
class Fact(Shown):
    """Something that a person should know of the flight, without an accusation.

    Attributes
    ----------
    about : str
        The check (``motor limits``), or the component.
    text : str
        One clause, without a full stop.
    is_wrong : bool
        Whether it is beyond doubt set up wrongly, or went wrong.
    leads : bool
        Whether it belongs into the verdict where nobody is accused.
    records : tuple of str
        What of the log it rests on, record by record; of a check its own numbers tell that.
    """

    about: str
    text: str
    is_wrong: bool = False
    leads: bool = False
    records: tuple[str, ...] = ()


def stood_out(checks: Sequence[Check], alarms: Alarms, diagnosis: Diagnosis) -> tuple[Fact, ...]:
    """Return what stood out, what carries the vehicle first, then what is wrong."""
    system = alarms.residuals.bank.system
    accused = {finding.component for finding in diagnosis.findings}
    facts = [
        *(_fact(check, accused, system) for check in checks if _is_told(check, accused)),
        *_falls(diagnosis),
        *_standing(alarms),
    ]
    return tuple(sorted(facts, key=_place))


def with_facts(diagnosis: Diagnosis, facts: Sequence[Fact]) -> Diagnosis:
    """Return a diagnosis whose verdict and outlook know what stood out.

    An accusation stays as it is; where nobody is accused, the first fact that leads stands behind
    the verdict's first sentence. A part that stood out itself is not ruled out: tests tell changes,
    and it was so all along.
    """
    about = {fact.about: fact for fact in facts}
    cleared = tuple(one for one in diagnosis.ruled_out if one.component not in about)
    known = tuple(
        Open(
            name,
            "no test saw it change, but " + about[name].text.removeprefix(f"{name}: "),
        )
        for one in diagnosis.ruled_out
        if (name := one.component) in about
    )
    known += tuple(
        Open(one.component, about[one.component].text)
        for one in diagnosis.not_testable
        if one.component in about
    )
    untested = tuple(one for one in diagnosis.not_testable if one.component not in about)
    diagnosis = replace(
        diagnosis, ruled_out=cleared, open=diagnosis.open + known, not_testable=untested
    )
    outlook = diagnosis.outlook
    if outlook == "healthy" and any(fact.is_wrong for fact in facts):
        outlook = "alarms"
    leading = next((fact for fact in facts if fact.leads), None)
    if leading is None or diagnosis.findings:
        return replace(diagnosis, outlook=outlook)
    return replace(diagnosis, outlook=outlook, verdict=_led_by(diagnosis.verdict, leading))


def _is_told(check: Check, accused: set[str]) -> bool:
    """Whether it stands out by itself: what an accused part explains is no set-up that strikes."""
    return check.verdict == "wrong" or (check.strikes and accused.isdisjoint(check.rests_on))


def _fact(check: Check, accused: set[str], system: System) -> Fact:
    """Return the fact of a check, less sure where what it rests on is accused itself."""
    own = check.text.lower().startswith(check.name.lower())
    text = check.text if own else f"{check.name}: {check.text}"
    doubted = [
        component_words(name, system.components) for name in check.rests_on if name in accused
    ]
    if doubted:
        return Fact(check.name, f"{text}; but {doubted[0]}, on which this rests, is accused itself")
    is_wrong = check.verdict == "wrong"
    return Fact(check.name, text, is_wrong, is_wrong or check.name in _ENDS_FLIGHTS)


def _falls(diagnosis: Diagnosis) -> Iterator[Fact]:
    """Yield the flights that end upright and at rest, though too fast for a landing."""
    for one in diagnosis.endings:
        end = one.end
        if end.how == "landed" and end.speed is not None and end.speed > HARD_SPEED:
            text = (
                f"it came down at {end.speed:.1f} m/s (log {end.at:.1f} s), harder than a landing: "
                f"landing gear stands {HARD_SPEED:.0f}"
            )
            yield Fact(ENDING, text, leads=True)


def _standing(alarms: Alarms) -> Iterator[Fact]:
    """Yield the statements that are violated from the beginning of the flight on, and mostly."""
    bank = alarms.residuals.bank
    in_air = begun_in_air(alarms.residuals.signals.flights) is not None
    what = "log" if in_air else "flight"
    for row, share in violated_from_start(alarms).items():
        generator = bank.generators[row]
        about = str(bank.system.equations[generator.residual].component)
        words = alarm_words(about, generator, bank.system)
        since = f"from the beginning of the {what} on and in {100 * share:.0f} % of it"
        yield Fact(about, f"{words}, {since}")


def _place(fact: Fact) -> tuple[int, bool]:
    known = fact.about in _ENDS_FLIGHTS
    return (_ENDS_FLIGHTS.index(fact.about) if known else len(_ENDS_FLIGHTS), not fact.is_wrong)


def _led_by(verdict: str, fact: Fact) -> str:
    """Return a verdict with a fact behind its first sentence, and what then has room.

    In its place where it says the same; before it, without its numbers, where both have no room.
    Of what carries the vehicle the first clauses are told where all have none.
    """
    first, *rest = _SENTENCE.split(verdict)
    if fact.is_wrong and fact.about == CARRIES[0]:  # how it was built may well explain it
        first = first.replace(UNEXPLAINED, "")
    clauses = f"{fact.text[:1].upper()}{fact.text[1:]}".split("; ")
    least = 0 if fact.about in CARRIES else len(clauses) - 1
    for count in range(len(clauses), least, -1):
        said = f"{'; '.join(clauses[:count])}."
        again = said.startswith(first.split(" at ")[0].split(" (")[0])
        text = said if again else f"{first} {said}"
        if len(text) > MOST_LETTERS and first.startswith(NOBODY):
            text = f"{said} {NOBODY}."
        if len(text) <= MOST_LETTERS:
            return _filled(text, rest)
    return verdict


def _filled(text: str, rest: Sequence[str]) -> str:
    """Return a text with the sentences that then have room."""
    for sentence in rest:
        # that nobody is accused has room where its numbers have none
        shorter = sentence.split(":")[0] + "." if sentence.startswith(NOBODY) else sentence
        for one in (f"{text} {sentence}", f"{text} {shorter}"):
            if len(one) <= MOST_LETTERS:
                text = one
                break
    return text
