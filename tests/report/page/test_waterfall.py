"""Pictures of vibrations: a line stands at its frequency and time, in file and browser alike."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from fdi.report.html import html_report
from fdi.report.page.drawing import panel_svg
from fdi.report.page.panel import Panel
from fdi.report.page.waterfall import waterfalls
from fdi.telemetry import Log

from ..browsing import opened, until
from ..build import message, small_analysis, small_log

LINE_HZ = 63.0
RATE_HZ = 250.0
PAUSE = (40.0, 60.0)


@pytest.fixture(scope="module")
def shaking() -> Log:
    """Return 90 s that shake from 20 s on, by records that pause for 20 s; a notch stands at 80."""
    t = np.arange(0.0, 90.0, 1 / RATE_HZ)
    t = t[(t < PAUSE[0]) | (t >= PAUSE[1])]
    noise = np.random.default_rng(3).normal(0, 0.01, (3, t.size))
    noise[1] += np.where(t >= 20, np.sin(2 * np.pi * LINE_HZ * t), 0.0)
    fast = message("sensor_combined", {f"gyro_rad[{i}]": v for i, v in enumerate(noise)}, t)
    log = small_log()
    filters = {"IMU_GYRO_NF0_FRQ": 80.0, "IMU_GYRO_NF1_FRQ": 0.0}
    return replace(
        log,
        messages={**log.messages, "sensor_combined": fast},
        autopilot="px4",
        parameters=filters,
    )


@pytest.fixture(scope="module")
def panel(shaking: Log) -> Panel:
    (found,) = waterfalls(shaking, (0.0, 90.0))
    return found


def brightness(panel: Panel, hz: float, at: float) -> float:
    """Return how bright a picture is at a frequency and a time, -1 where nothing is known."""
    assert panel.picture is not None
    image = imread(BytesIO(panel.picture.png), format="png")
    (start, end), top = panel.picture.t, panel.picture.top
    row = round((1 - hz / top) * (image.shape[0] - 1))
    pixel = image[row, round((at - start) / (end - start) * (image.shape[1] - 1))]
    return float(pixel[:3].mean()) if pixel[3] else -1.0


def test_a_line_stands_at_its_frequency_from_its_beginning_on(panel: Panel) -> None:
    assert brightness(panel, LINE_HZ, 30.0) > 0.8
    assert brightness(panel, LINE_HZ, 10.0) < 0.5
    assert brightness(panel, 100.0, 30.0) < 0.5


def test_nothing_is_drawn_where_nothing_was_recorded(panel: Panel) -> None:
    assert brightness(panel, LINE_HZ, 50.0) == -1.0
    assert brightness(panel, LINE_HZ, 75.0) > 0.8


def test_title_axis_and_curves_say_what_is_shown(panel: Panel) -> None:
    began = "Vibrations of the gyroscope (sensor_combined at 250 Hz, line at 63 Hz, "
    assert panel.title.startswith(began)
    assert panel.unit == "Hz"
    assert panel.picture is not None
    assert panel.picture.top == pytest.approx(RATE_HZ / 2)
    assert [curve.label for curve in panel.curves] == [
        "notch filter 80 Hz",
        "half the rate of sampling",
    ]
    assert "data:image/png;base64," in panel_svg(panel, (0.0, 90.0))


def test_slow_records_give_no_picture() -> None:
    assert not list(waterfalls(small_log(), (0.0, 90.0)))


def test_a_browser_shows_the_picture_below_the_curves(
    browser: Any, shaking: Log, tmp_path: Path
) -> None:
    written = tmp_path / "report.html"
    written.write_text(html_report(small_analysis(tmp_path, shaking)), "utf-8")
    with opened(browser, written, 1300) as page:
        page.locator("figcaption:has-text('Vibrations of the')").scroll_into_view_if_needed()
        until(page, "plots.some((one) => one.panel.picture)")
        pixel = """((hz, t) => {
            const { plot } = plots.find((one) => one.panel.picture);
            const at = [plot.valToPos(t, "x", true), plot.valToPos(hz, "y", true)];
            return [...plot.ctx.getImageData(...at.map(Math.round), 1, 1).data];
        })"""
        until(page, f"{pixel}(63, 27)[0] > 200 && {pixel}(63, 14)[0] < 160")
        assert page.evaluate(f"{pixel}(97, 53)[3]") == 0  # the page's own ground shines through
