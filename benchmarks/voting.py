"""Prints the figures of docs/methods.md, "Voting": the record, reaction times, simulated voters.

``python benchmarks/voting.py [FOLDER]``; FOLDER holds the published logs of the triple redundant
autopilot, by default those of ../shared. Without them the simulation alone is printed.
"""

import sys
from itertools import groupby
from pathlib import Path

import fdi
from fdi.methods.voting import PRESETS, Voting
from fdi.methods.voting.scenarios import run_standard
from fdi.report.simulation_text import per_cent
from fdi.report.vote_rows import reaction_times

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "flights" / "triplex"
NUMBERS = (3, 4, 5, 7)
RUNS = 1000
ONSET_S = {"errors": 37.624, "silence": 42.68}
"""When GPS was switched off, by the console; when messages stopped, 30 s after take-off."""


def within_a_cycle(found: Voting) -> str:
    """Return by how much a vote at any phase lies off the recorded one, at most, s."""
    off = []
    for change in (change for one in found.reactions for change in one.changes):
        if change.recorded is not None and change.any_phase is not None:
            off += [abs(at - change.recorded) for at in change.any_phase]
    return f"{max(off) / 1e6:.3f}" if off else "no change, as recorded"


def record(folder: Path) -> None:
    print("log | cycles | different | at any phase, s off")
    for path in sorted(folder.glob("*/*.ulg")):
        found = fdi.vote(fdi.read(path))
        for voter in found.voters:
            if voter.differing is not None:
                name = f"{path.parent.name}/{path.stem}"
                different = voter.differing["any"]
                print(f"{name} | {voter.replay.t.size} | {different} | {within_a_cycle(found)}")


def reactions(folder: Path) -> None:
    print("\ntest | logs | detection | at any phase | take-over | at any phase")
    paths = sorted(folder.glob("*/*.ulg"))
    for name, group in groupby(paths, key=lambda path: path.parent.name):
        logs = [fdi.read(path) for path in group]
        for cause, onset in ONSET_S.items():
            found = fdi.vote(logs, onset=onset)
            for one in found.reactions:
                if one.cause == cause:
                    t = reaction_times(one)
                    spans = (t.detection_range, t.takeover, t.takeover_range)
                    any_phase, takeover, later = (f"{a:.2f} to {b:.2f}" for a, b in spans)
                    told = f"{t.detection:.2f} | {any_phase} | {takeover} | {later}"
                    print(f"{name} | {len(logs)} | {told}")


def simulated() -> None:
    print(f"\n{RUNS} runs, seed 0: runs that end wrong, % | " + " | ".join(map(str, NUMBERS)))
    for row in run_standard(NUMBERS, PRESETS["recorded"], runs=RUNS, seed=0):
        shares = " | ".join(per_cent(one.wrong) for one in row.outcomes)
        print(f"{row.name} | {shares} | {row.enough or 'none'}")


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    if folder.is_dir():
        record(folder)
        reactions(folder)
    simulated()


if __name__ == "__main__":
    main()
