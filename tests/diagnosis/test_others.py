"""Why it was not another part: small systems with alarms set by hand."""

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
    assert quiet.startswith("1 of its 2 tests were quiet: whether the baro")
    assert others["baro"].alarm == 40.0


def test_who_has_no_alarm_is_told_with_its_quiet_tests_only():
    _, others = told({GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}, peak=20.0)
    assert others["compass"].alarm is None
    (quiet,) = others["compass"].against
    assert quiet.startswith("its only test was quiet: whether the compass")


def test_what_comes_later_and_follows_is_told_so():
    own = {GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}
    _, others = told(own | {row(BANK, "GPS.y", "ESTIMATOR.y"): [(46, 60)]}, peak=20.0)
    said = others["estimator"].against
    assert "its first alarm came 6.0 s later" in said
    assert "a failure of the gps disturbs it too" in said


def test_likelier_ones_come_first_and_the_accused_is_none_of_them():
    finding, others = told({GPS_BARO: [(40, 60)], GPS_RADAR: [(40, 60)]}, peak=20.0)
    rivals = [name for name, _ in finding.rivals]
    assert list(others)[: len(rivals)] == rivals
    assert finding.component not in others


def test_nothing_is_made_up_against_who_cannot_be_told_apart():
    bank = bank_of(model({"baro": ["x"], "gps": ["x"]}))
    _, others = told({0: [(40, 100)]}, bank, peak=20.0)
    assert others["gps"].against == ()
