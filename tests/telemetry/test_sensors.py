"""What the autopilot stops using in flight is told, and supports an accusation only."""

import pytest

import fdi

from .build import Flight, mav, record

GPS, BARO, RC, YAW = 1 << 5, 1 << 3, 1 << 16, 1 << 12
ALL = GPS | BARO | RC | YAW


def status(t: float, enabled: int, present: int = ALL) -> bytes:
    message = mav.MAVLink_sys_status_message(
        present, enabled, ALL, 300, 12000, 100, 80, 0, 0, 0, 0, 0, 0
    )
    return record(t, message, sequence=round(4 * t))


def log_of(enabled_at, present_at=lambda t: ALL, hover: float = 40.0, until=1e9) -> bytes:
    flight = Flight(hover=hover)
    told = [
        status(i / 4, enabled_at(i / 4), present_at(i / 4)) for i in range(int(4 * flight.duration))
    ]
    records = sorted([*flight.records(), *told], key=lambda r: r[:8])
    first, *stamps = (int.from_bytes(record[:8], "big") for record in [records[0], *records])
    kept = zip(stamps, records, strict=True)
    return b"".join(record for stamp, record in kept if stamp - first <= until * 1e6)


def said(log) -> list[tuple[float, str]]:
    return [(event.t, event.text) for event in log.events if event.kind == "sensor"]


def test_a_sensor_that_is_switched_off_in_flight_and_on_again_is_told(load):
    log = load(log_of(lambda t: ALL & ~GPS if 20 <= t < 30 else ALL))
    (off, what), (on, again) = said(log)
    assert (what, again) == (
        "the autopilot no longer uses the GPS receiver",
        "the GPS receiver is used again",
    )
    assert (off, on) == (pytest.approx(20.0, abs=0.3), pytest.approx(30.0, abs=0.3))


@pytest.mark.parametrize(
    ("enabled_at", "present_at"),
    [
        (lambda t: ALL & ~GPS if t < 3 else ALL, lambda t: ALL),  # it starts up on the ground
        (lambda t: ALL & ~GPS, lambda t: ALL),  # never used
        (lambda t: ALL & ~GPS if t > 20 else ALL, lambda t: ALL & ~GPS if t > 20 else ALL),  # gone
        (lambda t: ALL & ~YAW if t > 20 else ALL, lambda t: ALL),  # a controller, by its mode
        (lambda t: ALL, lambda t: ALL),
    ],
    ids=["start", "never", "gone", "controller", "always"],
)
def test_what_was_not_used_in_flight_or_is_gone_is_not_switched_off(load, enabled_at, present_at):
    assert said(load(log_of(enabled_at, present_at))) == []


@pytest.mark.parametrize("is_used", [True, False])
def test_a_sensor_that_is_switched_off_supports_and_accuses_nobody(tmp_path, is_used):
    path = tmp_path / "log.tlog"
    # up to the descent, in which this log's receiver drifts off: that would be evidence, too
    path.write_bytes(log_of(lambda t: ALL if is_used or t < 30 else ALL & ~BARO, until=50.0))
    analysis = fdi.analyze(path)
    bank, alarms = analysis.bank, analysis.alarms
    (row,) = [
        i
        for i, generator in enumerate(bank.generators)
        if bank.system.equations[generator.residual].name == "barometer_switched_off"
    ]
    assert bool((alarms.state[row] == 1).any()) is not is_used
    assert not [f for f in analysis.findings if f.component == "barometer"]
