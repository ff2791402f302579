"""For which vehicles a shipped model is made."""

from types import SimpleNamespace

import pytest

from fdi.errors import ModelError
from fdi.model.choose import choose_model, is_general, kind_of, made_for, vehicles_of


@pytest.mark.parametrize(
    ("name", "vehicles", "general"),
    [("quadcopter", ("quad",), False), ("of_my_own", (), False)],
)
def test_a_shipped_model_says_for_which_vehicles_it_is_and_no_other_does(name, vehicles, general):
    assert (made_for(name), is_general(name)) == (vehicles, general)


def test_what_has_no_model_of_its_own_has_a_general_one():
    assert is_general("any_vehicle")


def log_of(vehicle, frame=""):
    return SimpleNamespace(name="flight.bin", vehicle=vehicle, frame=frame)


def test_a_log_gets_the_model_of_its_vehicle_or_of_its_frame():
    assert choose_model(log_of("quad")) == "quadcopter"
    assert choose_model(log_of("quad", "Y6")) == "y6"
    assert choose_model(log_of("quad", "no such frame")) == "quadcopter"
    assert kind_of(log_of("quad", "Y6")) == "y6"
    assert kind_of(log_of("quad", "X")) == "quad"


def test_a_vehicle_without_a_model_is_told_which_there_are():
    with pytest.raises(ModelError, match=r"no shipped model .* 'submarine'") as caught:
        choose_model(log_of("submarine"))
    assert "quadcopter" in caught.value.hint


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("vehicles: [quad, y6]\n", ("quad", "y6")),
        ("name: a\nvehicles: [quad]   # all\n", ("quad",)),
        ("vehicles: []\n", ()),
        ("name: a\n", ()),
        (" vehicles: [quad]\n", ()),
    ],
)
def test_vehicles_stand_in_a_line_of_their_own(tmp_path, text, found):
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    assert vehicles_of(path) == found
