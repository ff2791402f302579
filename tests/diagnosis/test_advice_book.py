"""The book of advice holds what the shipped models, checks and endings can name."""

import json
import re
from pathlib import Path
from typing import get_args

import pytest

from fdi import store
from fdi.diagnosis.advice_book import FOLDER, OTHER, fits, load_book, read_book
from fdi.diagnosis.values import FindingKind
from fdi.errors import EntryError
from fdi.methods.setup import checks
from fdi.model import load_airframe
from fdi.model.choose import shipped_models
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.ends import How

BOOK = load_book()
AUTOPILOTS = ("ardupilot", "px4", "other")
MODELS = [load_airframe(model) for model in shipped_models()]
COMPONENTS = {name: one for model in MODELS for name, one in model.components.items()}
PARTS = sorted(COMPONENTS)
CHECKS = (
    "motors",
    "ailerons",
    "elevator",
    "rudder",
    "accelerometer 2",
    "weight on accelerometer 1",
    "gyroscopes",
    "gyroscopes at rest",
    "compass 1",
    "heading",
    "declination",
    "field at compass 2",
    "readings of compass 2",
    "agreement of compass 2",
    "offsets of compass 3",
    "interference at compass 2",
    "vibration",
    "oscillation",
    "thrust to weight",
    "motor limits",
    "battery",
)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("component", PARTS)
def test_every_part_of_a_shipped_model_has_its_own_advice(component: str, autopilot: str) -> None:
    """What to inspect, how to tell, and what to record, on any autopilot."""
    part = BOOK.part(component, COMPONENTS)
    assert part is not BOOK.groups[OTHER]
    assert part is not BOOK.group_of(component, COMPONENTS)
    needed = (part.tell, part.check) if autopilot == "other" else (part.tell, part.check, part.next)
    for entries in needed:
        assert [one for one in entries if one.on in ("", autopilot)]


@pytest.mark.parametrize("kind", list(get_args(FindingKind)))
def test_a_sensor_has_advice_for_the_way_in_which_it_failed(kind: str) -> None:
    """Limits and what is not known say nothing of how; every other kind does."""
    assert (kind in BOOK.groups["sensor"].kinds) == (kind not in ("limit", "unknown"))


def test_kinds_are_those_of_findings() -> None:
    named = {kind for part in (*BOOK.parts.values(), *BOOK.groups.values()) for kind in part.kinds}
    assert named <= set(get_args(FindingKind))


def test_every_pattern_of_a_statement_is_that_of_a_shipped_model() -> None:
    """A renamed statement does not lose its advice in silence; one of the whole has no part."""
    names = {
        (re.sub(r"_[0-9]+$", "", equation.component or ""), equation.name)
        for model in MODELS
        for equation in model.equations
    }
    wanted: dict[str, set[str]] = {}
    for component, part in BOOK.parts.items():
        for pattern in (one for key in part.tests for one in key.split("|")):
            wanted.setdefault(pattern, set()).add(component)
    for pattern, components in wanted.items():
        assert any(fits(pattern, name) for own, name in names if own in (*components, "")), pattern


@pytest.mark.parametrize("end", [*get_args(How), "sound", "stopped", "none"])
def test_every_end_of_a_flight_has_advice(end: str) -> None:
    assert BOOK.ends[end].check


def test_checks_are_named_as_the_program_names_them() -> None:
    """The names stand in the source of the checks, so that a new one is missed here."""
    source = "".join(path.read_text("utf-8") for path in Path(checks.__file__).parent.glob("*.py"))
    stems = {re.sub(r" [0-9]$", "", name) for name in CHECKS}
    assert all(stem in source for stem in stems)
    assert stems == set(BOOK.checks) - {OTHER}


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_every_check_has_advice_where_it_is_wrong_or_undecided(name: str, autopilot: str) -> None:
    found = BOOK.checked(name)
    assert found is not BOOK.checks[OTHER]
    assert [one for one in found.wrong if one.on in ("", autopilot)]
    assert [one for one in found.undecided if one.on in ("", autopilot)]


def test_every_entry_has_a_page_that_anybody_can_read() -> None:
    pages = {"https://ardupilot.org/", "https://docs.px4.io/main/en/", "docs/"}
    for entry in BOOK.entries():
        source = BOOK.sources[entry.source]
        assert source.title
        assert any(source.address.startswith(page) for page in pages)


def test_no_source_is_without_an_entry() -> None:
    used = {entry.source for entry in BOOK.entries()} | {"fdi_verdict", "ap_notch", "ap_outputs"}
    used |= {rule.source for rule in BOOK.net.values()}
    assert set(BOOK.sources) == used


def test_entries_are_short_and_end_without_a_full_stop() -> None:
    for entry in BOOK.entries():
        assert not entry.do.endswith(".")
        assert not entry.why.endswith((".", "?"))
        assert len(entry.do) <= 170
        assert len(entry.why) <= 170


def test_bits_of_the_log_are_those_of_the_table() -> None:
    bits = data_table("logging")["bits"]
    wanted = {one.parameter.bit_of for one in BOOK.entries() if one.parameter} - {""}
    assert wanted
    assert all(any(record in known for known in bits.values()) for record in wanted)


def test_an_entry_without_a_known_source_is_refused(tmp_path: Path) -> None:
    place = tmp_path / "book.yaml"
    lines = ["logs:", "  tlog:", "    - {do: Look, why: It shows, source: nobody}"]
    place.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(EntryError, match="nobody"):
        read_book([place])


def test_the_book_in_the_cache_is_that_of_the_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path))
    read = read_book(sorted(FOLDER.glob("*.yaml")))
    load_book.cache_clear()
    assert load_book() == read
    load_book.cache_clear()
    assert load_book() == read
    assert len(list(tmp_path.glob("advice-*.json"))) == 1


def test_a_foreign_book_in_the_cache_is_read_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(store, "fetch", lambda kind, key: json.loads("[{}, {}, {}, {}, {}, {}]"))
    load_book.cache_clear()
    assert load_book() == BOOK
    load_book.cache_clear()
