"""What do all figures have in common? Colours, fonts, how they are drawn and saved.

Figures are objects of matplotlib's Agg canvas: no window, no state of pyplot. Foreign text is never
read as mathematics. A figure of the same analysis has the same bytes (fixed ids, no date).
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, Literal

import numpy as np

from fdi.report.words import clean

GROUP_COLOURS: Final[dict[str, str]] = {
    "sensor": "#e3a008",
    "navigation": "#2b6cb0",
    "autopilot": "#c53030",
    "os": "#1f2933",
    "power": "#7b4bb3",
    "link": "#0e8a8a",
    "propulsion": "#b83280",
    "airframe": "#9c5b2e",
    "other": "#7b8794",
}
"""By the group of a fault; the first four as in the published figure; none is green,
which says of a part that it is ruled out."""
INK: Final = "#1f2933"
FAINT: Final = "#9aa5b1"
GRID: Final = "#e4e7eb"
ACCENT: Final = "#c53030"
CURVES: Final = ("#2b6cb0", "#dd6b20", "#2f855a", "#7b4bb3", "#b83280", "#4a5568")
FONT: Final = 8.5
_SETTINGS: Final[dict[str, Any]] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters everywhere
    "font.size": FONT,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "xtick.color": INK,
    "ytick.color": INK,
    "text.parse_math": False,
    "text.usetex": False,
    "axes.unicode_minus": False,
    "svg.hashsalt": "uav-fdi",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # publishers refuse the default, Type 3
    "hatch.linewidth": 0.6,
    "hatch.color": "#b8c2cc",
}


_UNDATED: Final[dict[str, dict[str, None]]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the style of the house while this is open."""
    import matplotlib as mpl

    with mpl.rc_context():
        # asked for the backend matplotlib looks for a window's, and imports pyplot (0.3 s)
        names = [name for name in mpl.rcParamsDefault if name != "backend"]
        wanted = {name: mpl.rcParamsDefault[name] for name in names} | _SETTINGS
        # each is checked anew when it is set, which takes longer than to compare them all
        mpl.rcParams.update({n: new for n, new in wanted.items() if mpl.rcParams[n] != new})
        yield


def new_figure(width: float, height: float) -> Any:
    """Return an empty figure, inches, that no global state knows of."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def image(figure: Any, kind: Literal["png", "svg", "pdf"] | str, *, dpi: int = 144) -> bytes:
    """Return a figure as the bytes of a picture, the same for the same figure."""
    out = io.BytesIO()
    with styled():
        engine = figure.get_layout_engine()
        if engine is not None:  # once, not in each of two passes for every kind of picture
            figure.set_dpi(dpi)
            engine.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(out, format=kind, dpi=dpi, metadata=_UNDATED.get(kind, {}))
    return out.getvalue()


class Picture:
    """A figure that is drawn at most once for each kind of picture."""

    def __init__(self, figure: Any) -> None:
        self._figure = figure
        self._drawn: dict[str, bytes] = {}

    def bytes(self, kind: str) -> bytes:
        """Return the picture, ``png`` or ``svg``."""
        if kind not in self._drawn:
            self._drawn[kind] = image(self._figure, kind)
        return self._drawn[kind]


def label(text: object, most: int = 48) -> str:
    """Return foreign text fit for a figure."""
    shown = clean(text)
    return shown if len(shown) <= most else shown[: most - 1] + "…"


def colour(group: str) -> str:
    """Return the colour of a group of faults."""
    return GROUP_COLOURS.get(group, GROUP_COLOURS["other"])


def tidy(axes: Any) -> None:
    """Leave only what a reader needs of the frame of a plot."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(length=3, width=0.8)


def levels(positions: Sequence[float], widths: Sequence[float], gap: float) -> list[int]:
    """Return for labels from left to right the lowest level on which each overlaps no other.

    Examples
    --------
    >>> levels([0.0, 1.0, 9.0], [4.0, 4.0, 4.0], 0.5)
    [0, 1, 0]
    """
    ends: list[float] = []
    result = []
    for start, width in zip(positions, widths, strict=True):
        free = next((i for i, end in enumerate(ends) if end + gap <= start), len(ends))
        if free == len(ends):
            ends.append(-np.inf)
        ends[free] = start + width
        result.append(free)
    return result
