"""Which vibrations does a log hold, at which frequencies and when?

In: a log. Out: a `Spectrum` of the gyroscope and of the accelerometer, each by the fastest of its
records: batches of raw samples (ArduPilot ``ISBH`` and ``ISBD``), raw or fast samples (``GYR``,
``ACC``, ``IMU``), the sensors' own buffers (PX4 ``sensor_gyro_fifo``, ``sensor_accel_fifo``) and
``sensor_combined``. Beside it what should stand in such a picture: how fast the motors turn, and
which frequencies notch filters take out.

A propeller out of balance shows once per turn, its blades as often as there are blades, a loose
part at its own frequency. What is faster than half the rate of sampling shows folded, unless the
sensor's own filter took it out. Power is that of all three axes.

References
----------
Welch, IEEE Trans. Audio Electroacoust. 15, 1967 (windows that overlap by half). ArduPilot,
"Measuring Vibration with IMU Batch Sampler", and pymavlink's ``mavfft_isb.py`` (batches).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from fdi.telemetry.log import Log
from fdi.telemetry.message import Floats, Message

Sensor = Literal["gyroscope", "accelerometer"]
SENSORS: Final[tuple[Sensor, ...]] = ("gyroscope", "accelerometer")
LEAST_HZ: Final = 100.0
"""Rate of sampling; slower records show next to nothing of what turns."""
WINDOW_S: Final = 1.0
"""So long a window tells frequencies to 1.5 Hz (Hann)."""
GAP: Final = 4.5
"""Of the usual step between samples: what is longer is a gap. Recorders lose single records (up to
6 % on recorded flights); over so few a straight line is drawn."""
BODY_HZ: Final = 20.0
"""Below, the vehicle itself moves."""
STANDS_OUT_DB: Final = 6.0
"""Twice the amplitude of what is around it: chosen; less is a ripple of noise."""
_LEAST: Final = 64  # samples of a window
_PLAIN: Final[Mapping[Sensor, tuple[tuple[str, tuple[str, ...]], ...]]] = {
    "gyroscope": (
        ("GYR", ("GyrX", "GyrY", "GyrZ")),
        ("IMU", ("GyrX", "GyrY", "GyrZ")),
        ("sensor_combined", tuple(f"gyro_rad[{i}]" for i in range(3))),
    ),
    "accelerometer": (
        ("ACC", ("AccX", "AccY", "AccZ")),
        ("IMU", ("AccX", "AccY", "AccZ")),
        ("sensor_combined", tuple(f"accelerometer_m_s2[{i}]" for i in range(3))),
    ),
}
_FIFO: Final = {"gyroscope": "sensor_gyro_fifo", "accelerometer": "sensor_accel_fifo"}
_BATCH_TYPE: Final = {"accelerometer": 0, "gyroscope": 1}  # ISBH.type
_ENTRIES: Final = range(32)  # of an array of a record
_AXES: Final = "xyz"
_NOTCHES: Final[Mapping[str, list[tuple[str, ...]]]] = {
    "ardupilot": [
        (f"INS_{n}_ENABLE", *(f"INS_{n}_{what}" for what in ("FREQ", "BW", "MODE", "HMNCS")))
        for n in ("HNTCH", "HNTC2", "NOTCH")
    ],
    "px4": [
        (f"IMU_GYRO_NF{n}_FRQ", f"IMU_GYRO_NF{n}_FRQ", f"IMU_GYRO_NF{n}_BW", "", "")
        for n in range(2)
    ],
}
"""Of each autopilot what switches a filter on, its frequency and bandwidth, its mode (one that
follows motors has another than 0) and its harmonics: a bit for each."""
_HARMONICS: Final = 16  # ArduPilot's most (HNF_MAX_HARMONICS)


class Notch(NamedTuple):
    """A fixed notch filter, or a harmonic of one: its middle and its width, Hz (0: unknown)."""

    hz: float
    width: float

    def reaches(self, hz: float) -> bool:
        """Return whether it takes out half of the power of a line at a frequency, or more."""
        return abs(hz - self.hz) <= self.width / 2


class Piece(NamedTuple):
    """Samples without a gap: s of the first one, (n, 3) values in SI."""

    start: float
    values: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The fastest samples of a sensor: of which message, how many a second, in pieces."""

    message: str
    rate_hz: float
    pieces: tuple[Piece, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power of a sensor's samples over time and frequency, all axes together.

    Attributes
    ----------
    sensor, message : str
    rate_hz : float
        Of sampling; frequencies go to half of it.
    t : (k,) float
        s, the middles of the windows.
    hz : (m,) float
    power : (m, k) float
        Density, (rad/s)^2/Hz or (m/s^2)^2/Hz.
    """

    sensor: Sensor
    message: str
    rate_hz: float
    t: Floats
    hz: Floats
    power: Floats

    def strongest(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the line that stands out most from what is around it, and by how much.

        Parameters
        ----------
        low, high : float
            s: within this time, by its median there.

        Returns
        -------
        (float, float) or None
            Hz, dB; None where none stands out by `STANDS_OUT_DB`.
        """
        from scipy.signal import find_peaks

        inside = (self.t >= low) & (self.t <= high)
        if not inside.any():
            return None
        level = 10 * np.log10(np.maximum(np.median(self.power[:, inside], axis=1), 1e-30))
        found, told = find_peaks(level, prominence=STANDS_OUT_DB)
        told = told["prominences"][self.hz[found] >= BODY_HZ]
        found = found[self.hz[found] >= BODY_HZ]
        if not found.size:
            return None
        best = int(np.argmax(told))
        return float(self.hz[found[best]]), float(told[best])


def spectrum(log: Log, sensor: Sensor) -> Spectrum | None:
    """Return the spectrum of a sensor; None where no record is fast enough (`LEAST_HZ`)."""
    samples = fastest(log, sensor)
    if samples is None or samples.rate_hz < LEAST_HZ:
        return None
    longest = max((len(piece.values) for piece in samples.pieces), default=0)
    size = min(2 ** round(np.log2(WINDOW_S * samples.rate_hz)), longest)
    if size < _LEAST:
        return None
    from scipy.signal import spectrogram  # a second, which most logs are too slow to need

    hz, times, powers = np.empty(0), list[Floats](), list[Floats]()
    for start, values in samples.pieces:
        if len(values) < size:
            continue
        hz, t, power = spectrogram(
            values, samples.rate_hz, window="hann", nperseg=size, noverlap=size // 2, axis=0
        )
        times.append(start + t)
        powers.append(power.sum(axis=1))
    found = np.concatenate(times), np.concatenate(powers, axis=1)
    return Spectrum(sensor, samples.message, samples.rate_hz, found[0], np.asarray(hz), found[1])


def fastest(log: Log, sensor: Sensor) -> Samples | None:
    """Return the fastest samples of a sensor in a log, None where there are none."""
    found = [*_plain(log, sensor), *_fifo(log, sensor), *_batches(log, sensor)]
    return max(found, key=lambda one: one.rate_hz, default=None)


def motor_rates(log: Log) -> Iterator[tuple[Floats, Floats]]:
    """Yield times (s) and turns a second of every motor whose controller tells them."""
    for key, message in log.messages.items():
        if key.startswith("ROTOR_") and "rpm" in message:
            yield message.t, np.abs(message.si("rpm")) / (2 * np.pi)


def notches(log: Log) -> list[Notch]:
    """Return the fixed notch filters that are set, one for each harmonic, by frequency."""
    found = set[Notch]()
    for switch, frequency, width, mode, harmonics in _NOTCHES.get(log.autopilot or "", ()):
        told = [log.parameters.get(name, 0.0) for name in (switch, frequency, width, mode)]
        if told[0] <= 0 or told[1] <= 0 or told[3]:
            continue
        bits = int(log.parameters.get(harmonics, 1))
        # its quality is one for all harmonics: the width grows with them (HarmonicNotchFilter)
        found |= {
            Notch(k * float(told[1]), k * float(told[2]))
            for k in range(1, _HARMONICS + 1)
            if bits >> (k - 1) & 1
        }
    return sorted(found)


def _plain(log: Log, sensor: Sensor) -> Iterator[Samples]:
    """Yield samples that are one record each."""
    for name, fields in _PLAIN[sensor]:
        message = log.messages.get(name)
        if message is None or len(message) < _LEAST or any(f not in message for f in fields):
            continue
        values = np.stack([message.si(field) for field in fields], axis=1)
        yield from _in_pieces(name, message.t, values)


def _in_pieces(
    name: str, t: Floats, values: Floats, step: float | None = None
) -> Iterator[Samples]:
    known = np.isfinite(values).all(axis=1)
    t, values = t[known], values[known]
    if t.size < _LEAST:
        return
    step = float(np.median(np.diff(t))) if step is None else step
    if step <= 0:
        return
    bounds = np.flatnonzero(np.diff(t) > GAP * step) + 1
    parts = zip(np.split(t, bounds), np.split(values, bounds), strict=True)
    yield Samples(name, 1.0 / step, tuple(_regular(*part, step) for part in parts))


def _regular(t: Floats, values: Floats, step: float) -> Piece:
    """Return samples at equal steps; records are not written quite regularly."""
    at = t[0] + step * np.arange(1 + round((t[-1] - t[0]) / step))
    return Piece(float(t[0]), np.stack([np.interp(at, t, one) for one in values.T], axis=1))


def _fifo(log: Log, sensor: Sensor) -> Iterator[Samples]:
    """Yield the samples of PX4's buffers: up to 32 a record, the last one at its time."""
    message = log.messages.get(_FIFO[sensor])
    names = [f"{axis}[{i}]" for axis in _AXES for i in _ENTRIES]
    if message is None or any(name not in message for name in (*names, "dt", "scale", "samples")):
        return
    step, scale, count = (_raw(message, name) for name in ("dt", "scale", "samples"))
    entries = np.stack([[_raw(message, f"{a}[{i}]") for i in _ENTRIES] for a in _AXES], axis=2)
    late = (count[None] - 1 - np.arange(len(_ENTRIES))[:, None]) * step[None] * 1e-6
    is_one = (late >= 0).T  # by record, in the order of time
    t = (message.t[None] - late).T[is_one]
    values = (entries * scale[None, :, None]).transpose(1, 0, 2)[is_one]
    yield from _in_pieces(_FIFO[sensor], t, values, float(np.median(step)) * 1e-6)


def _batches(log: Log, sensor: Sensor) -> Iterator[Samples]:
    """Yield the samples of ArduPilot's batches, of the first unit: whole ones are a piece each."""
    head, data = log.messages.get("ISBH"), log.messages.get("ISBD")
    names = [f"{axis}[{i}]" for axis in _AXES for i in _ENTRIES]
    if head is None or data is None or any(name not in data for name in names):
        return
    wanted = ("N", "type", "instance", "mul", "smp_cnt", "smp_rate")
    if any(name not in head for name in wanted):
        return
    number, kind, unit, factor, length, rate = (_raw(head, name) for name in wanted)
    own = (kind == _BATCH_TYPE[sensor]) & (factor > 0) & (rate > 0)
    if not own.any():
        return
    own &= unit == unit[own].min()
    entries = np.stack([[_raw(data, f"{a}[{i}]") for i in _ENTRIES] for a in _AXES], axis=2)
    of, order = _raw(data, "N"), _raw(data, "seqno")
    pieces = []
    for row in np.flatnonzero(own).tolist():
        # numbers come again: those of a batch follow its head
        until = head.t[row + 1 :][number[row + 1 :] == number[row]][:1]
        rows = np.flatnonzero((of == number[row]) & (data.t >= head.t[row]))
        rows = rows[data.t[rows] < until[0]] if until.size else rows
        if not np.array_equal(order[rows], np.arange(rows.size)):
            continue  # some of it was lost
        values = entries[:, rows].transpose(1, 0, 2).reshape(-1, 3)[: int(length[row])]
        if len(values):
            pieces.append(Piece(float(head.t[row]), values / factor[row]))
    if pieces:
        yield Samples("ISBD", float(np.median(rate[own])), tuple(pieces))


def _raw(message: Message, field: str) -> Floats:
    return np.asarray(message.raw(field)[message.kept], np.float64)


def too_slow(log: Log) -> str:
    """Return how fast the fastest records of a log are, and what to set to see more."""
    found = [one for sensor in SENSORS if (one := fastest(log, sensor)) is not None]
    best = max(found, key=lambda one: one.rate_hz, default=None)
    told = "there are none" if best is None else f"{best.message} has {best.rate_hz:.0f}"
    return f"{LEAST_HZ:.0f} samples a second of an inertial sensor are needed, {told}"


def in_air(spectra: Sequence[Spectrum], log: Log) -> tuple[float, float]:
    """Return from when to when the longest flight lasts, s; the whole log where nothing flew."""
    flown = [flight.airborne for flight in log.flights if flight.flew]
    whole = (min(one.t[0] for one in spectra), max(one.t[-1] for one in spectra))
    return max(flown, key=lambda span: span[1] - span[0], default=whole)
