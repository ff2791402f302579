"""Residuals behind which states are integrated: known answers, gaps, and what is refused."""

import numpy as np
import pytest

from fdi.decision.policy import load_policy, policy_text
from fdi.residuals import Differentiation, build_bank, cache
from fdi.residuals.cache import cached_bank
from fdi.residuals.kalman import Along, Filtered, State, follow, walk
from fdi.residuals.respond import respond, stretch
from fdi.residuals.rules import Reason

from .build import airframe
from .plants import ENGINE, PLANTS, TANKS, signals_of

TANK = """
format: 1
name: tank
variables:
  level: {unit: m}
  rise: {unit: m/s}
  flow: {unit: m/s}
parameters:
  a: {value: 0.05, unit: 1/s}
equations:
  e_1: rise = der(level)
  e_2: rise = flow - a*level
measurements:
  TANK:
    fields:
      level: {variable: level, accuracy: 0.05 m}
      flow: {variable: flow, accuracy: 0.02 m/s}
"""
A, RATE = 0.05, 5.0


def built(folder, text=TANK):
    return build_bank(airframe(folder, text).observe(), "mtes+cross_checks", integrate=True)


def run(bank, columns, rate=RATE, recipe=None):
    return bank.evaluate(signals_of(bank, columns, rate), recipe or Differentiation())


def tank(n, seed=1, start=37.0, noise=1.0):
    """A tank that is filled by a flow; the level is the exact solution for a flow held in steps."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / RATE
    w = 0.3
    flow = 0.1 + 0.05 * np.sin(w * t)
    # of rise = 0.1 + 0.05 sin(w t) - A level
    steady = 2.0 + 0.05 * (A * np.sin(w * t) - w * np.cos(w * t)) / (A**2 + w**2)
    level = steady + (start - steady[0]) * np.exp(-A * t)
    return {
        "TANK.level": level + noise * rng.normal(0, 0.05, n),
        "TANK.flow": flow + noise * rng.normal(0, 0.02, n),
    }


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    return built(tmp_path_factory.mktemp("tank"))


def test_a_state_is_integrated_instead_of_a_noisy_derivative(bank):
    (generator,) = bank.generators
    node = bank.nodes[generator.node]
    assert (node.kind, node.variables, node.states) == ("observer", ("level", "rise"), 1)
    assert generator.faults == ("TANK.level", "TANK.flow")


def test_the_unknown_start_is_forgotten_and_the_noise_is_as_predicted(bank):
    found = run(bank, tank(1900))
    values, spread = found.values[0], found.spread[0]
    assert np.isfinite(values[5:]).all()
    assert np.isnan(values[0])
    assert np.nanstd(values) == pytest.approx(np.nanmedian(spread), rel=0.05)
    assert abs(np.nanmean(values)) < 4 * spread[-1] / np.sqrt(1900)
    later = values[5:-1] @ values[6:] / (values[5:] @ values[5:])
    assert abs(later) < 0.08  # innovations are independent


def test_however_little_the_data_move_the_start_is_unknown_at_first(bank):
    found = run(bank, {name: np.zeros(100) for name in ("TANK.level", "TANK.flow")})
    assert np.isnan(found.values[0, 0])
    assert np.isfinite(found.values[0, 5:]).all()


def test_the_gain_is_that_of_the_steady_riccati_equation(bank):
    """Noise of one source alone comes through as scipy's Riccati equation says."""
    from scipy.linalg import solve_discrete_are

    found = run(bank, tank(600))
    h = 1 / RATE
    forward = (1 - h * A / 2) / (1 + h * A / 2)
    half = h / 2 / (1 + h * A / 2) * 0.02
    # the state beside the flow's noise at the same sample, which enters the next step again
    step = np.array([[forward, half], [0.0, 0.0]])
    noise = np.array([[half], [1.0]])
    seen = np.array([[1.0, 0.0]])
    p = solve_discrete_are(step.T, seen.T, noise @ noise.T, np.array([[0.05**2]]))
    assert found.spread[0, -1] == pytest.approx(np.sqrt(p[0, 0] + 0.05**2), rel=2e-3)


