"""What must not change the answer, and what must change it in one way only; no labels needed.

See ``reliability.md``: a prefix before the onset accuses nobody; times, a second vehicle, repeated
or damaged bytes change nothing; less telemetry says less; renumbered motors are accused renumbered.
"""

import heapq
import signal
from contextlib import contextmanager

import numpy as np
import pytest
from flights import (
    GROUND,
    Record,
    accused,
    assert_same_answer,
    components,
    document_of,
    document_of_bytes,
    examples,
    joined,
    records,
    shared,
)

from fdi.errors import FdiError

pytestmark = pytest.mark.flights

DAY = 86_400
LONGEST_S = 60.0  # CPU of an analysis of a minute of flight; they take 0.1 to 2 s
FAULTY = [
    *examples(),
    *shared(
        "sitl/copter/c13_motor4_x0.5.tlog",
        "sitl/copter/c47_compass_fail.tlog",
        "sitl/plane/p10_airspeed_stuck.tlog",
    ),
]
QUICK = "copter_gps_loss_landing"
"""Some thirty analyses a flight; the others, and more, by `make metamorphic`."""
LESS = [
    pytest.param(*p.values, id=p.id, marks=[*p.marks, *([pytest.mark.soak] * (p.id != QUICK))])
    for p in [*examples(), *shared("sitl/copter/c47_compass_fail.tlog")]
]
MOTORS = [p for p in FAULTY if "motor" in p.id]
COPTER, PLANE = (
    next(p.values[0] for p in examples() if p.id == name)
    for name in ("copter_gps_loss_landing", "plane_engine_failure_stall")
)
TUMBLE = next(p.values[0] for p in examples() if p.id == "copter_motor_failure_crash")
WRAP_MS = 2**32  # of time_boot_ms, and of the GPS time that is made from it
WRAP_US = 2**32  # of SERVO_OUTPUT_RAW.time_usec


@pytest.mark.parametrize("case", FAULTY)
def test_the_flights_below_accuse_somebody(case):
    """Else the tests of this file would show nothing."""
    assert accused(document_of(case.path)) & case.right


@pytest.mark.parametrize("case", FAULTY)
def test_prefix_that_ends_before_the_onset_accuses_nobody(case, tmp_path):
    own = records(case.path)
    end = own[0].stamp + (case.onset - 1.0) * 1e6
    before = [record for record in own if record.stamp < end]
    document = document_of_bytes(joined(before), tmp_path)
    assert not document["findings"], document["verdict"]


@pytest.mark.parametrize("days", [-300, 4000])
@pytest.mark.parametrize("case", FAULTY)
def test_another_start_time_gives_the_same_answer(case, days, tmp_path):
    shift = days * DAY * 1_000_000
    later = [Record(record.stamp + shift, record.frame) for record in records(case.path)]
    assert_same_answer(document_of(case.path), document_of_bytes(joined(later), tmp_path))


@pytest.mark.parametrize("case", FAULTY)
@pytest.mark.parametrize("seconds", [7.25, 100_000.5], ids=["soon", "next_day"])
def test_another_boot_offset_gives_the_same_answer(case, seconds, tmp_path):
    assert_boot_offset_does_not_matter(case, seconds, tmp_path)


@pytest.mark.parametrize("case", examples())
def test_boot_time_that_wraps_in_flight_gives_the_same_answer(case, tmp_path):
    """After 49.7 days; here 20 s before the onset."""
    boot = document_of(case.path)["log"]["boot_offset_s"] + case.onset
    assert_boot_offset_does_not_matter(case, WRAP_MS / 1000 - boot + 20, tmp_path)


