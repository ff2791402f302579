"""What is beyond a threshold, for how long, and what a calm part says of it."""

import numpy as np

from fdi.methods.observer.limits import LASTS_S, RESOLUTION, SIGMAS, alarms_of, learn
from fdi.methods.observer.states import RESIDUALS

T = np.arange(0, 40, 0.1)


def test_an_outlier_is_no_alarm_and_what_lasts_is_one():
    off, limit = np.zeros((13, T.size)), np.ones((13, T.size))
    off[3, 100] = 9.0
    off[6, 200:220] = -3.0
    (alarm,) = alarms_of(T, off, limit)
    assert (alarm.residual, alarm.start, alarm.end) == (RESIDUALS[6], T[200], T[219])
    assert (alarm.peak, alarm.threshold) == (-3.0, 1.0)


def test_unknown_is_no_alarm():
    off, limit = np.full((13, T.size), np.nan), np.ones((13, T.size))
    assert not alarms_of(T, off, limit)
    assert not alarms_of(T, np.full((13, T.size), 9.0), np.full((13, T.size), np.nan))


def test_an_alarm_is_longer_than_an_outlier_is_remembered():
    off, limit = np.zeros((13, T.size)), np.ones((13, T.size))
    off[0, 50 : 50 + round(LASTS_S / 0.1)] = 2.0  # one record short
    assert not alarms_of(T, off, limit)


def test_centre_and_noise_come_from_the_calm_part_alone():
    rng = np.random.default_rng(3)
    value = rng.normal(0, 0.1, (13, T.size)) + 2.0
    value[:, 200:] += 50.0
    limits = learn(T, value, T < 20)
    assert np.allclose(limits.centre[:11], 2.0, atol=0.05)
    # 95 % sure not to be too small: 20 s hold about 80 independent values
    assert (limits.deviation[:11] > 0.09).all()
    assert (limits.deviation[:11] < 0.15).all()


def test_silent_residuals_keep_the_least_deviation_and_a_threshold_above_zero():
    limits = learn(T, np.zeros((13, T.size)), T < 20)
    assert np.array_equal(limits.deviation, RESOLUTION)
    assert (limits.threshold(T, np.zeros((13, T.size))) >= SIGMAS * RESOLUTION[:, None]).all()
