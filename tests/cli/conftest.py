"""A real log, a model small enough to be quick, and the command line as a function."""

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from fdi.cli import main

LOG = Path(__file__).parents[2] / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog"
END = "\nimport sys\nfrom fdi.cli import main\nsys.exit(main())"
TOO_LONG_S = 600  # a process that hangs; no measure of speed
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


def without_override() -> None:
    """Let a child of root be refused what the mode of a file refuses (capabilities(7))."""
    libc = ctypes.CDLL(None, use_errno=True)
    for capability in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        if libc.prctl(24, capability, 0, 0, 0):  # PR_CAPBSET_DROP
            raise OSError(ctypes.get_errno(), "no capability can be dropped here")


def refused(*words: object, code: str = "") -> Ended:
    """Run the command line in a process of its own that permissions hold for, root's too."""
    if os.name == "nt":
        pytest.skip("permissions are others there")
    is_root = os.geteuid() == 0
    if is_root and sys.platform != "linux":
        pytest.skip("root may do everything there")
    ended = subprocess.run(
        [sys.executable, "-c", code + END, *map(str, words)],
        preexec_fn=without_override if is_root else None,
        capture_output=True,
        text=True,
        timeout=TOO_LONG_S,
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)


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
