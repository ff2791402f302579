"""Policies: what is shipped loads, what is wrong is told with its line."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from fdi import store
from fdi.decision import load_policy, policy
from fdi.decision.detectors import DETECTORS, PredictedSpread, Rank
from fdi.decision.policy import FOLDER, Calibration, policy_text, shipped_policies
from fdi.decision.recipes import Learned
from fdi.diagnosis.marking import MARKINGS
from fdi.errors import ModelError, UsageError
from fdi.model.system import Estimate
from fdi.model.yaml import read_document
from fdi.residuals import Differentiation
from fdi.telemetry import Sampling

RIGHT = (FOLDER / "default.yaml").read_text(encoding="utf-8")


def written(folder, text):
    path = folder / "own.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def line_of(text, start):
    return next(i for i, line in enumerate(text.splitlines(), 1) if line.strip().startswith(start))


def test_both_policies_are_shipped():
    assert shipped_policies() == ("default", "paper")


@pytest.mark.parametrize("name", ["default", "paper"])
def test_shipped_policy_loads_and_names_ways_that_exist(name):
    policy = load_policy(name)
    assert policy.name == name
    assert policy.decision.method in DETECTORS
    assert policy.marking in MARKINGS
    assert policy.sha256 == hashlib.sha256((FOLDER / f"{name}.yaml").read_bytes()).hexdigest()


def test_default_accuses_by_predicted_spread_and_paper_does_not_accuse():
    default, paper = load_policy("default"), load_policy("paper")
    assert (type(default.decision), default.accuse) == (PredictedSpread, True)
    assert (type(paper.decision), paper.accuse) == (Rank, False)
    assert paper.decision.quantile == 0.97


@pytest.mark.parametrize("name", shipped_policies())
def test_a_shipped_policy_comes_back_from_the_cache_as_it_was(name, tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path))
    parsed = []
    monkeypatch.setattr(policy, "read_document", lambda p: parsed.append(p) or read_document(p))
    first = load_policy(name)
    assert [path.stem for path in parsed] == [name]
    again = load_policy(name)
    assert again == first
    assert hash(again) == hash(first)
    assert len(parsed) == 1


@pytest.mark.parametrize("tree", [[], {}, None, "default", [1] * 10, [["default"]]])
def test_a_foreign_entry_of_the_cache_is_read_anew(tree, monkeypatch):
    expected = load_policy("default")
    monkeypatch.setattr(store, "fetch", lambda kind, key: tree)
    assert load_policy("default") == expected


def test_policy_of_a_file_is_read_like_a_shipped_one(tmp_path):
    own = load_policy(written(tmp_path, RIGHT.replace("sigmas: 5.0", "sigmas: 7.5")))
    assert own.decision.sigmas == 7.5
    assert own.sampling == load_policy("default").sampling


def test_what_a_file_leaves_out_is_what_the_value_has_by_itself(tmp_path):
    for name, recipe in (("default", PredictedSpread()), ("paper", Rank())):
        bare = (
            f"format: 1\nname: {name}\ntests: mtes\nsampling: {{}}\ndifferentiation: {{}}\n"
            f"decision: {{method: {recipe.method}}}\nmarking: majority\n"
        )
        found = load_policy(written(tmp_path, bare))
        assert found.decision == recipe
        assert (found.sampling, found.differentiation) == (Sampling(), Differentiation())
        assert (found.accuse, found.copies, found.methods) == (True, "dropped", ())
        assert found.description == ""
    assert Rank().quantile == 0.97  # as published


def test_thresholds_that_a_file_leaves_out_are_those_of_the_default():
    """But for what is not done without a number: a budget and the judgement of scatter."""
    default = load_policy("default").decision
    assert replace(default, scatter_most=None, budget_per_hour=None) == PredictedSpread()
    paper = load_policy("paper").decision
    assert paper == Rank()


def test_policies_can_be_told_apart_by_their_hash():
    default, paper = load_policy("default"), load_policy("paper")
    learned = {"a: gps": Learned(2.0)}
    taught = replace(
        default,
        decision=replace(default.decision, learned=learned),
        calibration=Calibration("m", "v", ("f",), 1.0, {"mass": Estimate(1.0, 0.1)}),
    )
    assert len({default, load_policy("default"), paper, taught}) == 3


@pytest.mark.parametrize(
    ("entry", "taken", "refused"),
    [
        ("sigmas", 0.1, 0),
        ("persistence_s", 0, -0.1),
        ("least_samples", 1, 0),
        ("least_factor", 1, 1.01),
        ("most_factor", 1, 0.99),
        ("reference_s", 0.1, 0),
        ("block_s", 0.1, 0),
        ("mean_s", 0.1, 0),
        ("mean_least", 0.1, 0),
        ("mean_most", 0.1, 0),
        ("mean_levels", 0.1, 0),
        ("scatter_most", 1.01, 1),
        ("scatter_most", 9.9, 10),
        ("budget_per_hour", 0.01, 0.009),
        ("budget_per_hour", 100, 101),
        ("least_scale", 0, -0.1),
        ("most_scale", 1, 0.99),
    ],
)
def test_a_figure_is_taken_up_to_its_bound_and_refused_beyond(tmp_path, entry, taken, refused):
    def with_figure(figure):
        kept = [line for line in RIGHT.splitlines() if not line.startswith(f"  {entry}:")]
        return "\n".join(kept).replace("decision:\n", f"decision:\n  {entry}: {figure}\n") + "\n"

    policy = load_policy(written(tmp_path, with_figure(taken)))
    assert getattr(policy.decision, entry) == taken
    with pytest.raises(ModelError, match=entry):
        load_policy(written(tmp_path, with_figure(refused)))


def test_wrong_policy_reports_every_problem_with_its_line(tmp_path):
    text = (
        RIGHT.replace("gap_factor: 3.0", "gap_factor: 0.5")
        .replace("sigmas: 5.0", "sigmas: -1")
        .replace("block_s:", "blocks_s:")
        .replace("marking: majority", "marking: minority")
    )
    with pytest.raises(ModelError) as caught:
        load_policy(written(tmp_path, text))
    told = {
        f"own.yaml:{line_of(text, key)}: {place}"
        for key, place in (
            ("gap_factor", "sampling.gap_factor"),
            ("sigmas", "decision.sigmas"),
            ("blocks_s", "decision.blocks_s"),
            ("marking", "marking"),
        )
    }
    assert {": ".join(problem.split(": ")[:2]) for problem in caught.value.problems} == told
    assert "(and 3 more)" in str(caught.value)


@pytest.mark.parametrize("entry", ["sigmas: 5.0", "persistence_s: 1.5", "mean_s: 10.0"])
def test_endless_figure_is_refused(tmp_path, entry):
    assert entry in RIGHT
    endless = RIGHT.replace(entry, entry.partition(":")[0] + ": .inf")
    with pytest.raises(ModelError, match="finite"):
        load_policy(written(tmp_path, endless))


def test_missing_entry_is_reported_by_name(tmp_path):
    text = RIGHT.replace("tests: mtes+cross_checks\n", "")
    with pytest.raises(ModelError, match=r"own\.yaml:1: tests: Field required"):
        load_policy(written(tmp_path, text))


def test_unknown_method_is_reported_with_the_known_ones(tmp_path):
    text = RIGHT.replace("method: predicted_spread", "method: guess")
    with pytest.raises(ModelError, match=r"'predicted_spread', 'rank'") as caught:
        load_policy(written(tmp_path, text))
    assert f"own.yaml:{line_of(text, 'decision:')}: decision" in str(caught.value)


def test_unknown_name_tells_the_shipped_ones():
    with pytest.raises(ModelError, match=r"^strict: is neither .* \(default, paper\)$"):
        load_policy("strict")


def test_folder_is_no_policy(tmp_path):
    with pytest.raises(ModelError, match="is not a file"):
        load_policy(tmp_path)


def test_resample_changes_window_and_rate_and_nothing_else():
    policy = load_policy("default")
    changed = policy.resample(window=(3.0, 9.0), rate_hz=2.0)
    assert (changed.sampling.window, changed.sampling.rate_hz) == ((3.0, 9.0), 2.0)
    assert policy.sampling.window is None
    assert (changed.decision, changed.sha256) == (policy.decision, policy.sha256)


def test_resample_keeps_what_is_not_given():
    policy = load_policy("default").resample(window=(3.0, 9.0), rate_hz=2.0)
    assert policy.resample() == policy
    assert policy.resample(rate_hz=1.0).sampling.window == (3.0, 9.0)
    assert policy.resample(window=(0.0, 1.0)).sampling.rate_hz == 2.0


def test_a_budget_asked_for_has_no_floor_of_the_policy():
    policy = load_policy("default")
    assert policy.budget_per_hour == 10.0
    asked = policy.within(3.0)
    assert asked.budget_per_hour == 3.0
    assert (policy.decision.least_scale, asked.decision.least_scale) == (1.0, 0.0)
    assert policy.within(None) == policy


def test_a_policy_without_a_budget_refuses_one():
    paper = load_policy("paper")
    assert paper.budget_per_hour is None
    with pytest.raises(UsageError, match=r"^the policy paper has no budget"):
        paper.within(1.0)


@pytest.mark.parametrize("figure", [0.0, -1.0, float("inf"), float("nan"), "10"])
def test_a_rate_and_a_budget_are_numbers_above_zero_that_end(figure):
    policy = load_policy("default")
    for ask in (policy.within, lambda rate: policy.resample(rate_hz=rate)):
        with pytest.raises(UsageError, match="no number above zero"):
            ask(figure)


TAUGHT = """calibration:
  model: quadcopter
  vehicle: quad
  flights: [a.bin]
  hours: 0.5
  parameters: {mass: {value: 1.5, std: 0.1, flights: 3}}
  tests: {"a: gps": {scale: 2.0, stray: 0.5, centre: [-1.0, 1.0]}, "b: gps": {}}
