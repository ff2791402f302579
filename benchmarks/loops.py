"""Are algebraic loops solved, or told where they cannot be?

    .venv/bin/python benchmarks/loops.py [COUNT]

In: nothing. Out: of COUNT random loops (10,000) of 2 to 8 equations with known roots, how many are
solved, how many are told to be ambiguous or undecided, how many unknown otherwise, how many wrong.
A loop's equations are sums of two to four terms of its unknowns (multiples, products, squares,
cubes, sines, roots, absolute values) with scales from 1e-4 to 1e4; its root is drawn, and what each
equation has to be is computed from it. Ten samples of each structure differ in root and factors.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

import numpy as np

from fdi.model.evaluate import Column, Floats, evaluate
from fdi.model.expression import Expression, parse
from fdi.model.parts import Variable
from fdi.residuals.newton import solve_loop

SAMPLES = 10
TERMS = (
    "{a}*{x}",
    "{a}*{x}",
    "{a}*{x}",
    "{a}*{x}*{y}",
    "{a}*{x}**2",
    "{a}*{x}**3",
    "{a}*sin({x})",
    "{a}*sqrt({x}**2 + 1)",
    "{a}*{x}*abs({x})",
    "{a}*exp(0.3*{x})",
)


def random_loop(
    rng: np.random.Generator, most: int = 8
) -> tuple[list[Expression], list[Variable], dict[str, Column], Floats]:
    """Return equations, unknowns, columns of what is known, and the roots, (m, n)."""
    m = int(rng.integers(2, most + 1))
    names = [f"x{i}" for i in range(m)]
    linear = rng.random() < 0.3
    roots = rng.uniform(-3, 3, (m, SAMPLES))
    columns: dict[str, Column] = {}
    equations = []
    for row in range(m):
        scale = 10.0 ** rng.uniform(-4, 4)
        columns[f"a{row}"] = scale * rng.uniform(1, 2, SAMPLES)
        text = f"a{row}*x{row}"
        for _ in range(int(rng.integers(1, 4))):
            x, y = rng.choice(m, 2)
            kind = TERMS[0] if linear else TERMS[rng.integers(len(TERMS))]
            text += " + " + kind.format(
                a=f"{scale * rng.uniform(-1, 1):.6g}", x=names[x], y=names[y]
            )
        left = parse(text)
        here = {**columns, **dict(zip(names, roots, strict=True))}
        columns[f"b{row}"] = evaluate(left, here)
        equations.append(parse(f"{text} - b{row}"))
    unknowns = [Variable(name, "1", low=-10.0, high=10.0) for name in names]
    return equations, [Variable(u.name, "1") if linear else u for u in unknowns], columns, roots


def judged(
    equations: list[Expression],
    unknowns: list[Variable],
    columns: dict[str, Column],
    roots: Floats,
) -> Counter[str]:
    """Return how many samples are right, told, unknown, wrong."""
    found = solve_loop(equations, unknowns, columns)
    known = np.isfinite(found.columns).all(axis=0)
    scale = 1e-6 * (1 + np.abs(roots).max(axis=0))
    right = known & np.all(np.abs(found.columns - roots) <= scale, axis=0)
    return Counter(
        right=int(right.sum()),
        told=int((~known & found.ambiguous).sum()),
        unknown=int((~known & ~found.ambiguous).sum()),
        wrong=int((known & ~right).sum()),
    )


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    rng = np.random.default_rng(26)
    begin = time.process_time()
    by_size: dict[int, Counter[str]] = {}
    for _ in range(count // SAMPLES):
        loop = random_loop(rng)
        by_size.setdefault(len(loop[1]), Counter()).update(judged(*loop))
    print("| equations | right | told | unknown | wrong |\n| ---: | ---: | ---: | ---: | ---: |")
    for size, own in sorted(by_size.items()):
        print(f"| {size} | {own['right']} | {own['told']} | {own['unknown']} | {own['wrong']} |")
    total = sum(by_size.values(), Counter())
    print(f"| all | {total['right']} | {total['told']} | {total['unknown']} | {total['wrong']} |")
    print(f"\n{time.process_time() - begin:.0f} s of CPU")


if __name__ == "__main__":
    main()
