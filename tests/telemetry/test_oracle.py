"""Values and completeness against pymavlink, and the damage experiments."""

import importlib.util
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.telemetry import read
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.mavlink_frames import find_frames

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
SAMPLES = SHARED / "telemetry" / "samples"
pytestmark = pytest.mark.skipif(not SAMPLES.is_dir(), reason="needs the shared folder")

FLIGHTS = (
    "telemetry/samples/copter_sitl_v2.tlog",
    "telemetry/samples/mixed_v1_v2_head.tlog",
    "flights/alfa/no_failure_4.tlog",
    "flights/healthy/copter_2013.tlog",
    "flights/sitl/copter/c88_telemetry_gap_12s.tlog",
)
BASES = {
    "copter_sitl_v2.tlog": SAMPLES,
    "mixed_v1_v2_head.tlog": SAMPLES,
    "mission_1hz.tlog": SHARED / "flights" / "healthy",
    "no_failure.tlog": SHARED / "flights" / "alfa",
}


def frames_of(path: Path):
    data = np.frombuffer(path.read_bytes(), np.uint8)
    return find_frames(data, frame_checks())


def spans(frames) -> list[tuple[int, int]]:
    """Return start and end of every record."""
    tail = np.where(frames.version == 2, 20, 16) + frames.length
    signed = (frames.version == 2) & (frames.data[frames.start + 10] & 1 == 1)
    end = frames.start + tail + 13 * signed
    return list(zip(frames.start.tolist(), end.tolist(), strict=True))


def same(ours, theirs) -> bool:
    if isinstance(theirs, str):
        return ours == theirs
    return ours == theirs or (ours != ours and theirs != theirs)


@pytest.mark.parametrize("name", FLIGHTS)
def test_every_field_of_every_message_equals_pymavlink(name):
    """Frame by frame, since pymavlink's own file reader loses frames where versions are mixed."""
    log, frames = read(SHARED / name), frames_of(SHARED / name)
    data = frames.data.tobytes()
    chosen = next(s for s in log.sources if s.chosen)
    decoder = mav.MAVLink(None)
    rows: Counter[str] = Counter()
    compared = 0
    columns: dict[str, dict] = {}
    for i, (start, end) in enumerate(spans(frames)):
        if (frames.system[i], frames.component[i]) != (chosen.system, chosen.component):
            continue
        message = decoder.decode(bytearray(data[start + 8 : end]))
        instance = getattr(message, message._instance_field or "", 0)
        key = message.get_type()
        if isinstance(instance, int) and instance:
            key += f"[{instance}]"
        if key not in columns:
            ours = log[key]
            columns[key] = {field: ours.raw(field).tolist() for field in ours.fields}
        row = rows[key]
        rows[key] += 1
        for field in message.get_fieldnames():
            value = getattr(message, field)
            if isinstance(value, (list, tuple)):
                for k, entry in enumerate(value):
                    assert same(columns[key][f"{field}[{k}]"][row], entry), (key, field, k)
            else:
                assert same(columns[key][field][row], value), (key, field, value)
            compared += 1
    assert compared > 5000
    assert all(log[key].stamp.size == count for key, count in rows.items())


@pytest.mark.parametrize("name", FLIGHTS)
def test_no_frame_of_pymavlink_is_missing(name):
    """pymavlink may give fewer (documented losses in mixed files), never one that we lack."""
    from pymavlink import mavutil

    ours = Counter(
        (int(s), int(c), int(n), int(q))
        for s, c, n, q in zip(
            *(
                getattr(frames_of(SHARED / name), f)
                for f in ("system", "component", "number", "sequence")
            ),
            strict=True,
        )
    )
    theirs: Counter = Counter()
    reader = mavutil.mavlogfile(str(SHARED / name))
    while (message := reader.recv_msg()) is not None:
        if message.get_type() == "BAD_DATA" or message.get_type().startswith("UNKNOWN"):
            continue
        header = message.get_header()
        theirs[header.srcSystem, header.srcComponent, header.msgId, header.seq] += 1
    assert not theirs - ours
    assert ours.total() - theirs.total() <= 5


def damage_module():
    spec = importlib.util.spec_from_file_location("damage", SHARED / "telemetry" / "damage.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("base", BASES)
def test_damaged_files_keep_every_true_record(base):
    """As many as the best reader of experiments.json, none that is not there, and all told."""
    known = json.loads((SHARED / "telemetry" / "experiments.json").read_text())["files"][base]
    damage = damage_module()
    intact = (BASES[base] / base).read_bytes()
    records = damage.records(intact, "tlog")
    experiments = dict(damage.EXPERIMENTS["tlog"])
    for name, result in known["experiments"].items():
        spoiled, true = (
            experiments[name](intact, records)
            if name in experiments
            else (intact, [(s, e) for s, e, _ in records])
        )
        wanted = Counter(intact[s:e] for s, e in true)
        frames = find_frames(np.frombuffer(spoiled, np.uint8), frame_checks())
        found = Counter(spoiled[s:e] for s, e in spans(frames))
        kept = (wanted & found).total()
        best = max(r["kept"] for r in result.values() if isinstance(r, dict) and "kept" in r)
        assert kept >= best, (name, kept, best)
        assert kept == wanted.total(), (name, kept, wanted.total())
        bodies = Counter(intact[s + 8 : e] for s, e, _ in records)
        invented = Counter(spoiled[s + 8 : e] for s, e in spans(frames)) - bodies
        assert not invented, name
        covered = sum(e - s for s, e in spans(frames)) + sum(d.size for d in frames.damage)
        assert covered == len(spoiled), name
