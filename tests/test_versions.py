"""What may not depend on the versions of the libraries: `make test-lowest`, `make test-newest`."""

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path
from pkgutil import walk_packages

import numpy as np
import pytest
from pymavlink import mavutil

import fdi
from fdi.report.analysis_document import libraries
from fdi.telemetry import read
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.tlog.checksum import checksum_is_right
from fdi.telemetry.formats.tlog.frames import find_frames
from fdi.units import Conversion, si

ROOT = Path(__file__).resolve().parents[1]
PROJECT = ROOT / "pyproject.toml"
LOGS = ROOT / "examples" / "crash_logs"
# By pymavlink 2.4.50: frames with a right checksum, and parameters by name.
EXAMPLES = {
    "copter_gps_loss_landing.tlog": (6105, 342),
    "copter_motor_failure_crash.tlog": (3707, 342),
    "plane_engine_failure_stall.tlog": (4681, 337),
}


@pytest.fixture(params=EXAMPLES)
def example(request):
    return LOGS / request.param


def test_stated_counts_are_those_of_another_reader(example):
    frames, names = 0, set()
    link = mavutil.mavlink_connection(str(example), robust_parsing=True)
    while (message := link.recv_msg()) is not None:
        frames += message.get_type() != "BAD_DATA"
        if message.get_type() == "PARAM_VALUE" and message.get_srcComponent() == 1:
            names.add(message.param_id)
    assert (frames, len(names)) == EXAMPLES[example.name]


@pytest.mark.parametrize("fast", ["0", "1"])
def test_every_frame_and_parameter_of_an_example_is_read(example, fast, monkeypatch):
    monkeypatch.setenv("FDI_FAST", fast)
    found = find_frames(np.fromfile(example, np.uint8), frame_checks())
    assert (found.start.size, found.damage) == (EXAMPLES[example.name][0], ())
    assert len(read(example).parameters) == EXAMPLES[example.name][1]


@pytest.mark.parametrize("python", ["3.11.0", "3.11.2"])
def test_every_pin_installs_on_the_oldest_python_that_is_promised(python):
    """What Debian 12 has is 3.11.2; one pin that wants 3.11.5 and pip installs nothing at all."""
    packaging = pytest.importorskip("packaging.specifiers")
    promised = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["requires-python"]
    assert packaging.SpecifierSet(promised).contains(python)
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line.split("==") for line in lines if line and not line.startswith("#")]
    assert len(pins) > 100
    wanting = {}
    for name, pinned in pins:
        try:
            found = metadata(name)
        except PackageNotFoundError:
            continue  # of the extras, of which this environment has not all
        if found["Version"] == pinned and found.get("Requires-Python"):
            needs = packaging.SpecifierSet(found.get("Requires-Python"))
            if not needs.contains(python):
                wanting[name] = str(needs)
    assert wanting == {}


def test_checksums_of_thousands_of_frames_at_once_are_right():
    """numpy before 2.0 counts with the smaller type where a scalar is in a sum: 16 bits."""
    data = np.fromfile(LOGS / "copter_motor_failure_crash.tlog", np.uint8)
    found = find_frames(data[:1000], frame_checks())
    times = 40_000
    covered = np.int16(found.length[0]) + np.int16(9 if found.version[0] == 2 else 5)
    right = checksum_is_right(
        data,
        np.full(times, found.start[0] + 9),
        np.full(times, covered, np.int16),
        np.full(times, found.number[0], np.int32),
        frame_checks(),
    )
    assert right.all()


def test_the_one_that_is_to_blame_is_found_in_every_example(example):
    truth = json.loads((LOGS / "labels.json").read_text(encoding="utf-8"))["flights"][example.name]
    first = fdi.analyze(example).findings[0]
    assert first.component in (truth["faults"][0]["component"], *truth["accept"])
    assert abs(first.onset - truth["faults"][0]["onset"]) < 3.0


def test_every_module_can_be_imported():
    names = [module.name for module in walk_packages(fdi.__path__, "fdi.")]
    names = [name for name in names if name != "fdi.__main__"]
    code = f"import importlib\nfor name in {names}: importlib.import_module(name)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=600)


@pytest.mark.parametrize("command", ["analyze", "structure", "batch"])
def test_the_command_line_explains_itself(command):
    ended = subprocess.run(
        [sys.executable, "-m", "fdi", command, "--help"],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "Usage" in ended.stdout


def test_units_that_models_rely_on_are_those_of_the_dialect_at_hand():
    """Accuracies and speeds; older dialects state lengths, or nothing."""
    from fdi.telemetry.dialect import definition_by_name

    stated = {"GPS_RAW_INT.vel_acc": "m/s", "RAW_IMU.xacc": "m/s^2", "AIRSPEED.airspeed": "m/s"}
    for channel, unit in stated.items():
        name, _, field = channel.partition(".")
        message = definition_by_name(name)
        assert message is not None, channel
        own = next(f.unit for f in message.fields if f.name == field)
        assert isinstance(si(own), Conversion)
        assert si(own).unit == unit, channel


def test_lowest_versions_that_are_tried_are_those_that_are_stated():
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["fast"]]
    stated = dict(re.fullmatch(r"([\w.-]+)>=([\d.]+)", one).groups() for one in wanted)
    lines = (ROOT / "constraints-lowest.txt").read_text(encoding="utf-8").splitlines()
    tried = dict(line.lower().split("==") for line in lines if not line.startswith("#"))
    assert {name: tried.get(name) for name in stated} == stated


def test_versions_told_are_those_that_run():
    told = libraries()
    assert told["numpy"] == np.__version__
    assert told["pymavlink"] == version("pymavlink")
    assert list(told) == sorted(told)


def test_types_are_shipped():
    """PEP 561: without the marker a user's type checker ignores our annotations."""
    assert (ROOT / "fdi" / "py.typed").read_bytes() == b""
    wheel = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    wheel = wheel["targets"]["wheel"]
    assert wheel["packages"] == ["fdi"]
    assert not any("typed" in str(one) for one in wheel.get("exclude", []))
