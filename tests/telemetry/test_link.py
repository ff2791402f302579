"""For how long a telemetry log heard nothing, against the times at which it heard something."""

import numpy as np
import pytest
from flights import analysis_of, shared
from hypothesis import given
from hypothesis import strategies as st

import fdi
from fdi.telemetry.meaning import with_link

LONGEST = 60.0


def pause_of(span, gaps):
    message = with_link({}, span, gaps)["LINK"]
    return message.t, message.si("pause")


def test_the_pause_grows_until_something_comes():
    t, pause = pause_of((0.0, 20.0), [(4.25, 9.75)])
    for moment, expected in ((4.0, 0.0), (4.25, 0.0), (5.0, 0.75), (9.0, 4.75), (9.75, 0.0)):
        assert pause[t == moment].tolist() == [expected]
    assert t[-1] == 20.0
    assert not pause[t > 9.75].any()


@given(st.lists(st.floats(0, LONGEST).map(lambda t: round(t, 2)), max_size=8, unique=True))
def test_nowhere_is_it_longer_than_since_the_last_record(times):
    edges = sorted(times)[: len(times) // 2 * 2]
    gaps = list(zip(edges[::2], edges[1::2], strict=True))
    t, pause = pause_of((0.0, LONGEST), gaps)
    assert np.all(np.diff(t) > 0)
    for moment, value in zip(t, pause, strict=True):
        inside = [moment - a for a, b in gaps if a <= moment < b]
        assert value == pytest.approx(sum(inside))


@pytest.mark.parametrize("case", shared("sitl/copter/c88_telemetry_gap_12s.tlog"))
def test_a_link_that_is_silent_is_named_and_nothing_else(case):
    found = analysis_of(case.path).findings
    assert [finding.component for finding in found] == ["telemetry_link"]
    assert found[0].onset == pytest.approx(43.5, abs=0.3)
    assert found[0].end == pytest.approx(55.7, abs=0.3)


@pytest.mark.parametrize("case", shared("sitl/copter/c10_motor1_x0.7_20s.BIN"))
def test_a_recorder_on_board_has_no_link(case):
    assert "LINK" not in fdi.read(case.path)
