"""How late does a sensor's channel come, against what the estimator says at the same time?

In: a bank and signals. Out: a `Lag` for every sensor in every message of which a test compares
channels with trusted inputs alone (the receiver's speed with the estimator's velocity, a gyroscope
with the turn of the attitude). Taking the residual back off the channel gives what the inputs
expect of it; the lag is where the cross-correlation of the two is largest, between samples by the
rate of change. It is found block by block in the first part of the flight, for all channels of the
sensor: how far the blocks agree, and how much noise there is against the motion, say how well the
lag is known. It counts where that is clearly better than what is assumed of a record's time anyway;
else the latency that the model states stays.

A fault that delays a sensor later in the flight moves few blocks, and one from the beginning on is
no healthy latency when it is longer than the autopilots allow for.

References
----------
Knapp, Carter: The generalized correlation method for estimation of time delay, IEEE Trans. ASSP
24(4), 1976: the variance of the maximum.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats, wrap
from fdi.model.parts import Kind, Measurement
from fdi.residuals.bank import Bank, Generator
from fdi.residuals.differentiate import Differentiation
from fdi.residuals.evaluate import TIMING_SHARE, compute_node, context_of
from fdi.residuals.reads import needed_for
from fdi.residuals.value import Context, Value
from fdi.telemetry import Channel, Log, Request, Sampling, Signals

BLOCK_S: Final = 10.0
"""Long enough for some turns, short enough for several before a fault."""
SHARE: Final = 0.5
LONGEST_S: Final = 300.0
"""Blocks are taken from the first half in the air, at most this long: a fault comes later."""
SEARCH_S: Final = 1.0
"""A maximum is looked for up to this lag on both sides."""
MOST_S: Final = 0.3
"""The longest delay of a receiver that autopilots allow for (PX4 EKF2_GPS_DELAY 300 ms, ArduPilot
GPS_DELAY_MS 250 ms); a period of the channel comes on top where it is sent on."""
NEWS_S: Final = 2.0
"""Noise is new so often: receivers and filters smooth over a second or two."""
LEAST_BLOCKS: Final = 3
BETTER: Final = 0.5
"""A lag counts that is known to this share of what is assumed of the time of a record."""
WITHIN: Final = 0.05
"""Samples by which a lag within a sample is missed: rates are differences of two."""
OF_MEDIAN: Final = 1.4826
"""Standard deviation of normal values over their median distance from the middle."""

Why = Literal["", "too little motion", "not known well enough", "no latency of health"]


@dataclass(frozen=True, slots=True)
class Lag:
    """By how much later than stated a sensor shows its quantities in a message.

    Attributes
    ----------
    source, component : str
        The message and the sensor in it.
    channels : tuple of Channel
        Those of the sensor in that message.
    against : tuple of str
        The messages that it was compared with.
    stated : float
        s; the latency that the model states.
    value, sigma : float
        s; beyond the stated one; NaN where nothing tells.
    assumed : float
        s; how well the time of a record is known without this.
    blocks : float
        From so many pieces of the flight, by their weight.
    used : bool
        Whether it is taken off the channel's times.
    why : str
        Why it is not used.
    """

    source: str
    component: str
    channels: tuple[Channel, ...]
    against: tuple[str, ...]
    stated: float
    value: float
    sigma: float
    assumed: float
    blocks: float
    used: bool
    why: Why


def estimate_lags(bank: Bank, signals: Signals, recipe: Differentiation) -> tuple[Lag, ...]:
    """Return how late the sensors' channels come, one each, in the order of the bank.

    Parameters
    ----------
    bank : Bank
    signals : Signals
        With the stated latencies taken off.
    recipe : Differentiation
    """
    context = context_of(bank.system, bank.nodes, signals, recipe)
    context = replace(context, spreads=False)
    begun = _beginning(signals)
    of_sensor: dict[tuple[str, str], list[_Comparison]] = {}
    for compared in _comparisons(bank):
        own = compared.measurement
        of_sensor.setdefault((own.channel.source, own.component), []).append(compared)
    lags = []
    for members in of_sensor.values():
        found: list[tuple[float, float]] = []
        for compared in members:
            shown = signals.columns[compared.measurement.channel]
            expected = shown - _excess(compared, context)
            noise = compared.measurement.jitter or 0.0
            for block in _blocks(np.where(begun, shown, np.nan), expected, signals.rate_hz):
                if compared.circular:  # a jump from pi to -pi would be at the same time in both
                    block = (np.unwrap(block[0]), np.unwrap(block[1]))
                lag = block_lag(*block, signals.rate_hz, noise)
                found += [] if lag is None else [lag]
        lags.append(_judged(members, found, bank, signals))
    return tuple(lags)


def sample(
    log: Log,
    bank: Bank,
    sampling: Sampling,
    recipe: Differentiation,
    *,
    lags: bool,
    accuracies: bool,
) -> tuple[Signals, tuple[Lag, ...]]:
    """Return the channels of a bank on one grid, and the lags that they show.

    Parameters
    ----------
    log : Log
    bank : Bank
    sampling : Sampling
    recipe : Differentiation
    lags : bool
        Whether lags are looked for, and those that are known well enough taken off.
    accuracies : bool
        Whether the accuracies that the log reports count.
    """
    channels = bank.system.channels
    if not accuracies:
        channels = tuple(replace(request, reported=None) for request in channels)
    signals = log.signals(channels, sampling)
    found = estimate_lags(bank, signals, recipe) if lags else ()
    if any(lag.used for lag in found):
        # the grid stays: what follows from it was found on it
        kept = replace(sampling, rate_hz=signals.rate_hz)
        signals = log.signals(with_lags(channels, found), kept)
    return signals, found


def with_lags(requests: Iterable[Request], lags: Iterable[Lag]) -> tuple[Request, ...]:
    """Return what to ask of a log so that lags that are used are taken off as well."""
    late = {channel: lag for lag in lags if lag.used for channel in lag.channels}
    return tuple(
        replace(
            request,
            latency=request.latency + late[request.channel].value,
            latency_accuracy=late[request.channel].sigma,
        )
        if request.channel in late
        else request
        for request in requests
    )


@dataclass(frozen=True, slots=True)
class _Comparison:
    """A test that compares one sensor's channel with inputs of other messages alone."""

    generator: Generator
    equation: int
    measurement: Measurement
    against: tuple[str, ...]
    circular: bool