def assert_boot_offset_does_not_matter(case, seconds, tmp_path):
    moved = [
        record if record.system == GROUND else record.edited(lambda m: boot_later(m, seconds))
        for record in records(case.path)
    ]
    assert joined(moved) != joined(records(case.path))
    document, other = document_of(case.path), document_of_bytes(joined(moved), tmp_path)
    assert_same_answer(document, other)
    for said, again in zip(document["findings"], other["findings"], strict=True):
        gone = again["onset"]["boot_s"] - said["onset"]["boot_s"]
        assert gone % (WRAP_MS / 1000) == pytest.approx(seconds % (WRAP_MS / 1000), abs=0.05)


def boot_later(message, seconds):
    """Add to every time since boot that a message carries, wrapping as the autopilot does."""
    name = message.get_type()
    if hasattr(message, "time_boot_ms"):
        message.time_boot_ms = (message.time_boot_ms + round(seconds * 1e3)) % WRAP_MS
    if 0 < getattr(message, "time_usec", 0) < 1e15:
        wrap = {"SERVO_OUTPUT_RAW": WRAP_US, "GPS_RAW_INT": WRAP_MS * 1000}.get(name, 2**64)
        message.time_usec = (message.time_usec + round(seconds * 1e6)) % wrap


PAIRS = pytest.mark.parametrize(
    ("first", "second"),
    [(COPTER, TUMBLE), (PLANE, TUMBLE), (TUMBLE, PLANE)],
    ids=["copters", "plane_and_copter", "copter_and_plane"],
)


def interleaved(first, second):
    """Two vehicles by one ground station; the second is system 7 and heard 0.3 s later."""
    own, others = records(first.path), records(second.path)
    shift = own[0].stamp - others[0].stamp + 300_000
    guests = [
        Record(record.stamp + shift, record.frame).edited(lambda message: None, system=7)
        for record in others
        if record.system != GROUND
    ]
    return list(heapq.merge(own, guests, key=lambda record: record.stamp))


@PAIRS
def test_second_vehicle_changes_nothing_for_the_first(first, second, tmp_path):
    mixed = document_of_bytes(joined(interleaved(first, second)), tmp_path, system=1)
    assert mixed["log"]["system_id"] == 1
    # its samples are taken some ms later, so that an onset may fall on the next one
    assert_same_answer(document_of(first.path), mixed, within=0.3)


@PAIRS
def test_second_vehicle_is_judged_like_the_first(first, second, tmp_path):
    """Its samples are taken at other moments, by up to a step of 0.25 s."""
    alone = document_of(second.path)
    mixed = document_of_bytes(joined(interleaved(first, second)), tmp_path, system=7)
    assert mixed["log"]["system_id"] == 7
    assert_same_answer(alone, mixed, later=0.3, within=0.3)


def test_vehicle_with_most_frames_is_taken_unasked(tmp_path):
    mixed = document_of_bytes(joined(interleaved(COPTER, TUMBLE)), tmp_path)
    assert mixed["log"]["system_id"] == 1
    assert_same_answer(document_of(COPTER.path), mixed)
    told = [text for text in mixed["warnings"] if "other vehicles" in text]
    assert len(told) == 1
    assert "system 7" in told[0]
    chosen = document_of_bytes(joined(interleaved(COPTER, TUMBLE)), tmp_path, system=1)
    assert not [text for text in chosen["warnings"] if "other vehicles" in text]


@pytest.mark.parametrize("case", FAULTY)
def test_appended_garbage_changes_no_byte_of_the_answer(case, tmp_path):
    garbage = np.random.default_rng(7).integers(0, 256, 5000, np.uint8).tobytes()
    data = case.path.read_bytes()
    document, other = document_of(case.path), document_of_bytes(data + garbage, tmp_path)
    assert "lost_bytes" in {record["kind"] for record in other["quality"]}
    for part in ("verdict", "findings", "consequences", "ruled_out", "not_testable", "fault_grid"):
        assert other[part] == document[part], part


