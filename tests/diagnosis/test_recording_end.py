"""Why a recording stops in flight: what the last voltages say, and what else it may be."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis.recording_end import recording_end
from fdi.telemetry import log_from_columns
from fdi.telemetry.clock import Clock
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.events import Event, Flight
from fdi.telemetry.log import Recording

T = np.arange(0.0, 60.0, 0.5)
FLOWN = Flight(0.0, 59.5, None, 50.0)


def log(how="in_air", events=(), **volts):
    names = {"battery": "SYS_STATUS.voltage_battery", "board": "POWER_STATUS.Vcc"}
    columns = {"t": T, "A.x": T, **{names[name]: value for name, value in volts.items()}}
    made = log_from_columns(columns, {names[name]: "V" for name in volts})
    cache = {"ends": (FlightEnd(0, how, 59.5),), "events": tuple(events)}
    return replace(made, format="ulog", _cache=cache)


def said(*args, **options):
    (fact,) = recording_end(log(*args, **options))
    return fact.text


def test_voltages_that_are_kept_say_that_power_was_there():
    text = said(battery=np.full(T.size, 15.2), board=np.full(T.size, 5.05))
    assert "power was there at its last records (battery 15.2 V and board 5.0 V)" in text
    assert text.startswith("the recording stops in flight (log 59.5 s)")


@pytest.mark.parametrize(
    ("name", "before", "last"), [("battery", 15.0, 12.0), ("board", 5.0, 4.3), ("board", 4.4, 4.4)]
)
def test_a_voltage_that_falls_says_that_power_was_going(name, before, last):
    text = said(**{name: np.where(T < 58.0, before, last)})
    assert f"power was going at its last records ({name} {last} V after {before} V)" in text


def test_without_voltages_nothing_is_known_of_power():
    assert "no voltage in the log tells whether power was there" in said()


def test_a_program_that_stopped_is_the_reason_and_leads():
    crash = Event(59.5, "failsafe", "the autopilot's processor crashed: hard fault in task nav")
    (fact,) = recording_end(log(events=[crash], battery=np.full(T.size, 15.2)))
    assert "the autopilot's program stopped (\"the autopilot's processor crashed\")" in fact.text
    assert fact.leads
    assert fact.about == "autopilot_computer"
    assert any("hard fault in task nav" in one for one in fact.records)


def test_power_that_goes_leads_and_power_that_stays_does_not():
    for last, leads in ((12.0, True), (15.0, False)):
        (fact,) = recording_end(log(battery=np.where(T < 58.0, 15.0, last)))
        assert fact.leads is leads


def anew(since: float, flight=FLOWN, events=()):
    clock = Clock(np.zeros(1), np.array([since]), np.full(1, np.nan), 0.1, np.nan, "none")
    made = replace(log("landed", events), clock=clock)
    return replace(made, _cache={**made._cache, "flights": (flight,)})


@pytest.mark.parametrize(
    ("since", "flight", "says"),
    [
        (3.0, FLOWN, True),
        (45.0, FLOWN, False),  # time to take off
        (3.0, replace(FLOWN, takeoff=2.0), False),
        (3.0, replace(FLOWN, flew=False), False),
    ],
)
def test_who_flies_just_after_its_boot_started_anew_in_the_air(since, flight, says):
    found = recording_end(anew(since, flight))
    assert len(found) == says
    for fact in found:
        assert "it flies 3.0 s after the autopilot's boot; why, is not told" in fact.text
        assert fact.leads


def test_the_report_of_a_watchdog_tells_why_it_started_anew():
    said = "WDG: T-3 SL0 FL0 FT3 FA200004BC"
    (fact,) = recording_end(anew(3.0, events=[Event(0.5, "text", said)]))
    assert 'its program had stopped ("WDG")' in fact.text
    assert any(said in one for one in fact.records)


def test_a_disarming_just_before_is_told_as_what_stops_recorders():
    assert "had just been disarmed" in said(events=[Event(58.0, "disarm", "")])
    assert "had just been disarmed" not in said(events=[Event(30.0, "disarm", "")])


@pytest.mark.parametrize("how", ["landed", "impact", "tipped_over", "on_ground"])
def test_another_end_needs_no_reason(how):
    assert recording_end(log(how)) == ()


def buffered(
    free: float, least: float, size: float = 200.0, form: str = "dataflash", recordings=()
) -> str:
    """Return the fact of a log whose recorder writes 20 kB a second."""
    second = np.arange(0.0, 60.0, 1.0)
    parts = {"DSF.Bytes": 20_000.0, "DSF.FAv": free, "DSF.FMn": least}
    columns = {"t": second, **{name: np.full(60, value) for name, value in parts.items()}}
    columns["DSF.FMn"][:30] = free
    made = log_from_columns(columns)
    cache = {"ends": (FlightEnd(0, "in_air", 59.0),), "events": ()}
    told = {"LOG_FILE_BUFSIZE": size}
    made = replace(made, format=form, parameters=told, recordings=recordings, _cache=cache)
    (fact,) = recording_end(made)
    return fact.text


def test_what_the_recorder_had_not_written_is_told_in_seconds():
    whole = 200 * 1024
    text = buffered(whole - 2_000, whole - 24_000)
    assert "is missing: 0.1 s as a rule, 1.2 s at most in the minute before" in text


def test_what_px4_wrote_is_safe_once_a_second():
    """40 KiB/s; 4 KiB are in the buffer as a rule, 60 once: 0.1 and 1.5 s, and the second."""
    second = np.arange(0.0, 60.0, 1.0)
    used = np.full(60, 4096.0)
    used[40] = 61440.0
    parts = {"write_rate_kb_s": 40.0, "buffer_size_bytes": 65536.0, "buffer_used_bytes": used}
    columns = {f"logger_status.{name}": np.broadcast_to(v, 60) for name, v in parts.items()}
    made = log_from_columns({"t": second, **columns})
    cache = {"ends": (FlightEnd(0, "in_air", 59.0),), "events": ()}
    (fact,) = recording_end(replace(made, format="ulog", _cache=cache))
    assert "is missing: 0.6 s as a rule, 2.5 s at most in the minute before" in fact.text
    assert "40960 bytes a second, in the buffer of 65536 4096 as a rule" in fact.records[-1]
    assert "made safe every 1 s" in fact.records[-1]


def test_nothing_is_told_of_a_buffer_that_nobody_knows():
    whole = 200 * 1024
    assert "missing" not in buffered(whole - 2_000, whole - 24_000, form="ulog")
    assert "missing" not in buffered(whole - 2_000, whole - 24_000, size=0.0)
    assert "missing" not in buffered(2 * whole, whole)  # more is free than there is


def joined(flew=True, how="landed", uncertainty=0.1, **ends: float):
    """Return a log of several recorders, named by their formats, that stop at these times."""
    recordings = tuple(
        Recording(f"a.{form}", form, 1, "", 0.0, uncertainty, "boot", end, (), {})
        for form, end in ends.items()
    )
    flight = Flight(0.0, 59.5, 5.0 if flew else None, 50.0 if flew else None, flew=flew)
    made = log(how)
    cache = {**made._cache, "flights": (flight,)}
    return recording_end(replace(made, recordings=recordings, _cache=cache))


@pytest.mark.parametrize(
    ("stops", "goes_on", "why"),
    [("ulog", "tlog", "its recorder stopped"), ("tlog", "dataflash", "the link or the ground")],
)
def test_a_recorder_that_stops_in_flight_while_another_goes_on_is_told(stops, goes_on, why):
    (fact,) = joined(**{stops: 30.0, goes_on: 59.5})
    assert fact.text.startswith(f"the recording a.{stops} stops in flight (log 30.0 s), and")
    assert f"a.{goes_on} goes on for 29.5 s: {why}" in fact.text
    assert fact.records[0] == f"a.{stops}: last record at log 30.0 s"


@pytest.mark.parametrize("end", [55.0, 48.5])  # after landing, and as near as a recorder loses
def test_a_recorder_that_stops_after_the_flight_is_not_told(end):
    assert joined(ulog=end, tlog=59.5) == ()
    assert joined(flew=False, ulog=30.0, tlog=59.5) == ()


@pytest.mark.parametrize(
    ("ends", "told"),
    [({"ulog": 58.5, "tlog": 59.5}, True), ({"ulog": 56.0, "tlog": 59.5}, False),
     ({"ulog": 59.5}, False), ({"dataflash": 59.0, "ulog": 59.5}, False)],
)  # fmt: skip
def test_that_both_kinds_stop_at_once_speaks_for_what_both_need(ends, told):
    *_, fact = joined(how="in_air", **ends)
    assert ("both need the autopilot and its power" in fact.text) == told


@pytest.mark.parametrize(("restarted", "facts"), [(30.5, 0), (45.0, 1)])
def test_a_recorder_that_ends_with_its_autopilot_did_not_stop_alone(restarted, facts):
    flight = Flight(0.0, 59.5, 5.0, 50.0, flew=True, restart=restarted + 2.0)
    recordings = tuple(
        Recording(f"a.{form}", form, 1, "", 0.0, 0.1, "boot", end, (), {})
        for form, end in (("dataflash", 30.0), ("tlog", 59.5))
    )
    ends = (FlightEnd(0, "restarted", restarted), FlightEnd(0, "landed", 50.0))
    made = replace(log(), recordings=recordings, _cache={"ends": ends, "flights": (flight,)})
    told = [fact.text for fact in recording_end(made)]
    assert sum("its recorder stopped" in text for text in told) == facts
    assert sum("gave nothing" in text for text in told) == 1


@pytest.mark.parametrize(("last", "told"), [("dataflash", True), ("tlog", False)])
def test_what_was_not_written_is_asked_of_the_recorder_that_stops_last(last, told):
    other = "tlog" if last == "dataflash" else "dataflash"
    recordings = tuple(
        Recording(f"a.{form}", form, 1, "", 0.0, 0.1, "boot", end, (), {})
        for form, end in ((other, 40.0), (last, 59.0))
    )
    text = buffered(180_000.0, 150_000.0, recordings=recordings)
    assert ("had not written yet" in text) == told
    assert ("the link is lost or the ground station stops" in text) != told
