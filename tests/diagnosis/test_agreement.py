"""Does a method accuse the same component as the tests of the model? Small systems by hand."""

import pytest

from fdi.diagnosis import diagnose

from .build import alarms_of, bank_of, limit_row, model

HEIGHTS = dict.fromkeys(("gps", "baro", "radar", "lidar", "sonar"), ("x",))
SHOWN = HEIGHTS | dict.fromkeys(("star", "sun", "moon"), ("y",))
TEXT = model(SHOWN | {"control": ["z"], "estimator": []}, {"gps": ["control"]})
ORACLE = """  oracle:
    component: estimator
    made_by: oracle
    fields:
      odd: {variable: odd, accuracy: 0.1}
      strange: {variable: strange, accuracy: 0.1}
      stray: {variable: stray, accuracy: 0.1}
limits:
  gps_odd: {variable: odd, max: 3, component: gps}
  control_stray: {variable: stray, max: 3, component: control}
  star_strange: {variable: strange, max: 3, component: star, suspects: [sun]}
"""
BANK = bank_of(
    TEXT.replace(
        "variables:\n",
        'variables:\n  odd: {unit: "1"}\n  strange: {unit: "1"}\n  stray: {unit: "1"}\n',
    )
    + ORACLE
)
GPS_ODD, STAR_STRANGE = limit_row(BANK, "gps_odd"), limit_row(BANK, "star_strange")
COMPARED = {place: [(40, 60)] for place, one in enumerate(BANK.generators) if "GPS.x" in one.faults}


def told(raised, **more):
    return diagnose(alarms_of(BANK, raised, peak=20.0, **more), BANK)


def test_only_what_reads_a_methods_columns_is_a_methods():
    methods = BANK.methods()
    assert {methods[GPS_ODD], methods[STAR_STRANGE]} == {"oracle"}
    assert {methods[place] for place in COMPARED} == {""}


def test_a_method_that_points_to_the_accused_agrees():
    found = told(COMPARED | {GPS_ODD: [(41, 60)]})
    assert [finding.component for finding in found.findings] == ["gps"]
    (one,) = found.methods
    assert (one.method, one.rank, one.agrees) == ("oracle", 1, True)
    assert "points to the gps as well" in one.text.lower()


def test_a_method_that_points_elsewhere_is_told_as_a_contradiction():
    found = told(COMPARED | {STAR_STRANGE: [(49, 60)]})
    first = found.methods[0]
    assert (first.rank, first.agrees) == (1, False)
    assert "does not point to the gps" in first.text.lower()
    assert "the star or the sun fits" in first.text.lower()


def test_a_method_that_points_to_what_the_accused_disturbs_is_told_so():
    found = told(COMPARED | {limit_row(BANK, "control_stray"): [(45, 60)]})
    (one,) = found.methods
    assert (one.rank, one.agrees) == (1, False)
    assert "points to the control, which may follow from the failure of the gps" in one.text.lower()


def test_where_only_the_method_shows_it_that_is_said():
    found = told({GPS_ODD: [(40, 60)]})
    assert [finding.component for finding in found.findings] == ["gps"]
    assert "no test of the model does" in found.methods[0].text


@pytest.mark.parametrize(("raised", "accused"), [(COMPARED, ["gps"]), ({}, [])])
def test_a_quiet_method_says_nothing(raised, accused):
    found = told(raised)
    assert [finding.component for finding in found.findings] == accused
    assert found.methods == ()


def test_what_a_method_showed_long_before_or_after_does_not_count():
    early = told(COMPARED | {STAR_STRANGE: [(5, 8)]})
    late = told(COMPARED | {STAR_STRANGE: [(90, 95)]})
    for found in (early, late):
        (gps,) = [finding.rank for finding in found.findings if finding.component == "gps"]
        assert gps not in [one.rank for one in found.methods]


def test_a_complaint_that_accuses_nobody_is_told():
    found = diagnose(alarms_of(BANK, {STAR_STRANGE: [(40, 60)]}, peak=1.05), BANK)
    assert found.findings == ()
    (one,) = found.methods
    assert (one.rank, one.agrees) == (None, False)
    assert "at 40.0 s" in one.text
    assert "not enough to accuse" in one.text


def test_the_first_complaint_tells_when():
    raised = {STAR_STRANGE: [(40, 60)], limit_row(BANK, "control_stray"): [(30, 35)]}
    (one,) = diagnose(alarms_of(BANK, raised, peak=1.05), BANK).methods
    assert "at 30.0 s" in one.text


def test_what_is_computed_is_pointed_to_where_nothing_else_is():
    text = TEXT.replace("control: {", "control: {computed: true, ")
    bank = bank_of(
        text.replace(
            "variables:\n",
            'variables:\n  odd: {unit: "1"}\n  strange: {unit: "1"}\n  stray: {unit: "1"}\n',
        )
        + ORACLE.replace("star, suspects: [sun]", "control, suspects: [sun]")
    )
    for limit, pointed in (("control_stray", "the control"), ("star_strange", "the sun")):
        alarms = alarms_of(bank, {limit_row(bank, limit): [(40, 60)]}, peak=1.05)
        (one,) = diagnose(alarms, bank).methods
        assert f"fits {pointed};" in one.text
