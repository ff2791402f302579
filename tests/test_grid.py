"""No array's size follows from a time: every grid with a step is made in one place, and bounded."""

import ast
from pathlib import Path

import numpy as np
import pytest

from fdi.errors import LogError
from fdi.grid import LEAST, PER_RECORD, checked, uniform

PACKAGE = Path(__file__).parents[1] / "fdi"
CENTURY_S = 100 * 365 * 86400.0


def test_points_are_those_of_numpy():
    np.testing.assert_array_equal(
        uniform(0.3, 7.9, 0.1, records=3), np.arange(0.3, 7.9, 0.1, dtype=np.float64)
    )
    assert uniform(5.0, 1.0, -1.0, records=3).tolist() == [5.0, 4.0, 3.0, 2.0]


def test_span_that_ends_before_it_begins_has_no_points():
    assert uniform(5.0, 1.0, 0.1, records=3).size == 0


@pytest.mark.parametrize("end", [CENTURY_S, 1e300, np.inf])
def test_grid_that_records_cannot_fill_is_refused_before_it_is_made(end):
    with pytest.raises(LogError, match="its times are nonsense"):
        uniform(0.0, end, 0.1, records=3000)


def test_number_of_points_follows_from_the_records_alone():
    most = LEAST + PER_RECORD * 100
    assert checked(most, 100, "that") == most
    with pytest.raises(LogError, match=f"that make {most + 1} points, and there are 100 records"):
        checked(most + 1, 100, "that")


def test_undefined_number_of_points_is_refused():
    with pytest.raises(LogError):
        checked(float("nan"), 100, "that")


def test_grids_with_a_step_are_made_in_one_place():
    """``arange`` with a start, an end and a step would be as long as a log's clock says."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_call = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            if is_call and node.func.attr == "arange" and len(node.args) > 2:
                found.append(path.relative_to(PACKAGE).as_posix())
    assert found == ["grid.py"]
