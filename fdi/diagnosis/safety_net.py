"""What would not have helped, had something failed: the failsafes and checks that are off.

In: a log and the rules in ``advice/safety_net.yaml``. Out: a `Gap` for each that applies, mistakes
first. They are settings, and no failures: nothing of it says that anything went wrong.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from fdi.diagnosis.advice_book import Rule, load_book
from fdi.diagnosis.stood_out import Fact
from fdi.methods.setup.compass import COMPASSES, all_readings, use_parameter
from fdi.shown import Shown
from fdi.telemetry import Log
from fdi.telemetry.log import recorder_of
from fdi.telemetry.motors import ROTORS

Word = Literal["mistake", "risk", "note"]
WORDS: Final[tuple[Word, ...]] = ("mistake", "risk", "note")
_VERSION: Final = re.compile(r"V?(\d+)\.(\d+)")
_PROGRAMS: Final = {"Copter": "copter", "Plane": "plane", "Rover": "rover", "Sub": "sub"}
_KINDS: Final = {"vtol": "plane", "boat": "rover", "helicopter": "copter"}
_OUTPUT: Final = re.compile(r"SERVO(\d{1,2})_FUNCTION")
_MOTORS: Final = {33 + i: 1 + i for i in range(8)} | {82 + i: 9 + i for i in range(4)}
"""ArduPilot's functions of motors 1 to 12 (SRV_Channel.h)."""
_FRAMES: Final = {1: range(1, 5), 2: range(1, 7), 3: range(1, 9), 4: range(1, 9), 5: range(1, 7)}
"""Motors of ArduPilot's ``FRAME_CLASS``: quad, hexa, octa, octa quad, Y6."""
_LEAST: Final = 8
"""Outputs of the smallest boards."""
_NOTCH: Final = re.compile(r"INS_(?:HNTCH|HNTC2)_MODE")
_BY_ESC: Final = 3.0


@dataclass(frozen=True, slots=True)
class Gap(Shown):
    """One thing that would not have helped.

    Attributes
    ----------
    word : str
        ``mistake``, ``risk`` or ``note``.
    parameter : str
    value : float
        As the log has it first.
    means : str
        A clause.
    source, address : str
        The page that says so.
    """

    word: Word
    parameter: str
    value: float
    means: str
    source: str
    address: str

    def words(self) -> str:
        """Return it as a person reads it."""
        return f"{self.parameter} is {self.value:.6g}: {self.means}"


def safety_net(log: Log) -> tuple[Gap, ...]:
    """Return what would not have helped, the gravest first; nothing without parameters."""
    book = load_book()
    values = log.parameters
    found = [
        Gap(rule.word, name, values[name], rule.means, *_page(rule.source))
        for rule in book.net.values()
        if (name := _named(rule, values)) and _applies(rule, name, log)
    ]
    found += [*_outputs(log), *_silent_compasses(log), *_notches(log)]
    return tuple(sorted(found, key=lambda gap: WORDS.index(gap.word)))


def mistakes(log: Log) -> tuple[Fact, ...]:
    """Return what of it is hardly meant, as facts of a flight; no failures, so nothing is wrong."""
    return tuple(
        Fact("safety net", gap.words()) for gap in safety_net(log) if gap.word == "mistake"
    )


def _page(source: str) -> tuple[str, str]:
    page = load_book().sources[source]
    return page.title, page.address


def _named(rule: Rule, values: Mapping[str, float]) -> str:
    """Return the name under which a vehicle has a parameter, "" where it has none."""
    return next((name for name in rule.parameter.split("|") if name in values), "")


def _applies(rule: Rule, name: str, log: Log) -> bool:
    values = log.parameters
    value = values[name]
    if rule.on != log.autopilot or (rule.vehicles and _kind(log) not in rule.vehicles):
        return False
    if not _is_of_version(rule, log.firmware):
        return False
    if any(values.get(other) not in told for other, told in rule.while_.items()):
        return False
    if any(values.get(other) in told for other, told in rule.unless.items()):
        return False
    if rule.bits:
        return value > 0 and any(int(value) >> bit & 1 for bit in rule.bits)
    if rule.lacks_bit is not None:
        return not int(value) >> rule.lacks_bit & 1
    return value not in rule.lacks if rule.lacks else value in rule.is_


