"""The bank over a window on a link says what it says over the whole log."""

import re
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from fdi.decision import load_policy
from fdi.errors import UsageError
from fdi.live.hearing import Hearing
from fdi.live.recorder import record
from fdi.live.session import Session
from fdi.live.watching import EDGE_S, Learned, Watching
from fdi.methods.columns import with_columns
from fdi.methods.table import methods_of
from fdi.residuals.latency import with_lags
from fdi.telemetry import read

from .playing import moments

REAL = Path(__file__).parents[3] / "shared" / "flights" / "sitl" / "copter"
UPTO_S = 75.0
"""Of the log: the receiver is off from 56 s on."""
LATEST_S = 2.5
"""Data that the newest samples need are still to come."""
REMEMBERS = ("over_60", "still", "bat_5")
"""Tests that look back for as long as the flight lasts, or for most of the window."""
OTHER_MOMENTS = 0.5
"""Deviations, of three that are a trigger: the columns of `heading` are taken once a cycle, whose
length is the usual one in what is looked at."""
EVERY_S = 3.0
"""A tick is taken to cost so much of a core that windows are this far apart, on any machine: how
much of the fault a window has seen, and with it how sure the first word is, hangs on that."""


@pytest.fixture(scope="module")
def gps_glitch() -> Path:
    path = REAL / "c20_gps_glitch_11m.tlog"
    if not path.exists():
        pytest.skip("needs the flights beside the repository")
    return path


def test_a_window_holds_the_residuals_of_the_whole_log(gps_glitch: Path, tmp_path: Path) -> None:
    """To 1e-9, with the bank, lags and grid that the flight's beginning told, but for two kinds."""
    windows, lines = [], []
    engine = Watching(
        sink=lambda t, values: windows.append((t, values)),
        share=1.0,
        clock=count(step=EVERY_S).__next__,
    )
    session = Session(record(tmp_path / "kept.tlog"), Hearing(), engine)
    for when, data in moments(gps_glitch, UPTO_S):
        lines += session.take(data, session.began[0] + when)
    session.recorder.close()
    assert engine.learned is not None
    t, whole, names = _whole(gps_glitch, engine.learned)
    rate = engine.learned.chain.signals.rate_hz
    remembers = np.array([any(word in name for word in REMEMBERS) for name in names])
    sampled = np.array(["heading." in name for name in names])
    exact = ~remembers & ~sampled
    assert exact.sum() > 0.75 * len(names)
    assert len(windows) >= 3
    for own, values in windows[:: max(len(windows) // 4, 1)]:
        inside = (own > own[0] + EDGE_S) & (own < min(own[-1], t[-1]) - LATEST_S)
        rows = np.rint((own[inside] - t[0]) * rate).astype(int)
        assert np.abs(own[inside] - t[rows]).max() < 1e-6
        here, there = values[:, inside], whole[:, rows]
        np.testing.assert_allclose(here[exact], there[exact], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(here[sampled], there[sampled], rtol=0, atol=OTHER_MOMENTS)
    accused = [line for line in lines if line.startswith("ACCUSED: ")]
    assert re.match(r"ACCUSED: GPS receiver, 9\d % sure, from ", accused[0])
    alarms = [line for line in lines if line.startswith("in alarm: ")]
    assert any("GPS receiver shows another" in line for line in alarms)
    assert not any(">" in line or "since boot, told" in line for line in alarms)


def _whole(path: Path, learned: Learned) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return times since boot, residuals and what every test compares, of the whole log."""
    chain, log = learned.chain, read(path)
    base = float(log.clock.boot_offset[-1])
    log, _ = with_columns(log, methods_of(chain.policy.methods))
    window = (float(chain.signals.t[0]) + learned.base - base, log.span[1])
    grid = replace(chain.policy.sampling, rate_hz=chain.signals.rate_hz, window=window)
    signals = log.signals(with_lags(chain.bank.system.channels, chain.lags), grid)
    signals = replace(signals, period=chain.signals.period, spacing=chain.signals.spacing)
    found = chain.bank.evaluate(signals, chain.policy.differentiation)
    return found.t + base, found.values, [chain.bank.describe(g) for g in chain.bank.generators]


def test_a_policy_that_ranks_a_whole_flight_is_refused() -> None:
    with pytest.raises(UsageError, match="takes its thresholds from a whole flight"):
        Watching(load_policy("paper"))
