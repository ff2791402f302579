"""Flights for the end-to-end tests: labelled logs, what is said about them, edits of their records.

An edited log is the list of records of a real one with one thing changed; frames are written anew
by pymavlink, so that their checksums are right.
"""

import json
import struct
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.analysis import analyze
from fdi.result import Analysis

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples" / "crash_logs"
SHARED = ROOT.parent / "shared" / "flights"
GROUND = 255  # system number of the ground station in all flights used here

Document = dict[str, Any]
Edit = Callable[[Any], Any]


class Case(NamedTuple):
    """A labelled flight."""

    path: Path
    label: dict[str, Any]

    @property
    def right(self) -> set[str]:
        """Components that are a right answer."""
        return {fault["component"] for fault in self.label["faults"]} | set(self.label["accept"])

    @property
    def onset(self) -> float:
        return min(fault["onset"] for fault in self.label["faults"])


@lru_cache
def labels(folder: Path) -> dict[str, Any]:
    path = folder / "labels.json"
    if not path.is_file():
        return {}
    return json.loads(path.read_text(encoding="utf-8"))["flights"]


def examples() -> list[Any]:
    """Return the labelled flights of the repository, as pytest parameters."""
    return [
        pytest.param(Case(EXAMPLES / n, x), id=Path(n).stem) for n, x in labels(EXAMPLES).items()
    ]


def shared(*names: str) -> list[Any]:
    """Return flights of ``../shared/flights``, as pytest parameters that skip without them."""
    missing = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
    known = labels(SHARED)
    return [
        pytest.param(Case(SHARED / name, known.get(name, {})), id=Path(name).stem, marks=missing)
        for name in names
    ]


@lru_cache
def analysis_of(path: Path, model: str = "auto") -> Analysis:
    return analyze(path, model=model)


@lru_cache
def document_of(path: Path, model: str = "auto") -> Document:
    """Return analysis.json of a flight as it is; callers must not write into it."""
    return analysis_of(path, model).document()


def document_of_bytes(data: bytes, folder: Path, **options: Any) -> Document:
    """Return analysis.json of an edited flight."""
    path = folder / "flight.tlog"
    path.write_bytes(data)
    return analyze(path, **options).document()


class Record(NamedTuple):
    """A record of a tlog: the recorder's stamp, us, and a MAVLink frame."""

    stamp: int
    frame: bytes

    @property
    def system(self) -> int:
        return self.frame[5] if self.frame[0] == 0xFD else self.frame[3]

    @property
    def name(self) -> str:
        number = (
            int.from_bytes(self.frame[7:10], "little") if self.frame[0] == 0xFD else self.frame[5]
        )
        return mav.mavlink_map[number].msgname

    def edited(self, edit: Edit, *, system: int | None = None) -> "Record":
        """Return the record with its message changed in place by ``edit``, its number kept."""
        message = mav.MAVLink(None).decode(bytearray(self.frame))
        edit(message)
        sender = mav.MAVLink(None, system or message.get_srcSystem(), message.get_srcComponent())
        sender.seq = message.get_seq()
        frame = message.pack(sender, force_mavlink1=self.frame[0] == 0xFE)
        return Record(self.stamp, bytes(frame))


@lru_cache
def records(path: Path) -> tuple[Record, ...]:
    """Return the records of an intact tlog."""
    data, at, found = path.read_bytes(), 0, []
    while at < len(data):
        head = data[at + 8 : at + 12]
        size = head[1] + ((25 if head[2] & 1 else 12) if head[0] == 0xFD else 8)
        assert head[0] in (0xFD, 0xFE), f"{path.name} is not intact at byte {at}"
        (stamp,) = struct.unpack_from(">Q", data, at)
        found.append(Record(stamp, data[at + 8 : at + 8 + size]))
        at += 8 + size
    return tuple(found)


def joined(some: Iterable[Record]) -> bytes:
    return b"".join(struct.pack(">Q", record.stamp) + record.frame for record in some)


class Accusation(NamedTuple):
    flight: int
    component: str
    faults: tuple[str, ...]
    kind: str
    inseparable_from: tuple[str, ...]


def accusations(document: Document) -> list[Accusation]:
    """Return what is said about the causes, in order, without when."""
    return [
        Accusation(
            finding["flight"],
            finding["component"],
            tuple(finding["faults"]),
            finding["kind"],
            tuple(finding["inseparable_from"]),
        )
        for finding in document["findings"]
    ]


def accused(document: Document) -> set[str]:
    return components(document["findings"])


def components(items: list[Document]) -> set[str]:
    return {item["component"] for item in items}


def assert_same_answer(
    document: Document, other: Document, *, later: float = 0.0, within: float = 0.05
) -> None:
    """Check that two analyses say the same, the other's times ``later`` by so many seconds."""
    assert accusations(other) == accusations(document)
    for said, again in zip(document["findings"], other["findings"], strict=True):
        for when in ("onset", "alarm", "end"):
            expected, found = said[when], again[when]
            assert (expected is None) == (found is None), when
            if expected is not None and found is not None:
                assert found["log_s"] == pytest.approx(expected["log_s"] + later, abs=within), when
    for part in ("consequences", "ruled_out", "not_testable"):
        assert components(other[part]) == components(document[part]), part