def _kind(log: Log) -> str:
    """Return by which of ArduPilot's programs a vehicle is run: copter, plane, rover, sub.

    By its greeting, or else by the vehicle.
    """
    for name, kind in _PROGRAMS.items():
        if name in (log.firmware or ""):
            return kind
    return "copter" if log.vehicle in ROTORS else _KINDS.get(log.vehicle, log.vehicle)


def _is_of_version(rule: Rule, firmware: str | None) -> bool:
    """Return whether a rule holds for a firmware; one of some versions not for an unknown one."""
    if not rule.since and not rule.before:
        return True
    found = _VERSION.search(firmware or "")
    if found is None:
        return False
    own = int(found[1]), int(found[2])
    return (not rule.since or own >= _version(rule.since)) and (
        not rule.before or own < _version(rule.before)
    )


def _version(text: str) -> tuple[int, int]:
    major, minor = text.split(".")
    return int(major), int(minor)


def _outputs(log: Log) -> Iterator[Gap]:
    """Yield the outputs that have another one's motor, and motors of the frame without any."""
    if log.autopilot != "ardupilot":
        return
    outputs: dict[int, list[str]] = defaultdict(list)
    for name, value in log.parameters.items():
        if _OUTPUT.fullmatch(name) and value in _MOTORS:
            outputs[_MOTORS[int(value)]].append(name)
    for names in outputs.values():
        names.sort(key=len)  # parameters come by name, SERVO10 before SERVO9
    for motor, names in sorted(outputs.items()):
        for name in names[1:]:
            means = f"a second output of motor {motor}, as {names[0]} is; rarely meant so"
            yield Gap("mistake", name, log.parameters[name], means, *_page("ap_outputs"))
    if _kind(log) != "copter":  # other programs have frames of their own
        return
    frame = log.parameters.get("FRAME_CLASS", 0.0)
    lacking = [motor for motor in _FRAMES.get(int(frame), ()) if motor not in outputs]
    if outputs and lacking and _has_all_outputs(log.parameters):
        named = " and ".join(f"motor {motor}" for motor in lacking)
        means = f"{named} of this frame {'has' if len(lacking) == 1 else 'have'} no output"
        yield Gap("mistake", "FRAME_CLASS", frame, means, *_page("ap_motors"))


def _has_all_outputs(values: Mapping[str, float]) -> bool:
    """Return whether the log tells what each output does: a link may lose a parameter."""
    numbers = {int(found[1]) for name in values if (found := _OUTPUT.fullmatch(name))}
    return len(numbers) >= _LEAST and numbers == set(range(1, len(numbers) + 1))


def _silent_compasses(log: Log) -> Iterator[Gap]:
    """Yield the compasses that are in use and there, and say nothing while others do."""
    if recorder_of(log.format) != "dataflash":  # a telemetry link leaves out what is there
        return
    speak = all_readings(log)
    for number in range(1, len(COMPASSES) + 1):
        name = use_parameter(number)
        device = log.parameters.get(f"COMPASS_PRIO{number}_ID", 0.0)
        if speak and number not in speak and device and log.parameters.get(name) == 1.0:
            means = f"compass {number} is in use, and says nothing here, or always the same"
            yield Gap("risk", name, 1.0, means, *_page("ap_compass"))


def _notches(log: Log) -> Iterator[Gap]:
    """Yield the filters that follow motors whose speed nothing tells."""
    tells = any(
        key.startswith(("ESC_TELEMETRY", "ROTOR_", "ESC[")) or key == "ESC" for key in log.messages
    )
    if recorder_of(log.format) != "dataflash" or tells:  # a telemetry link leaves out what is there
        return
    for name, value in log.parameters.items():
        is_on = log.parameters.get(name.replace("_MODE", "_ENABLE")) == 1.0
        if _NOTCH.fullmatch(name) and value == _BY_ESC and is_on:
            means = "the filter follows the motors' speeds, and no controller tells them"
            yield Gap("risk", name, value, means, *_page("ap_notch"))