def _comparisons(bank: Bank) -> list[_Comparison]:
    """Return one comparison for every channel that has any, that of the fewest equations."""
    equations = bank.system.equations
    found: dict[Channel, _Comparison] = {}
    for generator in sorted(bank.generators, key=lambda g: len(g.equations)):
        residual = equations[generator.residual]
        used = {i: m for i in generator.equations if (m := equations[i].measurement)}
        sensors = [(i, m) for i, m in used.items() if not m.trusted]
        inputs = sorted({m.channel.source for m in used.values() if m.trusted})
        if residual.kind is not Kind.RELATION or len(sensors) != 1 or not inputs:
            continue
        if bank.nodes[generator.node].kind == "observer":  # shows news, not by how much it is off
            continue
        ((equation, measurement),) = sensors
        if measurement.channel.source in inputs or measurement.accuracy is None:
            continue
        one = _Comparison(generator, equation, measurement, tuple(inputs), residual.circular)
        found.setdefault(measurement.channel, one)
    return list(found.values())


def _excess(compared: _Comparison, context: Context) -> Floats:
    """Return by how much a channel exceeds what the inputs expect of it, in its own unit."""
    plain = _residual(compared.generator, context)
    size = compared.measurement.accuracy
    assert size is not None
    added = {compared.equation: np.full(len(plain), size)}
    change = _residual(compared.generator, replace(context, added=added)) - plain
    slope = (wrap(change) if compared.circular else change) / size
    with np.errstate(divide="ignore", invalid="ignore"):
        excess: Floats = plain / slope
    return np.where(np.isfinite(excess), excess, np.nan)


def _residual(generator: Generator, context: Context) -> Floats:
    done: dict[int, Value] = {}
    for number in needed_for(context.nodes, generator.node):
        done[number] = compute_node(context.nodes[number], done, context)
    return done[generator.node].column


def _beginning(signals: Signals) -> NDArray[np.bool_]:
    """Return the first part of the time in the air."""
    flying = np.asarray(signals.state.airborne, dtype=bool)
    count = int(min(SHARE * flying.sum(), LONGEST_S * signals.rate_hz))
    return flying & (np.cumsum(flying) <= count)


