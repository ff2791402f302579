"""Which small mistakes in the code would the tests not notice?

    .venv/bin/python benchmarks/mutations.py [--count N] [--seed N] [--run] [--wider TEST...]

Draws mutations of four rooms, as many of each: a comparison, sign or operator exchanged, a constant
off by one or doubled, a condition dropped, least for most. Rooms, files and places are drawn by a
seed, so nobody picks the easy ones. Without ``--run`` they are listed. With it each is put into a
copy of the repository that has no ``../shared`` beside it, and tests run until one fails: first
those that import the file, then those of its room, then those of ``--wider``. Out: a line for every
mutation, those that no test noticed with their text, and how many of each room were noticed.

A survivor is no proof of a missing test: a mutation may change nothing that can be seen. Which do
has to be looked at, one by one.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
ROOMS: Final = ("decision", "diagnosis", "residuals", "model")
COPIED: Final = ("fdi", "models", "tests", "examples", "docs", "benchmarks", "notebooks")
LONGEST_S: Final = 300.0
"""A mutation that lets tests run for longer is noticed: somebody waits."""
COMPARED: Final = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
OPERATED: Final = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult,
}  # fmt: skip
EXCHANGED: Final = {
    "min": "max", "max": "min", "any": "all", "all": "any", "argmin": "argmax", "argmax": "argmin",
    "maximum": "minimum", "minimum": "maximum", "fmax": "fmin", "fmin": "fmax", "mean": "max",
    "median": "min", "abs": "float",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Mutation:
    """A place in a file, in bytes, and what is put there instead."""

    room: str
    path: str
    line: int
    start: int
    stop: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {_short(self.old)} -> {_short(self.new)}"


def _short(text: str) -> str:
    return " ".join(text.split())


def mutants(path: Path) -> list[Mutation]:
    """Return all mutations of a file, in the order of its text."""
    source = path.read_bytes()
    starts = [0]
    for row in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(row))
    found = []
    for node, new in _visited(ast.parse(source)):
        low = starts[node.lineno - 1] + node.col_offset
        high = starts[node.end_lineno - 1] + node.end_col_offset
        old = source[low:high].decode()
        whole = new if isinstance(node, ast.Constant | ast.stmt) else f"({new})"
        name = str(path.relative_to(ROOT))
        found.append(Mutation(path.parent.name, name, node.lineno, low, high, old, whole))
    return sorted(found, key=lambda one: (one.start, one.stop, one.new))


def _visited(tree: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    """Yield nodes of code that runs with what stands there instead; no types, no words."""
    for node in _run(tree):
        for new in _changed(node):
            yield node, ast.unparse(ast.fix_missing_locations(new))


def _run(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.JoinedStr | ast.Raise | ast.Assert | ast.Import | ast.ImportFrom):
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            # zip's "strict" asserts what is so
            is_claim = isinstance(child, ast.keyword) and child.arg == "strict"
            if isinstance(child, ast.AST) and not is_claim:
                yield from _run(child)


def _changed(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Compare(left, [op], right) if type(op) in COMPARED:
            yield ast.Compare(left, [COMPARED[type(op)]()], right)
        case ast.BinOp(left, op, right) if type(op) in OPERATED and not _is_type(node):
            yield ast.BinOp(left, OPERATED[type(op)](), right)
        case ast.BoolOp(op, values):
            yield ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
            for i in range(len(values)):
                rest = values[:i] + values[i + 1 :]
                yield rest[0] if len(rest) == 1 else ast.BoolOp(op, rest)
        case ast.UnaryOp(ast.USub() | ast.Invert() | ast.Not(), operand):
            yield operand
        case ast.Constant(bool()):
            yield ast.Constant(not node.value)
        case ast.Constant(int()):
            yield ast.Constant(node.value + 1)
        case ast.Constant(float()):
            yield ast.Constant(2.0 * node.value if node.value else 1.0)
        case ast.Call(ast.Attribute(value, name), args, words) if name in EXCHANGED:
            yield ast.Call(ast.Attribute(value, EXCHANGED[name]), args, words)
        case ast.Call(ast.Name(name), args, words) if name in EXCHANGED:
            yield ast.Call(ast.Name(EXCHANGED[name]), args, words)
        case ast.IfExp(test, body, other):
            yield ast.IfExp(test, other, body)
        case ast.If(body=[ast.Return() | ast.Continue() | ast.Break()], orelse=[]):
            yield ast.Pass()
        case ast.AugAssign(target, op, value) if type(op) in OPERATED:
            yield ast.AugAssign(target, OPERATED[type(op)](), value)


def _is_type(node: ast.BinOp) -> bool:
    """Return whether an operation is a union of types."""
    names = [n for n in ast.walk(node) if isinstance(n, ast.Name)]
    types = {"int", "float", "str", "bool", "list", "tuple", "dict", "set"}
    return isinstance(node.op, ast.BitOr) and all(n.id[0].isupper() or n.id in types for n in names)


def drawn(count: int, seed: int) -> list[Mutation]:
    """Return mutations, as many of each room; a room's files in turn, in an order that is drawn."""
    chance = random.Random(seed)
    found: list[Mutation] = []
    for number, room in enumerate(ROOMS):
        here = count // len(ROOMS) + (number < count % len(ROOMS))
        files = {p: mutants(p) for p in sorted((ROOT / "fdi" / room).glob("*.py"))}
        order = [path for path, own in files.items() if own]
        chance.shuffle(order)
        own = []
        for turn in range(here):
            places = files[order[turn % len(order)]]
            own.append(places.pop(chance.randrange(len(places))))
        found += sorted(own, key=lambda one: (one.path, one.start))
    return found


