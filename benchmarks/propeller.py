"""Does a policy learned from intact flights show a propeller that was short since take-off?

    .venv/bin/python benchmarks/propeller.py [FOLDER]

In: flights of one quadcopter with intact propellers and with one shortened by 5 to 25 mm, by
default ../shared/flights/propeller_cut beside the repository, and their labels. Every flight is
analysed by a policy of `fdi calibrate` from the intact ones, an intact one by that of the others.
Out: its trims and the learned ones, how large a share of healthy flights is as far off, where that
is told whose test is then the farthest off, and who is accused.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import fdi
from fdi.calibrate import calibrate
from fdi.decision.policy import policy_text
from fdi.residuals.between import departure
from fdi.residuals.departed import departed

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT.parent / "shared" / "flights" / "propeller_cut"
TRIMS = ("roll_trim", "pitch_trim", "yaw_trim", "power_taken")
HEAD = ("flight", "cut", *TRIMS, "as far off", "told", "accused")


def row(path: Path, intact: Sequence[Path], cut: str, folder: Path) -> list[str]:
    """Return the cells of a flight."""
    others = [one for one in intact if one != path]
    policy = folder / "policy.yaml"
    policy.write_text(policy_text(calibrate(others).policy))
    analysis = fdi.analyze(path, policy=policy)
    parameters = analysis.system.parameters
    off, found = departure(parameters), departed(analysis.residual_values)
    assert off is not None
    cells = [path.stem, cut]
    for name in TRIMS:
        flight, learned = parameters[name].flight, parameters[name].learned
        assert flight is not None
        assert learned is not None
        cells.append(
            f"{flight.value:.2f} ± {flight.std:.2f}, {learned.value:.2f} ± {learned.std:.2f}"
        )
    accused = ", ".join(dict.fromkeys(one.component for one in analysis.findings))
    first = found.tests[0].component if found and found.tests else "-"
    return [*cells, f"{off.share:.1%}", first if found else "no", accused or "nobody"]


def main() -> int:
    """Print the table."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    labels = folder.parent / "labels.json"
    if not labels.is_file():
        print(f"skipped: there is no {folder.name} beside the repository")
        return 0
    flights = {
        folder.parent / name: flight["faults"][0]["size"] if flight["faults"] else "none"
        for name, flight in json.loads(labels.read_text())["flights"].items()
        if name.startswith(f"{folder.name}/")
    }
    intact = sorted(path for path, cut in flights.items() if cut == "none")
    print(f"| {' | '.join(HEAD)} |\n|{' --- |' * len(HEAD)}")
    with tempfile.TemporaryDirectory() as scratch:
        for path, cut in sorted(flights.items(), key=lambda item: (item[1] != "none", item[0])):
            print(f"| {' | '.join(row(path, intact, cut, Path(scratch)))} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
