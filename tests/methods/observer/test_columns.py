"""The observer's residuals as columns: shares of their thresholds, and motors by name."""

import numpy as np
import pytest

import fdi
from fdi.methods.columns import Columns
from fdi.methods.observer import observe
from fdi.methods.observer.columns import observer_columns
from fdi.methods.observer.states import RESIDUALS
from fdi.telemetry import read

from .build import write

ONSET, END = 30.0, 45.0


@pytest.fixture(scope="module")
def weak(tmp_path_factory):
    path = tmp_path_factory.mktemp("weak") / "weak.tlog"
    return read(write(path, weak=(2, 0.7, ONSET, END)))


def test_an_alarm_is_where_the_share_is_above_one(weak):
    made = observer_columns(weak)
    assert isinstance(made, Columns)
    seen = observe(weak)
    for alarm in seen.alarms:
        own = made.values[alarm.residual]
        assert np.nanmin(own[(made.t >= alarm.start) & (made.t <= alarm.end)]) > 1.0
    quiet = [name for name in RESIDUALS if name not in {a.residual for a in seen.alarms}]
    assert quiet
    assert max(np.nanquantile(made.values[name], 0.99) for name in quiet) < 1.0


def test_a_weak_motor_is_weak_while_it_is_named_and_no_other_is(weak):
    made = observer_columns(weak)
    (named,) = observe(weak).motors
    inside = (made.t >= named.start) & (made.t <= named.end)
    assert np.array_equal(made.values["motor_2"] == 1, inside)
    assert not any(np.nansum(made.values[f"motor_{k}"]) for k in (1, 3, 4))


def test_an_analysis_weighs_them_where_it_is_asked_to(weak):
    policy = fdi.load_policy("default").using(["observer"])
    chain = fdi.residuals_of(weak, "quadcopter", policy)
    alarms = policy.decide(chain.residuals)
    names = [chain.system.equations[g.residual].name for g in chain.bank.generators]
    assert alarms.alarm[names.index("motor_2_observed_weak")].any()
    assert not alarms.alarm[names.index("motor_1_observed_weak")].any()
