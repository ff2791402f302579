"""Intervals of shares, angles and ratios hold the truth as often as they claim."""

import numpy as np
import pytest

from fdi.methods.setup.interval import (
    Interval,
    by_parts,
    in_percent,
    of_explained,
    of_time,
    verdict_of,
)


def held(found: Interval, truth: float) -> bool:
    return found.least <= truth <= found.most


def test_a_mean_of_noise_lies_in_its_interval() -> None:
    rng = np.random.default_rng(1)
    drawn = [rng.normal(5.0, 2.0, 400) for _ in range(200)]
    found = [by_parts(lambda some, x=x: float(x[some].mean()), x.size) for x in drawn]
    assert np.mean([held(one, 5.0) for one in found]) > 0.97
    width = np.mean([one.most - one.least for one in found])
    assert width == pytest.approx(2 * 3 * 2.0 / 20, rel=0.1)


def test_a_fault_in_one_part_widens_the_interval() -> None:
    x = np.zeros(100)
    x[40:50] = 100.0
    found = by_parts(lambda some: float(x[some].mean()), x.size)
    assert found.least < 0 < found.value == 10.0


def test_nothing_seen_in_few_records_may_yet_happen() -> None:
    assert of_time(np.zeros(40, bool)).most > 0.1
    assert of_time(np.zeros(1000, bool)).most < 0.01


def test_what_happens_once_for_a_while_is_one_event() -> None:
    """Fifty records in a row tell less of how often than fifty here and there."""
    here_and_there = np.arange(500) % 10 == 0
    in_a_row = np.arange(500) < 50
    apart, together = of_time(here_and_there), of_time(in_a_row)
    assert apart.value == together.value == 0.1
    assert together.most > 2 * apart.most


@pytest.mark.parametrize("truth", [0.0, 0.2, 0.7])
def test_an_explained_share_lies_in_its_interval(truth: float) -> None:
    rng = np.random.default_rng(2)
    found = []
    for _ in range(200):
        x, noise = rng.normal(size=(2, 60))
        y = np.sqrt(truth) * x + np.sqrt(1 - truth) * noise
        found.append(of_explained(float(np.corrcoef(x, y)[0, 1] ** 2), 60.0))
    assert np.mean([held(one, truth) for one in found]) > 0.97


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        (Interval(1.0, 0.5, 1.9), "in order"),
        (Interval(1.0, 0.5, 2.1), "not known"),
        (Interval(4.0, 2.9, 6.0), "not known"),
        (Interval(4.0, 3.1, 6.0), "wrong"),
    ],
)
def test_a_verdict_needs_the_whole_interval_on_its_side(found: Interval, verdict: str) -> None:
    assert verdict_of(found, fine=2.0, bad=3.0) == verdict


def test_an_interval_is_told_where_it_shows() -> None:
    assert in_percent(Interval(0.689, 0.6, 0.77)) == "69 % (60 to 77 %)"
    assert in_percent(Interval(0.3, 0.301, 0.299)) == "30 %"
