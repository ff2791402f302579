"""What does a plot look like where no script runs, and on paper? SVG, drawn here.

In: panels, modes, marks, rows of the fault grid, a way over ground. Out: SVG as text that is safe
to stand in a page: all foreign text is escaped. Colours are those of the page's style sheet, by
class, so that they are right on light and dark ground.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.columns import gaps, thinned
from fdi.report.page.panel import Panel, coloured
from fdi.report.page.track import Track

Floats = NDArray[np.float64]

WIDTH: Final = 900
LEFT: Final = 62
RIGHT: Final = 8
TOP: Final = 20
"""Above the plot stand the names of the curves."""
LETTER: Final = 5.9
HEIGHT: Final = 120
AXIS: Final = 18
MOST: Final = 500
"""Samples of a curve: the picture is 836 units wide."""
EDGE: Final = 6
ROW: Final = 24
NAME: Final = 15
"""Of a row of the fault grid: names stand above their bars, which are on the panels' own axis."""
SIDE: Final = 420


def escaped(text: object) -> str:
    """Return text as it may stand in SVG, between tags or in a quoted attribute."""
    from markupsafe import escape

    from fdi.report.words import clean

    return str(escape(clean(text)))


def ticks(low: float, high: float, most: int) -> list[float]:
    """Return round numbers between two, at most about so many.

    Examples
    --------
    >>> ticks(0.0, 10.0, 5), ticks(-0.3, 0.3, 4)
    ([0.0, 2.0, 4.0, 6.0, 8.0, 10.0], [-0.2, 0.0, 0.2])
    """
    if not high > low:
        return [low]
    rough = (high - low) / most
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(power * k for k in (1, 2, 5, 10) if power * k >= rough * 0.999)
    first = np.ceil(low / step - 1e-9)
    count = int(np.floor(high / step + 1e-9) - first) + 1
    return [round(float((first + i) * step), 10) + 0.0 for i in range(count)]


def panel_svg(
    panel: Panel,
    span: tuple[float, float],
    lines: Sequence[tuple[float, str]] = (),
    bands: Sequence[tuple[float, float, str]] = (),
) -> str:
    """Return a panel as SVG over a span of time, s.

    ``lines``: times with a class (``onset``, ``edge``); ``bands``: modes.
    """
    shown = [_within(curve.t, curve.value, span) for curve in panel.curves]
    low, high = _range(panel, [values for _, values in shown])
    height = TOP + HEIGHT + AXIS
    across = (WIDTH - LEFT - RIGHT) / (span[1] - span[0])

    def x(t: Floats | float) -> Any:
        return LEFT + (np.asarray(t) - span[0]) * across

    def y(v: Floats | float) -> Any:
        share = (np.clip(np.asarray(v), low, high) - low) / (high - low)
        return TOP + HEIGHT * (1 - share)

    label = escaped(f"{panel.title}, {panel.unit}" if panel.unit else panel.title)
    parts = [
        f'<svg class="plot" viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{label}">',
        *_bands(bands, span, x),
        *_picture(panel, span, x),
        *(
            f'<rect class="hot" x="{x(a):.1f}" y="{TOP}" width="{max(x(b) - x(a), 1):.1f}" '
            f'height="{HEIGHT}"/>'
            for a, b in _clipped(panel.hot, span)
        ),
    ]
    for value in ticks(low, high, 4):
        parts.append(
            f'<path class="rule" d="M{LEFT} {y(value):.1f}H{WIDTH - RIGHT}"/>'
            f'<text class="tick end" x="{LEFT - 5}" y="{y(value) + 3.5:.1f}">{value:.9g}</text>'
        )
    parts += _time_axis(span, x, TOP + HEIGHT)
    for (curve, colour), (t, values) in zip(coloured(panel), shown, strict=True):
        path = _path(x(t), y(values), np.isfinite(values), gaps(t))
        if path:
            parts.append(f'<path class="curve {curve.look} c{colour % 8}" d="{path}"/>')
    parts += _lines(lines, span, x, TOP + HEIGHT)
    parts += _legend(panel)
    return "".join([*parts, "</svg>"])


def _legend(panel: Panel) -> Iterator[str]:
    """Yield the names of the curves, in one line above them."""
    x = LEFT
    for curve, colour in coloured(panel):
        name = curve.label if len(curve.label) <= 48 else curve.label[:47] + "…"
        yield (
            f'<path class="curve {curve.look} c{colour % 8}" d="M{x} 8h22"/>'
            f'<text class="tick" x="{x + 26}" y="12">{escaped(name)}</text>'
        )
        x += 44 + round(LETTER * len(name))


def _within(t: Floats, values: Floats, span: tuple[float, float]) -> tuple[Floats, Floats]:
    first = max(int(np.searchsorted(t, span[0])) - 1, 0)
    last = int(np.searchsorted(t, span[1], side="right")) + 1
    times, columns = thinned(t[first:last], values[None, first:last], MOST)
    return np.clip(times, *span), columns[0]


def _range(panel: Panel, columns: Sequence[Floats]) -> tuple[float, float]:
    """Return what to show: all of the curves, and of a bound where it mostly is."""
    if panel.picture:
        return 0.0, panel.picture.top
    known = [column[np.isfinite(column)] for column in columns]
    known = [
        np.median(column, keepdims=True) if curve.look == "bound" and column.size else column
        for curve, column in zip(panel.curves, known, strict=True)
    ]
    known = [column for column in known if column.size]
    if not known:
        return 0.0, 1.0
    low, high = min(float(c.min()) for c in known), max(float(c.max()) for c in known)
    margin = 0.04 * (high - low) or 0.5 * max(abs(high) * 0.1, 1e-3)
    return low - margin, high + margin


