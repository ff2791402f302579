"""One chain: who scripts it gets the answer of ``fdi.analyze``."""

from dataclasses import replace

import numpy as np
import pytest
from flights import EXAMPLES, SHARED

import fdi
from fdi.errors import ModelError

pytestmark = pytest.mark.flights

LOGS = [
    EXAMPLES / "copter_motor_failure_crash.tlog",
    SHARED / "crash" / "motor2_lost.bin",
    SHARED / "alfa" / "engine_failure.tlog",
]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_the_chain_by_hand_gives_the_answer_of_analyze(path):
    if not path.is_file():
        pytest.skip("needs ../shared")
    whole = fdi.analyze(path)
    chain = fdi.residuals_of(fdi.read(path))
    alarms = chain.policy.decide(chain.residuals)
    diagnosis = fdi.diagnose(alarms, chain.bank)
    assert np.array_equal(chain.residuals.values, whole.residual_values.values, equal_nan=True)
    assert np.array_equal(alarms.threshold, whole.alarms.threshold, equal_nan=True)
    without_advice = tuple(replace(finding, advice=()) for finding in whole.findings)
    assert diagnosis.findings == without_advice
    assert diagnosis.verdict == whole.verdict


def test_a_policy_that_was_loaded_counts_as_it_is():
    path = LOGS[0]
    policy = fdi.load_policy("default").resample(rate_hz=2.0)
    assert fdi.residuals_of(fdi.read(path), policy=policy).signals.rate_hz == 2.0


def test_a_model_without_a_test_is_refused(tmp_path):
    model = tmp_path / "empty.yaml"
    model.write_text(
        "format: 1\nname: empty\ndescription: nothing\nvariables: {x: {unit: m}}\n"
        "measurements: {VFR_HUD: {component: gps, group: sensor, fields: {alt: {variable: x}}}}\n"
        "components: {gps: {group: sensor}}\n"
    )
    with pytest.raises(ModelError, match="no residual generator"):
        fdi.residuals_of(fdi.read(LOGS[0]), model)
