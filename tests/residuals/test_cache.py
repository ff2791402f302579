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
from .test_evaluate import LOOP

ROOT = Path(__file__).parents[2]
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
    "generator without node": lambda t: t[1][0].__setitem__(3, 99_999),
    "generator of another id": lambda t: t[1][0].__setitem__(0, "<b>"),
    "unknown fault": lambda t: t[1][0].__setitem__(2, ["nobody"]),
    "a list too few": lambda t: t.pop(),
    "fields too few": lambda t: t[0][0].pop(),
    "a mapping": lambda t: t.__setitem__(0, {}),
}


def _residual(tree):
    return next(node for node in tree[0] if node[0] == "residual")


@pytest.mark.parametrize("name", CHANGES)
def test_a_foreign_entry_is_ignored_and_built_anew(name, folder):
    system = load_airframe(MODEL).observe()
    built = parts(cached_bank(system, "mtes"))
    tampered(entry_of(folder), CHANGES[name])
    assert parts(cached_bank(system, "mtes")) == built
    assert parts(cached_bank(system, "mtes")) == built


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
            timeout=60,
        ).stdout.splitlines()
        for _ in range(2)
    ]
    assert lines[0][0] == lines[1][0]
    assert lines[1][1] == "[]"
