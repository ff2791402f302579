"""Nothing that discloses a simulated fault is evidence: without it the answer is the same.

Simulation parameters and records, overridden output functions, injected failures, the truth that a
simulator logs, the voter's own record, and every text of the console.
"""

import re
import struct

import pytest
from flights import (
    GROUND,
    Record,
    assert_same_answer,
    document_of,
    document_of_bytes,
    examples,
    joined,
    records,
    shared,
)
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.analysis import analyze

pytestmark = pytest.mark.flights

PARAMETER = re.compile(r"SIM_.*|SERVO\d+_FUNCTION|DISABLE_.*|RC\d+_FUNCTION")
TOPIC = re.compile(r".*groundtruth.*|redundancy_.*|.*inject.*|vehicle_command(_ack)?|.*sim.*")
TLOGS = [
    *examples(),
    *shared("sitl/copter/c47_compass_fail.tlog", "sitl/plane/p10_airspeed_stuck.tlog"),
]
BINS = shared(
    "motor_stop/quad-x_m1.bin", "motor_stop/quad-plus_m2m4.bin", "motor_stop/hexa-x_m1.bin"
)
ULOGS = shared("triplex/gps_fail/instance_0.ulg")


def assert_same_verdict(document, other):
    """Also where nobody is accused: the same residuals trigger."""
    alarms, again = (
        {tuple(r["equations"]) for r in d["residuals"] if r["triggered"]} for d in (document, other)
    )
    assert alarms, "a flight on which nothing triggers shows nothing"
    assert again == alarms
    assert other["verdict"] == document["verdict"]
    assert_same_answer(document, other, within=0.26)


def discloses(record):
    if record.name in ("STATUSTEXT", "SIMSTATE", "SIM_STATE"):
        return True
    if record.name not in ("PARAM_VALUE", "PARAM_SET"):
        return False
    name = mav.MAVLink(None).decode(bytearray(record.frame)).param_id
    return PARAMETER.fullmatch(name) is not None


@pytest.mark.parametrize("case", TLOGS)
def test_a_tlog_without_what_discloses_says_the_same(case, tmp_path):
    own = records(case.path)
    left = [record for record in own if not discloses(record)]
    assert len(left) < len(own)
    assert_same_verdict(document_of(case.path), document_of_bytes(joined(left), tmp_path))


@pytest.mark.parametrize("case", examples())
def test_texts_and_parameters_that_name_a_failure_accuse_nobody(case, tmp_path):
    """Told a second before anything failed, to a log that ends there."""
    own = records(case.path)
    end = own[0].stamp + (case.onset - 1.0) * 1e6
    before = [record for record in own if record.stamp < end]
    vehicle = next(r for r in before if r.system != GROUND)
    last = before[-1].stamp
    told = [
        mav.MAVLink_statustext_message(2, b"ENGINE FAILURE: motor 1 failed, GPS lost, crash"),
        mav.MAVLink_param_value_message(b"SIM_ENGINE_FAIL", 1, 9, 900, 1),
        mav.MAVLink_param_value_message(b"SERVO1_FUNCTION", 1, 9, 900, 2),
        mav.MAVLink_param_value_message(b"SIM_GPS_DISABLE", 1, 9, 900, 3),
    ]
    sender = mav.MAVLink(None, vehicle.system, 1)
    added = [Record(last + 1000 * k, bytes(m.pack(sender))) for k, m in enumerate(told)]
    document = document_of_bytes(joined([*before, *added]), tmp_path)
    assert not document["findings"], document["verdict"]


def dataflash_without_what_discloses(data):
    """Return the bytes of an intact DataFlash log without its texts, truths and overrides."""
    lengths, names, parts, at = {0x80: 89}, {0x80: "FMT"}, [], 0
    while at + 3 <= len(data):
        assert data[at : at + 2] == b"\xa3\x95", f"not intact at byte {at}"
        kind = data[at + 2]
        size = lengths[kind]
        record = data[at : at + size]
        at += size
        if kind == 0x80 and len(record) == size:
            lengths[record[3]] = record[4]
            names[record[3]] = record[5:9].split(b"\0")[0].decode()
        name = names[kind]
        parameter = record[11:27].split(b"\0")[0].decode("latin-1") if name == "PARM" else ""
        if not (name == "MSG" or name.startswith("SIM") or PARAMETER.fullmatch(parameter)):
            parts.append(record)
    return b"".join(parts)


@pytest.mark.parametrize("case", BINS)
def test_a_dataflash_log_without_what_discloses_says_the_same(case, tmp_path):
    data = case.path.read_bytes()
    less = dataflash_without_what_discloses(data)
    assert len(less) < len(data)
    # which firmware it is stands in a text only, and decides which model is taken
    whole = document_of(case.path)
    path = tmp_path / case.path.name
    path.write_bytes(less)
    assert_same_verdict(whole, analyze(path, model=whole["model"]["name"]).document())


def ulog_without_what_discloses(data):
    """Return the bytes of an intact ULog without logged texts and topics that hold the truth."""
    left, parts, at = set(), [data[:16]], 16
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<HB", data, at)
        body = data[at + 3 : at + 3 + size]
        name = body[3:].decode("latin-1") if kind == ord("A") else ""
        if TOPIC.fullmatch(name):
            left.add(body[1:3])
        is_left = bool(TOPIC.fullmatch(name)) or (kind == ord("D") and body[:2] in left)
        if not is_left and kind not in b"LC":
            parts.append(data[at : at + 3 + size])
        at += 3 + size
    return b"".join(parts)


@pytest.mark.parametrize("case", ULOGS)
def test_a_ulog_without_what_discloses_says_the_same(case, tmp_path):
    data = case.path.read_bytes()
    less = ulog_without_what_discloses(data)
    assert len(less) < len(data)
    path = tmp_path / case.path.name
    path.write_bytes(less)
    assert_same_verdict(document_of(case.path), analyze(path).document())