@pytest.mark.parametrize("case", FAULTY)
def test_log_that_was_split_inside_records_and_joined_says_the_same(case, tmp_path):
    """Five pieces; at every seam the end of one record and the head of the next are missing."""
    data = case.path.read_bytes()
    seams = [len(data) * k // 5 for k in range(1, 5)]
    pieces = zip([0, *(s + 30 for s in seams)], [*seams, len(data)], strict=True)
    torn = b"".join(data[low:high] for low, high in pieces)
    document = document_of_bytes(torn, tmp_path)
    assert document["quality"]
    assert_same_answer(document_of(case.path), document, within=0.26)


@pytest.mark.parametrize("case", FAULTY)
def test_packets_that_came_twice_change_nothing(case, tmp_path):
    own = records(case.path)
    again = [Record(record.stamp + 80_000, record.frame) for record in own]
    both = heapq.merge(own, again, key=lambda record: record.stamp)
    document = document_of_bytes(joined(both), tmp_path)
    assert "duplicate" in {record["kind"] for record in document["quality"]}
    assert_same_answer(document_of(case.path), document)


@pytest.mark.parametrize("case", FAULTY)
def test_stream_that_was_sent_twice_changes_nothing(case, tmp_path):
    """Sent again by the vehicle itself, as a new frame, a moment later."""
    own = records(case.path)
    stream = [record for record in own if record.name in ("ATTITUDE", "GPS_RAW_INT", "VFR_HUD")]
    again = [Record(record.stamp + 5_000, record.frame) for record in stream]
    both = heapq.merge(own, again, key=lambda record: record.stamp)
    assert_same_answer(document_of(case.path), document_of_bytes(joined(both), tmp_path))


@pytest.fixture(scope="module")
def with_less(tmp_path_factory):
    """Analyses of a flight without one message each, by the message's name; made once a flight.

    None for an analysis that takes longer than ``LONGEST_S``; to refuse is to say nothing.
    """
    made = {}

    def of(case):
        if case.path not in made:
            folder = tmp_path_factory.mktemp("less")
            own = records(case.path)
            names = sorted({record.name for record in own if record.system != GROUND})
            made[case.path] = {name: without(own, name, folder) for name in names}
        return made[case.path]

    return of


def without(own, name, folder):
    less = [record for record in own if record.system == GROUND or record.name != name]
    try:
        with time_limit(LONGEST_S):
            return document_of_bytes(joined(less), folder)
    except TimeoutError:
        return None
    except FdiError:
        return {"findings": [], "ruled_out": []}


@contextmanager
def time_limit(seconds):
    """Raise TimeoutError where the body takes longer."""

    def too_long(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@pytest.mark.parametrize("case", LESS)
def test_analysis_with_a_stream_less_takes_no_longer_than_seconds(case, with_less):
    slow = [name for name, less in with_less(case).items() if less is None]
    assert not slow, f"more than {LONGEST_S} s without one of {slow}"


def answered(analyses):
    return {name: document for name, document in analyses.items() if document is not None}


@pytest.mark.parametrize("case", LESS)
def test_removing_a_stream_never_accuses_whom_the_data_cleared(case, with_less):
    cleared = components(document_of(case.path)["ruled_out"])
    blamed = {name: accused(less) & cleared for name, less in answered(with_less(case)).items()}
    assert not {name: who for name, who in blamed.items() if who}


@pytest.mark.parametrize("case", LESS)
def test_removing_a_stream_never_clears_whom_the_data_accused(case, with_less):
    """Without the stream of the very sensor that failed, what is left may clear the others."""
    whole = document_of(case.path)
    told = {c.split(".")[0] for f in whole["findings"] for c in f["evidence"]["channels"]}
    own = {name for name in told if name.startswith(("RAW_IMU", "SCALED_IMU"))}
    freed = {
        name: accused(whole) & components(less["ruled_out"])
        for name, less in answered(with_less(case)).items()
        if name not in own
    }
    assert not {name: who for name, who in freed.items() if who}


@pytest.mark.parametrize("case", LESS)
def test_removing_a_stream_never_makes_a_component_testable(case, with_less):
    untested = components(document_of(case.path)["not_testable"])
    judged = {
        name: untested & (accused(less) | components(less["ruled_out"]))
        for name, less in answered(with_less(case)).items()
    }
    assert not {name: who for name, who in judged.items() if who}


def renumbered(order):
    def renumber(message):
        outputs = [getattr(message, f"servo{k}_raw") for k in range(1, 5)]
        for number, value in zip(order, outputs, strict=True):
            setattr(message, f"servo{number}_raw", value)

    return renumber


AGAINST = {
    "ATTITUDE": ("roll", "pitch", "rollspeed", "pitchspeed"),
    "AHRS2": ("roll", "pitch"),
    "RAW_IMU": ("xacc", "yacc", "xgyro", "ygyro", "xmag", "ymag"),
    "SCALED_IMU2": ("xacc", "yacc", "xgyro", "ygyro", "xmag", "ymag"),
    "SCALED_IMU3": ("xacc", "yacc", "xgyro", "ygyro", "xmag", "ymag"),
    "NAV_CONTROLLER_OUTPUT": ("nav_roll", "nav_pitch"),
}
ABOUT = {
    "ATTITUDE": ("yaw", 2 * np.pi),
    "AHRS2": ("yaw", 2 * np.pi),
    "VFR_HUD": ("heading", 360),
    "GLOBAL_POSITION_INT": ("hdg", 36000),
}


def turned(message):
    """Turn the body by half a turn about its vertical axis: what was forward is backward."""
    name = message.get_type()
    for field in AGAINST.get(name, ()):
        setattr(message, field, -getattr(message, field))
    if name in ABOUT:
        field, round_ = ABOUT[name]
        value = getattr(message, field) + round_ / 2
        if isinstance(round_, int):
            setattr(message, field, round(value) % round_)
        else:
            setattr(message, field, (value + np.pi) % round_ - np.pi)
    if name == "SERVO_OUTPUT_RAW":
        renumbered((2, 1, 4, 3))(message)


@pytest.mark.parametrize("case", MOTORS)
def test_accusation_follows_the_number_of_the_motor(case, tmp_path):
    """The same flight, flown backwards by a vehicle whose motors stand the other way round.

    To a second: whether noise could have opened a gate of a test is asked in one direction only,
    and turned about, rates err in the other one.
    """
    new = {"motor_1": "motor_2", "motor_2": "motor_1", "motor_3": "motor_4", "motor_4": "motor_3"}
    edited = [
        one.edited(turned) if one.name in {*AGAINST, *ABOUT, "SERVO_OUTPUT_RAW"} else one
        for one in records(case.path)
    ]
    document, other = document_of(case.path), document_of_bytes(joined(edited), tmp_path)
    said = [(f["component"], f["onset"]["log_s"]) for f in document["findings"]]
    assert said[0][0].startswith("motor_")
    again = [(f["component"], f["onset"]["log_s"]) for f in other["findings"]]
    assert [name for name, _ in again] == [new.get(name, name) for name, _ in said]
    assert [at for _, at in again] == pytest.approx([at for _, at in said], abs=1.0)
    cleared = {new.get(name, name) for name in components(document["ruled_out"])}
    assert components(other["ruled_out"]) == cleared


@pytest.mark.parametrize("case", MOTORS)
def test_outputs_left_for_right_accuse_the_motor_with_that_number_or_nobody(case, tmp_path):
    """The body still gives way at the old motor: that one it must not bring back.

    Nobody is accused where the tests that look at the outputs alone had too little time.
    """
    edited = [
        one.edited(renumbered((3, 4, 1, 2))) if one.name == "SERVO_OUTPUT_RAW" else one
        for one in records(case.path)
    ]
    document, other = document_of(case.path), document_of_bytes(joined(edited), tmp_path)
    new = {"motor_1": "motor_3", "motor_2": "motor_4", "motor_3": "motor_1", "motor_4": "motor_2"}
    said = document["findings"][0]["component"]
    assert [f["component"] for f in other["findings"]][:1] in ([new[said]], [])
