"""For how long a telemetry log heard nothing, against the times at which it heard something."""

import numpy as np
import pytest
from flights import analysis_of, shared
from hypothesis import given
from hypothesis import strategies as st

import fdi
from fdi.telemetry.meaning import link_of, with_link
from fdi.telemetry.message import Message


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


@pytest.mark.parametrize("case", shared("sitl/copter/c10_motor1_x0.7_20s.BIN"))
def test_a_recorder_on_board_has_no_link(case):
    assert "LINK" not in fdi.read(case.path)
