"""What do the labelled flights score, as docs/evaluation.md says?

    .venv/bin/python benchmarks/evaluation.py [--write] [--inject [--moments N]] [--workers N]

Does what ``fdi evaluate`` does on ../shared/flights beside the repository and prints its tables;
with ``--inject`` those of detection against size on a real plane and a real multicopter. With
``--write`` they go between the markers of docs/evaluation.md, and the pictures into docs/images.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fdi.evaluation import Evaluation, evaluate, load_labels, select
from fdi.evaluation.curves import Curve, curves, curves_text, sized
from fdi.evaluation.tables import evaluation_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
LABELS = ROOT.parent / "shared" / "flights" / "labels.json"
PAGE = ROOT / "docs" / "evaluation.md"
IMAGES = ROOT / "docs" / "images"
MOMENTS: Final = 4
SUBJECTS: Final = {
    "plane": "alfa/no_failure_5.tlog",
    "multicopter": "propeller_cut/good_prop_hover_1.bin",
}


def progress(name: str, share: float) -> None:
    """Show how far it is, on a terminal only."""
    if sys.stderr.isatty():
        print(f"\r{share:4.0%} {name:60.60}", end="", file=sys.stderr)


def evaluated(workers: int, *, bare: bool = False) -> Evaluation:
    """Return the scores of all labelled flights, each of which must have an analysis."""
    found = evaluate(load_labels(LABELS), bare=bare, workers=workers, progress=progress)
    errors = [f"{one.label.key}: {one.error}" for one in found.scores if one.error]
    if errors:
        raise SystemExit("without an analysis, so nothing is told:\n" + "\n".join(errors))
    return found


def scored(workers: int) -> str:
    """Return the tables of `fdi evaluate`."""
    found = evaluated(workers, bare=True)
    command = "fdi evaluate ../shared/flights/labels.json"
    return f"`{command}` printed:\n\n{evaluation_text(found)}"


def sizes(workers: int, draw: bool, moments: int) -> str:
    """Return the tables of detection against size, and draw the pictures."""
    parts = []
    labels = load_labels(LABELS)
    for name, flight in SUBJECTS.items():
        chosen = select(labels, [flight])
        found = curves(chosen, moments=moments, workers=workers, progress=progress)
        command = f"fdi evaluate ../shared/flights/labels.json --inject --only {flight}"
        parts.append(f"### {name.capitalize()}\n\n`{command} --moments {moments}` printed:\n")
        parts.append(curves_text(found, "bias"))
        if draw:
            save(shares_by_size(found), f"injection_{name}.png")
            parts.append(f"![Detection against size, {name}](images/injection_{name}.png)\n")
    return "\n".join(parts)


def shares_by_size(found: Sequence[Curve]) -> Figure:
    """Draw the share of detected (left) and named (right) faults, a row per channel."""
    plt = pyplot()
    names = [f"{one.channel} ({sized(one.accuracy, one.unit)})" for one in found]
    steps = [f"{point.size / found[0].accuracy:.0f}" for point in found[0].points]
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 1 + 0.24 * len(names)), sharey=True)
    for axis, what in zip(axes, ("detected", "named"), strict=True):
        shares = [[getattr(point, what).share for point in one.points] for one in found]
        image = axis.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axis.set_xticks(range(len(steps)), steps)
        axis.set_yticks(range(len(names)), names, fontsize=7)
        axis.set_xlabel("bias, in accuracies of the channel")
        axis.set_title(what, fontsize=9)
    figure.colorbar(image, ax=axes, label="share of the faults", fraction=0.04, pad=0.02)
    return figure


def pyplot():  # type: ignore[no-untyped-def]
    """Return matplotlib's plotting without a display."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def save(figure: Figure, name: str) -> None:
    """Write a picture, small and the same for the same figures."""
    IMAGES.mkdir(exist_ok=True)
    figure.savefig(IMAGES / name, dpi=90, bbox_inches="tight", metadata={"Software": None})


def put(text: str, marker: str) -> None:
    """Replace what stands between two markers of the page."""
    begin, end = f"<!-- {marker}: begin -->", f"<!-- {marker}: end -->"
    page = PAGE.read_text("utf-8")
    head, rest = page.split(begin)
    PAGE.write_text(f"{head}{begin}\n{text.strip()}\n{end}{rest.split(end)[1]}", "utf-8")


def main() -> int:
    """Print the tables, and write them where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put them into docs/evaluation.md")
    parser.add_argument("--inject", action="store_true", help="detection against size instead")
    parser.add_argument("--moments", type=int, default=MOMENTS, help="faults of each size")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    if not LABELS.is_file():
        print(f"skipped: {LABELS} is not here")
        return 0
    if given.inject:
        text = sizes(given.workers, given.write, given.moments)
    else:
        text = scored(given.workers)
    print(text)
    if given.write:
        put(text, "injection" if given.inject else "evaluation")
    return 0


if __name__ == "__main__":
    sys.exit(main())
