"""A log of two vehicles: which was taken is said, and another one is taken when asked for."""

import json
from pathlib import Path

import pytest
from telemetry.build import Flight, mav

from .conftest import Run

MOST, OTHER = 1, 7


@pytest.fixture
def both(tmp_path: Path) -> Path:
    """A quadcopter's flight, and a shorter one of a plane beside it, as a ground station hears."""
    quad = Flight().records()
    plane = Flight(system=OTHER, kind=mav.MAV_TYPE_FIXED_WING, boot=500.0).records()
    path = tmp_path / "both.tlog"
    path.write_bytes(b"".join(sorted([*quad, *plane[: len(plane) // 2]], key=lambda r: r[:8])))
    return path


@pytest.mark.parametrize(("asked", "taken"), [(None, MOST), (MOST, MOST), (OTHER, OTHER)])
def test_one_of_two_vehicles_is_taken(
    run: Run, both: Path, model: Path, asked: int | None, taken: int
) -> None:
    words = [] if asked is None else ["--system", asked]
    vehicle = {MOST: "quad", OTHER: "plane"}
    page = run("info", both, *words).out
    assert f"system {taken}\n" in page
    assert f"also heard  {vehicle[MOST + OTHER - taken]} {MOST + OTHER - taken}/1" in page
    assert f"another vehicle is taken with --system {MOST + OTHER - taken}" in page
    ended = run("analyze", both, "--model", model, "--json", *words)
    document = json.loads(ended.out)
    assert (document["log"]["system_id"], document["log"]["vehicle"]) == (taken, vehicle[taken])
    said = [text for text in document["warnings"] if "other vehicles" in text]
    assert [f"system {OTHER} (plane)" in text for text in said] == ([True] if not asked else [])
