"""Residual columns by hand, without a model: what the decide stage is given."""

import numpy as np

from fdi.decision import load_policy
from fdi.decision.bounds import Bounds, Told
from fdi.model.expression import Number, Symbol
from fdi.model.parts import Kind
from fdi.model.system import System, SystemEquation
from fdi.residuals import Bank, Differentiation, Generator, Residuals
from fdi.telemetry import Flight, Signals
from fdi.telemetry.events import flight_state

RATE = 4.0
DEFAULT, PAPER = load_policy("default"), load_policy("paper")


def signals(n, *, flights=(), rate=RATE):
    """A grid of ``n`` samples from 0 on, without columns."""
    t = np.arange(n) / rate
    return Signals(t, {}, {}, flight_state(t, (), flights), rate, (), flights, {}, "by hand")


def bank_of(count, *, kind=Kind.RELATION, **stated):
    """A bank of ``count`` residuals, each of an equation of its own."""
    equations = tuple(
        SystemEquation(f"e{i}", kind, Symbol("x"), Number(0.0), {}, **stated) for i in range(count)
    )
    system = System("by hand", "", equations, (), (), (), {}, {}, {})
    generators = tuple(Generator(f"r{i + 1}", (i,), (), i, i, (), True) for i in range(count))
    return Bank(system, (), generators, ())


def residuals(
    values,
    *,
    spread=1.0,
    allowance=0.0,
    swing=0.0,
    swung=None,
    unsure=0.0,
    tolerance=0.0,
    delay=0.0,
    flights=(),
    rate=RATE,
    **bank,
):
    """Residuals of given values, (n,) or (r, n); what else is stated holds at every sample."""
    values = np.atleast_2d(np.asarray(values, dtype=float)).copy()
    count, size = values.shape
    return Residuals(
        bank_of(count, **bank),
        values,
        np.broadcast_to(np.float64(spread), values.shape).copy(),
        np.broadcast_to(np.float64(allowance), values.shape).copy(),
        np.broadcast_to(np.float64(swing), values.shape).copy(),
        np.broadcast_to(np.float64(unsure), values.shape).copy(),
        np.full(count, float(tolerance)),
        np.full(count, float(delay)),
        np.full((count, 0), np.nan),
        signals(size, flights=flights, rate=rate),
        Differentiation(),
        swung=None if swung is None else np.broadcast_to(np.float64(swung), values.shape).copy(),
    )


def flown(start, end):
    """One flight in the air from ``start`` to ``end``, s."""
    return (Flight(start, end, takeoff=start, landing=end),)


def told_by_hand(**more):
    """What a beginning told of one residual; nothing special unless it is said."""
    one, off = np.ones(1), np.zeros(1, bool)
    plain = {"centre": np.zeros(1), "circular": off, "side": np.zeros(1, np.int8), "stated": off}
    plain |= {"unfit": off, "level": np.full(1, np.nan), "stray": np.zeros(1)}
    plain |= {"factor": 5.0 * one, "calm": one, "quieter": one, "mean_most": one}
    return Told(**(plain | more))


def bounds_by_hand(told, n, *, tolerance=0.0, noise=1.0, spread=1.0, mean=np.nan, settled=True):
    """Bounds of one residual of ``n`` samples, the same all along."""
    parts = (np.full((1, n), float(one)) for one in (tolerance, noise, spread))
    means = (np.full((1, n), float(one)) for one in (spread, mean))
    return Bounds(told, *parts, np.full(n, settled), *means)
