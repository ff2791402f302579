"""What a bank and its residuals say of themselves."""

from dataclasses import replace

import numpy as np
import pytest
from decision.build import RATE, residuals


def test_what_a_residual_may_stray_lasts_by_what_is_not_known_exactly():
    found = residuals(np.zeros(3), tolerance=0.5, unsure=0.0)
    assert found.lasting.tolist() == [[0.5] * 3]
    unsure = replace(found, unsure=np.array([[0.0, 1.0, np.nan]]))
    one, two, three = unsure.lasting[0]
    assert one == three == 0.5
    assert two > 1.0
    double = replace(found, unsure=np.array([[0.0, 2.0, 0.0]]))
    assert double.lasting[0, 1] - 0.5 == pytest.approx(2 * (two - 0.5))


def test_only_what_is_ambiguous_at_times_is_noted():
    found = residuals(np.zeros((2, 4)))
    assert found.notes() == ()
    found = replace(found, ambiguous=np.array([[False] * 4, [True, False, False, False]]))
    (note,) = found.notes()
    assert note.startswith("r2 (e1) is unknown for 25% of the time")


def test_residuals_are_a_frame_over_time():
    frame = residuals(np.arange(6.0).reshape(2, 3)).frame()
    assert frame.columns.tolist() == ["r1", "r2"]
    assert frame["r2"].tolist() == [3.0, 4.0, 5.0]
    assert frame.index.tolist() == [0.0, 1 / RATE, 2 / RATE]


def test_a_bank_and_residuals_say_how_many_they_are():
    found = residuals(np.zeros((2, 4)))
    assert repr(found) == "<Residuals 2 over 4 samples>"
    assert repr(found.bank) == (
        "<Bank by hand: 2 residual generators, 0 nodes, 0 sets not implementable>"
    )
