"""What do the labelled flights score, as docs/evaluation.md says?

    .venv/bin/python benchmarks/evaluation.py [--write] [--closed-loop DIR] [--workers N]
    .venv/bin/python benchmarks/evaluation.py --inject [--moments N] [--write] [--workers N]

Does what ``fdi evaluate`` does on ../shared/flights beside the repository, the closed-loop flights
among them, and prints its tables: those out of sample first. With ``--inject`` those of detection
against size on a real plane and a real multicopter. With ``--write`` they go between the markers of
docs/evaluation.md, and the pictures into docs/images.
"""

from __future__ import annotations

import argparse
import os
import sys
import tarfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from fdi.evaluation import Evaluation, evaluate, load_labels, select
from fdi.evaluation.curves import Curve, curves, curves_text, sized
from fdi.evaluation.tables import evaluation_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
LABELS = ROOT.parent / "shared" / "flights" / "labels.json"
ARCHIVE = LABELS.with_name("closed_loop.tar.xz")
PAGE = ROOT / "docs" / "evaluation.md"
IMAGES = ROOT / "docs" / "images"
NAME: Final = "closed_loop"
COMMAND: Final = f"fdi evaluate ../shared/flights/labels.json {NAME}/labels.json"
IN_SAMPLE: Final = "By the weights that the package holds"
"""So the tables begin that are not out of sample."""
MOMENTS: Final = 4
SUBJECTS: Final = {
    "plane": "alfa/no_failure_5.tlog",
    "multicopter": "propeller_cut/good_prop_hover_1.bin",
}


def progress(name: str, share: float) -> None:
    """Show how far it is, on a terminal only."""
    if sys.stderr.isatty():
        print(f"\r{share:4.0%} {name:60.60}", end="", file=sys.stderr)


@contextmanager
def closed_loop(folder: Path | None) -> Iterator[Path]:
    """Give the folder of the closed-loop flights; without one the archive is unpacked for it."""
    if folder is not None:
        yield folder
        return
    with TemporaryDirectory(prefix="fdi-") as place:
        own = Path(place) / NAME
        with tarfile.open(ARCHIVE) as archive:
            archive.extractall(own, filter="data")
        yield own


def missing(folder: Path | None) -> str:
    """Return why there is nothing to evaluate, or nothing."""
    others = ARCHIVE if folder is None else folder / LABELS.name
    return ", ".join(f"{path} is not here" for path in (LABELS, others) if not path.is_file())


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of all that analyses the labelled flights."""
    parser.add_argument("--closed-loop", type=Path, metavar="DIR", help="the archive, unpacked")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)


def evaluated(
    folder: Path | None,
    workers: int,
    *,
    methods: Sequence[str] | None = None,
    bare: bool = False,
) -> Evaluation:
    """Return the scores of all labelled flights, each of which must have an analysis."""
    with closed_loop(folder) as others:
        labels = [one for path in (LABELS, others / LABELS.name) for one in load_labels(path)]
        found = evaluate(labels, methods=methods, bare=bare, workers=workers, progress=progress)
    errors = [f"{one.label.key}: {one.error}" for one in found.scores if one.error]
    if errors:
        raise SystemExit("without an analysis, so nothing is told:\n" + "\n".join(errors))
    return found


def scored(folder: Path | None, workers: int) -> str:
    """Return the tables of `fdi evaluate`."""
    return evaluation_text(evaluated(folder, workers, bare=True))


def put_tables(text: str) -> None:
    """Put the table out of sample into its section of the page, and the others below."""
    unseen, begin, rest = text.partition(IN_SAMPLE)
    if not begin:
        raise SystemExit(f"the tables no longer say {IN_SAMPLE!r}; nothing is written")
    put(f"`{COMMAND}` printed:\n\n{unseen}", "out-of-sample")
    put(f"`{COMMAND}` printed, further:\n\n{begin}{rest}", "evaluation")


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


def put(text: str, marker: str, page: Path = PAGE) -> None:
    """Replace what stands between two markers of a page."""
    begin, end = f"<!-- {marker}: begin -->", f"<!-- {marker}: end -->"
    head, rest = page.read_text("utf-8").split(begin)
    page.write_text(f"{head}{begin}\n{text.strip()}\n{end}{rest.split(end)[1]}", "utf-8")


def main() -> int:
    """Print the tables, and write them where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put them into docs/evaluation.md")
    parser.add_argument("--inject", action="store_true", help="detection against size instead")
    parser.add_argument("--moments", type=int, default=MOMENTS, help="faults of each size")
    add_options(parser)
    given = parser.parse_args()
    if given.inject:
        if not LABELS.is_file():
            print(f"skipped: {LABELS} is not here")
            return 0
        text = sizes(given.workers, given.write, given.moments)
        print(text)
        if given.write:
            put(text, "injection")
        return 0
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    text = scored(given.closed_loop, given.workers)
    print(text)
    if given.write:
        put_tables(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
