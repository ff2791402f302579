"""What should be done about a finding, an ending, a check of the set-up, a part that no test saw?

In: what is said of a flight, and its log. Out: `Advice`, in the order in which to follow it: what
to inspect now and how to tell, then what to record next time; with the value of a parameter, as it
is and as it should be. What may be advised stands in the book (``advice_book.py``).

Advice is never surer than what it follows from: below `SURE`, and where several parts explain the
alarms alike, it begins with how to find out which it is, before anything is replaced.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Final

from fdi.diagnosis.advice_book import Entry, Wish, fits, load_book
from fdi.diagnosis.plain import the_part
from fdi.diagnosis.recording_end import begins_anew
from fdi.diagnosis.values import Advice, Diagnosis, Ending, Finding, NotTestable, When
from fdi.methods.setup import Check, Setting
from fdi.model.hints import log_bit
from fdi.model.parts import Component
from fdi.model.system import System
from fdi.residuals import Bank
from fdi.telemetry import Log
from fdi.units import hundredths

SURE: Final = 0.9
"""From here on the verdict says "failed first" without a doubt."""
EVEN: Final = 0.5
_UNKNOWN: Final = "none"
_VERDICT: Final = "fdi_verdict"

Components = Mapping[str, Component]


def advised(diagnosis: Diagnosis, log: Log, bank: Bank) -> Diagnosis:
    """Return a diagnosis of which every finding, ending and untested part brings advice."""
    components = bank.system.components
    sound = diagnosis.outlook == "healthy"
    return replace(
        diagnosis,
        findings=tuple(
            replace(one, advice=about_finding(one, log, bank)) for one in diagnosis.findings
        ),
        endings=tuple(
            # what drives or swims is not asked what kept it on the ground
            replace(one, advice=about_ending(one, sound, log))
            if bank.system.flies or one.end.how != "on_ground"
            else one
            for one in diagnosis.endings
        ),
        not_testable=tuple(
            replace(one, advice=about_untested(one, log, components))
            for one in diagnosis.not_testable
        ),
    )


def about_finding(finding: Finding, log: Log, bank: Bank) -> tuple[Advice, ...]:
    """Return what to do about an accused component.

    Parameters
    ----------
    finding : Finding
    log : Log
        Tells autopilot and parameters.
    bank : Bank
        Tells what the tests of the finding state.
    """
    book, components = load_book(), bank.system.components
    part, group = book.part(finding.component, components), None
    if part is not book.group_of(finding.component, components):
        group = book.group_of(finding.component, components)
    words = the_part(finding.component, components)
    suspects = (finding.component, *finding.inseparable_from)
    tell = [
        one
        for name in suspects
        for one in _told(book.part(name, components).tell, the_part(name, components), log)
    ]
    names = _statements(finding, bank)
    by_test = [
        entry
        for name in names
        for pattern, entries in part.tests.items()
        if fits(pattern, name)
        for entry in entries
    ]
    by_kind = part.kinds.get(finding.kind) or (group.kinds.get(finding.kind, ()) if group else ())
    own = _told((*by_test, *by_kind, *part.check), words, log)
    # One that is told by what it does is inspected first; one of several is told apart first.
    doubted = len(suspects) > 1 or finding.confidence < SURE
    now = (*_caution(finding, components), *tell, *own) if doubted else (*own, *tell)
    return _once((*now, *_told(part.next, words, log, "next flight")))


def about_ending(ending: Ending, is_sound: bool, log: Log) -> tuple[Advice, ...]:
    """Return what to do after a flight by how it ended; ``is_sound``: every glance was good."""
    book, end = load_book(), ending.end
    found = [book.ends["stopped"]] if end.lost_by == "stop" else []
    if ending.end.flight == 0 and begins_anew(log) is not None:
        found.append(book.ends["restarted"])
    if (end.lost_by, end.how) != ("stop", "control_lost"):  # nothing broke that was told to stop
        found.append(book.ends["sound" if end.how == "landed" and is_sound else end.how])
    now = [one for part in found for one in _told(part.check, "", log)]
    if not is_sound:
        now += _told(book.logs.get(log.format, ()), "", log)
    later = [one for part in found for one in _told(part.next, "", log, "next flight")]
    return _once((*now, *later))


def about_no_flight(log: Log, system: System) -> tuple[Advice, ...]:
    """Return what to do with a log that holds no flight, of a vehicle that is made for one."""
    return () if not system.flies else tuple(_told(load_book().ends[_UNKNOWN].check, "", log))


def about_untested(one: NotTestable, log: Log, components: Components) -> tuple[Advice, ...]:
    """Return what to record so that a part can be tested, and how to try it on the ground."""
    book, words = load_book(), the_part(one.component, components)
    part = book.part(one.component, components)
    hint: list[Advice] = []
    if one.wanted:
        source = book.sources["px_logging" if log.autopilot == "px4" else "ap_download"]
        hint = [
            Advice(
                f"Record {one.wanted}",
                f"Then tests of {words} can run",
                None,
                source.title,
                source.address,
                "next flight",
            )
        ]
    tell = _told(part.tell, words, log)
    return _once((*tell, *hint, *_told(part.next, words, log, "next flight")))


def about_check(check: Check, log: Log) -> tuple[Advice, ...]:
    """Return what to do about a check of the set-up; nothing where it is in order."""
    book = load_book()
    of_it = book.checked(check.name)
    if check.verdict == "in order":
        return ()
    if check.verdict == "not known":
        return tuple(_told(of_it.undecided, check.name, log))
    told = _told(of_it.wrong, check.name, log)
    known = {one.name for one in check.settings}
    told = [one for one in told if one.parameter is None or one.parameter.name not in known]
    source = book.sources[of_it.wrong[0].source]
    settings = [
        Advice(
            f"Look whether the vehicle confirms it, then set {setting_words(one)}",
            one.why,
            one,
            source.title,
            source.address,
        )
        for one in check.settings
    ]
    return _once((*settings, *told))


def setting_words(one: Setting) -> str:
    """Return a parameter with its value as it is and as it should be.

    Examples
    --------
    >>> setting_words(Setting("COMPASS_ORIENT", 0.0, 8.0))
    'COMPASS_ORIENT from 0 to 8'
    >>> setting_words(Setting("SDLOG_PROFILE", None, 64.0)), setting_words(Setting("FRAME", 1.0))
    ('SDLOG_PROFILE to 64', 'FRAME, now 1')
    """
    now = "" if one.now is None else f"{one.now:.9g}"
    if one.suggested is None:
        return f"{one.name}, now {now}" if now else one.name
    return f"{one.name}{f' from {now}' if now else ''} to {one.suggested:.9g}"


def _caution(finding: Finding, components: Components) -> Iterator[Advice]:
    """Yield what keeps a reader from replacing a part that is only suspected."""
    sure, source = hundredths(finding.confidence), load_book().sources[_VERDICT]
    if finding.inseparable_from:
        names = (the_part(one, components) for one in finding.inseparable_from)
        do = (
            f"Before you replace anything, tell {the_part(finding.component, components)} from "
            f"{' and '.join(names)}"
        )
        why = "Each explains the alarms as well; the next steps, one for each, tell them apart"
    else:
        nobody = 1.0 - finding.confidence - sum(share for _, share in finding.rivals)
        others = [(the_part(name, components), share) for name, share in finding.rivals]
        name, share = max([*others, ("no part at all", nobody)], key=lambda one: one[1])
        do = f"Before you replace anything, make sure: this accusation is {sure} % sure"
        if finding.confidence < EVEN:
            do = f"Replace nothing on this alone: it is only {sure} % sure"
        why = f"The next explanation is {name}, {hundredths(max(share, 0.0))} %"
    yield Advice(do, why, None, source.title, source.address)


def _statements(finding: Finding, bank: Bank) -> list[str]:
    """Return the names of the statements of a component in the tests of its finding."""
    by_id = {generator.id: generator for generator in bank.generators}
    equations = bank.system.equations
    tests = dict.fromkeys((finding.evidence.telling, *finding.evidence.residuals))
    found = [
        equations[i].name
        for name in tests
        if name in by_id
        for i in by_id[name].equations
        if equations[i].component == finding.component
    ]
    return list(dict.fromkeys(found))


def _told(entries: Iterable[Entry], words: str, log: Log, when: When = "now") -> list[Advice]:
    """Return entries as advice about a log, without those that it follows already."""
    book, found = load_book(), []
    for entry in entries:
        if entry.on and entry.on != log.autopilot:
            continue
        if entry.parameter is not None and _lacks(entry.parameter, log):
            continue
        parameter = None if entry.parameter is None else _setting(entry.parameter, log)
        if parameter is not None and _is_so(parameter, entry.parameter):
            continue
        source = book.sources[entry.source]
        do, why = (text.replace("{part}", words) for text in (entry.do, entry.why))
        found.append(Advice(do, why, parameter, source.title, source.address, when))
    return found


def _is_so(setting: Setting, wish: Wish | None) -> bool:
    """Return whether a parameter is as it should be, or does as well."""
    enough = () if wish is None else wish.enough
    return setting.now == setting.suggested is not None or setting.now in enough


def _lacks(wish: Wish, log: Log) -> bool:
    """Return whether this firmware has no such parameter: its group is in the log, it is not."""
    group = f"{wish.name.partition('_')[0]}_"
    known = log.parameters
    if wish.name in known or wish.older in known:
        return False
    return any(name.startswith(group) for name in known)


def _setting(wish: Wish, log: Log) -> Setting | None:
    """Return a parameter as it is and should be; None for a bit that is not known."""
    name = wish.older if wish.older in log.parameters else wish.name
    now = log.parameters.get(name)
    bit = log_bit(wish.bit_of, log) if wish.bit_of else wish.bit
    if bit is not None:  # a mask that nobody knows cannot be added to
        return None if now is None else Setting(name, now, float(int(now) | 1 << bit))
    return None if wish.bit_of else Setting(name, now, wish.suggested)


def _once(advice: Iterable[Advice]) -> tuple[Advice, ...]:
    """Return advice without what was said before."""
    return tuple({one.do: one for one in reversed(tuple(advice))}.values())[::-1]
