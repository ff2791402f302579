"""In which way a component failed: a real log with faults of known kinds put into it."""

from pathlib import Path

import pytest
from flights import ROOT

import fdi
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault

LOG = ROOT / "examples" / "healthy_logs" / "copter_gusts.tlog"


@pytest.mark.parametrize(
    ("fault", "component", "kind"),
    [
        ("GPS_RAW_INT.lat:bias=5e-6", "gps", "step"),
        ("SCALED_PRESSURE.press_abs:drift=15", "barometer", "ramp"),
        ("SCALED_PRESSURE.press_abs:noise=150", "barometer", "noise"),
        ("SCALED_PRESSURE.press_abs:freeze", "barometer", "freeze"),
        ("GPS_RAW_INT.satellites_visible:bias=-12", "gps", "limit"),
    ],
)
def test_a_failure_is_of_the_kind_that_was_put_in(
    fault: str, component: str, kind: str, tmp_path: Path
) -> None:
    low, high = fdi.read(LOG).span
    other = tmp_path / LOG.name
    other.write_bytes(injected(fdi.read(LOG), parse_fault(f"{fault}@{(low + high) / 2:.1f}")))
    first = fdi.analyze(other).diagnosis.findings[0]
    assert (first.component, first.kind) == (component, kind)


def test_an_output_that_stands_still_does_not_say_how_a_motor_failed() -> None:
    log = ROOT / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog"
    first = fdi.analyze(log).diagnosis.findings[0]
    assert first.component.startswith("motor_")
    assert first.kind in ("limit", "unknown")