def _path(x: Floats, y: Floats, known: NDArray[np.bool_], broken: NDArray[np.bool_]) -> str:
    """Return a line through what is known, with a new start after every gap."""
    parts, up = list[str](), True
    for i in range(len(x)):
        if not known[i]:
            up = True
            continue
        parts.append(f"{'M' if up else 'L'}{x[i]:.1f} {y[i]:.1f}")
        up = i < len(broken) and bool(broken[i])
    return "".join(parts)


def _clipped(
    bars: Sequence[Sequence[float]], span: tuple[float, float]
) -> Iterator[tuple[float, float]]:
    for start, end in bars:
        if end > span[0] and start < span[1]:
            yield max(start, span[0]), min(end, span[1])


def _picture(panel: Panel, span: tuple[float, float], x: Any) -> Iterator[str]:
    if panel.picture is None:
        return
    start, end = panel.picture.t
    yield (
        f'<image x="{x(start):.1f}" y="{TOP}" width="{x(end) - x(start):.1f}" height="{HEIGHT}" '
        f'preserveAspectRatio="none" '
        f'href="data:image/png;base64,{base64.b64encode(panel.picture.png).decode()}"/>'
    )


def _bands(
    bands: Sequence[tuple[float, float, str]], span: tuple[float, float], x: Any
) -> Iterator[str]:
    names = list(dict.fromkeys(name for _, _, name in bands))
    for start, end, name in bands:
        for a, b in _clipped([(start, end)], span):
            yield (
                f'<rect class="mode m{names.index(name) % 6}" x="{x(a):.1f}" y="{TOP}" '
                f'width="{x(b) - x(a):.1f}" height="{HEIGHT}"><title>{escaped(name)}</title></rect>'
            )


def _time_axis(span: tuple[float, float], x: Any, bottom: float) -> Iterator[str]:
    for t in ticks(*span, 9):
        yield f'<text class="tick mid" x="{x(t):.1f}" y="{bottom + 14}">{t:g} s</text>'


def _lines(
    lines: Sequence[tuple[float, str]],
    span: tuple[float, float],
    x: Any,
    bottom: float,
    top: float = TOP,
) -> Iterator[str]:
    for t, kind in lines:
        if span[0] <= t <= span[1]:
            yield f'<path class="mark {kind}" d="M{x(t):.1f} {top}V{bottom}"/>'


def grid_svg(
    rows: Sequence[dict[str, Any]],
    span: tuple[float, float],
    lines: Sequence[tuple[float, str]] = (),
) -> str:
    """Return the fault grid as SVG."""
    height = EDGE + ROW * len(rows) + AXIS
    across = (WIDTH - LEFT - RIGHT) / (span[1] - span[0])

    def x(t: float) -> float:
        return LEFT + (t - span[0]) * across

    parts = [
        f'<svg class="plot grid" viewBox="0 0 {WIDTH} {height}" role="img" '
        f'aria-label="Which fault was marked when">'
    ]
    for place, row in enumerate(rows):
        top = EDGE + ROW * place
        name = row["name"] if len(row["name"]) <= 120 else row["name"][:119] + "…"
        look, more = ("tick accused", ", accused") if row["accused"] else ("tick", "")
        words = escaped(name) + more
        parts.append(f'<text class="{look}" x="{LEFT}" y="{top + NAME - 3}">{words}</text>')
        marked = "accused" if row["accused"] else f"g-{row['group']}"
        for kind, style in (("off", "unknown"), ("on", marked)):
            path = _bars(list(_clipped(row[kind], span)), x, top)
            if path:
                parts.append(f'<path class="bar {style}" d="{path}"/>')
    parts += _time_axis(span, x, EDGE + ROW * len(rows))
    # through the bars alone: a line through the names makes these hard to read
    for place in range(len(rows)):
        parts += _lines(lines, span, x, EDGE + ROW * (place + 1) - 1, EDGE + ROW * place + NAME)
    return "".join([*parts, "</svg>"])


def _bars(bars: Sequence[tuple[float, float]], x: Any, top: int) -> str:
    """Return bars as one path; those that lie within a unit of each other are one."""
    found: list[list[float]] = []
    for start, end in ((x(a), x(b)) for a, b in bars):
        if found and start - found[-1][1] < 0.5:
            found[-1][1] = end
        else:
            found.append([start, end])
    return "".join(
        f"M{a:.1f} {top + NAME}H{max(b, a + 1):.1f}v{ROW - NAME - 1}H{a:.1f}z" for a, b in found
    )


def track_svg(way: Track) -> str:
    """Return the way over ground as SVG, north up."""
    span = max(float(np.ptp(way.east)), float(np.ptp(way.north)), 1.0)
    scale = (SIDE - 40) / span
    middle = [(float(v.min()) + float(v.max())) / 2 for v in (way.east, way.north)]
    x = SIDE / 2 + (way.east - middle[0]) * scale
    y = SIDE / 2 - (way.north - middle[1]) * scale
    path = _path(x, y, np.ones(len(x), bool), gaps(way.t))
    power = 10.0 ** np.floor(np.log10(span / 4))
    step = max(k * power for k in (1, 2, 5) if k * power <= span / 4)
    return (
        f'<svg class="plot track" viewBox="0 0 {SIDE} {SIDE}" role="img" '
        f'aria-label="Way over ground, north up">'
        f'<path class="curve line c0" d="{path}"/>'
        f'<circle class="begin" cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="4"><title>begin</title></circle>'
        f'<circle class="finish" cx="{x[-1]:.1f}" cy="{y[-1]:.1f}" r="4"><title>end</title>'
        f"</circle>"
        f'<path class="scale" d="M12 {SIDE - 12}h{step * scale:.1f}"/>'
        f'<text class="tick" x="12" y="{SIDE - 18}">{step:g} m</text></svg>'
    )
