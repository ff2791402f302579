"""Several logs of one flight are one log that says what came from where; others are refused."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import EXAMPLES, GROUND, SHARED, Record, accusations, joined, records

from fdi.analysis import analyze
from fdi.errors import UsageError
from fdi.report import json_text
from fdi.telemetry import Event, Log, QualityRecord, join, read
from fdi.telemetry.log import ParameterChange
from fdi.telemetry.together.happenings import merged_events, merged_parameters

from ..build import AFTER, Flight, started_anew
from .test_agreement import PAIRS, needs_shared, pair, without_clocks

pytestmark = pytest.mark.flights

EXAMPLE = EXAMPLES / "copter_motor_failure_crash.tlog"
HOST_S = 137.2  # by which another recorder's host clock is ahead

Write = Callable[[str, Sequence[Record]], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to(name: str, some: Sequence[Record]) -> Path:
        path = tmp_path / name
        path.write_bytes(joined(some))
        return path

    return to


def late(some: Sequence[Record], by: float = HOST_S) -> list[Record]:
    """Return the records as a host whose clock is ahead stamps them."""
    return [one._replace(stamp=one.stamp + round(by * 1e6)) for one in some]


@pytest.fixture(scope="module")
def whole() -> Log:
    return read(EXAMPLE)


def assert_same_records(found: Log, expected: Log, *, within: float) -> None:
    """Check that every message has the same values at the same times."""
    assert set(found.messages) == set(expected.messages)
    for key, message in expected.messages.items():
        assert len(found[key]) == len(message), key
        np.testing.assert_allclose(found[key].t, message.t, atol=within, err_msg=key)
        for name, column in message.columns.items():
            if column.is_text:
                texts = found[key].raw(name)[found[key].kept]
                assert texts.tolist() == message.raw(name)[message.kept].tolist()
            else:
                np.testing.assert_allclose(
                    found[key].si(name), message.si(name), rtol=1e-9, atol=1e-12, err_msg=key
                )


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["in_order", "swapped"])
@pytest.mark.parametrize("by", [0.0, HOST_S], ids=["same_host", "other_host"])
def test_two_halves_are_the_whole(
    write: Write, whole: Log, order: tuple[int, int], by: float
) -> None:
    every = records(EXAMPLE)
    half = len(every) // 2
    paths = [write("a.tlog", every[:half]), write("b.tlog", late(every[half:], by))]
    log = join([read(paths[i]) for i in order])
    zero = 0.0 if order == (0, 1) else (every[half].stamp - every[0].stamp) / 1e6
    moved = replace(
        whole,
        messages={
            key: replace(m, t=m.t - zero, stamp=m.stamp - zero, _cache={})
            for key, m in whole.messages.items()
        },
        _cache={},
    )
    assert_same_records(log, moved, within=0.002)
    assert log.duration == pytest.approx(whole.duration, abs=0.002)
    assert log.span == pytest.approx([end - zero for end in whole.span], abs=0.002)
    assert dict(log.parameters) == dict(whole.parameters)
    assert [(e.kind, e.text) for e in log.events] == [(e.kind, e.text) for e in whole.events]
    (flight,) = log.flights
    assert flight.impact == pytest.approx(whole.flights[0].impact - zero, abs=0.002)
    assert log.clock.boot(0.0) == pytest.approx(whole.clock.boot(zero), abs=0.002)


def test_two_lossy_recorders_give_the_whole(write: Write, whole: Log) -> None:
    """Two ground stations with different clocks, each deaf for another third of the flight."""
    every = records(EXAMPLE)
    n = len(every)
    hear_a = [r for i, r in enumerate(every) if not 0.45 < i / n < 0.6]
    hear_b = [r for i, r in enumerate(every) if i / n > 0.3 and not 0.7 < i / n < 0.85]
    log = join([read(write("a.tlog", hear_a)), read(write("b.tlog", late(hear_b)))])
    (placed,) = log.recordings[1:]
    assert placed.placed_by == "boot"
    assert placed.offset == pytest.approx((hear_b[0].stamp - every[0].stamp) / 1e6, abs=0.01)
    for key in ("ATTITUDE", "GLOBAL_POSITION_INT", "SERVO_OUTPUT_RAW"):
        assert np.diff(log[key].t).max() < 1.0, key
        at = np.searchsorted(whole[key].t, log[key].t - 0.01)
        np.testing.assert_allclose(log[key].t, whole[key].t[at], atol=0.003)
        name = whole[key].fields[1]
        np.testing.assert_allclose(log[key].si(name), whole[key].si(name)[at], atol=1e-9)


def test_more_than_two_logs_and_one_that_only_another_one_knows(write: Write, whole: Log) -> None:
    every = records(EXAMPLE)
    n = len(every)
    parts = [every[: n // 2], late(every[n // 4 : 3 * n // 4]), late(every[n // 2 :], 5.0)]
    log = join([read(write(f"{i}.tlog", part)) for i, part in enumerate(parts)])
    assert log.files == ("0.tlog", "1.tlog", "2.tlog")
    assert len(log["ATTITUDE"]) == len(whole["ATTITUDE"])
    assert [(e.kind, e.text) for e in log.events] == [(e.kind, e.text) for e in whole.events]


def test_one_log_stays_as_it_is(whole: Log) -> None:
    assert join([whole]) is whole
    assert whole.files == (EXAMPLE.name,)
    with pytest.raises(UsageError, match="no log"):
        join([])


@pytest.mark.parametrize(
    ("others", "says"),
    [
        ([EXAMPLE.name], "the same file twice"),
        (["copter_gps_loss_landing.tlog"], "another flight than"),
        (["plane_engine_failure_stall.tlog"], "vehicle plane, there quad"),
    ],
)
def test_what_is_not_of_one_flight_is_refused(whole: Log, others: list[str], says: str) -> None:
    with pytest.raises(UsageError, match=says) as refused:
        join([whole, *(read(EXAMPLES / name) for name in others)])
    assert "\n" not in str(refused.value)


def test_other_parameters_are_of_another_vehicle(write: Write, whole: Log) -> None:
    def edit(message: object) -> None:
        if message.param_id != "FRAME_CLASS":  # type: ignore[attr-defined]
            message.param_value += 1.0  # type: ignore[attr-defined]

    changed = [
        r.edited(edit) if r.name == "PARAM_VALUE" and r.system != GROUND else r
        for r in records(EXAMPLE)
    ]
    with pytest.raises(UsageError, match=r"341 of the 342 parameters"):
        join([whole, read(write("b.tlog", changed))])


def test_another_system_is_another_vehicle(write: Write, whole: Log) -> None:
    other = [
        r.edited(lambda message: None, system=7) if r.system != GROUND else r
        for r in records(EXAMPLE)
    ]
    with pytest.raises(UsageError, match="system 7, there 1"):
        join([whole, read(write("b.tlog", other))])


def test_the_same_motion_at_another_place_is_another_flight(write: Write, whole: Log) -> None:
    """Two flights of one plan may look alike in every rate and speed."""

    def edit(message: object) -> None:
        message.lat += 1000  # type: ignore[attr-defined]  # 1e-7 deg: 11 m

    places = ("GLOBAL_POSITION_INT", "GPS_RAW_INT")
    every = records(EXAMPLE)
    elsewhere = [r.edited(edit) if r.name in places else r for r in every[len(every) // 5 :]]
    second = read(write("b.tlog", late(elsewhere)))
    with pytest.raises(UsageError, match=r"they are 11\.\d m apart"):
        join([whole, second])
    near = [r for r in elsewhere if r.name not in places]
    assert join([whole, read(write("c.tlog", late(near)))]).recordings[1].placed_by == "boot"


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["in_order", "swapped"])
def test_files_before_and_after_a_restart_in_the_air_lie_in_turn(
    tmp_path: Path, order: tuple[int, int]
) -> None:
    parts = [tmp_path / "before.tlog", tmp_path / "after.tlog"]
    parts[0].write_bytes(Flight().bytes(11.0))
    parts[1].write_bytes(b"".join(started_anew()))
    log = join([read(parts[i]) for i in order])
    zero = 0.0 if order == (0, 1) else AFTER
    assert log.recordings[1].placed_by == "utc"
    assert [e.t + zero for e in log.events if e.kind == "reboot"] == [pytest.approx(AFTER, abs=0.1)]
    first, second = log.flights
    assert first.restart + zero == pytest.approx(AFTER, abs=0.1)
    assert second.landing + zero == pytest.approx(Flight().phases()[3], abs=1.5)
    assert log["RESTART"] is not None
    assert log.clock.boot(AFTER + 5.0 - zero) == pytest.approx(7.0, abs=0.1)
    assert log.clock.boot(5.0 - zero) == pytest.approx(25.0, abs=0.1)


def test_an_autopilot_that_ran_before_the_other_file_ended_did_not_start_anew(
    tmp_path: Path,
) -> None:
    parts = [tmp_path / "before.tlog", tmp_path / "other.tlog"]
    parts[0].write_bytes(Flight().bytes(11.0))
    parts[1].write_bytes(b"".join(started_anew(since_boot=40.0)))
    with pytest.raises(UsageError, match="ran already 38 s before"):
        join([read(part) for part in parts])


def test_files_an_hour_apart_are_of_two_flights(tmp_path: Path) -> None:
    parts = [tmp_path / "one.tlog", tmp_path / "other.tlog"]
    parts[0].write_bytes(Flight().bytes())
    late = [one._replace(stamp=one.stamp + 3_600_000_000) for one in records(parts[0])]
    parts[1].write_bytes(joined(late))
    moved = read(parts[1])
    clock = replace(moved.clock, utc_offset=moved.clock.utc_offset + 3600.0)
    anew = replace(clock, boot_offset=clock.boot_offset + 1.0)
    with pytest.raises(UsageError, match=r"by satellite time 35\d\d s lie between"):
        join([read(parts[0]), replace(moved, clock=anew, _cache={})])


def test_halves_of_which_nothing_tells_how_they_lie_are_refused(write: Write) -> None:
    every = records(EXAMPLE)
    half = len(every) // 2
    logs = [
        without_clocks(read(write(name, part)))
        for name, part in (("a.tlog", every[:half]), ("b.tlog", every[half:]))
    ]
    with pytest.raises(UsageError, match=r"b\.tlog: .*(another flight|no signals)"):
        join(logs)


def test_the_quality_of_each_file_is_told_with_its_name_on_the_common_clock(
    write: Write, whole: Log
) -> None:
    every = records(EXAMPLE)
    second = read(write("b.tlog", late(every[len(every) // 4 :])))
    lost = QualityRecord("lost_bytes", None, 3.0, 4.0, 17, "17 bytes")
    log = join([whole, replace(second, quality=(lost,), _cache={})])
    offset = log.recordings[1].offset
    assert QualityRecord(
        "lost_bytes", None, 3.0 + offset, 4.0 + offset, 17, "b.tlog: 17 bytes"
    ) in list(log.quality)
    told = [q.text for q in log.quality if q.kind == "joined"]
    assert "its clock counts" in told[0]
    assert f"+ {offset:.3f} s" in told[1]
    assert {key for one in log.recordings for key in one.messages} == set(log.messages)


def shift(log: Log, by: float) -> Log:
    """Return the log with its happenings later."""
    return replace(
        log,
        reported=tuple(replace(e, t=e.t + by) for e in log.reported),
        parameter_changes=tuple(c._replace(t=c.t + by) for c in log.parameter_changes),
        _cache={},
    )


@pytest.mark.parametrize("late_s", [-1.0, 0.0, 0.7])
def test_what_two_logs_tell_is_told_once(whole: Log, late_s: float) -> None:
    change = ParameterChange(20.0, "WPNAV_SPEED", 500.0, 300.0)
    log = replace(whole, parameter_changes=(change,), _cache={})
    events = merged_events([(log, 0.0), (shift(log, late_s), 0.0)])
    told = sorted((e.kind, e.text) for e in whole.reported)
    assert sorted((e.kind, e.text) for e in events) == told
    values, changes, differ = merged_parameters([(log, 0.0), (shift(log, late_s), 0.0)])
    assert values == dict(whole.parameters)
    assert changes == (change,)
    assert not differ


def test_events_that_come_twice_are_told_twice(whole: Log) -> None:
    """A mode that was left and taken again is no double, in either log."""
    modes = [(10.0, "LOITER"), (20.0, "RTL"), (30.0, "LOITER")]
    one = replace(whole, reported=tuple(Event(t, "mode", name) for t, name in modes), _cache={})
    seen_late = replace(
        one, reported=tuple(Event(t + 0.9, "mode", name) for t, name in modes), _cache={}
    )
    events = merged_events([(one, 0.0), (seen_late, 0.0)])
    assert [(e.t, e.text) for e in events] == modes


def test_about_parameters_that_differ_the_log_that_began_first_is_believed(whole: Log) -> None:
    name = next(iter(whole.parameters))
    other = replace(whole, parameters={**whole.parameters, name: 77.0, "NEW": 1.0}, _cache={})
    values, _, differ = merged_parameters([(other, 5.0), (whole, 0.0)])
    assert values[name] == whole.parameters[name]
    assert values["NEW"] == 1.0
    assert differ == (name,)


@needs_shared
@pytest.mark.parametrize("name", [PAIRS[i] for i in (0, 3, 4, 9)])
def test_two_recorders_give_the_verdict_of_the_better_one(name: str) -> None:
    paths = [SHARED / "sitl" / f"{name}{ending}" for ending in (".tlog", ".BIN")]
    both, alone = analyze(paths), analyze(paths[1])
    assert {f.component for f in both.findings} <= {f.component for f in alone.findings}
    offset = both.log.recordings[1].offset
    if alone.findings:
        assert both.findings[0].component == alone.findings[0].component
        assert both.findings[0].onset == pytest.approx(alone.findings[0].onset + offset, abs=1.0)
    swapped = analyze(paths[::-1])
    assert accusations(swapped.document()) == accusations(both.document())


@needs_shared
def test_a_pair_says_what_came_from_where() -> None:
    log = join(pair(PAIRS[3]))
    told = json.loads(json_text(analyze_document(log)))
    first, second = told["recordings"]
    assert (first["placed_by"], first["offset_s"]) == ("first", 0.0)
    assert second["placed_by"] == "boot"
    assert {"ATTITUDE", "GPS_RAW_INT", "SERVO_OUTPUT_RAW", "ATT"} <= set(second["messages"])
    assert {"HEARTBEAT", "SYSTEM_TIME"} <= set(first["messages"])
    assert "flags" in first["added"]["EKF_STATUS_REPORT"]
    arm = [event.t for event in log.events if event.kind == "arm"]
    assert len(arm) == 1


def analyze_document(log: Log) -> dict[str, object]:
    from fdi.report.log_document import log_facts

    return log_facts(log)


def test_analysis_of_several_logs_keeps_the_schema(write: Write) -> None:
    from importlib.resources import files

    import jsonschema

    every = records(EXAMPLE)
    half = len(every) // 2
    paths = [write("a.tlog", every[:half]), write("b.tlog", late(every[half:]))]
    analysis = analyze(paths)
    document = json.loads(json_text(analysis.document()))
    jsonschema.validate(
        document, json.loads(files("fdi.report").joinpath("analysis.schema.json").read_text())
    )
    assert document["log"]["files"] == ["a.tlog", "b.tlog"]
    assert document["log"]["name"] == "a.tlog + b.tlog"
    assert analysis.findings[0].component == analyze(EXAMPLE).findings[0].component
