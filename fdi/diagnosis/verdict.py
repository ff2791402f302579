"""What is the answer, in words that a pilot understands, in at most `MOST_LETTERS` letters?

In: how the flights ended, findings, what the tests did. Out: the verdict, and the outlook that a
glance should tell. A flight that ended badly leads with that, accused or not; then who (with the
place on the airframe), since when (in flight, and on the log's clock), at what height and in which
mode, what is wrong with it, what followed, and how sure that is. What is least needed goes first
where the letters do not suffice. "Stayed within what health explains" is said only where every test
that ran did, and with the moments in which one did not.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.alarms import UNKNOWN
from fdi.diagnosis.claim import When, claim_of
from fdi.diagnosis.ending import BEFORE_S, led_to, went_wrong
from fdi.diagnosis.features import SIMULTANEOUS_S
from fdi.diagnosis.plain import alarm_words, channel_words, telling_clause
from fdi.diagnosis.straying import BRIEF_S, strays, violated_from_start
from fdi.diagnosis.values import (
    MOST_LETTERS,
    Consequence,
    Ending,
    Finding,
    First,
    Outlook,
    Size,
)
from fdi.model.naming import component_words, inside
from fdi.residuals import Bank
from fdi.telemetry import Flight, Signals
from fdi.telemetry.ends import FlightEnd, gravest, is_failsafe
from fdi.units import customary, two_digits

NOBODY: Final = "No component is accused"
UNEXPLAINED: Final = "; no component explains it"
PROPULSION: Final = "propulsion"
"""The group of what keeps the vehicle in the air."""
MOST_FOLLOWERS: Final = 2
LEAST_DEPTH_M: Final = 5.0
"""A height less far below take-off is 0: air pressure drifts by as much in an hour of weather."""
LAST_S: Final = 5.0
"""A height that is older than this is not told as that of the end."""


@dataclass(frozen=True, slots=True)
class Tests:
    """How many tests there are, ran, raised an alarm, left health without one, and for moments.

    Each of the last three counts the tests that none before it does. ``standing``: statements that
    are violated from the beginning of the flight on, and therefore not judged.
    """

    all: int
    ran: int
    raised: int
    strayed: int
    touched: int = 0
    standing: int = 0


def count_tests(alarms: Alarms) -> Tests:
    """Return what the tests did in the air."""
    ran = (alarms.state != UNKNOWN).any(axis=1)
    left = strays(alarms)
    raised, lasted, moments = (m.any(axis=1) for m in (left.raised, left.lasted, left.moments))
    strayed = lasted & ~raised
    touched = moments & ~raised & ~lasted
    n_ran, n_raised, n_strayed, n_touched = (
        int(mask.sum()) for mask in (ran, raised, strayed, touched)
    )
    standing = len(violated_from_start(alarms))
    return Tests(len(ran), n_ran, n_raised, n_strayed, n_touched, standing)


def outlook(
    findings: Sequence[Finding], endings: Sequence[Ending], tests: Tests, alarms: Alarms
) -> Outlook:
    """Return what a glance should tell."""
    doubtful = bool(findings) and claim_of(findings[0]).level == "possible"
    if findings and not doubtful:
        return "accused"
    if any(one.end.is_bad for one in endings):
        return "ended badly"
    if doubtful:
        return "suspected"
    if not tests.ran or stayed_down(alarms):
        return "untested"
    upset = any(one.end.how == "failsafe" for one in endings)
    if tests.raised or tests.strayed or upset:
        return "alarms"
    if any(_is_cut_off(one.end, alarms.residuals.signals) for one in endings):
        return "untested"
    return "healthy" if _propulsion_testable(alarms) else "untested"


def stayed_down(alarms: Alarms) -> bool:
    """Return whether a vehicle that is made to fly, by its model, never did."""
    residuals = alarms.residuals
    return residuals.bank.system.flies and not np.any(residuals.signals.state.airborne)


def _propulsion_testable(alarms: Alarms) -> bool:
    """Return whether every part of the propulsion has a test that ran."""
    bank = alarms.residuals.bank
    system = bank.system
    parts = {name for name, c in system.components.items() if c.group == PROPULSION}
    ran = (alarms.state != UNKNOWN).any(axis=1)
    tested = {
        fault.component
        for column, fault in enumerate(system.faults)
        if (bank.incidence[:, column] & ran).any()
    }
    return bool(parts) and parts <= tested


def verdict(
    findings: Sequence[Finding],
    consequences: Sequence[Consequence],
    endings: Sequence[Ending],
    tests: Tests,
    alarms: Alarms,
) -> str:
    """Return the answer."""
    signals = alarms.residuals.signals
    if not alarms.use.accuse:
        return "This policy gives a fault grid and accuses no component."
    bad = [one for one in endings if one.end.is_bad]
    if findings:
        return _accused(findings, consequences, endings, alarms)
    if bad:
        worst = gravest([one.end for one in bad])
        return _unexplained(next(one for one in bad if one.end is worst))
    if stayed_down(alarms):
        return f"The vehicle is never seen to fly. {_grounded(tests)}"
    failsafe, when = _failsafe(endings, signals)
    unfinished, clock = _unfinished(endings, signals)
    return _fitted([*filter(None, (failsafe, unfinished)), _quiet(tests)], [clock, when])


def _grounded(tests: Tests) -> str:
    """Return what is said where nothing flew: that few tests ran does not clear anybody."""
    if not tests.ran or tests.raised or tests.strayed:
        return _quiet(tests)
    return (
        f"What only a flight shows is not tested: {tests.ran} of {tests.all} tests could run, and "
        "stayed within what health explains."
    )


def _quiet(tests: Tests) -> str:
    """Return what is said where nobody is accused."""
    if not tests.ran and tests.standing:
        of = f"{tests.standing} of {tests.all} tests {'is' if tests.standing == 1 else 'are'}"
        what = "the only test is" if tests.all == 1 else f"none could be judged, and {of}"
        return (
            f"{NOBODY}, and none is cleared: {what} violated from the beginning of the flight on."
        )
    if not tests.ran:
        return "Nothing in this telemetry could be tested."
    if tests.raised:
        return (
            f"{NOBODY}: {tests.raised} of {tests.all} tests raised alarms, but no "
            "component's failure explains them well enough."
        )
    if tests.strayed:
        return (
            f"{NOBODY}: {tests.strayed} of {tests.all} tests left what health "
            "explains, too briefly to accuse anybody."
        )
    if tests.ran == tests.all:
        ran = f"all {tests.all} tests"
    else:
        ran = f"{tests.ran} of {tests.all} tests could run and"
    aside = ""
    if tests.touched:
        of = "one of them" if tests.touched == 1 else f"{tests.touched} tests"
        aside = f", moments of less than {BRIEF_S:g} s in {of} aside"
    return f"{NOBODY}: {ran} stayed within what health explains{aside}."


def _unexplained(ending: Ending) -> str:
    """Return what is said of a flight that ended badly and nobody is accused."""
    moment = went_wrong(ending.end)
    first = next((one for one in ending.first if one.kind in ("alarm", "trigger")), None)
    head = f"{_end_words(ending.end)}{UNEXPLAINED}."
    if first is None:
        return _fitted([head, f"No test left health in the {BEFORE_S:.0f} s before."], [])
    when = f"{max(moment - first.at, 0.0):.1f} s before"
    return _fitted([head, f"First to leave health: {_plain(first)}, {when}."], [])


def _plain(first: First) -> str:
    return first.text.replace("_", " ").rstrip(".")


def _end_words(end: FlightEnd) -> str:
    """Return how a flight ended, as the beginning of a sentence."""
    clock = f"(log {end.at:.1f} s)"
    if end.how == "impact":
        speed, lost = end.how_fast, ""
        if end.lost_control is not None and end.at - end.lost_control >= 0.1:
            lost = f", {end.at - end.lost_control:.1f} s after {end.loss}"
        if not end.is_seen:  # no longer than what it replaces, so that the rest has its place
            return f"Fell{speed} (log {end.at:.1f} s, its end){lost}"
        return f"Hit the ground{speed} {clock}{lost}"
    if end.how == "restarted":
        return f"The autopilot started anew in the air (silent from log {end.at:.1f} s on)"
    if end.lost_control is not None:
        where = " in the air" if end.lost_by == "stop" else ""
        when = f"(log {end.lost_control:.1f} s)"
        left = f"the flight ends {max(end.at - end.lost_control, 0.0):.1f} s later"
        return f"{end.loss[0].upper()}{end.loss[1:]}{where} {when}, and {left}"
    if end.how == "tipped_over":
        return f"Tipped over on the ground {clock}"
    return f"The recording stops in flight {clock}" if end.how == "in_air" else f"Landed {clock}"


def _failsafe(endings: Sequence[Ending], signals: Signals) -> tuple[str, str]:
    """Return the first failsafe of a flight that ended after one, and its time; "" without."""
    for ending in endings:
        if ending.end.how == "failsafe":
            flight = signals.flights[ending.end.flight]
            low, high = flight.airborne
            said = next(e for e in signals.events if is_failsafe(e) and low <= e.t <= high)
            text = re.sub(r"[_<>=]+", " ", said.text)[:60].strip()
            when = f" {_time(said.t)} into the log"
            return f'The autopilot reported "{text}"{when}.', when
    return "", ""


def _unfinished(endings: Sequence[Ending], signals: Signals) -> tuple[str, str]:
    """Return that the recording stops in flight, and when, "" where it does not.

    Whether the recording was cut off or the power was, nothing in the log tells.
    """
    if not endings or not _is_cut_off(endings[-1].end, signals):
        return "", ""
    end = endings[-1].end
    height, clock = "", f" (log {end.at:.1f} s)"
    if signals.height is not None:
        known = signals.height[(signals.t > end.at - LAST_S) & (signals.t <= end.at)]
        known = known[np.isfinite(known)]
        height = f" at {known[-1] + 0.0:.0f} m" if len(known) else ""
    return f"The recording stops in flight{height}{clock}.", clock


def _is_cut_off(end: FlightEnd, signals: Signals) -> bool:
    """Return whether a flight is not seen to end: the log does so before."""
    return end.how in ("in_air", "failsafe") and signals.flights[end.flight].landing is None


def _accused(
    findings: Sequence[Finding],
    consequences: Sequence[Consequence],
    endings: Sequence[Ending],
    alarms: Alarms,
) -> str:
    """Return whom the findings name, as surely as they do, and what is told of the first."""
    first = findings[0]
    components = alarms.residuals.bank.system.components
    signals = alarms.residuals.signals
    bad = gravest([one.end for one in endings])
    claim = claim_of(first)
    is_gap = all(components[name].records for name in claim.names)
    explains = bad is not None and not is_gap and led_to(bad, first.flight, first.end)
    of_vehicle = [first, *(f for f in findings[1:] if not components[f.component].records)]
    order = "gap" if is_gap else _order(of_vehicle, signals, bad if explains else None)
    when, height, mode = _moment(first, signals)
    if order in ("take-off", "ground"):
        when = f" (log {first.onset:z.1f} s)"
        height, mode = (height, mode) if order == "take-off" else ("", "")
    else:
        when = f", {when}"
    said = claim.subject(components)
    if bad is not None and not explains:
        said = f"{'Before' if first.onset <= bad.at else 'After'} that, {inside(said)}"
    core = f"{said} {claim.verb(order)} ({claim.odds(components)}){when}"
    what = f": {_what(first, alarms)}" if len(claim.names) == 1 else _seen(first, alarms)
    followers = _followers(first, consequences, findings, alarms)
    tail = f"Then: {', '.join(followers)}." if followers else ""
    head = []
    if bad is not None:
        head = [_end_words(bad) + ("." if explains else f"{UNEXPLAINED}.")]
    # in the order in which they are given up
    return _fitted([*head, f"{core}{height}{mode}{what}."], [tail, height, mode, what], tail)


def _order(findings: Sequence[Finding], signals: Signals, bad: FlightEnd | None) -> When:
    """Return where the first finding stands in time.

    Parameters
    ----------
    findings : sequence of Finding
    signals : Signals
    bad : FlightEnd or None
        How the flight ended, where that was badly and the first finding still stood then.
    """
    first = findings[0]
    # what shows after control was lost may still be the cause, but it was not seen to be first
    if bad is not None and bad.lost_control is not None:
        # a spin is what a fault of the propulsion shows itself, and at once
        late = SIMULTANEOUS_S if bad.lost_by == "spin" else 0.0
        if first.onset > bad.lost_control + late:
            return "after"
    if any(one.onset < first.onset for one in findings if one.flight == first.flight):
        return "later"
    flight = signals.flights[first.flight] if first.flight < len(signals.flights) else None
    if flight is not None and flight.flew:
        after = first.onset - flight.airborne[0]
        if after < SIMULTANEOUS_S:
            return "ground" if after < -SIMULTANEOUS_S else "take-off"
    return "first"


def _seen(first: Finding, alarms: Alarms) -> str:
    """Return what the test showed that speaks for several alike."""
    bank = alarms.residuals.bank
    by_id = {generator.id: generator for generator in bank.generators}
    telling = by_id.get(first.evidence.telling)
    if telling is None:
        return ""
    return f": {inside(alarm_words(first.component, telling, bank.system))}"


def _moment(finding: Finding, signals: Signals) -> tuple[str, str, str]:
    """Return when a finding began, at what height and in which mode, in words."""
    t = finding.onset
    when = f"{_time(t)} into the log"
    flights = signals.flights
    flight: Flight | None = flights[finding.flight] if finding.flight < len(flights) else None
    on_ground = flight is not None and not flight.flew  # a rover, or a vehicle that was only armed
    if flight is not None and flight.flew:
        start = flight.start if flight.takeoff is None else flight.takeoff
        which = f" {finding.flight + 1}" if len(flights) > 1 else ""
        if t >= start:
            least = "at least " if flight.takeoff is None else ""  # the log begins in the air
            when = f"{least}{_time(t - start)} into flight{which} (log {t:.1f} s)"
    place = int(np.clip(np.searchsorted(signals.t, t), 0, max(len(signals.t) - 1, 0)))
    height = mode = ""
    if not on_ground and signals.height is not None and np.isfinite(signals.height[place]):
        height = _height(float(signals.height[place]))
    name = str(signals.state.mode[place]) if len(signals.t) else ""
    if name:
        mode = f" in {re.sub(r'[_<>=]+', ' ', name)[:20]}"
    return when, height, mode


def _height(metres: float) -> str:
    """Return a height above take-off; one below it is told as what it is, a reading.

    Examples
    --------
    >>> _height(21.4), _height(-0.3), _height(-60.0)
    (', at 21 m', ', at 0 m', ', by its own reading 60 m below take-off')
    """
    rounded = round(metres)
    if rounded >= 0:
        return f", at {rounded} m"
    if metres > -LEAST_DEPTH_M:
        return ", at 0 m"
    return f", by its own reading {-rounded} m below take-off"


def _what(finding: Finding, alarms: Alarms) -> str:
    """Return what is wrong, in the words of the model, with the size where it is known."""
    bank = alarms.residuals.bank
    names = (finding.evidence.telling, *finding.evidence.residuals)
    clause = telling_clause(finding.component, names, bank)
    if finding.size is None:
        return clause
    words = _quantity(finding.size, bank)
    what = f"{words} " if words and words not in clause else ""
    return f"{clause} ({what}{_amount(finding.size)})"


def _quantity(size: Size, bank: Bank) -> str:
    """Return in words what a size is one of, "" where it is told by what it moves in a residual."""
    if size.shown is not None and (size.unit, size.shown_unit) != ("rad", "m"):
        return ""
    measured = (e.measurement for e in bank.system.equations)
    own = next((m for m in measured if m and str(m.channel) == size.channels[0]), None)
    return "" if own is None else inside(channel_words(own, bank.system.variables))


def _amount(size: Size) -> str:
    """Return a size in short: ``about 11 m off``."""
    value, unit = size.value, size.unit
    if size.shown is not None and size.shown_unit:
        value, unit = size.shown, size.shown_unit
    label, scale, _ = customary(unit)
    label = "" if label == "1" else f" {label}"
    rate = " a second" if size.shape == "drift" else ""
    return f"about {two_digits(abs(value) * scale)}{label}{rate} off"


def _followers(
    first: Finding, consequences: Sequence[Consequence], findings: Sequence[Finding], alarms: Alarms
) -> list[str]:
    """Return what followed, in the order of time, by name."""
    components = alarms.residuals.bank.system.components
    after = [(c.onset, c.component) for c in consequences if c.because_of == first.rank]
    after += [(f.onset, f.component) for f in findings[1:] if f.onset >= first.onset]
    names = dict.fromkeys(name for _, name in sorted(after) if name != first.component)
    return [inside(component_words(name, components)) for name in list(names)[:MOST_FOLLOWERS]]


def _fitted(sentences: Sequence[str], optional: Sequence[str], last: str = "") -> str:
    """Return sentences in `MOST_LETTERS` letters, giving up optional parts in their order.

    Parameters
    ----------
    sentences : sequence of str
    optional : sequence of str
        Parts of the sentences, or ``last``.
    last : str
        A sentence that stands behind them.
    """
    text = " ".join(filter(None, (*sentences, last)))
    for part in filter(None, optional):
        if len(text) <= MOST_LETTERS:
            break
        text = " ".join(text.replace(part, "", 1).split())
    if len(text) <= MOST_LETTERS:
        return text
    return text[: MOST_LETTERS - 4].rsplit(" ", 1)[0] + " ..."


def _time(seconds: float) -> str:
    """Return a length of time, in minutes above one."""
    tenths = round(abs(seconds) * 10)
    if tenths < 600:
        return f"{tenths / 10:.1f} s"
    whole = round(abs(seconds))
    return f"{whole // 60} min {whole % 60} s"
