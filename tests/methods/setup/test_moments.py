"""What drives the rates costs no more, whatever a clock says."""

import time

import numpy as np
import pytest

from fdi.methods.setup.moments import intervals
from fdi.methods.setup.records import Series, Stretch

PART = (Stretch(0.0, 5.0),)


def spent(t):
    rates, inputs = (Series(t, np.ones((n, t.size))) for n in (3, 4))
    began = time.process_time()
    assert all(one.t.size for _, one in intervals(rates, inputs, PART))
    return time.process_time() - began


@pytest.mark.parametrize("apart_s", [1e-4, 1e-6, 1e-9])
def test_records_that_a_clock_sets_close_together_cost_what_others_do(apart_s):
    whole = np.linspace(0.0, 5.0, 5000)
    pairs = np.sort(np.concatenate([whole[::2], whole[::2] + apart_s]))
    triples = np.sort(np.concatenate([pairs, whole[::2] + 2 * apart_s]))
    assert np.median(np.diff(triples)) < 1.1 * apart_s
    assert spent(triples) < 10 * max(spent(whole), 0.1)


def test_stretch_without_any_record_says_nothing():
    t = np.linspace(0.0, 5.0, 500)
    rates, inputs = (Series(t, np.ones((n, t.size))) for n in (3, 4))
    beyond = (*PART, Stretch(5.0, 9.0))
    alone, both = (sum(1 for _ in intervals(rates, inputs, parts)) for parts in (PART, beyond))
    assert alone == both > 0
