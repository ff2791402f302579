"""Control surfaces and engines of aeroplanes that fail in part: named, and early enough."""

import pytest
from flights import accused, analysis_of, document_of, shared

ALFA = "alfa/{}.tlog"
PLANE = "sitl/plane/{}.tlog"
SURFACES = shared(
    *(
        ALFA.format(name)
        for name in (
            "both_ailerons_stuck",
            "left_aileron_stuck",
            "elevator_stuck",
            "rudder_left",
            "rudder_right",
        )
    ),
    *(
        PLANE.format(name)
        for name in (
            "p30_aileron_stuck",
            "p31_aileron_offset",
            "p34_elevator_stuck",
            "p35_elevator_offset",
            "p37_rudder_hardover",
            "p38_rudder_stuck",
        )
    ),
)
ENGINES = shared(PLANE.format("p21_engine_x0.5"), "sitl/long/l32_plane_engine_x0.5.tlog")
TAKEN = shared(
    *(ALFA.format(f"engine_failure_{n}") for n in (3, 6, 7, 8, 9)), ALFA.format("engine_failure")
)
SENSORS = shared(PLANE.format("p11_pitot_blocked"), PLANE.format("p17_airspeed_zero"))


@pytest.mark.parametrize("case", SURFACES)
def test_surface_that_fails_is_named_within_seven_seconds(case):
    first = document_of(case.path)["findings"][0]
    assert first["component"] in case.right
    assert 0 <= first["alarm"]["log_s"] - case.onset < 7


@pytest.mark.parametrize("case", ENGINES)
def test_engine_at_half_power_is_named_within_five_seconds(case):
    first = document_of(case.path)["findings"][0]
    assert first["component"] == "engine"
    assert 0 <= first["alarm"]["log_s"] - case.onset < 5


@pytest.mark.parametrize("case", TAKEN)
def test_throttle_that_is_taken_away_is_seen_within_two_seconds(case):
    first = document_of(case.path)["findings"][0]
    assert first["component"] == "engine"
    assert 0 <= first["alarm"]["log_s"] - case.onset < 2


@pytest.mark.parametrize("case", SENSORS)
def test_airspeed_that_reads_low_is_no_want_of_thrust(case):
    """The drag of the larger of two airspeeds counts, so that nothing is missed where one lies."""
    assert document_of(case.path)["findings"][0]["component"] == "airspeed"
    assert "engine" not in accused(document_of(case.path))


@pytest.mark.parametrize("case", shared(ALFA.format("no_failure_5")))
def test_output_that_never_moved_is_not_judged(case):
    """Output 1 drives nothing there: both ailerons are on 5 and 6."""
    alarms = analysis_of(case.path).alarms
    generators = alarms.residuals.bank.generators
    names = [alarms.residuals.bank.system.equations[g.residual].name for g in generators]
    assert (alarms.state[names.index("aileron_output_held")] == -1).all()
    assert (alarms.state[names.index("aileron_2_output_held")] == 0).any()
