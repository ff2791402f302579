"""What is asked of a log, and what has to hold whatever the file was?"""

from __future__ import annotations

import math
from pathlib import Path
from random import Random
from typing import Final, get_args

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry import Channel, Log, Request, Sampling, read
from fdi.telemetry.quality import Kind

CHANNELS: Final = 4
KINDS: Final = get_args(Kind)


def exercise(path: Path, random: Random) -> Log:
    """Read a log, decode every column, resample a few channels; return it.

    Raises
    ------
    AssertionError
        Something that has to hold does not.
    """
    log = read(path)
    for key, message in log.messages.items():
        assert key == message.key
        assert np.isfinite(message.t).all(), f"a time is not finite: {key}"
        assert (np.diff(message.t) > 0).all(), f"times do not ascend: {key}"
        assert message.kept.shape == message.t.shape, key
        for field in message.fields:
            raw, values = message.raw(field), message.si(field)
            assert raw.shape == message.stamp.shape, f"shape: {key}.{field}"
            assert values.shape == message.t.shape, f"shape: {key}.{field}"
            assert not np.isinf(values).any(), f"infinite: {key}.{field}"
    _check_account(log)
    _resample(log, random)
    return log


def _check_account(log: Log) -> None:
    """What is said about the log is finite, printable and consistent."""
    assert math.isfinite(log.duration)
    assert log.duration >= 0, "a negative duration"
    for record in log.quality:
        assert record.kind in KINDS, f"quality: {record}"
        assert record.count >= 0, f"quality: {record}"
        assert record.text, f"quality: {record}"
        assert record.text.isprintable(), f"quality: {record}"
    lost = sum(r.count for r in log.quality if r.kind in ("lost_bytes", "truncated"))
    assert lost <= log.bytes, "more bytes are said to be lost than there are"
    for event in log.events:
        assert math.isfinite(event.t), f"time of an event: {event}"
    times = [event.t for event in log.events]
    assert times == sorted(times), "events are not in order"
    for flight in log.flights:
        assert flight.start <= flight.end, f"times of a flight: {flight}"
    assert all(math.isfinite(value) for value in log.parameters.values()), "a parameter is not"
    for t in (0.0, log.duration):
        log.clock.boot(t)
        log.clock.utc(t)
    assert repr(log)
    assert repr(log.clock)


def _parsed(text: str) -> Channel | None:
    try:
        return Channel.parse(text)
    except UsageError:
        return None


def _resample(log: Log, random: Random) -> None:
    channels = list(log.channels)
    if not channels:
        return
    chosen = random.sample(channels, min(CHANNELS, len(channels)))
    requests = [Request(channel, (channel.field,)) for channel in chosen]
    for channel in chosen:
        assert _parsed(str(channel)) == channel, f"not understood when typed: {channel}"
        found = log.channel(channel)
        assert found.t.shape == found.value.shape
        assert np.isfinite(found.value).any(), f"no known value: {channel}"
    if len(log.messages) > 1:
        log[chosen[0].source].frame()
    signals = log.signals(requests, Sampling())
    for values in signals.columns.values():
        assert values.shape == signals.t.shape
    log.state(np.linspace(-1, log.duration + 1, 20))
