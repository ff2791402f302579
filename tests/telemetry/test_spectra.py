"""Lines of known frequency, in every kind of record that fast samples come in."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest

from fdi.report.waterfall import told_of
from fdi.telemetry import read
from fdi.telemetry.message import Column, Message
from fdi.telemetry.spectra import fastest, motor_rates, notches, spectrum, too_slow
from fdi.units import Conversion

RNG = np.random.default_rng(7)
GYRO = tuple(f"gyro_rad[{i}]" for i in range(3))


def message(name, t, columns):
    made = {k: Column(lambda v=v: np.asarray(v), Conversion("")) for k, v in columns.items()}
    return Message(name, None, t, t, np.arange(t.size), made)


def log(*messages, autopilot="px4", parameters=None):
    return SimpleNamespace(
        messages={m.key: m for m in messages},
        autopilot=autopilot,
        parameters=parameters or {},
        flights=(),
    )


def shaking(t, hz, size=1.0, noise=0.1):
    """Three axes, (n, 3): a line on the second of them, noise on all."""
    values = noise * RNG.standard_normal((t.size, 3))
    values[:, 1] += size * np.sin(2 * np.pi * hz * t)
    return values


def combined(rate, hz, seconds=20.0, lost=0.0):
    t = np.arange(0.0, seconds, 1 / rate)
    values = shaking(t, hz)
    kept = RNG.random(t.size) >= lost
    t, values = t[kept], values[kept]
    return message("sensor_combined", t, dict(zip(GYRO, values.T, strict=True)))


@pytest.mark.parametrize("lost", [0.0, 0.05])
@pytest.mark.parametrize("hz", [40.0, 93.0])
def test_a_line_is_found_where_it_is_though_records_are_lost(hz, lost):
    found = spectrum(log(combined(250.0, hz, lost=lost)), "gyroscope")
    line, above = found.strongest(5.0, 15.0)
    assert line == pytest.approx(hz, abs=1.5)
    assert above > 15.0
    assert found.hz[-1] == pytest.approx(125.0)
    assert spectrum(log(combined(250.0, hz)), "accelerometer") is None


def test_power_is_the_variance_that_there_is():
    given = combined(250.0, 60.0)
    found = spectrum(log(given), "gyroscope")
    variance = sum(np.var(given.si(name)) for name in GYRO)
    assert variance == pytest.approx(0.53, abs=0.02)
    powers = found.power.sum(axis=0) * found.hz[1]
    assert np.median(powers) == pytest.approx(variance, rel=0.05)


def test_noise_alone_has_no_line():
    t = np.arange(0.0, 60.0, 0.004)
    given = message("sensor_combined", t, dict(zip(GYRO, shaking(t, 60.0, 0.0).T, strict=True)))
    assert spectrum(log(given), "gyroscope").strongest(0.0, 60.0) is None


def test_windows_do_not_reach_across_a_gap():
    given = combined(250.0, 60.0)
    t = np.where(given.t > 10.0, given.t + 30.0, given.t)
    given = message("sensor_combined", t, {name: given.si(name) for name in GYRO})
    found = spectrum(log(given), "gyroscope")
    assert not ((found.t > 10.0) & (found.t < 40.0)).any()
    assert found.t[-1] > 45.0


def test_slow_records_are_not_enough_and_it_is_said_how_fast_they_are():
    given = log(combined(50.0, 20.0))
    assert spectrum(given, "gyroscope") is None
    assert "sensor_combined has 50" in too_slow(given)
    assert "there are none" in too_slow(log())


def test_a_buffer_of_the_sensor_is_read_to_its_last_sample():
    """1 kHz in records of 20 samples, the last of which has the record's time."""
    rate, count = 1000.0, 20
    t = np.arange(0.0, 8.0, 1 / rate)
    values = np.round(shaking(t, 180.0) / 0.001).reshape(-1, count, 3)
    columns = {"dt": np.full(len(values), 1000.0), "scale": np.full(len(values), 0.001)}
    columns["samples"] = np.full(len(values), count)
    for axis, name in enumerate("xyz"):
        for i in range(32):
            entry = values[:, i, axis] if i < count else np.zeros(len(values))
            columns[f"{name}[{i}]"] = entry
    given = log(message("sensor_gyro_fifo", t[count - 1 :: count], columns), combined(250.0, 40.0))
    found = spectrum(given, "gyroscope")
    assert (found.message, found.rate_hz) == ("sensor_gyro_fifo", pytest.approx(1000.0))
    assert found.strongest(0.0, 8.0)[0] == pytest.approx(180.0, abs=1.5)
    (piece,) = fastest(given, "gyroscope").pieces
    assert piece.start == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(piece.values, values.reshape(-1, 3) * 0.001, atol=1e-9)


