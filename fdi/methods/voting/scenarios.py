"""Which scenarios say when three autopilots are not enough?

In: how many autopilots. Out: scenarios by name, each with the settings it is run under. Those that
fail are the lowest numbers, whom the voter prefers: the worst case.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from fdi.errors import UsageError
from fdi.methods.voting.settings import Settings
from fdi.methods.voting.simulate import KINDS, Failure, Kind, Outcome, Scenario, simulate

ENOUGH = 0.01
"""So many autopilots are enough where the upper limit of the share of wrong selections is below."""


@dataclass(frozen=True, slots=True)
class Row:
    """One scenario with several numbers of autopilots.

    Attributes
    ----------
    name : str
    outcomes : tuple of Outcome
        By the number of autopilots, ascending.
    """

    name: str
    outcomes: tuple[Outcome, ...]

    @property
    def enough(self) -> int | None:
        """The number from which on all are enough, None where no number is."""
        found = None
        for outcome in reversed(self.outcomes):
            if outcome.wrong.high >= ENOUGH:
                break
            found = outcome.scenario.autopilots
        return found


def first_fail(*kinds: Kind) -> tuple[Failure, ...]:
    """Return failures of the autopilots with the lowest numbers."""
    return tuple(Failure(kind, place + 1) for place, kind in enumerate(kinds))


def parse_failures(texts: Sequence[str]) -> tuple[Failure, ...]:
    """Return failures written ``KIND`` or ``KIND:NUMBER``; without a number, the lowest free one.

    Raises
    ------
    UsageError
        One is not so written.
    """
    stated: list[tuple[Kind, int | None]] = []
    for text in texts:
        name, colon, digits = text.partition(":")
        kind = next((known for known in KINDS if known == name), None)
        if kind is None or (colon and not (digits.isascii() and digits.isdigit())):
            raise UsageError(
                f"{text[:60]!r} is no failure", hint=f"KIND or KIND:NUMBER, of {', '.join(KINDS)}"
            )
        stated.append((kind, int(digits) if colon else None))
    taken = {number for _, number in stated if number is not None}
    free = (number for number in range(1, 2 * len(stated) + 1) if number not in taken)
    made = [Failure(kind, next(free) if number is None else number) for kind, number in stated]
    return tuple(made)


def standard(
    autopilots: int, settings: Settings, lasts: float = 50.0
) -> Mapping[str, tuple[Scenario, Settings]]:
    """Return the scenarios by name, in an order in which they can be read."""
    most = replace(settings, quorum=autopilots // 2 + 1)
    found: dict[str, tuple[Scenario, Settings]] = {}
    for name, kinds, loss, rules in (
        ("nothing fails, 30 % of messages lost", (), 0.3, settings),
        ("1 faulty", ("faulty",), 0.0, settings),
        ("2 faulty", ("faulty", "faulty"), 0.0, settings),
        ("1 mute", ("mute",), 0.0, settings),
        ("1 dead, all votes are awaited", ("dead",), 0.0, settings),
        ("1 dead, a majority is awaited", ("dead",), 0.0, most),
        ("1 faulty, 10 % of messages lost", ("faulty",), 0.1, settings),
        ("1 faulty, 30 % of messages lost", ("faulty",), 0.3, settings),
        ("1 stuck", ("stuck",), 0.0, settings),
        ("2 stuck", ("stuck", "stuck"), 0.0, settings),
        ("1 lying", ("lying",), 0.0, settings),
        ("1 faulty, 1 lying", ("faulty", "lying"), 0.0, settings),
    ):
        if len(kinds) < autopilots:
            failures = first_fail(*kinds)
            found[name] = Scenario(autopilots, failures, loss=loss, lasts=lasts), rules
    jammed = Scenario(autopilots, (Failure("lying", 2),), outside=True, lasts=lasts)
    found["all flags bad from outside, 1 lying"] = jammed, settings
    return found


def run_standard(
    numbers: Sequence[int], settings: Settings, *, lasts: float = 50.0, runs: int, seed: int
) -> tuple[Row, ...]:
    """Return the standard scenarios, each with several numbers of autopilots.

    Raises
    ------
    UsageError
        No number is given.
    """
    return _rows(numbers, lambda n: standard(n, settings, lasts), runs, seed)


def run_one(
    numbers: Sequence[int], scenario: Scenario, settings: Settings, *, runs: int, seed: int
) -> tuple[Row, ...]:
    """Return one scenario with several numbers of autopilots."""
    failures = (
        ", ".join(f"{kind} {number}" for kind, number in scenario.failures) or "nothing fails"
    )
    name = failures + (", all flags bad from outside" if scenario.outside else "")
    name += f", {scenario.loss:.0%} of messages lost".replace("%", " %") if scenario.loss else ""
    return _rows(numbers, lambda n: {name: (replace(scenario, autopilots=n), settings)}, runs, seed)


def _rows(
    numbers: Sequence[int],
    made: Callable[[int], Mapping[str, tuple[Scenario, Settings]]],
    runs: int,
    seed: int,
) -> tuple[Row, ...]:
    if not numbers:
        raise UsageError("no number of autopilots is given", hint="for example 3,5,7")
    found: dict[str, list[Outcome]] = {}
    for number in sorted(set(numbers)):
        for name, (scenario, settings) in made(number).items():
            outcome = simulate(scenario, settings, runs=runs, seed=seed)
            found.setdefault(name, []).append(outcome)
    return tuple(Row(name, tuple(outcomes)) for name, outcomes in found.items())
