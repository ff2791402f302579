"""Whether two that fit with the same attitude decide that a third is wrong by itself."""

import pytest

from fdi.methods.setup.compass import ATTITUDE
from fdi.methods.setup.values import Check
from fdi.methods.setup.witnesses import decided

AWAY = Check(
    "compass 3",
    "not known",
    "readings are 31 degrees off",
    {"miss_as_set_deg_most": 33.0},
    strikes=True,
    rests_on=ATTITUDE,
)
RECEIVER = Check("heading", "in order", "the vehicle accelerates where it leans")


def compass(number: int, most: float) -> Check:
    return Check(f"compass {number}", "not known", "", {"miss_as_set_deg_most": most})


@pytest.mark.parametrize(
    ("others", "verdict"),
    [
        ((), "not known"),
        ((compass(1, 10.0),), "not known"),
        ((RECEIVER,), "not known"),
        ((compass(1, 10.0), RECEIVER), "wrong"),
        ((compass(1, 10.0), compass(2, 22.0)), "wrong"),
        ((compass(1, 10.0), compass(2, 23.0)), "not known"),
        ((compass(1, 10.0), Check("heading", "not known", "")), "not known"),
    ],
)
def test_a_compass_is_wrong_by_itself_where_two_others_fit(others, verdict):
    *same, one = decided((*others, AWAY))
    assert tuple(same) == others
    assert one.verdict == verdict
    assert one.strikes == (verdict == "not known")
    assert ("the attitude may be wrong" in one.text) == (verdict == "not known")


def test_one_that_may_yet_fit_is_not_wrong():
    unsure = Check("compass 3", "not known", "24 degrees off", rests_on=ATTITUDE)
    *_, one = decided((compass(1, 10.0), compass(2, 10.0), unsure))
    assert one == unsure


TURNED_BY_ITS_FIT = Check(
    "compass 3", "wrong", "it is turned", {"miss_as_set_deg_most": 93.0}, rests_on=ATTITUDE
)


@pytest.mark.parametrize(
    ("others", "verdict"),
    [
        ((), "wrong"),  # no other compass that could have turned the heading
        ((compass(1, 40.0), compass(2, 40.0)), "wrong"),
        ((compass(1, 10.0),), "not known"),
        ((compass(1, 10.0), Check("heading", "wrong", "91 degrees off")), "not known"),
        ((compass(1, 10.0), compass(2, 10.0)), "wrong"),
        ((compass(1, 10.0), RECEIVER), "wrong"),
    ],
)
def test_one_turned_about_the_vertical_is_wrong_unless_the_heading_may_follow_another(
    others, verdict
):
    *_, one = decided((*others, TURNED_BY_ITS_FIT))
    assert one.verdict == verdict
    assert one.strikes == (verdict == "not known")


def agreement(number: int, apart: float) -> Check:
    numbers = {"apart_deg": apart, "apart_deg_most": apart + 1.0}
    return Check(f"agreement of compass {number}", "in order", "", numbers)


TURNED = Check("compass 3", "wrong", "it is turned by 50 degrees", {"turned_deg": 50.0})
FITS = Check("compass 2", "in order", "4 degrees off", {"miss_as_set_deg": 4.0})


@pytest.mark.parametrize(
    ("apart", "in_order"), [((3.0, 5.0), False), ((3.0, 45.0), True), ((45.0, 3.0), True)]
)
def test_a_compass_that_points_as_a_turned_one_does_is_not_in_order(apart, in_order):
    own, other = apart
    found = decided((FITS, TURNED, agreement(2, own), agreement(3, other)))[0]
    assert (found.verdict == "in order") == in_order
    assert found.strikes == (not in_order)
    assert ("points as compass 3 does, which is turned" in found.text) == (not in_order)


@pytest.mark.parametrize(("verdict", "in_order"), [("wrong", False), ("not known", True)])
def test_a_compass_that_fits_a_heading_that_is_wrong_is_not_in_order(verdict, in_order):
    off = Check("heading", verdict, "it accelerates 91 degrees left of where it leans")
    found = decided((FITS, off))[0]
    assert (found.verdict == "in order") == in_order
