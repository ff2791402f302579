from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis import Isolability
from fdi.report.figures import fault_grid_figure, isolability_figure, marked_rows
from fdi.report.style import image
from fdi.result import Analysis


def texts(figure: object) -> list[str]:
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text)]  # type: ignore[attr-defined]


def with_marks(analysis: Analysis, marks: np.ndarray, **changes: object) -> Analysis:
    grid = replace(analysis.diagnosis.grid, marks=marks.astype(np.int8), **changes)  # type: ignore[arg-type]
    return replace(analysis, diagnosis=replace(analysis.diagnosis, grid=grid))


def test_the_grid_shows_marked_faults_findings_and_the_impact(analysis: Analysis) -> None:
    shown = texts(fault_grid_figure(analysis))
    assert {"GPS_RAW_INT.alt", "1 gps", "take-off", "impact", "sensor"} <= set(shown)
    assert "VFR_HUD.alt" not in shown


def test_rows_stand_by_component_in_the_order_of_first_marks(analysis: Analysis) -> None:
    marks = np.zeros_like(analysis.diagnosis.grid.marks)
    marks[0, 50:], marks[1, 20:], marks[2, 10:] = 1, 1, 1
    components = ("gps", "barometer", "gps")
    grid = with_marks(analysis, marks, components=components).diagnosis.grid
    assert marked_rows(grid) == [2, 0, 1]


def test_a_grid_without_marks_says_so(analysis: Analysis) -> None:
    marks = np.zeros_like(analysis.diagnosis.grid.marks)
    assert "No fault is marked (3 of 3 could be tested)" in texts(
        fault_grid_figure(with_marks(analysis, marks))
    )


def test_foreign_names_are_not_read_as_mathematics(analysis: Analysis) -> None:
    faults = (r"$\frac{$", "$x_1$", "<b>\x1b")
    marks = np.ones_like(analysis.diagnosis.grid.marks)
    figure = fault_grid_figure(with_marks(analysis, marks, faults=faults))
    assert r"$\frac{$" in texts(figure)
    image(figure, "svg")


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_a_picture_is_the_same_every_time(analysis: Analysis, kind: str) -> None:
    first, second = (image(fault_grid_figure(analysis), kind) for _ in range(2))
    assert first == second
    assert b"<dc:date>" not in first


def test_very_many_bars_stay_a_small_picture(analysis: Analysis) -> None:
    t = np.arange(40_000) / 4
    marks = np.tile(np.arange(len(t)) % 2, (3, 1))
    assert len(image(fault_grid_figure(with_marks(analysis, marks, t=t)), "svg")) < 1_500_000


def test_the_matrix_counts_what_it_does_not_show() -> None:
    seen = np.array([True, True, False])
    matrix = np.array([[0, 0, 1], [1, 0, 1], [0, 0, 0]], dtype=bool)
    figure = isolability_figure(Isolability(("a", "b", "c"), seen, matrix, (("a", "b"),)))
    assert "Isolability: 2 detectable faults (1 undetectable not shown)" in texts(figure)


def test_drawing_leaves_the_callers_settings_alone(analysis: Analysis) -> None:
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 33.0}):
        image(fault_grid_figure(analysis), "png")
        assert mpl.rcParams["font.size"] == 33.0
