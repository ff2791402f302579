"""What healthy flights teach, and whom they may not teach anything."""

import json
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from flights import SHARED
from jsonschema import validate

from fdi.analysis import analyze
from fdi.calibrate import Flown, _frame, _same_vehicle, calibrate
from fdi.chain import residuals_of
from fdi.decision import load_policy
from fdi.decision.learned import Reached, learned_from
from fdi.decision.policy import policy_text
from fdi.errors import ModelError, UsageError
from fdi.model.system import Estimate
from fdi.model.yaml import read_document
from fdi.report.text import summary
from fdi.telemetry import read

pytestmark = pytest.mark.flights

ALFA = [SHARED / "alfa" / f"no_failure_{number}.tlog" for number in (2, 4, 5)]
OLD_COPTER = SHARED / "healthy" / "copter_2013.tlog"
COPTER = SHARED / "sitl" / "copter"
needs_flights = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")


def flight(scale, size=0.0, centre=None, key="a: gps"):
    return {key: Reached(scale, size, centre)}


def test_threshold_stands_a_margin_above_what_was_reached():
    found = learned_from([flight(1.2), flight(2.0), flight(0.3)])["a: gps"]
    assert found.scale == 2.5  # a quarter above
    assert learned_from([flight(1000.0)])["a: gps"].scale == 5.0
    assert learned_from([flight(0.01)] * 3)["a: gps"].scale == 0.7


def test_few_flights_do_not_lower_a_threshold():
    assert learned_from([flight(0.2), flight(0.2)])["a: gps"].scale == 1.0
    assert learned_from([flight(0.2), flight(0.2), flight(0.2)])["a: gps"].scale < 1.0


def test_stated_bound_gives_way_by_what_health_reached_and_is_not_scaled():
    found = learned_from([flight(None, 0.3), flight(None, 0.1), flight(None, 0.0)])["a: gps"]
    assert found.stray == 0.375
    assert found.scale == 1.0


def test_constants_of_several_flights_bound_the_next_one():
    found = learned_from([flight(0.0, centre=c) for c in (1.0, 1.2, 1.4)])["a: gps"]
    assert found.centre == pytest.approx((0.8, 1.6))
    for few in ([1.0], [1.0, 1.2]):
        found = learned_from([flight(0.0, centre=c) for c in few])["a: gps"]
        assert not np.isfinite(found.centre).any()


def test_what_is_learned_is_written_with_four_digits():
    found = learned_from([flight(1.23456), flight(None, 2345.678), flight(0.1)])["a: gps"]
    assert (found.scale, found.stray) == (1.543, 2932.0)


def test_order_of_flights_does_not_matter():
    flights = [flight(0.2, centre=1.0), flight(1.2, centre=0.5), flight(0.7, key="b: gps")]
    assert learned_from(flights) == learned_from(flights[::-1])


def test_written_policy_is_read_back(tmp_path):
    learned = learned_from([flight(2.0), flight(None, 0.3, key="b: x"), flight(None, key="c: y")])
    policy = load_policy("default")
    policy = replace(policy, name="mine", decision=replace(policy.decision, learned=learned))
    path = tmp_path / "mine.yaml"
    path.write_text(policy_text(policy))
    assert load_policy(path).decision == replace(policy.decision, learned={})
    from fdi.decision.policy import Calibration

    parameters = {"yaw_trim": Estimate(-0.07, 0.15, 3)}
    policy = replace(
        policy, calibration=Calibration("quadcopter", "quad", ("a.bin",), 0.5, parameters)
    )
    path.write_text(policy_text(policy))
    found = load_policy(path)
    assert found.calibration == policy.calibration
    # a test of which nothing was learned is left out
    assert found.decision.learned == {k: v for k, v in learned.items() if k != "c: y"}