def related(one: Mutation, root: Path) -> Iterator[list[str]]:
    """Yield the tests to try, by path: those of the file, those that name it, those of its room."""
    stem, folder = Path(one.path).stem, root / "tests"
    tests = [str(p.relative_to(root)) for p in sorted(folder.rglob("test_*.py"))]
    room = [name for name in tests if Path(name).parts[1] == one.room]
    own = [name for name in room if Path(name).stem == f"test_{stem}"]
    said = f"fdi.{one.room}.{stem} import"
    near = [n for n in tests if n not in own and said in (root / n).read_text("utf-8")]
    yield own
    yield near
    yield [name for name in room if name not in {*own, *near}]


def noticed(one: Mutation, root: Path, wider: Iterable[str]) -> str | None:
    """Return what noticed a mutation in the copy at ``root``, None where nothing did."""
    path = root / one.path
    whole = path.read_bytes()
    path.write_bytes(whole[: one.start] + one.new.encode() + whole[one.stop :])
    try:
        stages: list[Sequence[str]] = [*related(one, root), [*wider]]
        for tests in stages:
            told = failed(tests, root) if tests else None
            if told is not None:
                return told
        return None
    finally:
        path.write_bytes(whole)


def failed(tests: Sequence[str], root: Path) -> str | None:
    """Return the first test that fails, None where all pass."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "-p", "no:cacheprovider"]
    command += ["-m", "not soak"]  # those of whole flights as well
    environment = {**os.environ, "PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            [*command, *tests], cwd=root, env=environment, capture_output=True, text=True,
            timeout=LONGEST_S,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"runs for more than {LONGEST_S:.0f} s"
    if done.returncode == 0:
        return None
    lines = [row for row in done.stdout.splitlines() if row.startswith(("FAILED", "ERROR"))]
    return lines[0][:120] if lines else "does not run"


def main() -> int:
    """List the mutations, or tell which of them no test notices."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--run", action="store_true", help="try them")
    parser.add_argument("--only", nargs="+", default=[], help="numbers in the list")
    parser.add_argument("--wider", nargs="+", default=[], help="further tests for what is left")
    options = parser.parse_args()
    chosen = list(enumerate(drawn(options.count, options.seed)))
    if options.only:
        chosen = [(i, one) for i, one in chosen if str(i) in options.only]
    if not options.run:
        print("\n".join(f"{i:3d} {one}" for i, one in chosen))
        return 0
    hits: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "repository"
        for name in COPIED:
            shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
        for path in ROOT.iterdir():
            if path.is_file():
                shutil.copy(path, root / path.name)
        for i, one in chosen:
            told = noticed(one, root, options.wider)
            hits[one.room] += told is not None
            print(f"{i:3d} {'SURVIVES' if told is None else 'noticed '} {one}", flush=True)
            if told is not None:
                print(f"      {told}", flush=True)
    for room in ROOMS:
        print(f"{room}: {hits[room]} of {sum(one.room == room for _, one in chosen)} noticed")
    print(f"all: {hits.total()} of {len(chosen)} noticed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
