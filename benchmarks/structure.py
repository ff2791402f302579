"""How many times faster than the toolbox of record is fdi.structure?

    .venv/bin/python benchmarks/structure.py [MODEL...] [--write]

In: the reference models of ../shared/structural beside the repository; by default all with faults.
Out: two Markdown tables, sets and isolability, CPU time of faultdiagnosistoolbox and how many times
faster fdi is, in pure Python and with compiled code, with geometric means over those models that
have 20 equations and redundancy 3 at least. With ``--write`` they replace what
``docs/structure.md`` holds between its marks, together with the cost of the tutorial there.

What is compared runs in one process, one after the other, on the same machine; the shortest of some
repeats counts. Each comparison has a process of its own, forked after all imports, because the
toolbox may print, run out of memory or never end: after 60 s of CPU or at 6 GB it is stopped.
Compiled code is loaded before the clock starts, as it is in any process that has used it once.
"""

from __future__ import annotations

import json
import math
import os
import resource
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fdi import structure

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT.parent / "shared" / "structural" / "models"
DOCUMENT = ROOT / "docs" / "structure.md"
MARKS = "<!-- {}: begin -->", "<!-- {}: end -->"
CPU_LIMIT_S, MEMORY_LIMIT = 60, 6 << 30
LEAST_S = 0.1  # CPU time of one measurement; short calls are repeated until it is reached
OUTLIER = "rand_u_60_2_7_parts"  # left out of the means: its ratio is in the ten thousands
CAUSALITIES = {"mixed": "mixed", "integral": "int", "derivative": "der"}
SETS = {"MSO": structure.mso_sets, "MTES": structure.mtes_sets}

Call = Callable[[], Any]
Seconds = dict[str, list[float]]
"""For each quantity what Python, compiled code (sets only) and the toolbox take; NaN: no end."""

Found = list[tuple[dict[str, Any], Seconds]]


def cpu_time(call: Call) -> float:
    """Return the CPU seconds of one call, the best of three measurements if they are short."""
    loops = 1
    while True:
        taken = _measured(call, loops)
        if taken >= LEAST_S:
            break
        loops = max(2 * loops, int(loops * LEAST_S / max(taken, 0.01)))
    repeats = 2 if taken < 2 else 0
    return min([taken, *(_measured(call, loops) for _ in range(repeats))]) / loops


def _measured(call: Call, loops: int) -> float:
    start = time.process_time()
    for _ in range(loops):
        call()
    return time.process_time() - start


def toolbox_model(data: dict[str, Any]) -> Any:
    """Return the toolbox's model of a reference file."""
    import faultdiagnosistoolbox as fdt

    incidence = np.zeros((len(data["equations"]), len(data["unknowns"])), dtype=int)
    for equation, unknown, kind in data["incidence"]:
        incidence[equation, unknown] = {"x": 1, "i": 2, "d": 3}[kind]
    names = list(dict.fromkeys(fault["name"] for fault in data["faults"]))
    faults = np.zeros((len(data["equations"]), len(names)), dtype=int)
    for fault in data["faults"]:
        faults[fault["equation"], names.index(fault["name"])] = 1
    return fdt.DiagnosisModel({"type": "MatrixStruc", "X": incidence, "F": faults, "Z": []})


def comparisons(data: dict[str, Any], model: structure.Model) -> Iterator[tuple[str, list[Call]]]:
    """Yield what is compared: its name, and how Python, compiled code and the toolbox do it."""
    toolbox = toolbox_model(data)
    for kind, find in SETS.items():
        if kind.lower() in data["reference"]:  # else enumeration ends nowhere
            yield (
                kind,
                [
                    lambda find=find: list(find(model, compiled=False)),
                    lambda find=find: list(find(model)),
                    getattr(toolbox, kind),
                ],
            )
    for causality, short in CAUSALITIES.items():
        yield (
            causality,
            [
                lambda causality=causality: structure.isolability(model, causality),
                lambda short=short: toolbox.IsolabilityAnalysis(causality=short),
            ],
        )


