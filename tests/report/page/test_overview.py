"""Heights side by side: an estimate that runs away from what measures it shows at once."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.report.page.overview import overview
from fdi.report.page.panel import Curve
from fdi.telemetry import Event, Log

from ..build import message, small_log

T = np.arange(0.0, 90.0, 0.25)
CLIMBED = np.clip(T - 10.0, 0.0, 20.0)


def heights(log: Log) -> dict[str, Curve]:
    (panel,) = (one for one in overview(log) if one.title.startswith("Height"))
    return {curve.label: curve for curve in panel.curves}


@pytest.fixture
def told() -> Log:
    """Return a flight whose estimated height drifts by 10 m; nothing else does."""
    flown = CLIMBED + np.where(T >= 40, 10.0, 0.0)
    pressure = 101325.0 * (1 - CLIMBED / 44330.8) ** (1 / 0.190263)
    said = [
        message("GLOBAL_POSITION_INT", {"relative_alt": flown}, T),
        message("GPS_RAW_INT", {"alt": 400.0 + CLIMBED}, T),
        message("SCALED_PRESSURE", {"press_abs": pressure}, T),
        message("NAV_CONTROLLER_OUTPUT", {"alt_error": 15.0 - flown}, T),
    ]
    log = small_log()
    modes = (Event(0.0, "mode", "STABILIZE"), Event(50.0, "mode", "LOITER"))
    return replace(log, messages={one.key: one for one in said}, reported=modes)


def test_sensors_stand_beside_the_estimate_at_its_height_at_take_off(told: Log) -> None:
    found = heights(told)
    assert list(found) == ["flown", "demanded", "by air pressure", "by the receiver"]
    for label in ("by air pressure", "by the receiver"):
        np.testing.assert_allclose(found[label].value, CLIMBED, atol=0.6)


def test_a_demand_is_none_where_no_mode_controls_the_height(told: Log) -> None:
    demanded = heights(told)["demanded"]
    assert np.isnan(demanded.value[T < 50]).all()
    np.testing.assert_allclose(demanded.value[T >= 50], 15.0)


def test_the_same_reading_twice_is_drawn_once(told: Log) -> None:
    same = message(
        "GPS_RAW_INT", {"alt": 400.0 + told["GLOBAL_POSITION_INT"].si("relative_alt")}, T
    )
    found = heights(replace(told, messages={**told.messages, "GPS_RAW_INT": same}))
    assert "by the receiver" not in found
