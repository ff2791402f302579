"""Control surfaces and engines of aeroplanes that fail in part: named, and early enough."""

from dataclasses import replace

import pytest
from flights import accused, analysis_of, document_of, shared

from fdi.analysis import analyze
from fdi.decision import load_policy
from fdi.decision.policy import policy_text

pytestmark = pytest.mark.flights

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


@pytest.fixture(scope="module")
def no_commands(tmp_path_factory):
    """A policy without the tests that read a recorded command."""
    file = tmp_path_factory.mktemp("policy") / "no_commands.yaml"
    own = replace(load_policy("default"), commands="left_out")
    file.write_text(policy_text(own), encoding="utf-8")
    return file


TIE = pytest.mark.xfail(
    strict=True, reason="the elevator, held up in the glide, alarms 1.6 s before the engine does"
)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(*p.values, id=p.id, marks=[*p.marks, *([TIE] * p.id.endswith("_9"))])
        for p in TAKEN
    ],
)
def test_dead_engine_is_named_by_what_it_does(case, no_commands):
    """Its throttle was taken away; height and speed go while they are asked for."""
    first = analyze(case.path, policy=no_commands).document()["findings"][0]
    assert first["component"] == "engine"
    assert 0 <= first["alarm"]["log_s"] - case.onset < 20


@pytest.mark.xfail(
    strict=True, reason="elevator and engine are near a tie since the weights were fitted anew"
)
@pytest.mark.parametrize("case", shared(ALFA.format("no_failure")))
def test_engine_that_gives_nothing_at_an_open_throttle_is_no_elevator(case):
    """From 51.5 s on, as its notes say: the throttle stays and rises, the vehicle sinks."""
    document = document_of(case.path)
    assert accused(document) == {"engine"}
    assert 51.5 < document["findings"][0]["alarm"]["log_s"] < 65


@pytest.mark.parametrize(
    "case", shared(*(ALFA.format(f"rudder_{side}") for side in ("left", "right")))
)
def test_ailerons_that_hold_a_slip_are_not_astray(case):
    alarms = analysis_of(case.path).alarms
    generators = alarms.residuals.bank.generators
    names = [alarms.residuals.bank.system.equations[g.residual].name for g in generators]
    assert alarms.alarm[names.index("rudder_turns_otherwise")].any()
    assert not alarms.alarm[names.index("aileron_2_turns_otherwise")].any()