def timed(calls: list[Call]) -> list[float]:
    """Return the CPU seconds of each call, in a process of its own; NaN from the one that stops."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        try:
            silence = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silence, 1)
            os.dup2(silence, 2)
            for call in calls:
                if call is calls[-1]:
                    spent = math.ceil(time.process_time())
                    resource.setrlimit(resource.RLIMIT_CPU, (spent + CPU_LIMIT_S,) * 2)
                    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT,) * 2)
                os.write(writing, f"{cpu_time(call)!r} ".encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        found = [float(text) for text in pipe.read().split()]
    os.waitpid(child, 0)
    return found + [math.nan] * (len(calls) - len(found))


def measure(names: list[str]) -> Iterator[tuple[dict[str, Any], Seconds]]:
    """Yield each model with the seconds of Python, compiled code and toolbox."""
    for path in sorted(MODELS.glob("*.json")):
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["faults"] and (path.stem in names or not names):
            model = structure.load_reference(path)
            yield data, {what: timed(calls) for what, calls in comparisons(data, model)}
            print(f"{path.stem} is done", file=sys.stderr)


def times(ours: float, toolbox: float) -> str:
    """Return how many times faster ours is, two digits."""
    ratio = toolbox / ours
    return "–" if math.isnan(ratio) else f"{float(f'{ratio:.2g}'):g}"


def milliseconds(seconds: float) -> str:
    return "stops" if math.isnan(seconds) else f"{float(f'{seconds * 1e3:.3g}'):g}"


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table, the first column left, the others right."""
    marks = ["---"] + ["---:"] * (len(head) - 1)
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, marks, *rows))


def mean(ratios: list[float]) -> str:
    """Return number, geometric mean and least of some ratios."""
    known = [ratio for ratio in ratios if not math.isnan(ratio)]
    if not known:
        return "–"
    geometric = math.exp(sum(map(math.log, known)) / len(known))
    least = f"{float(f'{min(known):.2g}'):g}"
    return f"{float(f'{geometric:.3g}'):g} ({len(known)} models, least {least})"


def set_table(found: Found) -> str:
    """Return the table of MSO and MTES with its means."""
    rows: list[list[str]] = []
    ratios: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for data, seconds in found:
        row = size_of(data)
        for kind in SETS:
            if kind not in seconds:
                row += ["–"] * 5
                continue
            python, compiled, toolbox = seconds[kind]
            row += [f"{data['reference'][kind.lower()]['count']:,}", milliseconds(toolbox)]
            row += [milliseconds(python), times(python, toolbox), times(compiled, toolbox)]
            for who, own in (("Python", python), ("compiled", compiled)):
                if is_counted(data):
                    ratios[kind, who, "all"].append(toolbox / own)
                    if toolbox > 0.01:
                        ratios[kind, who, "slow"].append(toolbox / own)
        rows.append(row)
    head = ["model", "equations", "φ"]
    for kind in SETS:
        head += [kind, "toolbox, ms", "Python, ms", "times faster", "compiled"]
    means = [
        [kind, who, *(mean(ratios[kind, who, which]) for which in ("all", "slow"))]
        for kind in SETS
        for who in ("Python", "compiled")
    ]
    words = ["sets", "searched by", "geometric mean", "where the toolbox needs more than 10 ms"]
    return f"{table(words, means)}\n\n{table(head, rows)}"