@needs_flights
def test_flights_are_not_accused_by_a_policy_learned_from_them(tmp_path):
    """Begun with thresholds half as high, so that there is something to unlearn."""
    eager, default = tmp_path / "eager.yaml", load_policy("default")
    lower = ("sigmas", "least_factor", "most_factor")
    changes = {name: 0.5 * getattr(default.decision, name) for name in lower}
    eager.write_text(policy_text(replace(default, decision=replace(default.decision, **changes))))
    before = analyze(OLD_COPTER, policy=eager)
    assert before.findings, "this flight no longer shows what is tested here"
    found = calibrate([OLD_COPTER], name="old", policy=eager)
    assert found.checks[0].before == len(before.findings)
    assert found.checks[0].after is None
    assert len(found.warnings) >= 1
    path = tmp_path / "old.yaml"
    path.write_text(policy_text(found.policy))
    after = analyze(OLD_COPTER, policy=path)
    assert not after.findings
    assert after.document()["policy"]["name"] == "old"


@needs_flights
def test_a_fault_is_still_found_by_a_policy_of_other_flights(tmp_path):
    found = calibrate(ALFA)
    assert [check.after for check in found.checks] == [0, 0, 0]
    path = tmp_path / "heron.yaml"
    path.write_text(policy_text(found.policy))
    assert read_document(path).tree["calibration"]["flights"] == [p.name for p in ALFA]
    failed = analyze(SHARED / "alfa" / "engine_failure.tlog", policy=path)
    assert failed.findings[0].component == "engine"


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A policy of four healthy flights of the simulated quadcopter."""
    names = ("c01_ref_slow_line", "c02_hover_calm", "c03_ref_square_wind", "c04_loiter_sticks_wind")
    found = calibrate([COPTER / f"{name}.tlog" for name in names], name="simulated")
    path = tmp_path_factory.mktemp("policy") / "simulated.yaml"
    path.write_text(policy_text(found.policy))
    return path


@needs_flights
def test_parameters_of_healthy_flights_stand_in_the_policy(simulated):
    """A simulated vehicle has no trims, and flies alike."""
    parameters = read_document(simulated).tree["calibration"]["parameters"]
    assert list(parameters) == ["roll_trim", "pitch_trim", "yaw_trim", "power_taken"]
    power = parameters.pop("power_taken")
    assert power["flights"] == 4  # its current does not go as a real one does
    for one in parameters.values():
        assert one["flights"] == 4
        assert abs(one["value"]) < 0.01
        assert 0 < one["std"] < 0.01


@needs_flights
def test_a_propeller_that_is_short_since_take_off_is_accused_by_the_power_it_takes(tmp_path):
    """Of a real quadcopter; with 5 mm less it flies as with an intact one."""
    folder = SHARED / "propeller_cut"
    intact = [f"good_prop_{name}.bin" for name in ("hover_1", "hover_3", "straight_line_3")]
    path = tmp_path / "intact.yaml"
    path.write_text(policy_text(calibrate([folder / name for name in intact]).policy))
    for name, accused in (("20mm_hover_2", True), ("5mm_straight_line_2", False)):
        found = analyze(folder / f"{name}.bin", policy=path)
        assert [one.component for one in found.findings] == ["propulsion"] * accused
        if accused:
            assert found.findings[0].onset == found.log.flights[0].takeoff
            assert "takes another power" in summary(found)


@needs_flights
def test_a_motor_weak_from_the_beginning_is_named_by_what_others_taught(simulated, tmp_path):
    """The window begins when it gives 0.85 of its output already: by itself it is no change."""
    log, window = COPTER / "c11_motor2_x0.85.tlog", (44.0, 150.0)
    assert "motor_2" not in {f.component for f in analyze(log, window=window).findings}
    found = analyze(log, window=window, policy=simulated)
    assert [f.component for f in found.findings] == ["motor_2"]
    document = found.document()
    own = document["model"]["parameters"]["yaw_trim"]
    assert (own["source"], own["value"]) == ("policy", own["learned"]["value"])
    assert own["flight"]["value"] == pytest.approx(0.35, abs=0.02)
    assert document["departed"]["tests"][0]["component"] == "motor_2"
    schema = json.loads(files("fdi.report").joinpath("analysis.schema.json").read_text())
    validate(document, schema)
    report = (found.report(tmp_path / "out", ["html"]) / "report.html").read_text()
    for text in (summary(found), report):
        assert "Unlike the flights that the policy was learned from" in text
    assert "4 earlier flights: " in report


@needs_flights
def test_a_healthy_flight_is_as_the_others(simulated):
    found = analyze(COPTER / "c06_strong_gusts.tlog", policy=simulated)
    assert not found.findings
    assert found.document()["departed"] is None
    own = found.system.parameters["roll_trim"]
    assert own.source == "identified"
    assert own.std <= own.learned.std


@needs_flights
@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("mass: {value: 1, std: 1, flights: 2}", "no parameter 'mass' to identify in quadcopter"),
        (
            "roll_trim: {value: 0.7, std: 0.1, flights: 2}",
            r"the value 0.7 of roll_trim is not within the bounds \[-0.4, 0.4\]",
        ),
        (
            "roll_trim: {value: 0, std: 0, flights: 2}",
            "parameters.roll_trim.std: Input sho",
        ),
        ("roll_trim: {value: 0, std: 1, flights: 0}", "parameters.roll_trim.flights: Input sho"),
        ("roll_trim: {value: 0, std: 1}", "parameters.roll_trim.flights: Field required"),
    ],
)
def test_parameters_that_cannot_be_are_one_line(simulated, tmp_path, entry, said):
    head, _, rest = simulated.read_text().partition("  parameters:\n")
    path = tmp_path / "edited.yaml"
    path.write_text(f"{head}  parameters:\n    {entry}\n{rest[rest.index('  tests:') :]}")
    with pytest.raises(ModelError, match=said):
        analyze(COPTER / "c02_hover_calm.tlog", policy=path)


@needs_flights
def test_another_vehicle_is_refused():
    with pytest.raises(UsageError, match=r"another vehicle \(quad\) than no_failure_2.tlog"):
        calibrate([ALFA[0], SHARED / "sitl" / "copter" / "c02_hover_calm.tlog"])


@needs_flights
def test_another_frame_is_refused():
    """The same model serves both; their trims have nothing to do with each other."""
    folder = SHARED / "motor_stop"
    with pytest.raises(UsageError, match=r"quad-plus_m2m4.bin: has another frame than quad-x_m1"):
        _same_vehicle(*(flown(folder / f"{name}.bin") for name in ("quad-x_m1", "quad-plus_m2m4")))


def flown(path):
    """A flight as far as it tells of which vehicle it is."""
    chain = residuals_of(read(path))
    log = chain.log
    model = chain.airframe.name
    return Flown(log.name, log.vehicle, model, chain.residuals, {}, {}, {}, _frame(chain), 0.1, ())


@needs_flights
def test_a_flight_that_is_not_healthy_is_refused():
    with pytest.raises(UsageError, match=r"is not healthy: gps is accused at .* beyond what noise"):
        calibrate([SHARED / "sitl" / "copter" / "c25_gps_freeze.tlog"])


@needs_flights
def test_a_flight_that_ends_with_an_impact_is_refused():
    with pytest.raises(UsageError, match=r"is not healthy: it ends with an impact at \d"):
        calibrate([SHARED / "crash" / "motor2_lost.bin"])


@needs_flights
def test_a_policy_learned_for_another_model_is_refused(tmp_path):
    path = tmp_path / "plane.yaml"
    path.write_text(policy_text(calibrate(ALFA[:1]).policy))
    with pytest.raises(
        ModelError, match="was learned for the model fixed_wing, not for quadcopter"
    ):
        analyze(SHARED / "sitl" / "copter" / "c02_hover_calm.tlog", policy=path)


@needs_flights
def test_the_published_recipe_cannot_learn():
    with pytest.raises(UsageError, match="policy paper has nothing to learn"):
        calibrate(ALFA[:1], policy="paper")
