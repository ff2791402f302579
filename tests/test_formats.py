"""The same flight, recorded as telemetry and on board, gives the same answer."""

import pytest
from flights import Case, document_of, shared

pytestmark = pytest.mark.flights

WITHIN_S = 1.0

PAIRS = (
    "sitl/copter/c03_ref_square_wind",
    "sitl/copter/c10_motor1_x0.7_20s",
    "sitl/copter/c20_gps_glitch_11m",
    "sitl/copter/c30_accel_bias_y_both",
    "sitl/copter/c62_gps_loss_30s_wind",
    "sitl/copter/c90_crash_motor1_x0.2",
    "sitl/plane/p01_rect_calm",
    "sitl/plane/p20_engine_stop",
    "sitl/plane/p34_elevator_stuck",
    "sitl/plane/p78_no_airspeed_stall_5kg",
)


def onsets(case: Case) -> dict[str, float]:
    """Return when each accused component first showed, seconds since boot."""
    found: dict[str, float] = {}
    for finding in document_of(case.path)["findings"]:
        boot = finding["onset"]["boot_s"]
        found[finding["component"]] = min(boot, found.get(finding["component"], boot))
    return found


@pytest.mark.parametrize("case", shared(*(f"{name}.BIN" for name in PAIRS)))
def test_telemetry_and_dataflash_accuse_the_same_components_at_the_same_time(case):
    onboard, sent = onsets(case), onsets(Case(case.path.with_suffix(".tlog"), case.label))
    assert onboard.keys() == sent.keys()
    for component, boot in onboard.items():
        assert boot == pytest.approx(sent[component], abs=WITHIN_S), component


@pytest.mark.parametrize(
    "case",
    shared(
        "healthy/quad_short.bin",
        "propeller_cut/good_prop_hover_1.bin",
        "propeller_cut/good_prop_straight_line_3.bin",
    ),
)
def test_healthy_flights_of_other_autopilots_and_versions_accuse_nobody(case):
    """Copter 3.1 and 4.1."""
    assert not onsets(case)


@pytest.mark.parametrize("case", shared("healthy/no_battery_monitor.ulg"))
def test_px4_without_receiver_and_battery_monitor_has_no_sensor_or_estimator_accused(case):
    """Its motors are given unequal shares in manoeuvres, more than the model allows: not solved."""
    assert all(name.startswith("motor_") for name in onsets(case))


@pytest.mark.parametrize("case", shared("triplex/gps_fail/instance_0.ulg"))
def test_receiver_that_falls_silent_is_accused(case):
    (finding,) = document_of(case.path)["findings"]
    assert finding["component"] == "gps"
    assert finding["onset"]["log_s"] == pytest.approx(case.onset, abs=WITHIN_S)


@pytest.mark.parametrize("case", shared("crash/motors_cut_in_air.ulg"))
def test_motors_that_obey_are_not_accused(case):
    """They were commanded to stop in the air, and did; how small a fault of a motor would have
    shown no test says, so they are not cleared either.
    """
    found = document_of(case.path)
    motors = {"motor_1", "motor_2", "motor_3", "motor_4"}
    assert motors.isdisjoint(item["component"] for item in found["findings"])
    assert motors <= {item["component"] for item in found["open"]}
    assert "after all motors were told to stop" in found["verdict"]
