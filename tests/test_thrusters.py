"""The boat with four thrusters in examples/: nobody is accused of health, a dead one is named."""

import re
import subprocess
import sys
from math import exp, log
from pathlib import Path

import pytest

from fdi import analyze
from fdi.diagnosis.likelihood import load_fitted

pytestmark = pytest.mark.flights

ROOT = Path(__file__).resolve().parents[1]
BOAT = ROOT / "examples" / "thrusters"


@pytest.fixture(scope="module")
def accused(tmp_path_factory):
    def of(*options):
        table = tmp_path_factory.mktemp("boat") / "boat.csv"
        subprocess.run([sys.executable, BOAT / "drive.py", table, *options], check=True)
        return [
            (one.component, one.onset)
            for one in analyze(table, model=BOAT / "thrusters.yaml").findings
        ]

    return of


@pytest.mark.parametrize("seed", ["1", "2", "3"])
def test_a_healthy_boat_accuses_nobody(accused, seed):
    assert accused("--seed", seed) == []


@pytest.mark.parametrize("thruster", ["1", "2", "3", "4"])
def test_a_thruster_that_dies_is_named_when_it_does(accused, thruster):
    ((component, onset),) = accused("--dead", thruster)
    assert component == f"thruster_{thruster}"
    assert 60.0 <= onset < 66.0  # it is asked for nothing now and then


def test_the_table_of_how_many_tests_an_accusation_needs_is_that_of_the_weights():
    page = (ROOT / "docs" / "models.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([123]) \| (\d+) % \| (\d+) % \| (\d+) % \| (\d+) % \|$", page, re.M)
    assert len(rows) == 3
    weight = load_fitted().weights
    for count, *shares in rows:
        for ratio, share in zip((1.2, 1.5, 2.0, 3.0), shares, strict=True):
            evidence = log(ratio)
            all_of_it = int(count) * evidence
            odds = exp(
                weight["one"]
                + weight["tests"] * log(1 + int(count))
                + weight["alone"] * evidence
                + weight["fit"] * all_of_it / (1 + all_of_it)
            )
            assert min(round(100 * odds / (1 + odds)), 99) == int(share)
