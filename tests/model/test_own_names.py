"""What a format records beyond MAVLink is measured under its own name."""

from pathlib import Path

import pytest

from fdi.model import load_airframe
from fdi.telemetry import read

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "flights"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")

MODEL = """
format: 1
name: own_names
variables:
  innovation: {{unit: m/s}}
  first: {{unit: {unit}}}
limits:
  small: {{variable: innovation, max: 5, component: gps}}
  turns: {{variable: first, max: 3000, component: motor_1}}
measurements:
  "{innovations}":
    component: estimator
    fields:
      "{innovation}": {{variable: innovation, accuracy: 0.1 m/s}}
  "{motors}":
    component: motor_1
    fields:
      "{motor}": {{variable: first, accuracy: 1}}
"""


@needs_shared
@pytest.mark.parametrize(
    ("log", "unit", "channels"),
    [
        ("sitl/copter/c03_ref_square_wind.BIN", "us", ("XKF3[1]", "IVN", "RCOU", "C1")),
        (
            "crash/motors_cut_in_air.ulg",
            "rad/s",
            ("estimator_innovations", "gps_hvel[0]", "esc_status", "esc[0].esc_rpm"),
        ),
    ],
)
def test_what_only_one_format_has_is_measured_by_its_own_name(tmp_path, log, unit, channels):
    keys = dict(zip(("innovations", "innovation", "motors", "motor"), channels, strict=True))
    path = tmp_path / "own.yaml"
    path.write_text(MODEL.format(unit=unit, **keys))
    system = load_airframe(path).observe(read(SHARED / log))
    assert [str(request.channel) for request in system.channels] == [
        f"{channels[0]}.{channels[1]}",
        f"{channels[2]}.{channels[3]}",
    ]
    assert not system.warnings


@needs_shared
def test_message_that_a_log_could_not_fill_is_passed_over_in_silence(tmp_path):
    """MEMINFO of a DataFlash log has the free memory under another name: there is no MEMINFO."""
    path = tmp_path / "memory.yaml"
    path.write_text(MEMORY)
    system = load_airframe(path).observe(read(SHARED / "sitl/copter/c03_ref_square_wind.BIN"))
    assert [str(request.channel) for request in system.channels] == ["ATTITUDE.roll"]
    assert not system.warnings


MEMORY = """
format: 1
name: memory
variables:
  free: {unit: bytes}
  roll: {unit: rad}
limits:
  short: {variable: free, min: 200}
  level: {variable: roll, max: 1}
measurements:
  MEMINFO: {fields: {freemem: {variable: free}}}
  ATTITUDE: {fields: {roll: {variable: roll}}}
"""
