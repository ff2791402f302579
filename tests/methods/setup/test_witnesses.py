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