def isolability_table(found: Found) -> str:
    """Return the table of isolability with its means."""
    rows: list[list[str]] = []
    ratios: dict[tuple[str, str], list[float]] = defaultdict(list)
    for data, seconds in found:
        row = [*size_of(data), str(len({fault["name"] for fault in data["faults"]}))]
        for causality in CAUSALITIES:
            ours, toolbox = seconds[causality]
            row += [milliseconds(toolbox), milliseconds(ours), times(ours, toolbox)]
            ratios[causality, "all"].append(toolbox / ours)
            if is_counted(data) and len(data["equations"]) >= 60:
                ratios[causality, "large"].append(toolbox / ours)
        rows.append(row)
    head = ["model", "equations", "φ", "faults"]
    for causality in CAUSALITIES:
        head += [f"{causality}: toolbox, ms", "fdi, ms", "times faster"]
    means = [
        [causality, mean(ratios[causality, "large"]), mean(ratios[causality, "all"])]
        for causality in CAUSALITIES
    ]
    words = ["causality", "geometric mean from 60 equations up", "all models"]
    return f"{table(words, means)}\n\n{table(head, rows)}"


def tutorial() -> str:
    """Return what both ways through the tutorial of the page cost, each in fresh processes."""
    page = DOCUMENT.read_text(encoding="utf-8")
    model = block(page, "model").replace(">>> ", "").replace("... ", "")
    rows = []
    for name, shown in (("toolbox", "faultdiagnosistoolbox"), ("fdi", "fdi.structure")):
        code = block(page, name)
        imports = "".join(f"{x}\n" for x in code.splitlines() if x.startswith(("import", "from")))
        calls = sum(line.count("(") > 0 for line in code.removeprefix(imports).splitlines())
        importing, calling = least_of_processes(imports, model + code.removeprefix(imports))
        shares = (importing, calling, importing + calling)
        rows.append([f"`{shown}`", str(calls), *(f"{1e3 * share:.0f}" for share in shares)])
    return table(["", "lines with calls", "imports, ms", "calls, ms", "together, ms"], rows)


def block(page: str, title: str) -> str:
    """Return the code of the page that stands under a title."""
    _, _, rest = page.partition(f"<!-- tutorial: {title} -->\n```python\n")
    return rest.partition("```")[0]


def least_of_processes(imports: str, rest: str) -> tuple[float, float]:
    """Return the CPU seconds of a program's imports and of the rest, the least of five runs."""
    stamp = "stamps.append(process_time())\n"
    program = (
        f"from time import process_time\nstamps = []\n{stamp}{imports}{stamp}{rest}\n{stamp}"
        "print(*stamps)"
    )
    runs = []
    for _ in range(5):
        command = [sys.executable, "-c", program]
        told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
        start, between, end = map(float, told.split()[-3:])
        runs.append((between - start, end - between))
    return min(run[0] for run in runs), min(run[1] for run in runs)


def written(page: str, mark: str, text: str) -> str:
    """Return a page with a text between two marks."""
    begin, end = (half.format(mark) for half in MARKS)
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n\n{text}\n\n{end}{after}"


def size_of(data: dict[str, Any]) -> list[str]:
    return [f"`{data['name']}`", str(len(data["equations"])), str(data["reference"]["redundancy"])]


def is_counted(data: dict[str, Any]) -> bool:
    """Return whether a model counts in the means."""
    large = len(data["equations"]) >= 20 and data["reference"]["redundancy"] >= 3
    return large and data["name"] != OUTLIER


def main() -> int:
    """Print the tables, or write them into the document."""
    names = [argument for argument in sys.argv[1:] if argument != "--write"]
    try:
        import faultdiagnosistoolbox  # noqa: F401
    except ImportError as error:
        print(f"skipped: {error}")
        return 0
    if not MODELS.is_dir():
        print(f"skipped: {MODELS} is not here")
        return 0
    list(structure.mso_sets(structure.Model.from_matrix([[1]] * 4), compiled=True))  # load it
    found = list(measure(names))
    texts = {
        "tutorial-times": tutorial(),
        "timings": f"{set_table(found)}\n\n{isolability_table(found)}",
    }
    if "--write" not in sys.argv:
        print("\n\n".join(texts.values()))
        return 0
    page = DOCUMENT.read_text(encoding="utf-8")
    for mark, text in texts.items():
        page = written(page, mark, text)
    DOCUMENT.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