"""


def test_what_healthy_flights_taught_is_read(tmp_path):
    policy = load_policy(written(tmp_path, RIGHT + TAUGHT))
    assert policy.decision.learned == {
        "a: gps": Learned(2.0, 0.5, (-1.0, 1.0)),
        "b: gps": Learned(1.0, 0.0, (-np.inf, np.inf)),
    }
    assert policy.calibration == Calibration(
        "quadcopter", "quad", ("a.bin",), 0.5, {"mass": Estimate(1.5, 0.1, 3)}
    )
    path = tmp_path / "again.yaml"
    path.write_text(policy_text(policy), encoding="utf-8")
    again = load_policy(path)
    assert again.calibration == policy.calibration
    # a test of which nothing was learned is left out
    assert again.decision.learned == {"a: gps": policy.decision.learned["a: gps"]}
    assert replace(again.decision, learned={}) == load_policy("default").decision


@pytest.mark.parametrize(
    ("old", "taken", "refused"),
    [
        ("scale: 2.0", "scale: 100.0", "scale: 100.5"),
        ("scale: 2.0", "scale: 0.01", "scale: 0.0"),
        ("stray: 0.5", "stray: 0.0", "stray: -0.1"),
        ("centre: [-1.0, 1.0]", "centre: null", "centre: [-1.0]"),
        ("std: 0.1", "std: 0.01", "std: 0.0"),
        ("flights: 3", "flights: 1", "flights: 0"),
        ("hours: 0.5", "hours: 0.01", "hours: 0.0"),
    ],
)
def test_what_was_taught_is_taken_up_to_its_bounds_and_refused_beyond(
    tmp_path, old, taken, refused
):
    load_policy(written(tmp_path, RIGHT + TAUGHT.replace(old, taken)))
    with pytest.raises(ModelError, match=old.partition(":")[0]):
        load_policy(written(tmp_path, RIGHT + TAUGHT.replace(old, refused)))


def test_the_published_recipe_takes_no_calibration(tmp_path):
    paper = (FOLDER / "paper.yaml").read_text(encoding="utf-8")
    with pytest.raises(ModelError, match="only predicted_spread"):
        load_policy(written(tmp_path, paper + TAUGHT))


@pytest.mark.parametrize("window", [(1.0,), (1.0, 2.0, 3.0), (2.0, 1.0), ("1", "2"), (0.0, np.inf)])
def test_a_window_is_two_times_in_order(window):
    with pytest.raises(UsageError, match="two times"):
        load_policy("default").resample(window=window)
    assert load_policy("default").resample(window=(2.0, 2.0)).sampling.window == (2.0, 2.0)


def test_methods_are_asked_for_by_name():
    policy = load_policy("default")
    assert policy.using(None) is policy
    assert policy.using(["heading", "heading"]).methods == ("heading",)
    assert policy.using([]).methods == ()
    with pytest.raises(UsageError, match="no method compass"):
        policy.using(["compass"])


@pytest.mark.parametrize("asked", [0.5, 10.0])
def test_a_budget_that_is_asked_for_is_the_policys(asked):
    policy = load_policy("default")
    assert policy.within(None) is policy
    assert policy.within(asked).budget_per_hour == asked
    assert load_policy("paper").budget_per_hour is None
    assert (policy.use.mean_s, load_policy("paper").use.mean_s) == (10.0, 0.0)
