"""What do residuals reach that may integrate states, and do their alarms equal their signatures?

    .venv/bin/python benchmarks/integral.py [--structure | --plants]

Two tables. The first: pairs of faults that can be told apart on four dynamic models of
``../shared/structural`` beside the repository, by structure and by the tests that a bank can
compute without and with integration. These models are incidence alone; each equation is written
out as a linear one with coefficients by chance, known on one side, so that a real bank is built of
it. An entry that cannot be solved for stays so. The large banks select their tests, and take some
minutes.

The second: three plants that are simulated from their own equations (``tests/residuals/plants.py``)
with each fault from the middle on. A residual alarms where its mean over 25 samples leaves 4.5 of
its predicted standard deviations. A capital letter is an alarm that the signature has, a dot a
residual that is rightly quiet; ``-`` an alarm that is missing, ``!`` one too many.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from fdi import structure
from fdi.model import System, load_airframe
from fdi.residuals import Bank, Differentiation, build_bank

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT.parent / "shared" / "structural" / "models"
NAMES = ("three_tank", "induction_motor", "vep4", "fuel_cell_sensors")
BLOCK, LEVEL = 25, 4.5


def system_of(text: str) -> System:
    """Return the system of a model's text, with all its channels."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text, encoding="utf-8")
        return load_airframe(path).observe()


def written_out(tree: dict[str, Any]) -> str:
    """Return a model of incidence alone as one of equations."""
    rng = np.random.default_rng(0)
    pairs: dict[int, dict[str, int]] = {}
    rows: dict[int, list[int]] = {e: [] for e in range(len(tree["equations"]))}
    for equation, unknown, kind in tree["incidence"]:
        rows[equation].append(unknown)
        if kind != "x":
            pairs.setdefault(equation, {})[kind] = unknown
    order = dict.fromkeys(range(len(tree["unknowns"])), 0)
    for _ in pairs:
        order.update({own["d"]: order[own["i"]] + 1 for own in pairs.values()})
    blocked = {tuple(entry) for entry in tree.get("nonsolvable", [])}
    faulty = {fault["equation"] for fault in tree["faults"]}
    used = {u for row in rows.values() for u in row}
    lines = ["format: 1", "name: written_out", "variables:"]
    units = {u: f"1/s**{order[u]}" if order[u] else "1" for u in sorted(used)}
    lines += [f"  x{u}: {{unit: '{unit}'}}" for u, unit in units.items()]
    lines += [f"  u{e}: {{unit: '1'}}" for e in rows if e not in pairs]
    lines += ["parameters:", "  second: {value: 1, unit: s}", "equations:"]
    for e, row in rows.items():
        if e in pairs:
            lines.append(f"  e_{e}: x{pairs[e]['d']} = der(x{pairs[e]['i']})")
            continue
        sizes = rng.uniform(0.3, 0.9, len(row)).round(3)
        times = [f"*second**{order[u]}" if order[u] else "" for u in row]
        terms = [f"{a}{s}*x{u}" for a, s, u in zip(sizes, times, row, strict=True)]
        fault = f", fault: f_{e}, component: c_{e}" if e in faulty else ""
        solves = ", ".join(f"x{u}" for u in row if (e, u) not in blocked)
        lines.append(f"  e_{e}: {{text: u{e} = {' + '.join(terms)}{fault}, solves: [{solves}]}}")
    lines += ["inputs:", "  Y:", "    fields:"]
    lines += [f"      c{e}: {{variable: u{e}, accuracy: '0.1'}}" for e in rows if e not in pairs]
    return "\n".join(lines)


def pairs_of(bank: Bank, tree: dict[str, Any]) -> np.ndarray:
    """Return which fault a bank tells from which, by the equations that its tests use."""
    place = {equation.name: i for i, equation in enumerate(bank.system.equations)}
    entered: dict[str, set[int]] = {}
    for fault in tree["faults"]:
        entered.setdefault(fault["name"], set()).add(place[f"e_{fault['equation']}"])
    seen = np.array(
        [[bool(own & set(g.equations)) for own in entered.values()] for g in bank.generators]
    ).reshape(-1, len(entered))
    return np.asarray((seen[:, :, None] & ~seen[:, None, :]).any(axis=0))


def structure_table() -> None:
    """Print the pairs that are told apart."""
    print("| model | mixed | integral | bank | with integrate | missing | refused | build, s |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in NAMES:
        tree = json.loads((MODELS / f"{name}.json").read_text(encoding="utf-8"))
        model = structure.load_reference(MODELS / f"{name}.json")
        promised = structure.isolability(model, "integral")
        system = system_of(written_out(tree))
        plain = pairs_of(build_bank(system, "selected"), tree)
        begun = time.perf_counter()
        bank = build_bank(system, "selected", integrate=True)
        spent = time.perf_counter() - begun
        found = pairs_of(bank, tree)
        print(
            f"| {name} | {structure.isolability(model).sum()} | {promised.sum()} | {plain.sum()} | "
            f"{found.sum()} | {(promised & ~found).sum()} | {len(bank.not_implementable)} | "
            f"{spent:.1f} |",
            flush=True,
        )


def plants_table() -> None:
    """Print which residuals alarm for which fault."""
    sys.path.insert(0, str(ROOT))
    from tests.residuals.plants import PLANTS, signals_of

    print("| plant | fault | " + "alarms by residual | unknown | us per residual and sample |")
    print("| --- | --- | --- | ---: | ---: |")
    for name, plant in PLANTS.items():
        bank = build_bank(system_of(plant.text), "mtes+cross_checks", integrate=True)
        faults = [fault.name for fault in bank.system.faults]
        recipe = Differentiation(window_s=5 / plant.rate_hz)
        for fault in ("", *plant.sizes):
            signals = signals_of(bank, plant.run(fault), plant.rate_hz)
            begun = time.perf_counter()
            found = bank.evaluate(signals, recipe)
            spent = (time.perf_counter() - begun) / found.values.size
            with np.errstate(invalid="ignore"):
                z = np.nan_to_num(found.values / found.spread)[:, plant.samples // 10 :]
            whole = z.shape[1] // BLOCK * BLOCK
            blocks = z[:, :whole].reshape(len(z), -1, BLOCK).mean(axis=2) * np.sqrt(BLOCK)
            alarms = (np.abs(blocks) > LEVEL).any(axis=1)
            own = bank.sensitivity[:, faults.index(fault)] if fault else np.zeros(len(z), bool)
            marks = {(1, 1): "A", (0, 0): ".", (0, 1): "-", (1, 0): "!"}
            shown = "".join(marks[int(a), int(o)] for a, o in zip(alarms, own, strict=True))
            unknown = np.isnan(found.values).mean()
            print(
                f"| {name} | {fault or 'none'} | `{shown}` | {unknown:.1%} | {1e6 * spent:.0f} |",
                flush=True,
            )


def main() -> int:
    """Print the tables."""
    if "--plants" not in sys.argv:
        if MODELS.is_dir():
            structure_table()
        else:
            print(f"skipped: {MODELS} is not here")
    if "--structure" not in sys.argv:
        plants_table()
    return 0


if __name__ == "__main__":
    sys.exit(main())
