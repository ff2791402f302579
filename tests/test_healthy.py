"""Nobody is accused on the healthy flights of the repository: a fresh clone holds that alone."""

import json
from pathlib import Path

import pytest
from flights import ROOT, analysis_of

HEALTHY = ROOT / "examples" / "healthy_logs"
FLIGHTS = json.loads((HEALTHY / "labels.json").read_text("utf-8"))["flights"]


def test_every_healthy_log_is_labelled_and_labelled_healthy():
    assert {path.name for path in HEALTHY.glob("*.tlog")} == set(FLIGHTS)
    assert not any(label["faults"] for label in FLIGHTS.values())
    assert len(FLIGHTS) >= 3


@pytest.mark.parametrize("name", FLIGHTS)
def test_nobody_is_accused_on_a_healthy_flight(name):
    found = analysis_of(HEALTHY / name)
    assert [finding.component for finding in found.findings] == []
    assert not any(ending.end.is_bad for ending in found.diagnosis.endings)
    whole = all(ending.end.how == "landed" for ending in found.diagnosis.endings)
    assert found.diagnosis.outlook == ("healthy" if whole else "untested")


@pytest.mark.parametrize("name", FLIGHTS)
def test_an_example_is_small(name):
    assert Path(HEALTHY / name).stat().st_size < 300_000
