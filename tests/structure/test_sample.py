"""A sample of minimal sets is fair: every set of the model is as probable as any other."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from fdi.errors import UsageError
from fdi.structure import Model, load_reference, mso_sets, mtes_sets, sample, sample_sets

from .models import SHARED, models, needs_shared, tried

LISTED = {"mso": mso_sets, "mtes": mtes_sets}
KINDS = pytest.mark.parametrize("kind", LISTED)


def dense(equations, unknowns, faults=10):
    """A model with redundancy to spare, drawn from a fixed seed."""
    rng = np.random.default_rng(20)
    where = {f"f{i}": int(e) for i, e in enumerate(rng.permutation(equations)[:faults])}
    return Model.from_matrix(rng.random((equations, unknowns)) < 0.3, faults=where)


@given(models(max_equations=9, max_unknowns=4), st.sampled_from(sorted(LISTED)))
@tried(100)
def test_a_large_sample_of_a_small_model_holds_all_sets_and_no_others(model, kind):
    every = set(LISTED[kind](model))
    drawn = sample_sets(model, 60 * len(every), kind=kind)
    assert set(drawn.sets) == every
    assert drawn.bound >= len(every)


@KINDS
def test_every_set_is_drawn_as_often_as_any_other(kind):
    """Also while the bounds are corrected: the first draws of many samples."""
    model = dense(14, 9)
    every = list(LISTED[kind](model))
    assert len(every) > 50
    drawn = [
        one for seed in range(300) for one in sample_sets(model, 20, kind=kind, seed=seed).sets
    ]
    counts = Counter(drawn)
    assert stats.chisquare([counts[one] for one in every]).pvalue > 1e-3


@KINDS
def test_bounds_that_are_not_kept_do_no_harm(kind, monkeypatch):
    monkeypatch.setattr(sample, "MAX_KEPT", 2)
    model = dense(14, 9)
    every = list(LISTED[kind](model))
    drawn = [
        one for seed in range(30) for one in sample_sets(model, 200, kind=kind, seed=seed).sets
    ]
    counts = Counter(drawn)
    assert stats.chisquare([counts[one] for one in every]).pvalue > 1e-3


@KINDS
def test_the_number_of_sets_is_estimated_without_bias(kind):
    model = dense(16, 9)
    every = len(list(LISTED[kind](model)))
    estimates = [sample_sets(model, 40, kind=kind, seed=seed).estimate for seed in range(40)]
    error = np.std(estimates) / np.sqrt(len(estimates))
    assert abs(np.mean(estimates) - every) < max(4 * error, 0.01 * every)


@needs_shared
@pytest.mark.parametrize(
    ("name", "kind"), [("uav_fravolini", "mso"), ("fuel_cell_sensors", "mso"), ("vep4", "mtes")]
)
def test_sets_of_a_reference_model_are_among_those_of_its_reference(name, kind):
    model = load_reference(SHARED / "structural" / "models" / f"{name}.json")
    every = set(LISTED[kind](model))
    drawn = sample_sets(model, 300, kind=kind)
    assert every.issuperset(drawn.sets)
    assert drawn.estimate == pytest.approx(len(every), rel=0.25)


@needs_shared
def test_a_model_that_no_enumeration_ends_on_has_a_sample():
    model = load_reference(SHARED / "structural" / "models" / "fixed_wing_uav_f.json")
    drawn = sample_sets(model, 100, kind="mtes")
    assert len(set(drawn.sets)) > 95
    assert 50_000 < drawn.estimate < drawn.bound


def test_the_seed_decides():
    model = dense(14, 9)
    first, again, other = (sample_sets(model, 20, seed=seed) for seed in (1, 1, 2))
    assert first == again
    assert first.sets != other.sets


def test_a_model_without_redundancy_has_an_empty_sample():
    assert sample_sets(Model.from_matrix([[1]]), 5).sets == ()
    assert sample_sets(Model.from_matrix([[1], [1]]), 5, kind="mtes").sets == ()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: sample_sets(m, -1), "-1 sets"),
        (lambda m: sample_sets(m, 5, max_draws=4), "5 sets cannot be drawn with 4 draws"),
        (lambda m: sample_sets(m, 1, kind="all"), "no kind 'all'"),
        (lambda m: sample_sets(m, 25, max_draws=25), "of 25 draws led to a set, 25 are wanted"),
        (lambda m: list(mso_sets(m, limit=3)), "draw some with sample_sets"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(call, message):
    with pytest.raises(UsageError) as caught:
        call(dense(14, 9))
    assert message in str(caught.value)
