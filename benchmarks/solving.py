"""How many equations does fdi turn round by its own rules, how many sympy, and how fast?

    .venv/bin/python benchmarks/solving.py [MODEL] [LOG]

Every equation that holds with the log is solved for each of its unknowns, once by `isolate`, once
by sympy through the same front end. Both are warm: sympy's import is not counted.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from time import perf_counter

import fdi
from fdi.model.calculus import isolate
from fdi.model.expression import symbols
from fdi.residuals import solve

ROOT = Path(__file__).resolve().parents[1]
LOG = ROOT / "examples" / "crash_logs" / "plane_engine_failure_stall.tlog"


def main() -> None:
    """Print both counts and both times."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("model", nargs="?", default="fixed_wing")
    parser.add_argument("log", nargs="?", default=LOG)
    asked = parser.parse_args()
    system = fdi.load_airframe(asked.model).observe(fdi.read(asked.log))
    pairs = [
        (equation, name)
        for equation in system.equations
        for name in {*symbols(equation.left), *symbols(equation.right)} & system.variables.keys()
    ]
    import sympy

    sympy.solve(sympy.Symbol("x") - 1)
    solved, spent = [0, 0], [0.0, 0.0]
    for equation, name in pairs:
        low = system.variables[name].low
        begun = perf_counter()
        own = isolate(equation.left, equation.right, name, signed=low is None or low < 0)
        spent[0] += perf_counter() - begun
        begun = perf_counter()
        theirs = solve._by_sympy(equation, name)
        spent[1] += perf_counter() - begun
        solved[0] += own is not None
        solved[1] += theirs is not None
    for who, count, seconds in zip(("own rules", "sympy"), solved, spent, strict=True):
        print(f"{who:10} {count:4} of {len(pairs)} in {seconds:.3g} s")


if __name__ == "__main__":
    main()
