"""For how long a telemetry log heard nothing, against the times at which it heard something."""

from pathlib import Path

import numpy as np
import pytest
from flights import analysis_of, shared
from hypothesis import given
from hypothesis import strategies as st

import fdi
from fdi import analyze
from fdi.telemetry.meaning import link_of, with_link
from fdi.telemetry.message import Message

from .fuzz.heads import telemetry_records

EXAMPLES = Path(__file__).parents[2] / "examples"


def message(name, times):
    t = np.array(times, float)
    return Message(name, None, t, t, np.arange(t.size), {})


def pause_of(*messages):
    link = link_of(messages)
    return link.t, link.si("pause")


def test_the_pause_grows_until_something_comes():
    t, pause = pause_of(
        message("HEARTBEAT", [0, 1, 2, 3, 4, 11]), message("ATTITUDE", [0.5, 4.25, 9.75])
    )
    expected = {4.0: 0.0, 4.25: 0.0, 9.75: 0.0, 11.0: 0.0}
    assert {moment: pause[t == moment].item() for moment in expected} == expected
    inside = (t > 4.25) & (t < 9.75)
    np.testing.assert_allclose(pause[inside], t[inside] - 4.25)
    assert pause.max() == pytest.approx(5.5)
    assert np.diff(t[inside]).max() < 1.3


def test_one_message_that_comes_is_enough():
    _, pause = pause_of(message("ATTITUDE", [0, 1, 20]), message("HEARTBEAT", range(21)))
    assert not pause.any()


@given(st.lists(st.floats(0, 1e9), min_size=1, max_size=40, unique=True))
def test_however_far_apart_records_are_the_pause_is_bounded_and_few_values_tell_it(times):
    t, pause = pause_of(message("HEARTBEAT", sorted(times)))
    assert np.all(np.diff(t) > 0)
    assert t[-1] == max(times)
    assert 0 <= pause.min() <= pause.max() <= np.ptp(times)
    assert t.size <= 1002 * len(times)


def test_without_heartbeats_nothing_is_said_of_a_link():
    other = {"ATTITUDE": message("ATTITUDE", [0, 1, 2])}
    assert with_link(other) == other


@pytest.mark.parametrize("case", shared("sitl/copter/c88_telemetry_gap_12s.tlog"))
def test_a_link_that_is_silent_is_named_and_nothing_else(case):
    found = analysis_of(case.path).findings
    assert [finding.component for finding in found] == ["telemetry_link"]
    assert found[0].onset == pytest.approx(43.5, abs=0.3)
    assert found[0].end == pytest.approx(55.7, abs=0.3)


def cut(name, share, tmp_path):
    """Return an example from whose records this share is left out behind the half."""
    records = list(telemetry_records((EXAMPLES / f"{name}.tlog").read_bytes()))
    half, on = len(records) // 2, int((0.5 + share) * len(records))
    path = tmp_path / "cut.tlog"
    path.write_bytes(b"".join([*records[:half], *records[on:]]))
    return path


def test_a_gap_cut_into_a_healthy_flight_is_told_as_one_of_the_recording(tmp_path):
    analysis = analyze(cut("healthy_logs/copter_gusts", 0.2, tmp_path))
    assert [finding.component for finding in analysis.findings] == ["telemetry_link"]
    said = "Telemetry link left a gap in the recording (99 % sure), 32.3 s into flight"
    assert analysis.verdict.startswith(said)
    assert "failed" not in analysis.verdict


def test_a_gap_is_no_earlier_failure_of_the_vehicle_and_explains_no_impact(tmp_path):
    analysis = analyze(cut("crash_logs/copter_motor_failure_crash", 0.25, tmp_path))
    assert {finding.component for finding in analysis.findings} >= {"motor_1", "telemetry_link"}
    assert "Motor 1 (front right) failed first (99 % sure)" in analysis.verdict


@pytest.mark.parametrize("case", shared("sitl/copter/c10_motor1_x0.7_20s.BIN"))
def test_a_recorder_on_board_has_no_link(case):
    assert "LINK" not in fdi.read(case.path)
