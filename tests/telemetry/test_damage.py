"""Damaged logs keep every record that the best reader known keeps, and tell what was lost.

The experiments and what today's readers keep are measured (``experiments.json``). Of a telemetry
log, whose frames have checksums, nothing that was not in the intact file may be delivered.
"""

import importlib.util
import json
import re
from collections import Counter
from functools import lru_cache
from pathlib import Path

import pytest

from fdi.errors import LogError
from fdi.telemetry import read

from .spans import SPANS, spans

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
FOLDER = SHARED / "telemetry"
ODD = SHARED / "flights" / "odd"
BYTES = ("lost_bytes", "truncated", "bad_checksum", "unknown_message")
PLACES = 20  # as many the readers tell one by one


@lru_cache
def table():
    return json.loads((FOLDER / "experiments.json").read_text())


@lru_cache
def damage():
    spec = importlib.util.spec_from_file_location("damage", FOLDER / "damage.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@lru_cache(maxsize=1)
def intact(base):
    """Return an intact file, its records and their kind of file."""
    data = (SHARED / table()["where"][base] / base).read_bytes()
    kind = table()["files"][base]["kind"]
    return data, damage().records(data, kind), kind


def experiments():
    if not FOLDER.is_dir():
        return
    for base, row in table()["files"].items():
        if row["kind"] in SPANS:
            for name in row["experiments"]:
                yield pytest.param(base, name, id=f"{base}-{name}")


@pytest.mark.skipif(not FOLDER.is_dir(), reason="needs the shared folder")
@pytest.mark.parametrize(("base", "name"), list(experiments()))
def test_damaged_log_keeps_what_the_best_reader_keeps_and_tells_the_rest(base, name, tmp_path):
    data, records, kind = intact(base)
    bad, alive = data, [(low, high) for low, high, _ in records]
    if name != "intact":
        bad, alive = damage().EXPERIMENTS[kind][name](data, records)
    found = spans(bad, kind)
    mine, wanted = counted(bad, found, kind), counted(data, alive, kind)
    results = table()["files"][base]["experiments"][name].values()
    best = [row for row in results if isinstance(row, dict) and "kept" in row]
    most = max(row["kept"] for row in best)
    assert (mine & wanted).total() >= most
    if kind == "tlog":
        # the stamp before a frame is not under its checksum
        bodies = Counter(data[low + 8 : high] for low, high, _ in records)
        assert not Counter(bad[low + 8 : high] for low, high in found) - bodies
    else:
        invented = max(row["false"] for row in best if row["kept"] == most)
        assert (mine - wanted).total() <= invented
    assert_lost_bytes_are_told(bad, found, tmp_path)


def counted(data, found, kind):
    """Return the records; of a ULog the experiments count those of data alone."""
    records = (data[low:high] for low, high in found)
    return Counter(record for record in records if kind != "ulg" or record[2:3] == b"D")


def assert_lost_bytes_are_told(bad, found, folder):
    """Check places and sum of what is said to be lost against what no record covers."""
    ends = [0, *(high for _, high in found)]
    starts = [*(low for low, _ in found), len(bad)]
    gaps = [(end, start) for end, start in zip(ends, starts, strict=True) if start > end]
    path = folder / "log"
    path.write_bytes(bad)
    told = [record for record in read(path).quality if record.kind in BYTES]
    texts = [record.text for record in told]
    sizes = [re.search(r"(\d+) bytes (?:in all|at byte)", text) for text in texts]
    assert all(sizes), texts
    assert sum(int(size[1]) for size in sizes) == sum(high - low for low, high in gaps)
    places = {int(place) for text in texts for place in re.findall(r"at byte (\d+)", text)}
    if gaps:
        assert min(places) == gaps[0][0]
        assert gaps[-1][0] <= max(places) < gaps[-1][1]
    if len(gaps) <= PLACES:
        assert {low for low, _ in gaps} <= places


@pytest.mark.skipif(not ODD.is_dir(), reason="needs the shared folder")
@pytest.mark.parametrize(
    ("name", "kind", "lost"),
    [
        ("cut_mid_packet.tlog", "tlog", 3434),
        ("tlog_named_log.log", "tlog", 0),
        ("cut_64k.bin", "dataflash", 24),
        ("robert_lefebvre_octo_PM.log", "dataflash_text", 0),
        ("tradheli_brownout.log", "dataflash_text", 0),
        ("underpowered.log", "dataflash_text", 0),
        ("nan.log", "dataflash_text", 0),
        ("appended_multiple.ulg", "ulog", 0),
        ("not_a_flight.ulg", "ulog", 0),
        ("sitl_2017.ulg", "ulog", 0),
    ],
)
def test_odd_file_is_read_and_its_damage_told(name, kind, lost):
    log = read(ODD / name)
    assert log.format == kind
    told = [record.count for record in log.quality if record.kind in ("lost_bytes", "truncated")]
    assert sum(told) == lost


@pytest.mark.skipif(not ODD.is_dir(), reason="needs the shared folder")
def test_log_of_px4_before_ulog_is_refused_by_name():
    with pytest.raises(LogError, match=r"sdlog2 log \(\.px4log\)"):
        read(ODD / "sdlog2.px4log")
