"""A fault put into the data moves the residuals as it would have moved them in flight."""

import numpy as np
import pytest

from fdi.model.evaluate import wrap
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.respond import respond, stretch

from .build import airframe
from .test_evaluate import ACCURACY, RATE, signals, truth

SIZE = 40


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    return build_bank(airframe(tmp_path_factory.mktemp("m")).observe(), "mtes+cross_checks")


def run(bank, columns):
    return bank.evaluate(signals(bank.system, columns), Differentiation())


def equation_of(bank, channel):
    """The number of the measurement equation of a channel."""
    (found,) = [
        i
        for i, e in enumerate(bank.system.equations)
        if e.measurement is not None and str(e.measurement.channel) == channel
    ]
    return found


@pytest.fixture(scope="module")
def healthy(bank):
    return run(bank, truth(SIZE))


@pytest.mark.parametrize(
    ("channel", "sigmas", "first", "grows"),
    [
        ("LOCAL_POSITION_NED.vx", 2.0, 20, False),
        ("GPS_RAW_INT.vel", -3.0, 10, True),
        ("GPS_RAW_INT.cog", 40.0, 0, False),
        ("VFR_HUD.alt", 5.0, 30, False),
        ("VFR_HUD.alt", -2.0, 25, True),
        ("VFR_HUD.climb", 1.0, 39, False),
    ],
)
def test_response_is_the_difference_that_changed_data_make(
    bank, healthy, channel, sigmas, first, grows
):
    added = np.where(np.arange(SIZE) >= first, sigmas * ACCURACY[channel], 0.0)
    added = added * (np.arange(SIZE) - first) / RATE if grows else added
    columns = truth(SIZE)
    changed = run(bank, {**columns, channel: columns[channel] + added})
    off = changed.values - healthy.values
    circular = [bank.system.equations[g.residual].circular for g in bank.generators]
    off[circular] = wrap(off[circular])
    got = respond(stretch(healthy, slice(0, SIZE)), {equation_of(bank, channel): added})
    known = np.isfinite(off)
    assert known.mean() > 0.8
    # loops are iterated to a tolerance for all samples together
    np.testing.assert_allclose(got[known], off[known], atol=1e-6)


def test_fault_moves_only_the_residuals_that_hold_it(bank, healthy):
    piece = stretch(healthy, slice(0, SIZE))
    change = respond(piece, {equation_of(bank, "GPS_RAW_INT.vel"): np.ones(SIZE)})
    holds = np.array(["GPS_RAW_INT.vel" in g.faults for g in bank.generators])
    assert not holds.all()
    assert np.array_equal((np.nan_to_num(change) != 0).any(axis=1), holds)


def test_bias_shows_in_a_derivative_for_a_window_and_a_drift_lasts(bank, healthy):
    piece, alt = stretch(healthy, slice(0, SIZE)), equation_of(bank, "VFR_HUD.alt")
    (row,) = [i for i, g in enumerate(bank.generators) if "VFR_HUD.climb" in g.faults]
    grown = np.maximum(np.arange(SIZE) - 20, 0) / RATE
    bias = respond(piece, {alt: 5.0 * (grown > 0)})[row]
    drift = respond(piece, {alt: 0.5 * grown})[row]
    assert np.abs(bias[18:23]).max() > 1
    assert np.nanmax(np.abs(bias[26:])) < 1e-9
    np.testing.assert_allclose(np.abs(drift[26:-4]), 0.5)


def test_stretch_of_a_flight_answers_as_the_whole_flight_does(bank, healthy):
    added = np.where(np.arange(SIZE) >= 20, 2.0, 0.0)
    vel = equation_of(bank, "GPS_RAW_INT.vel")
    whole = respond(stretch(healthy, slice(0, SIZE)), {vel: added})
    piece = stretch(healthy, slice(10, 30))
    np.testing.assert_allclose(respond(piece, {vel: added[10:30]}), whole[:, 10:30])
    assert piece.t[0] == 10 / RATE


def test_unknown_stays_unknown(bank):
    columns = truth(SIZE)
    columns["GPS_RAW_INT.vel"][10:20] = np.nan
    piece = stretch(run(bank, columns), slice(0, SIZE))
    change = respond(piece, {equation_of(bank, "GPS_RAW_INT.vel"): np.ones(SIZE)})
    holds = np.array(["GPS_RAW_INT.vel" in g.faults for g in bank.generators])
    assert np.isnan(change[holds][:, 10:20]).all()
    (other,) = [i for i, g in enumerate(bank.generators) if "VFR_HUD.climb" in g.faults]
    assert np.array_equal(change[other], np.zeros(SIZE))
