"""The computation graph says what a residual is made of: held against what the data move."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import EXAMPLES, SHARED

from fdi.model import load_airframe, shipped_models
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.evaluate import compute_node, context_of
from fdi.telemetry import Channel, Sampling, read
from fdi.telemetry.message import Column

pytestmark = pytest.mark.flights

PAPER = Path(__file__).parents[1] / "models" / "paper_77.yaml"  # in it channels choose among roots
PLANES = {
    "tlog": EXAMPLES / "plane_engine_failure_stall.tlog",
    "dataflash": SHARED / "sitl" / "plane" / "p78_no_airspeed_stall_5kg.BIN",
    "ulog": SHARED / "px4_motor" / "sil_01.ulg",  # of no plane
}
COPTERS = {
    "tlog": EXAMPLES / "copter_motor_failure_crash.tlog",
    "dataflash": SHARED / "healthy" / "quad_short.bin",
    "ulog": SHARED / "px4_motor" / "sil_01.ulg",
}
WHOLE = ("fixed_wing", "quadcopter")
"""Of these logs of all formats; of the others, which share their files, of one: `make soak`."""
CASES = [
    pytest.param(
        *(model, path),
        id=f"{model}-{kind}",
        marks=[pytest.mark.soak] * (model not in WHOLE and number % 3 != place),
    )
    for number, model in enumerate(shipped_models())
    for place, (kind, path) in enumerate((PLANES if model == "fixed_wing" else COPTERS).items())
] + [pytest.param(PAPER, SHARED / "paper" / "afrika.tlog", id="paper-tlog")]
WINDOW_S = 200.0
BLOCKS = (2, 3, 5, 7)
"""Seconds for which a channel is changed in one way."""


def changed(column, t, seconds):
    """The column with noise, nothing, zeros and great values in turn, block after block."""
    raw = np.asarray(column.load(), dtype=float)
    known = raw[np.isfinite(raw)]
    size = 10 * max(np.abs(known).max(initial=0.0), 1.0)
    noise = np.random.default_rng(1).normal(size=raw.size) * size
    block = (t // seconds).astype(int) % 6
    ways = [raw, raw + noise, np.full(raw.size, np.nan), 0 * raw, raw + size, raw - size]
    values = np.choose(block, ways)
    return Column(lambda: values, column.conversion)


def with_changed(log, source, field, seconds):
    message = log[source]
    columns = {**message.columns, field: changed(message.columns[field], message.stamp, seconds)}
    other = replace(message, columns=columns, _cache={})
    return replace(log, messages={**log.messages, source: other})


def values(bank, signals):
    """Every residual, computed whole: nothing is asked of what the graph says it reads."""
    context = replace(
        context_of(bank.system, bank.nodes, signals, Differentiation()), spreads=False
    )
    done = {}
    for number, node in enumerate(bank.nodes):
        done[number] = compute_node(node, done, context)
    return np.array([done[generator.node].column for generator in bank.generators])


def resampled(log, source, system, sampling, signals):
    """The signals with what a message shows taken from another log; None: they are the same."""
    requests = [
        r
        for r in system.channels
        if source in (r.channel.source, *(c.source for c, _ in r.stirred))
    ]
    found = log.signals(requests, sampling).columns
    if all(np.array_equal(signals.columns[c], found[c], equal_nan=True) for c in found):
        return None
    return replace(signals, columns={**signals.columns, **found})


@pytest.mark.parametrize(("model", "path"), CASES)
def test_a_changed_channel_moves_the_residuals_whose_signature_has_it_and_no_other(model, path):
    """Values, or whether they are known; fields that no residual reads included."""
    if not path.is_file():
        pytest.skip("no ../shared")
    log = read(path)
    system = load_airframe(model).observe(log)
    bank = build_bank(system, "mtes" if model == PAPER else "mtes+cross_checks")
    begin = next((f.takeoff for f in log.flights if f.takeoff is not None), log.span[0])
    rate = 1.0 if model == PAPER else 5.0  # its loops are slow
    sampling = Sampling(rate_hz=rate, window=(begin, min(begin + WINDOW_S, log.span[1])))
    signals = log.signals(system.channels, sampling)
    healthy = values(bank, signals)
    known = np.isfinite(healthy).any(axis=1)
    assert known.mean() > 0.4
    signatures = bank.signatures
    read_by = [set(bank.channels(generator)) for generator in bank.generators]
    stirs = [
        {c for i in g.equations if (m := system.equations[i].measurement) for c, _ in m.stirred}
        for g in bank.generators
    ]
    # what a message calls unknown is silence: the field then tells of its being there
    silent = [
        {
            (m.channel.source, m.channel.field.split(":")[0])
            for i in g.equations
            if (m := system.equations[i].measurement) and m.silence
        }
        for g in bank.generators
    ]
    # what was kept from standing is read there alone: no block need fall there
    standing = {
        r.channel: {(r.channel.source, f) for f in r.fields} for r in system.channels if r.kept
    }
    stood = [
        {
            one
            for i in g.equations
            if (m := system.equations[i].measurement)
            for one in standing.get(m.channel, ())
        }
        for g in bank.generators
    ]
    fields = {(r.channel.source, f) for r in system.channels for f in log[r.channel.source].fields}
    for source, field in sorted(fields):
        channel = Channel(log[source].name, field, log[source].instance)
        reads = np.array([channel in own for own in read_by])
        gates = np.array([channel in own for own in stirs])  # of a sensor that stands still
        gates |= np.array([(source, field) in own for own in stood])
        moved = np.zeros(len(reads), dtype=bool)
        for seconds in BLOCKS:
            other = with_changed(log, source, field, seconds)
            again = resampled(other, source, system, sampling, signals)
            after = healthy if again is None else values(bank, again)
            moved |= ~((after == healthy) | (np.isnan(after) & np.isnan(healthy))).all(axis=1)
            if (moved >= (reads & known & ~gates)).all():
                break
        quiet = np.array([(source, field) in own for own in silent])
        if str(channel) in signatures:
            holds = signatures[str(channel)].to_numpy()
            assert not (moved & ~holds & ~quiet).any(), (
                f"{channel} moves a residual without its fault"
            )
            assert not (holds & known & ~gates & ~moved).any(), (
                f"{channel} does not move a residual"
            )
        assert (moved <= reads | quiet).all(), f"{channel} moves a residual that does not say so"
        assert (reads & known & ~gates <= moved).all(), f"{channel} is said to move a residual"


@pytest.mark.parametrize("model", shipped_models())
def test_signature_holds_what_the_equations_bring(model):
    bank = build_bank(load_airframe(model).observe())
    names = bank.signature_names()
    assert all(set(g.faults) <= set(own) for g, own in zip(bank.generators, names, strict=True))
