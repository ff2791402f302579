import pytest

from fdi.diagnosis.plain import alarm_words
from fdi.model import load_airframe, shipped_models
from fdi.residuals import build_bank
from fdi.telemetry import read
from tests.flights import SHARED


def said(name):
    """Return what each alarm of a shipped model says of each component that it concerns."""
    system = load_airframe(name).observe()
    found = {}
    for generator in build_bank(system).generators:
        equations = [system.equations[i] for i in generator.equations]
        for component in {e.component for e in equations if e.component and e.kind != "input"}:
            key = (system.equations[generator.residual].name, component)
            found.setdefault(key, set()).add(alarm_words(component, generator, system))
    return found


@pytest.mark.parametrize("name", shipped_models())
def test_every_alarm_of_a_shipped_model_has_a_clause_that_a_pilot_reads(name):
    for words in set().union(*said(name).values()):
        assert len(words) <= 110
        assert not set("_<=>") & set(words), words
        assert words[0].isupper(), words
        assert words[-1] != ".", words


def test_what_the_model_says_stands_behind_the_name_of_the_component():
    words = said("quadcopter")
    motor = words["motor_2_given_more", "motor_2"]
    assert motor == {"Motor 2 is given far more power than its share"}
    assert "GPS receiver gives no position fix" in words["gps_fix_lost", "gps"]


def test_a_sensor_against_the_estimator_is_said_from_the_side_of_who_is_accused():
    words = said("quadcopter")
    receiver = "GPS receiver shows another ground speed than the state estimator"
    assert receiver in words["pos_3", "gps"]
    assert (
        "State estimator does not fit the ground speed of the receiver"
        in words["pos_3", "estimator"]
    )


def test_two_units_that_differ_contradict_themselves():
    words = said("quadcopter")
    assert "Gyroscope contradicts itself in roll rate" in words["SCALED_IMU2.xgyro", "gyroscope"]


@pytest.mark.skipif(not SHARED.is_dir(), reason="no flights beside the repository")
def test_clause_names_the_place_of_a_motor():
    log = read(SHARED / "crash" / "motor2_lost.bin")
    system = load_airframe("quadcopter").observe(log)
    bank = build_bank(system)
    generator = next(
        g for g in bank.generators if system.equations[g.residual].name == "motor_2_given_more"
    )
    assert alarm_words("motor_2", generator, system) == (
        "Motor 2 (rear left) is given far more power than its share"
    )
