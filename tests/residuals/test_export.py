"""The exported module gives the bank's own residuals, with numpy alone."""

import json
import subprocess
import sys

import numpy as np
import pytest
from flights import EXAMPLES

import fdi
from fdi.model import load_airframe
from fdi.model.given import Function
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.export import python_module
from fdi.telemetry import read

from .build import GLIDER, airframe
from .plants import TANKS
from .test_cache import SLOPE
from .test_evaluate import ROOT, signals, truth

LOG = EXAMPLES / "copter_gps_loss_landing.tlog"
TOLERANCE = 1e-9  # of the residual's size

RUN = """
import json, sys
import numpy as np
import residuals
assert not [name for name in sys.modules if name.startswith(("fdi", "scipy", "sympy", "pandas"))]
given = np.load("given.npz", allow_pickle=False)
told = json.load(open("told.json"))
state = {name: given["state " + name] for name in told["states"]}
columns = {name: given[name] for name in residuals.CHANNELS}
found = residuals.residuals(columns, told["rate"], state, told["spacing"])
np.savez("found.npz", **found)
"""


def run_alone(source, signals, folder):
    """Return what the module computes in an interpreter that knows nothing of the package."""
    (folder / "residuals.py").write_text(source, encoding="utf-8")
    columns = {str(channel): column for channel, column in signals.columns.items()}
    states = signals.state.named()
    arrays = columns | {f"state {name}": np.asarray(v, None) for name, v in states.items()}
    np.savez(folder / "given.npz", **{k: _plain(v) for k, v in arrays.items()})
    spacing = {str(c): float(v) for c, v in signals.spacing.items() if np.isfinite(v)}
    told = {"rate": signals.rate_hz, "spacing": spacing, "states": list(states)}
    (folder / "told.json").write_text(json.dumps(told), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-P", "-c", "import sys; sys.path.insert(0, '')\n" + RUN],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        env={},
    )
    assert done.returncode == 0, done.stderr
    return dict(np.load(folder / "found.npz"))


def _plain(values):
    return np.asarray(values, dtype=str) if values.dtype == object else values


def assert_equal(found, bank, residuals):
    for generator, own in zip(bank.generators, residuals.values, strict=True):
        if generator.id not in found:
            continue
        other = found[generator.id]
        assert np.array_equal(np.isnan(other), np.isnan(own)), generator.id
        assert np.nanmax(np.abs(other - own), initial=0) <= TOLERANCE * (
            1 + np.nanmax(np.abs(own), initial=0)
        )


def test_the_exported_bank_of_an_airframe_equals_ours_on_a_log(tmp_path):
    chain = fdi.residuals_of(read(LOG))
    found = run_alone(python_module(chain.bank, chain.residuals.recipe), chain.signals, tmp_path)
    assert len(found) >= len(chain.bank.generators) - 1
    assert_equal(found, chain.bank, chain.residuals)


@pytest.mark.parametrize(
    "recipe",
    [
        Differentiation(),
        Differentiation("local_line", 3.0),
        Differentiation("backward_from_zero", imaginary="real_part"),
    ],
)
def test_gaps_roots_and_conditions_are_exported(recipe, tmp_path):
    bank = build_bank(airframe(tmp_path).observe(), "mtes+cross_checks")
    rng = np.random.default_rng(0)
    columns = {name: c + rng.normal(0, 3, c.shape) for name, c in truth(100).items()}
    columns["GPS_RAW_INT.vel"][40:45] = np.nan
    given = signals(bank.system, columns)
    source = python_module(bank, recipe)
    found = run_alone(source, given, tmp_path)
    assert len(bank.generators) - len(found) == source.count("has an algebraic loop") == 2
    assert_equal(found, bank, bank.evaluate(given, recipe))


def test_the_module_holds_the_signatures_and_says_what_it_lacks(tmp_path):
    text = GLIDER.replace("sqrt(v_n**2 + v_e**2)", "size(v_n, v_e)")
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    size = Function(np.hypot, ("m/s", "m/s"), "m/s")
    bank = build_bank(load_airframe(path, {"size": size}).observe(), "mtes+cross_checks")
    space: dict = {}
    exec(python_module(bank), space)  # noqa: S102
    every = dict(zip([g.id for g in bank.generators], bank.signature_names(), strict=True))
    assert {**space["SIGNATURES"], **dict.fromkeys(space["NOT_EXPORTED"])}.keys() == every.keys()
    assert all(every[name] == own for name, own in space["SIGNATURES"].items())
    assert any("size" in why for why in space["NOT_EXPORTED"].values())


SHOWN = "  C: {component: c, group: sensor, fields: {p: {variable: p}}}\n"
CIRCLE = """
format: 1
name: circle
variables: {c: {unit: rad, circular: true}, s: {unit: "1"}}
parameters: {least: {value: -0.9, unit: "1"}}
equations:
  k: {text: "s = cos(c)", solves: [c], when: "not (s < least)"}
measurements:
  A: {component: a, group: sensor, fields: {s: {variable: s}}}
  C: {component: c, group: sensor, fields: {p: {variable: c}}}
"""
SEVERAL = {
    "of which nothing tells one": ROOT,
    "with a domain": ROOT.replace('p: {unit: "1"}', 'p: {unit: "1", domain: [0, null]}'),
    "with a lower side": ROOT.replace('p: {unit: "1"}', 'p: {unit: "1", domain: [-9, 0]}'),
    "and a channel": ROOT + SHOWN,
    "of an angle": CIRCLE,
}


@pytest.mark.parametrize("imaginary", ["unknown", "real_part"])
@pytest.mark.parametrize("which", SEVERAL)
def test_an_equation_with_several_roots_is_exported(which, imaginary, tmp_path):
    bank = build_bank(airframe(tmp_path, SEVERAL[which]).observe(), "mtes+cross_checks")
    recipe = Differentiation(imaginary=imaginary)
    n = np.arange(12.0)
    columns = {"A.twice": 8 - n, "B.q": 5 - n, "C.p": 4 * np.cos(n), "A.s": np.sin(n)}
    given = signals(
        bank.system, {str(c.channel): columns[str(c.channel)] for c in bank.system.channels}
    )
    found = run_alone(python_module(bank, recipe), given, tmp_path)
    assert len(found) == len(bank.generators) > 0
    assert_equal(found, bank, bank.evaluate(given, recipe))


@pytest.mark.parametrize(("text", "why"), [(TANKS, "integrates states"), (SLOPE, "has a slope")])
def test_what_needs_more_than_a_sample_and_its_neighbours_is_told_and_not_exported(
    text, why, tmp_path
):
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks", integrate=True)
    space: dict = {}
    exec(python_module(bank), space)  # noqa: S102
    assert any(own.startswith(why) for own in space["NOT_EXPORTED"].values())
    assert space["NOT_EXPORTED"].keys().isdisjoint(space["SIGNATURES"])
