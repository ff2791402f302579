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


def test_a_log_that_was_read_is_analysed_as_its_file():
    documents = [fdi.analyze(given).document() for given in (LOGS[0], fdi.read(LOGS[0]))]
    for document in documents:
        del document["timings_s"]
    assert documents[0] == documents[1]


def test_columns_of_ones_own_are_analysed(tmp_path):
    model = tmp_path / "two.yaml"
    field = "{variable: p, accuracy: 2 Pa}"
    model.write_text(
        "format: 1\nname: two\nvariables: {p: {unit: Pa}}\n"
        "components: {a: {group: sensor}, b: {group: sensor}}\n"
        f"measurements: {{A: {{component: a, fields: {{p: {field}}}}},\n"
        f"               B: {{component: b, fields: {{p: {field}}}}}}}\n"
    )
    t = np.arange(0.0, 60.0, 0.05)
    one, other = 1000 + np.random.default_rng(0).normal(0.0, 1.0, (2, t.size))
    columns = {"t": t, "A.p": one + np.where(t > 30, 50.0, 0.0), "B.p": other}
    found = fdi.analyze(fdi.log_from_columns(columns, {"A.p": "Pa", "B.p": "Pa"}), model=model)
    (finding,) = found.findings
    assert {finding.component, *finding.inseparable_from} == {"a", "b"}
    assert abs(finding.onset - 30.0) < 1.0


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
