"""What a sensor says of its own accuracy widens what it may stray, within bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.residuals import build_bank
from fdi.residuals.accuracy import (
    BEGINNING_S,
    MOST,
    WORSE,
    beginning_of,
    believed,
    reported_accuracies,
)
from fdi.telemetry import Channel

from .build import GLIDER, airframe
from .test_evaluate import run, truth

REPORTS = st.lists(st.floats(0.01, 300.0) | st.just(float("nan")), min_size=5, max_size=50)


@given(reports=REPORTS, stated=st.floats(0.1, 10.0))
def test_a_report_never_narrows_and_never_excuses_without_end(reports, stated):
    used = believed(np.array(reports), stated, slice(0, 3))
    assert (used >= stated).all()
    assert (used <= WORSE * MOST * stated).all()


@given(report=st.floats(1.0, 4.0))
def test_a_poor_receiver_is_believed_from_the_beginning_on(report):
    used = believed(np.full(20, report), 1.0, slice(0, 5))
    assert used == pytest.approx(report)


def test_a_sensor_that_grows_bad_is_excused_by_a_factor_only():
    """A receiver that is jammed reports 276 m, which would let it stray by a kilometre."""
    reports = np.array([0.6] * 10 + [276.0] * 10)
    used = believed(reports, 1.3, slice(0, 5))
    assert used[-1] == pytest.approx(WORSE * 1.3)


@pytest.mark.parametrize(
    ("beginning", "most"),
    [
        ([1.0, 2.0, 3.0], 2.0),
        ([0.1, 0.2, 9.0], 1.0),
        ([9.0, 9.0, 1.0], MOST),
        ([np.nan, 1.5, np.nan], 1.5),
        ([np.nan] * 3, 1.0),
    ],
)
def test_what_is_usual_is_the_median_of_the_beginning_within_bounds(beginning, most):
    """In units of what is stated; a report of later may be so many times worse."""
    used = believed(np.array([*beginning, 1e6, 0.5]), 1.0, slice(0, 3))
    assert used[-2:].tolist() == [WORSE * most, 1.0]


def test_the_beginning_is_that_of_the_time_in_the_air(tmp_path):
    signals = run(build_bank(airframe(tmp_path).observe(), "cross_checks"), truth(200)).signals
    state = replace(signals.state, airborne=np.arange(200) >= 30)
    own = beginning_of(replace(signals, state=state))
    assert (own.start, own.stop) == (30, 30 + round(BEGINNING_S * signals.rate_hz))


def test_without_a_report_the_stated_accuracy_counts():
    assert believed(np.full(5, np.nan), 0.7, slice(0, 2)).tolist() == [0.7] * 5


def test_a_report_widens_the_spread_of_every_residual_that_uses_the_channel(tmp_path):
    text = GLIDER.replace("accuracy: 0.3 m/s}", "accuracy: 0.3 m/s, reported: vel_acc}")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    plain = run(bank, truth(50))
    vel = Channel.parse("GPS_RAW_INT.vel")
    poor = replace(plain.signals, accuracy={vel: np.full(50, 0.6)})
    widened = bank.evaluate(poor, plain.recipe)
    holds = np.array(["GPS_RAW_INT.vel" in g.faults for g in bank.generators])
    known = np.isfinite(plain.values) & (plain.spread > 0)
    assert holds.any()
    for row in np.flatnonzero(known.any(axis=1)):
        wider = widened.spread[row][known[row]] > plain.spread[row][known[row]] + 1e-9
        assert wider.all() if holds[row] else not wider.any()
    assert reported_accuracies(bank.system, plain.signals) == ()
    silent = replace(plain.signals, accuracy={vel: np.full(50, np.nan)})
    assert reported_accuracies(bank.system, silent) == ()
    (one,) = reported_accuracies(bank.system, poor)
    assert (one.stated, one.reported, one.used, one.bounded) == (0.3, 0.6, 0.6, 0.0)
    briefly = replace(plain.signals, accuracy={vel: np.where(np.arange(50) == 30, 0.9, 0.6)})
    (one,) = reported_accuracies(bank.system, briefly)
    assert (one.reported, one.worst) == (0.6, 0.9)


def test_what_records_do_not_tell_adds_to_the_accuracy_without_bounds(tmp_path):
    """It is no sensor's own word about itself, and is not told among those."""
    old = "      climb: {variable: climb, accuracy: 0.4 m/s}\n"
    new = (
        '      "climb:over": {variable: climb, accuracy: 0.4 m/s, value: "integral(climb, 1)", '
        'reported: "sampled(climb, 1)"}\n'
    )
    text = GLIDER.replace(old, "inputs:\n  VFR_HUD:\n    fields:\n" + new)
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    columns = truth(50)
    columns["VFR_HUD.climb:over"] = columns.pop("VFR_HUD.climb")
    plain = run(bank, columns)
    climb = next(r.channel for r in bank.system.channels if r.over)
    rough = replace(plain.signals, accuracy={climb: np.full(50, 9.0)})
    widened = bank.evaluate(rough, plain.recipe)
    added = np.sqrt(np.maximum(widened.spread**2 - plain.spread**2, 0.0))
    known = np.isfinite(plain.values) & (added > 1e-6)
    assert known.any()
    assert added[known] == pytest.approx(9.0)
    assert not reported_accuracies(bank.system, rough)


def test_the_time_of_a_mean_is_as_unsure_as_that_of_its_message(tmp_path):
    """Against another message: a quarter of the period, on a quantity that grows."""
    old = "      vel: {variable: v_ground, accuracy: 0.3 m/s}\n"
    new = (
        '      "vel:over": {variable: v_ground, accuracy: 0.3 m/s, value: "integral(vel, 1)", '
        'reported: "sampled(vel, 1)"}\n'
    )
    assert old in GLIDER
    text = (
        GLIDER.replace(old, "") + "inputs:\n  GPS_RAW_INT:\n    component: gps\n    fields:\n" + new
    )
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    t = np.arange(50) / 5.0
    columns = truth(50) | {
        "LOCAL_POSITION_NED.vx": 9 + 0.6 * t,
        "LOCAL_POSITION_NED.vy": -12 - 0.8 * t,
        "GPS_RAW_INT.vel:over": 15 + t,
    }
    del columns["GPS_RAW_INT.vel"]
    plain = run(bank, columns)
    mean = next(r.channel for r in bank.system.channels if r.over)
    slow = replace(plain.signals, period={**plain.signals.period, mean: 2.0})
    added = np.sqrt(bank.evaluate(slow, plain.recipe).spread ** 2 - plain.spread**2)
    against = [row for row, own in enumerate(added) if np.nanmax(own) > 0]
    # of the speed, and of its two components by their shares of it
    expected = 0.25 * 2.0 * np.array([1.0, 0.8, 0.6])
    assert added[against][:, 25] == pytest.approx(expected, rel=1e-6)