def _definition(number, name, form, labels):
    widths = {"Q": 8, "H": 2, "B": 1, "f": 4, "a": 64, "n": 4, "N": 16, "Z": 64}
    size = 3 + sum(widths[character] for character in form)
    packed = struct.pack("<BB4s16s64s", number, size, name, form.encode(), labels)
    return b"\xa3\x95\x80" + packed


def batches(lost=()):
    """A DataFlash log: four batches of 1024 samples at 2 kHz, of the gyroscope and then not."""
    head = b"TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate"
    yield _definition(128, b"FMT", "BBnNZ", b"Type,Length,Name,Format,Columns")
    yield _definition(10, b"ISBH", "QHBBHHQf", head)
    yield _definition(11, b"ISBD", "QHHaaa", b"TimeUS,N,seqno,x,y,z")
    for batch in range(4):
        start = 1_000_000 + 2_000_000 * batch
        kind = batch % 2
        t = np.arange(1024) / 2000.0
        counts = np.round(1000 * shaking(t, 300.0 if kind else 90.0)).astype("<i2")
        head = struct.pack("<QHBBHHQf", start, 0, kind, 0, 1000, 1024, start, 2000.0)
        yield b"\xa3\x95\x0a" + head
        for seqno in range(32):
            if (batch, seqno) in lost:
                continue
            part = counts[32 * seqno : 32 * seqno + 32]
            data = struct.pack("<QHH", start + 1000 * (seqno + 1), 0, seqno)
            yield b"\xa3\x95\x0b" + data + b"".join(part[:, i].tobytes() for i in range(3))


@pytest.mark.parametrize(("lost", "count"), [((), 2), (((1, 7),), 1)])
def test_batches_of_raw_samples_are_read_whole(tmp_path, lost, count):
    """All have the same number, so that only time tells which data are of which head."""
    path = tmp_path / "batches.bin"
    path.write_bytes(b"".join(batches(lost)))
    given = read(path)
    samples = fastest(given, "gyroscope")
    assert (samples.message, samples.rate_hz, len(samples.pieces)) == ("ISBD", 2000.0, count)
    assert samples.pieces[-1].values.shape == (1024, 3)
    line, _ = spectrum(given, "gyroscope").strongest(0.0, 20.0)
    assert line == pytest.approx(300.0, abs=3.0)
    line, _ = spectrum(given, "accelerometer").strongest(0.0, 20.0)
    assert line == pytest.approx(90.0, abs=3.0)


def test_motors_turn_as_often_as_their_controllers_say():
    t = np.arange(0.0, 5.0, 0.1)
    rotor = message("ROTOR_2", t, {"rpm": np.full(t.size, -200 * np.pi)})
    ((_, turns),) = motor_rates(log(rotor))
    np.testing.assert_allclose(turns, 100.0)


HARMONIC = {
    "INS_HNTCH_ENABLE": 1,
    "INS_HNTCH_FREQ": 80.0,
    "INS_HNTCH_BW": 40.0,
    "INS_HNTCH_HMNCS": 3,
}
"""A fixed filter of ArduPilot at 80 Hz and twice it."""


@pytest.mark.parametrize(
    ("autopilot", "parameters", "found"),
    [
        ("ardupilot", HARMONIC, [(80.0, 40.0), (160.0, 80.0)]),
        ("ardupilot", HARMONIC | {"INS_HNTCH_HMNCS": 4}, [(240.0, 120.0)]),
        ("ardupilot", HARMONIC | {"INS_HNTCH_ENABLE": 0}, []),
        ("ardupilot", HARMONIC | {"INS_HNTCH_MODE": 3}, []),
        ("px4", {"IMU_GYRO_NF0_FRQ": 0.0, "IMU_GYRO_NF1_FRQ": 95.0}, [(95.0, 0.0)]),
        ("px4", HARMONIC, []),
    ],
)
def test_notch_filters_are_those_that_are_on(autopilot, parameters, found):
    assert notches(log(autopilot=autopilot, parameters=parameters)) == found


@pytest.mark.parametrize(
    ("hz", "told"),
    [(95.0, "within the notch filter at 80 Hz"), (110.0, "which no fixed notch filter takes out")],
)
def test_a_line_is_held_against_the_filters_that_are_set(hz, told):
    t = np.arange(0.0, 10.0, 1 / 400)
    noise = np.random.default_rng(0).normal(0.0, 0.01, (3, t.size))
    wave = noise + np.sin(2 * np.pi * hz * t)
    raw = message("GYR", t, dict(zip(("GyrX", "GyrY", "GyrZ"), wave, strict=True)))
    given = log(raw, autopilot="ardupilot", parameters=HARMONIC | {"INS_HNTCH_HMNCS": 1})
    (words,) = told_of([spectrum(given, "gyroscope")], given)
    assert f"line at {hz:.0f} Hz" in words
    assert words.endswith(told)
    given.parameters["INS_HNTCH_BW"] = 0.0  # how wide it is nobody knows
    (words,) = told_of([spectrum(given, "gyroscope")], given)
    assert "filter" not in words
