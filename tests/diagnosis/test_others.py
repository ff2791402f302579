"""Why it was not another part: small systems with alarms set by hand."""

import pytest

from fdi.diagnosis import diagnose
from fdi.residuals import Bank

from .build import alarms_of, bank_of, model, row

BANK = bank_of(
    model(
        {
            "gps": ["x", "y"],
            "baro": ["x"],
            "radar": ["x"],
            "estimator": ["y"],
            "compass": ["z"],
            "sun": ["z"],
        },
        {"gps": ["estimator"], "estimator": []},
    )
)


def told(raised: dict[int, list[tuple[float, float]]], bank: Bank = BANK, **more):
    (finding,) = diagnose(alarms_of(bank, raised, **more), bank).findings
    return finding, {one.component: one for one in finding.others}


GPS_BARO, GPS_RADAR = row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")


def test_a_rival_answers_for_the_alarm_that_is_not_about_it_and_for_its_quiet_test():
    finding, others = told({GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}, peak=20.0)
    assert finding.component == "gps"
    unexplained, quiet = others["baro"].against
    assert unexplained.startswith("it does not explain 1 of the 2 alarms at first")
    assert "the gps" in unexplained
    assert "the radar" in unexplained
    assert quiet.startswith("1 of 2 tests of its own were quiet: whether the baro")
    assert others["baro"].alarm == 40.0


def test_who_has_no_alarm_is_told_with_its_quiet_tests_only():
    _, others = told({GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}, peak=20.0)
    assert others["compass"].alarm is None
    (quiet,) = others["compass"].against
    assert quiet.startswith("the only test of its own was quiet: whether the compass")


def test_what_comes_later_and_follows_is_told_so():
    own = {GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}
    _, others = told(own | {row(BANK, "GPS.y", "ESTIMATOR.y"): [(46, 60)]}, peak=20.0)
    said = others["estimator"].against
    assert "its first alarm came 6.0 s later" in said
    assert "a failure of the gps disturbs it too" in said


@pytest.mark.parametrize(("later", "is_told"), [(2.0, False), (2.25, True)])
def test_what_comes_at_the_same_time_is_not_told_as_later(later, is_told):
    own = {GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}
    _, others = told(own | {row(BANK, "GPS.y", "ESTIMATOR.y"): [(40 + later, 60)]}, peak=20.0)
    said = others["estimator"].against
    assert any("first alarm came" in one for one in said) == is_told
    assert "a failure of the gps disturbs it too" in said


@pytest.mark.parametrize(("sooner", "is_told"), [(2.0, True), (2.25, False)])
def test_what_shows_a_little_sooner_may_follow_all_the_same(sooner, is_told):
    shown = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "estimator": ["y"], "camera": ["y"]}
    bank = bank_of(model(shown, {"gps": ["estimator"], "estimator": []}))
    raised = {row(bank, "GPS.x", f"{name}.x"): [(40, 60)] for name in ("BARO", "RADAR")}
    raised[row(bank, "ESTIMATOR.y", "CAMERA.y")] = [(40 - sooner, 60)]
    found = diagnose(alarms_of(bank, raised, peak=20.0), bank).findings
    (gps,) = [one for one in found if one.component == "gps"]
    (said,) = [one.against for one in gps.others if one.component == "estimator"]
    assert ("a failure of the gps disturbs it too" in said) == is_told


def test_who_shows_something_else_explains_none_of_the_alarms():
    raised = {
        GPS_BARO: [(40, 60)],
        GPS_RADAR: [(40, 60)],
        row(BANK, "COMPASS.z", "SUN.z"): [(41, 60)],
    }
    first = diagnose(alarms_of(BANK, raised, peak=20.0), BANK).findings[0]
    against = {one.component: one.against for one in first.others}
    assert against["sun"][0].startswith("it explains none of the 2 alarms at first, such as that")
    assert not any("first alarm came" in one for one in against["sun"])
    assert not any("disturbs it too" in one for one in against["sun"])


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("computed: true", "it is computed, and has no part that breaks"),
        ("group: autopilot", "it is a program, which does as well as what it is given"),
    ],
)
def test_what_has_no_parts_is_told_so(kind, said):
    shown = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "camera": ["z"], "sun": ["z"]}
    bank = bank_of(model(shown).replace("camera: {", f"camera: {{{kind}, "))
    raised = {row(bank, "GPS.x", f"{name}.x"): [(40, 60)] for name in ("BARO", "RADAR")}
    _, others = told(raised, bank, peak=20.0)
    assert said in others["camera"].against
    assert said not in others["sun"].against


def test_likelier_ones_come_first_and_the_accused_is_none_of_them():
    finding, others = told({GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}, peak=20.0)
    rivals = [name for name, _ in finding.rivals]
    assert list(others)[: len(rivals)] == rivals
    assert finding.component not in others


def test_nothing_is_made_up_against_who_cannot_be_told_apart():
    bank = bank_of(model({"baro": ["x"], "gps": ["x"]}))
    _, others = told({0: [(40, 100)]}, bank, peak=20.0)
    assert others["gps"].against == ()
