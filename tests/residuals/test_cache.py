"""A bank from the cache is the bank; what is not one is built anew."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fdi import store
from fdi.model import load_airframe
from fdi.residuals import build_bank, cache
from fdi.residuals.cache import _depends_on, cached_bank

from .build import GLIDER, airframe
from .plants import TANKS
from .test_evaluate import LOOP

ROOT = Path(__file__).parents[2]
SLOPE = """
format: 1
name: slope
variables: {u: {unit: m}, v: {unit: m}, gain: {unit: "1"}}
equations:
  k_1: {text: "gain = slope(v, u)", window: 10 s, tolerance: 0.1}
limits:
  l_1: {variable: gain, min: 0.5, component: a}
measurements:
  A: {component: a, fields: {u: {variable: u, accuracy: 1 m}, v: {variable: v, accuracy: 1 m}}}
"""
MODEL = ROOT / "tests" / "models" / "paper_77.yaml"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def parts(bank):
    return bank.nodes, bank.generators, bank.not_implementable


def entry_of(folder):
    return next(folder.glob("bank-*.json"))


def tampered(path, change):
    """Write an entry anew with a right checksum, so that only its content can give it away."""
    head, _, body = path.read_bytes().partition(b"\n")
    tree = json.loads(body)
    change(tree)
    kind, key = head.split()[2:4]
    store.keep(kind.decode(), key.decode(), tree)


def test_second_bank_equals_the_first(folder):
    system = load_airframe(MODEL).observe()
    built = build_bank(system, "mtes")
    assert parts(cached_bank(system, "mtes")) == parts(built)
    assert len(list(folder.glob("bank-*"))) == 1
    assert parts(cached_bank(system, "mtes")) == parts(built)


@pytest.mark.parametrize("text", [GLIDER, LOOP], ids=["derivative", "loop"])
def test_second_bank_is_read_and_not_built(folder, tmp_path, monkeypatch, text):
    system = airframe(tmp_path, text).observe()
    built = cached_bank(system)
    assert any(generator.steps for generator in built.generators)

    def build(*_):
        raise AssertionError("built anew")

    monkeypatch.setattr(cache, "build_bank", build)
    assert parts(cached_bank(system)) == parts(built)


def test_key_holds_what_a_bank_depends_on_and_no_values():
    system = load_airframe(MODEL).observe()
    key = _depends_on(system)
    other = {n: replace(p, value=p.value + 1) for n, p in system.parameters.items()}
    assert _depends_on(replace(system, parameters=other)) == key
    looser = tuple(replace(e, tolerance=e.tolerance + 1) for e in system.equations)
    assert _depends_on(replace(system, equations=looser)) == key
    dearer = (replace(system.equations[0], cost=7.0), *system.equations[1:])
    assert _depends_on(replace(system, equations=dearer)) != key
    assert _depends_on(replace(system, faults=system.faults[1:])) != key


CHANGES = {
    "argument ahead": lambda t: t[0][1].__setitem__(4, [["x", 999]]),
    "negative argument": lambda t: t[0][1].__setitem__(4, [["x", -1]]),
    "equation out of range": lambda t: t[0][0].__setitem__(1, 10_000),
    "unknown kind": lambda t: t[0][0].__setitem__(0, "system"),
    "unknown variable": lambda t: t[0][0].__setitem__(2, ["nobody"]),
    "unknown name in an expression": lambda t: _residual(t).__setitem__(3, [["nobody"]]),
    "unknown operator": lambda t: _residual(t).__setitem__(3, [[1.0, ["os.system", 1]]]),
    "a word as a number": lambda t: _residual(t).__setitem__(3, [[{"text": "x"}, ["sin", 1]]]),
    "too deep": lambda t: _residual(t).__setitem__(3, [[1.0] + [["-", 1]] * 1000]),
    "too long": lambda t: _residual(t).__setitem__(3, [[1.0] * 30_000]),
    "a node that reads a residual": lambda t: _after_a_residual(t)[4].__setitem__(0, _of_it(t)),
    "generator without node": lambda t: t[1][0].__setitem__(3, 99_999),
    "generator of another id": lambda t: t[1][0].__setitem__(0, "<b>"),
    "unknown fault": lambda t: t[1][0].__setitem__(2, ["nobody"]),
    "a list too few": lambda t: t.pop(),
    "fields too few": lambda t: t[0][0].pop(),
    "a mapping": lambda t: t.__setitem__(0, {}),
}


def _residual(tree):
    return next(node for node in tree[0] if node[0] == "residual")


def _after_a_residual(tree):
    """The first node behind a residual that has arguments."""
    behind = tree[0][tree[0].index(_residual(tree)) + 1 :]
    return next(node for node in behind if node[4])


def _of_it(tree):
    """The first argument of that node, read from the residual instead."""
    return [_after_a_residual(tree)[4][0][0], tree[0].index(_residual(tree))]


@pytest.mark.parametrize("name", CHANGES)
def test_a_foreign_entry_is_ignored_and_built_anew(name, folder):
    system = load_airframe(MODEL).observe()
    built = parts(cached_bank(system, "mtes"))
    tampered(entry_of(folder), CHANGES[name])
    assert parts(cached_bank(system, "mtes")) == built
    assert parts(cached_bank(system, "mtes")) == built


FITS = {  # what more of a list leaves a node one that can be computed
    "solve": {"expressions", "arguments"},
    "loop": {"arguments"},
    "residual": {"arguments"},
    "observer": {"arguments"},
    "slope": {"arguments"},
}
FIELDS = {"variables": 2, "expressions": 3, "arguments": 4}
NEEDED = {"part": {"arguments"}, "derivative": {"arguments"}, "slope": {"arguments"}}


@pytest.mark.parametrize(
    "text", [GLIDER, LOOP, TANKS, SLOPE], ids=["plain", "loop", "held", "slope"]
)
def test_a_node_of_another_shape_is_built_anew(text, folder, tmp_path, monkeypatch):
    """Of each of its lists once twice as much, and once nothing."""
    system = airframe(tmp_path, text).observe()
    bank = cached_bank(system, integrate=True)
    entry = entry_of(folder)
    whole = json.loads(entry.read_bytes().partition(b"\n")[2])
    built = []
    monkeypatch.setattr(cache, "build_bank", lambda *a, **k: built.append(1) or bank)
    cached_bank(system, integrate=True)
    assert not built
    for number, node in enumerate(bank.nodes):
        needed = {"variables", "expressions"} | NEEDED.get(node.kind, set())
        for name, place in FIELDS.items():
            own = whole[0][number][place]
            for changed in [2 * own] * (name not in FITS.get(node.kind, ())) + [[]] * (
                name in needed
            ):
                if changed == own:
                    continue
                built.clear()
                tampered(entry, lambda t: t[0][number].__setitem__(place, changed))  # noqa: B023
                cached_bank(system, integrate=True)
                assert built, (node.kind, name, len(changed))
                tampered(entry, lambda t: t.__setitem__(slice(None), whole))


def test_a_second_run_imports_neither_sympy_nor_pint(folder):
    code = (
        "import sys; from fdi.model import load_airframe;"
        "from fdi.residuals.cache import cached_bank;"
        f"print(cached_bank(load_airframe({str(MODEL)!r}).observe()));"
        "heavy = ('sympy', 'pint', 'pydantic', 'ruamel.yaml', 'scipy');"
        "print([name for name in heavy if name in sys.modules])"
    )
    lines = [
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
            timeout=600,
        ).stdout.splitlines()
        for _ in range(2)
    ]
    assert lines[0][0] == lines[1][0]
    assert lines[1][1] == "[]"
