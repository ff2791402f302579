"""Which tests are off at the beginning by what a vehicle's learned parameters make of them."""

import numpy as np
import pytest
from decision.build import RATE, flown, residuals

from fdi.residuals.departed import _tests

N = 200
AIR = {"flights": flown(0.0, N / RATE)}


@pytest.mark.parametrize(
    ("values", "side", "more", "off"),
    [
        (3.0, "", {}, 2.0),
        (-3.0, "", {}, 2.0),
        (-3.0, "above", {}, 2.0),
        (3.0, "above", {}, None),
        (3.0, "below", {}, 2.0),
        (0.9, "", {}, None),
        (3.0, "", {"unsure": 0.0}, None),
        (3.0, "", {"component": None}, None),
        (np.nan, "", {}, None),
    ],
)
def test_off_is_what_needs_a_parameter_and_is_beyond_its_tolerance(values, side, more, off):
    stated = {"component": "gps", "side": side, "tolerance": 1.0, "unsure": 0.25}
    found = list(_tests(residuals(np.full(N, values), **(stated | more), **AIR)))
    assert [one.value for one in found] == ([] if off is None else [off])
    for one in found:
        assert (one.component, one.test, one.std) == ("gps", "e0", 0.25)


def test_off_is_the_median_of_the_beginning_of_what_is_known():
    values = np.concatenate([np.full(40, 50.0), np.full(N - 40, 3.0)])
    values[20:90] = np.nan
    values[95:98] = 90.0
    (one,) = _tests(residuals(values, component="gps", tolerance=1.0, unsure=0.5, **AIR))
    assert one.value == 2.0
