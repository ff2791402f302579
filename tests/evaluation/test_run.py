import pytest

from fdi.decision import load_policy
from fdi.evaluation import evaluate, load_labels
from fdi.model import load_airframe, shipped_models
from fdi.residuals import build_bank
from tests.flights import EXAMPLES

pytestmark = pytest.mark.flights


@pytest.mark.parametrize("name", shipped_models())
def test_no_test_reads_a_command_that_is_left_out(name):
    airframe = load_airframe(name)
    bank = build_bank(airframe.observe(commands=False))
    assert not any(e.command for e in bank.system.equations)
    with_them = build_bank(airframe.observe())
    named = {frozenset(g.equations) for g in bank.generators}
    lost = [
        g
        for g in with_them.generators
        if any(with_them.system.equations[i].command for i in g.equations)
    ]
    assert len(named) == len(with_them.generators) - len(lost)


def test_shipped_policies_use_recorded_commands():
    assert load_policy("default").commands == "used"
    assert load_policy("paper").commands == "used"


def test_every_flight_is_scored_a_second_time_without_commands(tmp_path):
    every = load_labels(EXAMPLES / "labels.json")
    chosen = next(label for label in every if "motor" in label.key)
    once = evaluate([chosen]).scores[0]
    twice = evaluate([chosen], bare=True).scores[0]
    assert once.bare is None
    assert twice.bare is not None
    assert twice.accused == once.accused
    assert twice.bare.label == chosen
