"""A vehicle of one's own: what its file states, and what is wrong with it."""

import pytest

from fdi.errors import ModelError
from fdi.methods.observer import REFERENCE_QUADROTOR, read_vehicle

OWN = """
name: mine
mass: 2.5
inertia: [0.03, 0.04, 0.06]
arm: 0.33
torque_per_thrust: 0.02
thrust_max: 15
"""


def written(tmp_path, text):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    return path


def test_the_preset_is_the_reference():
    assert read_vehicle("reference") is REFERENCE_QUADROTOR


def test_a_file_states_a_vehicle(tmp_path):
    own = read_vehicle(written(tmp_path, OWN))
    assert (own.name, own.mass, own.inertia) == ("mine", 2.5, (0.03, 0.04, 0.06))
    assert (own.arm, own.torque_per_thrust, own.thrust_max) == (0.33, 0.02, 15.0)
    assert own.drag == REFERENCE_QUADROTOR.drag


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("mass: 2.5", "mass: -1"), "mass must be a number above 0"),
        (("mass: 2.5", "mass: heavy"), "mass must be a number above 0"),
        (("mass: 2.5", ""), "a vehicle needs mass"),
        (("[0.03, 0.04, 0.06]", "[0.03, 0.04]"), "inertia must be three numbers above 0"),
        (("[0.03, 0.04, 0.06]", "0.03"), "inertia must be three numbers above 0"),
        (("name: mine", "weight: 3"), "a vehicle has no 'weight'"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, change, said):
    with pytest.raises(ModelError) as told:
        read_vehicle(written(tmp_path, OWN.replace(*change)))
    assert said in str(told.value)
    assert "mine.yaml" in str(told.value)


def test_all_that_is_wrong_is_told_together(tmp_path):
    with pytest.raises(ModelError) as told:
        read_vehicle(written(tmp_path, "mass: 0\nweight: 1\n"))
    assert len(told.value.problems) == 5