def _judged(
    members: Sequence[_Comparison],
    found: Sequence[tuple[float, float]],
    bank: Bank,
    signals: Signals,
) -> Lag:
    first = members[0].measurement
    period = signals.period.get(first.channel, 1.0 / signals.rate_hz)
    assumed = float(np.hypot(TIMING_SHARE * period, signals.late.get(first.channel, 0.0)))
    value, sigma, blocks = combined(found)
    why: Why = ""
    if not blocks >= LEAST_BLOCKS:
        why = "too little motion"
    elif not sigma <= BETTER * assumed:
        why = "not known well enough"
    elif not -period <= first.latency + value <= MOST_S + period:
        why = "no latency of health"
    return Lag(
        source=first.channel.source,
        component=first.component,
        channels=tuple(
            m.channel
            for e in bank.system.equations
            if (m := e.measurement)
            and not m.trusted
            and (m.channel.source, m.component) == (first.channel.source, first.component)
        ),
        against=tuple(dict.fromkeys(name for one in members for name in one.against)),
        stated=first.latency,
        value=value,
        sigma=sigma,
        assumed=assumed,
        blocks=blocks,
        used=not why,
        why=why,
    )


def _blocks(shown: Floats, expected: Floats, rate: float) -> Iterator[tuple[Floats, Floats]]:
    """Yield pieces of the channel, with what is expected for so much longer on both sides."""
    size, around = round(BLOCK_S * rate), _around(rate)
    known = np.isfinite(shown) & np.isfinite(expected)
    for start in range(0, len(shown) - size - 2 * around + 1, size):
        piece = slice(start, start + size + 2 * around)
        if known[piece].all():
            yield shown[start + around : start + around + size], expected[piece]


def _around(rate: float) -> int:
    return int(np.ceil(SEARCH_S * rate))


def block_lag(
    shown: Floats, expected: Floats, rate: float, noise: float = 0.0
) -> tuple[float, float] | None:
    """Return by how much, s, a piece comes late and the standard deviation, None if untold.

    Parameters
    ----------
    shown : (n,) float
        The channel.
    expected : (n + 2 k,) float
        What is expected of it, k = ceil(SEARCH_S * rate) samples longer on both sides.
    rate : float
        Samples per second.
    noise : float
        Stated; what is left may look smaller, because a lag explains slow noise as well.
    """
    size, around = len(shown), _around(rate)
    windows = np.lib.stride_tricks.sliding_window_view(expected, size)  # from late to early
    line = np.linspace(-1.0, 1.0, size)
    own, others = _without_line(shown[None], line)[0], _without_line(windows, line)
    power = np.sqrt((own**2).sum() * (others**2).sum(axis=1))
    if not power.min() > 0.0:
        return None
    together = others @ own / power
    best = int(together.argmax())
    if not 0 < best < 2 * around:
        return None
    speed = _without_line(np.gradient(windows[best])[None] * rate, line)[0]
    # own = gain * (expected - lag * its rate), which is exact for a lag within a sample
    terms = np.stack([others[best], speed], axis=1)
    (gain, turned), *_ = np.linalg.lstsq(terms, own, rcond=None)
    if not (together[best] > 0.0 and gain > 0.0 and abs(turned / gain) <= 1.0 / rate):
        return None
    left_over = float(np.sqrt(((own - terms @ (gain, turned)) ** 2).mean())) / gain
    news = size / rate / NEWS_S
    sigma = max(left_over, noise) / np.sqrt((speed**2).mean() * news)
    lag = (around - best) / rate - turned / gain
    return float(lag), float(max(sigma, WITHIN / rate))


def _without_line(rows: Floats, line: Floats) -> Floats:
    centred = rows - rows.mean(axis=1, keepdims=True)
    slope = centred @ line / (line @ line)
    return np.asarray(centred - slope[:, None] * line)


def combined(found: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Return the weighted median of lags, its standard deviation, and how many weigh something.

    The deviation is the larger of what the noise makes and of how far the lags scatter. Of none the
    first two are NaN.

    Examples
    --------
    >>> combined([(0.1, 0.01), (0.1, 0.01), (0.1, 0.01), (0.9, 0.5)])[0]
    0.1
    """
    if not found:
        return np.nan, np.nan, 0.0
    value, sigma = np.array(sorted(found)).T
    weight = sigma**-2.0
    middle = value[np.searchsorted(np.cumsum(weight), 0.5 * weight.sum())]
    apart = np.abs(value - middle)
    order = np.argsort(apart)
    wide = apart[order][np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())]
    effective = weight.sum() ** 2 / (weight**2).sum()
    scatter = OF_MEDIAN * wide / np.sqrt(effective)
    return float(middle), float(max(scatter, weight.sum() ** -0.5)), float(effective)
