"""Figures for a printed page: what they show, that letters fit, what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from flights import EXAMPLES, SHARED
from matplotlib.text import Text

from fdi.analysis import analyze
from fdi.diagnosis import Isolability
from fdi.errors import UsageError
from fdi.model.parts import Kind
from fdi.report.page.evidence import Court
from fdi.report.paper import DPI, FIGURES, draw
from fdi.report.paper.column import thinned
from fdi.report.paper.grid import MOST_ROWS, grid_rows
from fdi.report.style import image
from fdi.report.waterfall import MOST_COLUMNS, columns_of, with_pauses
from fdi.telemetry.spectra import Spectrum

from .build import NOTHING
from .test_figures import texts

DRAWN = [what for what in FIGURES if what not in ("track", "spectrum")]


@pytest.mark.parametrize("what", DRAWN)
def test_a_figure_is_one_column_wide_and_no_letter_leaves_it(analysis, what):
    figure = analysis.plot(what)
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    figure.canvas.draw()
    page = figure.bbox
    for text in figure.findobj(Text):
        assert text.get_fontsize() >= 5.5
    tight = figure.get_tightbbox(figure.canvas.get_renderer())
    assert tight.x0 * figure.dpi >= page.x0 - 2
    assert tight.x1 * figure.dpi <= page.x1 + 2


@pytest.mark.parametrize("what", DRAWN)
@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_a_picture_has_the_same_bytes_every_time(analysis, what, kind):
    first, second = (image(draw(analysis, what), kind, dpi=DPI) for _ in range(2))
    assert first == second


def test_times_have_a_unit_on_their_axis(analysis):
    for what in ("grid", "channels", "residual", "evidence"):
        assert "time in the log (s)" in texts(analysis.plot(what))


def test_channels_are_labelled_with_their_unit(analysis):
    shown = texts(analysis.plot("channels", channels=["VFR_HUD.alt", "GPS_RAW_INT.alt"]))
    assert {"VFR_HUD.alt", "GPS_RAW_INT.alt", "alt (m)"} <= set(shown)


def test_a_test_is_found_by_its_id_or_component(analysis):
    assert any("r5" in text for text in texts(analysis.plot("residual", test="r5")))
    assert any(text.endswith("(m)") for text in texts(analysis.plot("residual", test="gps")))


@pytest.mark.parametrize(
    ("what", "asked", "said"),
    [
        ("pie", {}, "no figure 'pie'"),
        ("grid", {"channels": ["VFR_HUD.alt"]}, "channels are not what grid shows"),
        ("grid", {"test": "r1"}, "a test is not what grid shows"),
        ("residual", {"test": "r999"}, "no test 'r999'"),
        ("channels", {"channels": ["ATTITUDE.roll"]}, "has no message ATTITUDE"),
        ("channels", {"channels": ["nonsense"]}, "is no channel"),
        ("evidence", {"finding": 7}, "no finding 7"),
        ("grid", {"width_mm": 3.0}, "cannot be drawn"),
        ("grid", {"width_mm": float("nan")}, "cannot be drawn"),
        ("track", {}, "holds no position"),
        ("spectrum", {}, "holds no vibrations to draw: 100 samples a second"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(analysis, what, asked, said):
    with pytest.raises(UsageError, match=said) as caught:
        analysis.plot(what, **asked)
    assert "\n" not in str(caught.value)


@pytest.mark.flights
@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
def test_a_waterfall_has_every_sensor_and_where_its_line_is():
    """A log of 250 Hz whose gyroscope shows a line at 116.6 Hz all the time."""
    found = analyze(SHARED / "real" / "pyulog_sample.ulg")
    figure = draw(found, "spectrum")
    assert [ax.get_ylabel() for ax in figure.axes] == ["gyroscope (Hz)", "accelerometer (Hz)"]
    (title,) = [text for text in texts(figure) if "sensor_combined at 250 Hz" in text]
    assert re.search("line at 11[67] Hz", title)
    assert len(image(figure, "svg")) < 500_000


def test_a_pause_in_a_waterfall_is_empty_and_columns_are_means():
    t = np.array([0.0, 1.0, 2.0, 8.0, 9.0])
    times, level = with_pauses(t, np.arange(5.0)[None])
    np.testing.assert_array_equal(times, [0.0, 1.0, 2.0, 3.0, 7.0, 8.0, 9.0])
    np.testing.assert_array_equal(level[0], [0.0, 1.0, 2.0, np.nan, np.nan, 3.0, 4.0])
    count = 2 * MOST_COLUMNS - 1
    t, power = np.arange(count, dtype=float), np.full((3, count), 10.0)
    one = Spectrum("gyroscope", "GYR", 400.0, t, np.arange(3.0), power)
    times, level = columns_of(one, (0.0, count))
    assert times.size == MOST_COLUMNS
    np.testing.assert_allclose(times[[0, 1, -1]], [0.5, 2.5, count - 1])
    np.testing.assert_allclose(level, 10.0)  # dB


@pytest.fixture(scope="module")
def crash():
    return analyze(EXAMPLES / "copter_motor_failure_crash.tlog")


def test_a_limit_is_violated_upwards_on_the_page_and_in_the_figure(crash):
    """The figure drew the residual of a limit as negative, the page as positive."""
    finding = crash.findings[0]
    figure = crash.plot("evidence")
    generator = next(g for g in crash.bank.generators if g.id == finding.evidence.telling)
    assert crash.system.equations[generator.residual].kind is Kind.LIMIT
    panels = Court(crash).of_finding(finding).panels()
    shown = next(one for one in panels if one.title.startswith(f"{generator.id}: residual"))
    drawn = next(y for line in figure.axes[0].lines if len(y := line.get_ydata()) > 2)
    assert np.nanmax(drawn) == pytest.approx(np.nanmax(shown.curves[0].value))
    assert np.nanmax(drawn) > 0
    assert np.nanmin(drawn) >= 0


def test_a_figure_says_what_an_alarm_means_and_no_unit_where_there_is_none(crash):
    shown = texts(crash.plot("evidence"))
    assert crash.findings[0].evidence.telling in shown  # the label of the axis
    assert not any("no unit" in text or "<=" in text for text in shown)
    assert any(text.startswith("Motor 1") for text in shown)


def test_a_healthy_flight_has_a_grid_and_no_evidence(analysis):
    marks = np.zeros_like(analysis.diagnosis.grid.marks)
    grid = replace(analysis.diagnosis.grid, marks=marks)
    healthy = replace(analysis, diagnosis=replace(analysis.diagnosis, **NOTHING, grid=grid))
    assert "no fault is marked\n(3 of 3 could be tested)" in texts(healthy.plot("grid"))
    assert healthy.plot("residual")
    for what in ("evidence", "channels"):
        with pytest.raises(UsageError, match="accused"):
            healthy.plot(what)


def test_many_marked_faults_are_drawn_by_component(analysis):
    grid = analysis.diagnosis.grid
    count = MOST_ROWS + 6
    marks = np.zeros((count, len(grid.t)), np.int8)
    marks[:, 5] = 1
    marks[0, :3], marks[6, :3] = -1, -1
    names = tuple(f"f{i}" for i in range(count))
    groups = tuple("sensor" for _ in names)
    big = replace(
        grid,
        faults=names,
        components=tuple(f"c{i % 6}" for i in range(count)),
        groups=groups,
        marks=marks,
    )
    rows = grid_rows(big)
    assert sorted(row.name for row in rows) == [f"c{i}" for i in range(6)]
    assert all(row.marks[5] == 1 for row in rows)
    first = next(row for row in rows if row.name == "c0")
    assert first.marks[0] == 0  # others of its faults are known


def test_a_large_isolability_is_drawn_as_groups(analysis):
    names = tuple(f"f{i}" for i in range(40))
    matrix = ~np.eye(40, dtype=bool)
    matrix[0, 1] = matrix[1, 0] = False
    seen = np.ones(40, bool)
    seen[39] = False
    value = Isolability(names, seen, matrix, (("f0", "f1"),))
    fault = analysis.system.faults[0]
    big = replace(
        analysis,
        diagnosis=replace(analysis.diagnosis, implementable=value),
        system=replace(analysis.system, faults=tuple(replace(fault, name=name) for name in names)),
    )
    shown = texts(big.plot("isolability"))
    assert {"f0, f1", "37 further faults can be told from every other one", "f39"} <= set(shown)
    assert "1 fault cannot be detected" in shown


def test_a_thinned_curve_keeps_its_peaks_and_gaps():
    t = np.arange(10_000.0)
    value = np.sin(t / 500)
    value[1234], value[7000:7600] = 50.0, np.nan
    fewer, kept = thinned(t, value, 400)
    assert len(fewer) <= 700
    assert np.nanmax(kept) == 50.0
    assert np.isnan(kept).any()
    assert np.all(np.diff(fewer) > 0)
