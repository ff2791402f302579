"""For which vehicles a shipped model is made."""

import pytest

from fdi.model.choose import is_general, made_for


@pytest.mark.parametrize(
    ("name", "vehicles", "general"),
    [("quadcopter", ("quad",), False), ("of_my_own", (), False)],
)
def test_a_shipped_model_says_for_which_vehicles_it_is_and_no_other_does(name, vehicles, general):
    assert (made_for(name), is_general(name)) == (vehicles, general)


def test_what_has_no_model_of_its_own_has_a_general_one():
    assert is_general("any_vehicle")
