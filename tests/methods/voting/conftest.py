"""Autopilots' logs, composed and read."""

import pytest

from fdi.telemetry import read

from .build import autopilot


@pytest.fixture
def load(tmp_path):
    """Return a composed autopilot's log, read."""

    def made(number=1, name=None, **changed):
        path = tmp_path / (name or f"autopilot_{number}.ulg")
        path.write_bytes(autopilot(number, **changed))
        return read(path)

    return made