def test_integration_is_exact_to_second_order_in_the_step(bank):
    """Without noise what is left is the trapezoidal rule's error, four times at twice the step."""
    columns = tank(3000, noise=0)
    left = []
    for every in (2, 4):
        coarse = {name: column[::every] for name, column in columns.items()}
        values = run(bank, coarse, RATE / every).values[0]
        # the same time after the start, and per step: the gain is another at another rate
        left.append(np.abs(values[len(values) // 2 :]).max())
    assert left[0] < 1e-3
    assert 2 < left[1] / left[0] < 12


def test_uneven_steps_are_integrated_over_the_time_that_they_take(bank):
    from dataclasses import replace

    signals = signals_of(bank, tank(1200, noise=0), RATE)
    kept = np.sort(np.random.default_rng(0).choice(1200, 700, replace=False))
    uneven = replace(
        signals,
        t=signals.t[kept],
        columns={channel: column[kept] for channel, column in signals.columns.items()},
    )
    found = bank.evaluate(uneven, Differentiation())
    assert np.abs(found.values[0, 200:]).max() < 2e-3  # with the mean step it would be 0.02


def test_a_gap_of_what_is_integrated_starts_anew_and_one_of_the_residual_does_not(bank):
    columns = tank(600)
    columns["TANK.flow"][300:320] = np.nan
    columns["TANK.level"][450:470] = np.nan
    values = run(bank, columns).values[0]
    assert np.isnan(values[300:321]).all()
    assert np.isfinite(values[330:450]).all()
    assert np.isnan(values[450:470]).all()
    assert np.isfinite(values[470:]).all()
    assert np.nanmax(np.abs(values)) < 0.4


def test_where_a_condition_does_not_hold_nothing_is_integrated(tmp_path):
    text = TANK.replace(
        "  e_2: rise = flow - a*level",
        ('  e_2: {text: "rise = flow - a*level", when: "flow > low"}'),
    ).replace("parameters:", "parameters:\n  low: {value: 0.0, unit: m/s}")
    bank = built(tmp_path, text)
    columns = tank(400)
    columns["TANK.flow"][200:210] = -1.0
    filled = 5.0 * np.exp(-A * np.arange(190) / RATE)  # while nobody looked, and it runs out again
    columns["TANK.level"][210:] += filled
    values = run(bank, columns).values[0]
    assert np.isnan(values[200:211]).all()
    assert np.nanmax(np.abs(values)) < 0.4


def test_without_a_stated_accuracy_no_gain_can_be_chosen(tmp_path):
    text = TANK.replace(", accuracy: 0.05 m}", "}").replace(", accuracy: 0.02 m/s}", "}")
    bank = built(tmp_path, text)
    assert bank.generators[0].node is not None
    assert bank.nodes[bank.generators[0].node].kind != "observer"


def test_a_nonlinear_set_needs_domains_to_start_from(tmp_path):
    bank = built(tmp_path, ENGINE.replace(", domain: [50, 700]", ""))
    reasons = {r.why: r.reason for r in bank.not_implementable}
    assert Reason.INTEGRATION in reasons.values()
    assert any("n: integrated in equations that are not linear" in why for why in reasons)


def test_a_faults_answer_is_computed_over_a_piece_of_the_flight(bank):
    found = run(bank, tank(400))
    piece = stretch(found, slice(100, 300))
    (channel,) = [i for i, e in enumerate(bank.system.equations) if e.fault == "TANK.flow"]
    change = respond(piece, {channel: np.full(200, 0.5)})[0]
    assert np.nanmax(np.abs(change)) > 5 * found.spread[0, -1]


@pytest.mark.parametrize("circular", [False, True])
def test_both_walks_over_samples_say_the_same(circular):
    pytest.importorskip("numba")
    from fdi.residuals.kalman_compiled import walk as compiled

    rng = np.random.default_rng(5)
    m, n, s = 80, 3, 4
    along = Along(
        np.eye(n) + rng.normal(0, 0.1, (m, n, n)),
        rng.normal(0, 1, (m, n)),
        rng.normal(0, 0.1, (m, s, n)),
        rng.normal(0, 0.1, (m, s, n)),
        rng.normal(0, 1, (m, n)),
        np.where(rng.random(m) < 0.1, np.nan, rng.normal(0, 3, m)),
        rng.normal(0, 1, (m, s)),
    )
    roots = rng.normal(0, 1, (s, n, n))
    start = State(
        rng.normal(0, 1, n), roots @ roots.swapaxes(1, 2), np.zeros((s, n)), np.zeros((s, n))
    )
    found = []
    for kernel in (walk, compiled):
        state = State(*(np.array(part) for part in start))
        shapes = ((m,), (m, s), (m, s), (m, n), (m, n), (m, n))
        told = Filtered(*(np.full(shape, np.nan) for shape in shapes))
        kernel(along, state, np.full(n, -2.0), np.full(n, 2.0), circular, told)
        found.append([*told, *state])
    for one, other in zip(*found, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-12, nan_ok=True)


def test_parts_of_the_variance_are_what_each_source_does_alone():
    """A simulation of many runs has the predicted variance, with noise that enters twice."""
    rng = np.random.default_rng(2)
    m, runs = 20, 300
    step, push = np.full((m, 1, 1), 0.95), np.zeros((m, 1))
    before, after = np.zeros((m, 3, 1)), np.zeros((m, 3, 1))
    before[:, 1], after[:, 1] = 0.4, 0.3
    direct = np.zeros((m, 3))
    direct[:, 1], direct[:, 2] = 0.5, 1.0
    cov = np.zeros((3, 1, 1))
    cov[0] = 4.0
    start = State(np.zeros(1), cov, np.zeros((3, 1)), np.zeros((3, 1)))
    ends = (np.full(1, -np.inf), np.full(1, np.inf))
    shown = []
    predicted = None
    for _ in range(runs):
        w = rng.normal(0, 1, (m, 3))
        x, h = rng.normal(0, 2), np.zeros(m)
        for k in range(m):
            h[k] = -x + direct[k] @ w[k]
            if k + 1 < m:
                x = 0.95 * x - before[k, :, 0] @ w[k] - after[k, :, 0] @ w[k + 1]
        c = np.ones((m, 1))
        along = Along(step, push, before, after, c, h, direct)
        found, _ = follow(along, start, *ends, circular=False, fast=False)
        shown.append(found.residual)
        predicted = found.variance.sum(axis=1)
    share = np.var(shown, axis=0) / predicted
    assert share.mean() == pytest.approx(1.0, abs=0.08)
    assert share == pytest.approx(np.ones(m), abs=0.4)


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_with_each_fault_the_alarms_equal_the_signatures(name, tmp_path):
    """A residual alarms where its mean over 25 samples leaves 4.5 of its standard deviations."""
    plant = PLANTS[name]
    bank = built(tmp_path, plant.text)
    names = [fault.name for fault in bank.system.faults]
    recipe = Differentiation(window_s=5 / plant.rate_hz)
    # of the engine, which is slow, two of four; benchmarks/integral.py has all
    faults = ("ECU.angle", "ECU.map") if name == "engine" else tuple(plant.sizes)
    for fault in ("", *faults):
        found = run(bank, plant.run(fault), plant.rate_hz, recipe)
        with np.errstate(invalid="ignore"):
            z = np.nan_to_num(found.values / found.spread)[:, plant.samples // 10 :]
        blocks = z[:, : z.shape[1] // 25 * 25].reshape(len(z), -1, 25).mean(axis=2) * 5
        alarms = (np.abs(blocks) > 4.5).any(axis=1)
        expected = bank.sensitivity[:, names.index(fault)] if fault else np.zeros(len(z), bool)
        assert alarms.tolist() == expected.tolist(), fault
        assert np.isfinite(found.values).mean() > 0.95


def test_a_kept_bank_that_integrates_is_read_and_not_built(tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "cache"))
    system = airframe(tmp_path, TANKS).observe()
    first = cached_bank(system, integrate=True)
    assert cached_bank(system).nodes != first.nodes
    monkeypatch.setattr(cache, "build_bank", None)
    again = cached_bank(system, integrate=True)
    assert (again.nodes, again.generators) == (first.nodes, first.generators)


def test_a_policy_may_ask_for_it(tmp_path):
    plain = load_policy("default")
    assert not plain.integrate
    write = tmp_path / "p.yaml"
    text = policy_text(plain)
    assert "integrate: false" in text
    write.write_text(text.replace("integrate: false", "integrate: true"), encoding="utf-8")
    assert load_policy(write).integrate


def test_without_the_option_a_bank_is_as_it_was(tmp_path):
    plain = build_bank(airframe(tmp_path, TANKS).observe(), "mtes+cross_checks")
    assert {node.kind for node in plain.nodes}.isdisjoint({"observer"})
    assert {r.reason for r in plain.not_implementable} == {Reason.DYNAMIC_LOOP}
