"""PX4 over MAVLink: the same table and tree, with what telemetry does not send left unknown."""

import pytest
from telemetry.build import mav, record

from fdi.methods.estimator import EstimatorHealth, estimator_health
from fdi.methods.estimator.tree import walk
from fdi.telemetry import read

GOOD, LOST = 0x33F, 0xA5


@pytest.fixture(scope="module")
def health(tmp_path_factory: pytest.TempPathFactory) -> EstimatorHealth:
    parts = []
    for i in range(200):
        t = 0.5 * i
        flags = GOOD if t < 60 else LOST
        ratio = 0.1 + 0.01 * (i % 5)
        messages = [
            mav.MAVLink_estimator_status_message(
                round(t * 1e6), flags, ratio, 2 * ratio, 0.5 * ratio, 0.02, 0.0, 0.0, 1.0, 1.5
            ),
            mav.MAVLink_attitude_message(round(t * 1000), 0.01 * (i % 3), 0, 0, 0, 0, 0),
        ]
        if i % 2 == 0:
            messages.append(
                mav.MAVLink_heartbeat_message(
                    mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0x81, 3 << 16, 4, 3
                )
            )
        parts += [record(t, message, sequence=3 * i + k) for k, message in enumerate(messages)]
    path = tmp_path_factory.mktemp("px4") / "px4.tlog"
    path.write_bytes(b"".join(parts))
    return estimator_health(read(path))


def test_ratios_are_those_of_the_message_and_zero_is_unused(health: EstimatorHealth) -> None:
    assert health.family.status == "ESTIMATOR_STATUS"
    peaks = {ratio.quantity: ratio.peak for ratio in health.ratios}
    assert peaks == {
        "velocity": pytest.approx(0.14),
        "horizontal position": pytest.approx(0.28),
        "height": pytest.approx(0.07),
        "compass": pytest.approx(0.02),
    }


def test_a_solution_that_is_given_up_is_in_the_tree(health: EstimatorHealth) -> None:
    nodes = {node.name: node for node, _, _ in walk(health.trees[0])}
    lost = nodes["the estimator gives up its solution (xy_valid)"]
    assert lost.spans is not None
    assert lost.spans[0][0] == pytest.approx(60.0, abs=0.01)
    assert nodes["local position invalid"].since == pytest.approx(60.0, abs=0.01)
    assert nodes["the commander is in failsafe"].spans is None
    assert nodes["attitude invalid"].spans is None


def test_solution_bits_fall_by_name(health: EstimatorHealth) -> None:
    spans = health.bits.spans("solution", "pos_horiz_abs", 0)
    assert spans is not None
    assert spans[0][1] == pytest.approx(60.0, abs=0.01)
    assert health.bits.spans("fault", "bad_mag_x", 0) is None


def test_what_telemetry_lacks_is_told(health: EstimatorHealth) -> None:
    alone = "only the core that flew is in this log: there is no other to compare it with"
    assert alone in health.notes
    assert "innovations are not in this log" in health.notes
