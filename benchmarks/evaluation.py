"""What do the labelled flights score, as docs/evaluation.md says?

    .venv/bin/python benchmarks/evaluation.py [--write] [--inject] [--workers N]

Runs ``fdi evaluate`` on ../shared/flights beside the repository and prints its tables; with
``--inject`` those of detection against size on a real plane and a real multicopter. ``--write``
puts them between the markers of docs/evaluation.md, and the pictures into docs/images.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

ROOT = Path(__file__).resolve().parents[1]
LABELS = ROOT.parent / "shared" / "flights" / "labels.json"
PAGE = ROOT / "docs" / "evaluation.md"
IMAGES = ROOT / "docs" / "images"
FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]
SUBJECTS: Final = {
    "plane": "alfa/no_failure_5.tlog",
    "multicopter": "propeller_cut/good_prop_hover_1.bin",
}


def told(words: list[str]) -> str:
    """Return what the command line prints."""
    done = subprocess.run(FDI + words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout


def scored(workers: int) -> str:
    tables = told(["evaluate", str(LABELS), "--workers", str(workers)])
    command = f"fdi evaluate ../shared/flights/labels.json --workers {workers}"
    return f"`{command}` printed:\n\n{tables}"


def sizes(workers: int, draw: bool) -> str:
    """Return the tables of detection against size, and draw the pictures."""
    parts = []
    for name, flight in SUBJECTS.items():
        words = ["evaluate", str(LABELS), "--inject", "--only", flight, "--workers", str(workers)]
        curves = json.loads(told([*words, "--json"]))["curves"]
        parts.append(f"### {name.capitalize()}\n\n{table(curves)}\n")
        if draw:
            picture(curves, IMAGES / f"injection_{name}.png")
            parts.append(f"![Detection against size, {name}](images/injection_{name}.png)\n")
    return "\n".join(parts)


def table(curves: list[dict[str, Any]]) -> str:
    from fdi.evaluation.curves import Curve, Point, curves_text
    from fdi.evaluation.totals import Rate

    made = [
        Curve(
            one["log"],
            one["channel"],
            one["component"],
            one["unit"],
            one["accuracy"],
            tuple(
                Point(p["size"], Rate(p["detected"], p["of"]), Rate(p["named"], p["of"]))
                for p in one["points"]
            ),
        )
        for one in curves
    ]
    return curves_text(made, "bias")


def picture(curves: list[dict[str, Any]], path: Path) -> None:
    """Draw the share of detected (left) and named (right) faults, a row per channel."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    names = [one["channel"] for one in curves]
    steps = [round(p["size"] / curves[0]["accuracy"]) for p in curves[0]["points"]]
    figure, axes = plt.subplots(1, 2, figsize=(8, 1 + 0.24 * len(names)), sharey=True)
    for axis, what in zip(axes, ("detected", "named"), strict=True):
        shares = [[p[what] / p["of"] for p in one["points"]] for one in curves]
        axis.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axis.set_xticks(range(len(steps)), [str(step) for step in steps])
        axis.set_yticks(range(len(names)), names, fontsize=7)
        axis.set_xlabel("bias, in accuracies of the channel")
        axis.set_title(f"{what}: white none, dark all", fontsize=9)
    figure.tight_layout()
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)


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
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    if not LABELS.is_file():
        print(f"skipped: {LABELS} is not here")
        return 0
    text = sizes(given.workers, given.write) if given.inject else scored(given.workers)
    print(text)
    if given.write:
        put(text, "injection" if given.inject else "evaluation")
    return 0


if __name__ == "__main__":
    sys.exit(main())
