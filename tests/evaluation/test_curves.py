"""Detection against size: what is put in shows when it is large, and counts where it is new."""

import json
from pathlib import Path

import pytest
from flights import EXAMPLES

from fdi.cli import main
from fdi.errors import UsageError
from fdi.evaluation.curves import (
    Curve,
    InjectedJob,
    Point,
    analyze_injected,
    curves,
    curves_text,
    smallest,
)
from fdi.evaluation.injected_fault import parse_fault
from fdi.evaluation.labels import Fault, Label
from fdi.evaluation.totals import Rate

pytestmark = pytest.mark.flights

LOG = EXAMPLES / "copter_gps_loss_landing.tlog"
HEALTHY_UNTIL = 40.0  # s; its own fault begins at 41.5


def label(*faults):
    return Label("a", LOG, "quad", "simulated", "diagnosis", faults, frozenset(), HEALTHY_UNTIL)


def curve(*shares):
    points = [Point(2.0**k, Rate(hits, 2), Rate(0, 2)) for k, hits in enumerate(shares)]
    return Curve("a", "GPS_RAW_INT.alt", "gps", "m", 1.0, tuple(points))


def test_a_large_bias_is_detected_and_a_small_one_is_not():
    """Not at every moment: what begins soon after take-off may be taken for a constant offset."""
    (found,) = curves([label()], moments=6, channels=["GPS_RAW_INT.vel"], steps=(0.01, 128.0))
    small, large = found.points
    assert found.component == "gps"
    assert small.detected.of == large.detected.of == 6
    assert small.detected.hits == 0
    assert large.detected.hits == large.named.hits > 0


def test_a_log_with_a_fault_is_a_row_like_any_other():
    fault = parse_fault("NO_SUCH.alt:bias=1@20")
    row = analyze_injected(InjectedJob(str(LOG), fault=fault))
    assert row["error_kind"] == "UsageError"
    assert row["path"] == str(LOG)


def test_only_healthy_flights_are_taken():
    with pytest.raises(UsageError, match="no flight is healthy"):
        curves([label(Fault("gps", "step", 3.0))])


def test_the_smallest_size_is_that_from_which_all_are_detected():
    assert smallest(curve(0, 1, 2, 2), lambda p: p.detected) == 4.0
    assert smallest(curve(2, 1, 2, 2), lambda p: p.detected) == 4.0
    assert smallest(curve(0, 1, 2, 1), lambda p: p.detected) is None
    assert smallest(curve(0, 1, 2, 2), lambda p: p.detected, 0.5) == 2.0
    told = curves_text([curve(0, 1, 2, 2)], "bias")
    assert "| 1 m | from 2 m | from 4 m | not up to 8 m | not up to 8 m |" in told


def test_the_command_gives_the_same_as_plain_values(tmp_path, capsys):
    path = Path(tmp_path) / "labels.json"
    entry = {
        "vehicle": "quad", "origin": "simulated", "source": "", "use": "diagnosis", "what": "",
        "faults": [], "accept": [], "evaluate_until": HEALTHY_UNTIL,
    }  # fmt: skip
    path.write_text(json.dumps({"flights": {str(LOG): entry}}))
    words = ["--inject", "--moments", "1", "--channel", "GPS_RAW_INT.alt", "--kind", "noise"]
    assert main(["evaluate", str(path), *words, "--json", "--workers", "1"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["curves"]
    assert found["channel"] == "GPS_RAW_INT.alt"
    assert [point["of"] for point in found["points"]] == [1] * 7
