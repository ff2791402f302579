from pathlib import Path

import pytest

from fdi.telemetry import Log, read


@pytest.fixture
def load(tmp_path: Path):
    """Return a function that reads bytes as a log."""

    def reader(data: bytes, **options: object) -> Log:
        path = tmp_path / "log.tlog"
        path.write_bytes(data)
        return read(path, **options)

    return reader
