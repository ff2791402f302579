"""A real log, a model small enough to be quick, and the command line as a function."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from fdi.cli import main

LOG = Path(__file__).parents[2] / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog"
MODEL = """
format: 1
name: tiny
description: Two altitudes, and an output that must not stand at its maximum.
components:
  gps: {group: sensor}
  estimator: {group: navigation}
  motor_1: {group: propulsion}
  compass: {group: sensor}
variables:
  altitude: {unit: m}
  u_1: {unit: "1"}
  effort: {unit: "1"}
parameters:
  effort_max: {value: 0.9, unit: "1"}
equations:
  mot_1: {text: "effort = u_1", fault: motor_1, component: motor_1}
limits:
  works_hardest: {variable: effort, max: effort_max, component: motor_1, when: airborne}
inputs:
  SERVO_OUTPUT_RAW:
    fields:
      servo1_raw: {variable: u_1, value: "(servo1_raw - 1000)/1000", accuracy: 0.002}
measurements:
  GPS_RAW_INT:
    component: gps
    fields:
      alt: {variable: altitude, accuracy: 3 m}
  GLOBAL_POSITION_INT:
    component: estimator
    fields:
      alt: {variable: altitude, accuracy: 3 m}
"""


class Ended(NamedTuple):
    code: int
    out: str
    err: str


Run = Callable[..., Ended]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(MODEL)
    return path


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Run the command line in an empty folder."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)

    def call(*words: object) -> Ended:
        code = main([str(word) for word in words])
        return Ended(code, *capsys.readouterr())

    return call
