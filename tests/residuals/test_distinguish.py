"""How large a fault must be to be seen and told: known answers, and draws of the noise itself."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.errors import UsageError
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.distinguish import (
    _crossing,
    at_smallest,
    best_test,
    distinguishability,
    smallest_size,
)
from fdi.residuals.respond import stretch
from fdi.residuals.suffice import Wish, both_ways, cheapest_sensors, cheapest_tests
from fdi.residuals.window import at_sizes, window_of

from .build import airframe
from .test_evaluate import signals, truth

THREE = """
format: 1
name: three
components: {a: {group: sensor}}
variables: {p: {unit: m}}
measurements:
  A: {component: a, fields: {p: {variable: p, accuracy: 1 m}}}
  B: {component: a, fields: {p: {variable: p, accuracy: 2 m}}}
  C: {component: a, fields: {p: {variable: p, accuracy: 3 m, jitter: 1 m}}}
"""


@pytest.fixture(scope="module")
def glider(tmp_path_factory):
    bank = build_bank(airframe(tmp_path_factory.mktemp("m")).observe(), "mtes+cross_checks")
    return bank.evaluate(signals(bank.system, truth(200)), Differentiation())


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    bank = build_bank(airframe(tmp_path_factory.mktemp("n"), THREE).observe(), "mtes")
    columns = {f"{name}.p": np.zeros(100) for name in "ABC"}
    return bank.evaluate(signals(bank.system, columns), Differentiation())


def test_sensors_of_one_quantity_have_the_distances_of_the_formula(three):
    """A fault at A against what B and C say together: sigma of their best mean, per sample.

    C's part that does not change counts once: 8 m^2 for the window, 1 m^2 for each of 10 samples.
    """
    window = window_of(three, 5.0, 2.0)
    found = distinguishability(window)
    n = 10
    mean_b, mean_c = 2**2 / n, 8 + 1**2 / n
    others = 1 / (1 / mean_b + 1 / mean_c)
    assert found.detected[0] == pytest.approx(0.5 / (1 / n + others), rel=2e-2)
    # B may be wrong in any way: only C is left
    assert found.told[0, 1] == pytest.approx(0.5 / (1 / n + mean_c), rel=2e-2)
    assert found.told[1, 0] == pytest.approx(0.5 / (mean_b + mean_c), rel=2e-2)


def test_a_drift_has_the_energy_of_its_ramp(three):
    window = window_of(three, 5.0, 2.0, "drift", ["A.p"])
    ramp = np.arange(10) / 5.0
    # white noise of A and B, and C's with its constant
    noise = np.eye(10) * 1.0
    other_b, other_c = np.eye(10) * 4.0, np.eye(10) + 8.0
    joint = noise + np.linalg.inv(np.linalg.inv(other_b) + np.linalg.inv(other_c))
    expected = 0.5 * ramp @ np.linalg.solve(joint, ramp)
    assert distinguishability(window).detected[0] == pytest.approx(expected, rel=2e-2)
    assert window.units == ("m/s",)


def test_two_sensors_alone_cannot_be_told_apart(three):
    bank = [i for i, g in enumerate(three.bank.generators) if "C.p" not in g.faults]
    found = distinguishability(window_of(three, 5.0, 2.0), bank)
    assert found.told[0, 1] == found.told[1, 0] == 0
    assert found.detected[0] > 0
    assert found.detected[2] == 0


@pytest.fixture(scope="module")
def seen(glider):
    return window_of(glider, 10.0, 3.0)


def test_telling_is_never_easier_than_seeing(seen):
    found = distinguishability(seen)
    detected = found.detected[:, None] * np.ones(len(found.names))
    known = np.isfinite(found.told)
    assert (found.told[known] <= detected[known] * (1 + 1e-9)).all()


@pytest.mark.parametrize(
    ("lengths", "size"),
    [
        ([0.0, 1.0, 3.0, 5.0], 2.5),  # half of the way from 1 to 3
        ([2.0, 3.0, 4.0, 5.0], 1.0),
        ([0.0, 3.0, 1.0, 5.0], 3.25),  # what is lost again does not count
        ([0.0, 1.0, 1.0, 1.5], np.inf),
    ],
)
def test_a_fault_is_seen_from_where_it_is_seen_for_good(lengths, size):
    assert _crossing(np.array([1.0, 2.0, 3.0, 4.0]), np.array(lengths), 2.0) == size


def test_smallest_size_of_a_distance_is_that_of_normal_quantiles():
    assert smallest_size(np.array([0.5]), 0.05, 0.5)[0] == pytest.approx(1.959964, rel=1e-6)
    assert np.isinf(smallest_size(np.array([0.0]), 0.05)[0])


@pytest.mark.parametrize(
    ("fault", "other"),
    [
        ("GPS_RAW_INT.cog", None),
        ("VFR_HUD.alt", None),
        ("GPS_RAW_INT.vel", "LOCAL_POSITION_NED.vx"),
    ],
)
def test_draws_of_the_noise_are_found_as_often_as_predicted(glider, seen, fault, other):
    """The bank itself, not its linear form, with noise in the channels of many windows."""
    window = seen
    found = distinguishability(window)
    i = found.names.index(fault)
    distance = found.detected[i] if other is None else found.told[i, found.names.index(other)]
    size = float(smallest_size(distance, 0.02, 0.9))
    weights = best_test(window, fault, other)
    healthy = np.abs(_drawn(glider, window, weights, fault, 0.0)) > 2.326
    faulty = np.abs(_drawn(glider, window, weights, fault, size)) > 2.326
    assert healthy.mean() == pytest.approx(0.02, abs=0.02)
    assert faulty.mean() == pytest.approx(0.9, abs=0.05)


DRAWS, LENGTH, APART = 300, 15, 25


def _drawn(residuals, window, weights, fault, size):
    """Return the best test's values in windows of one long flight with noise in all channels."""
    rng = np.random.default_rng(7)
    bank = residuals.bank
    steady = {name: np.full(DRAWS * APART, own[0]) for name, own in truth(2).items()}
    t = np.arange(DRAWS * APART) / 5.0
    steady["VFR_HUD.alt"] = 100 + 2.0 * t
    began = (np.arange(DRAWS * APART) % APART) >= 5
    for equation in bank.system.equations:
        if equation.measurement is not None:
            noise = rng.normal(0, equation.measurement.accuracy, t.size)
            name = str(equation.measurement.channel)
            steady[name] = steady[name] + noise + size * began * (name == fault)
    long = replace(residuals, signals=signals(bank.system, steady))
    piece = stretch(long, slice(0, t.size))
    columns = np.array([piece.nodes[g.node].column for g in bank.generators])
    columns = columns.reshape(len(columns), DRAWS, APART)[:, :, 5 : 5 + LENGTH]
    assert np.bincount(window.residual).tolist() == [LENGTH] * len(columns)
    values = columns.transpose(1, 0, 2).reshape(DRAWS, -1)
    return values @ weights


def test_the_cheapest_tests_and_sensors_are_the_ones_by_hand(three):
    window = window_of(three, 5.0, 2.0)
    bank = three.bank
    only = cheapest_tests(window, bank, [Wish("A.p", 10.0)], 0.01)
    assert len(only) == 1
    assert cheapest_sensors(window, bank, [Wish("A.p", 4.0)], 0.01) == ("A", "B")
    assert cheapest_sensors(window, bank, [Wish("A.p", 20.0)], 0.01, costs={"B": 5.0}) == ("A", "C")
    told = both_ways("A.p", 20.0, "B.p", 20.0)
    assert cheapest_sensors(window, bank, told, 0.01) == ("A", "B", "C")
    assert cheapest_sensors(window, bank, [Wish("A.p", 0.1)], 0.01) is None


def test_what_shows_only_without_stated_noise_has_no_size(tmp_path):
    text = THREE.replace(", accuracy: 1 m", "").replace(", accuracy: 2 m", "")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes")
    found = bank.evaluate(
        signals(bank.system, {f"{n}.p": np.zeros(100) for n in "ABC"}), Differentiation()
    )
    rows = [i for i, g in enumerate(bank.generators) if "C.p" not in g.faults]
    assert np.isnan(distinguishability(window_of(found, 5.0, 2.0), rows).detected[0])


def test_a_window_beyond_the_flight_is_refused(three):
    with pytest.raises(UsageError, match="not within"):
        window_of(three, 19.5, 5.0)
    with pytest.raises(UsageError, match="no fault"):
        window_of(three, 5.0, faults=["D.p"])


def test_unknown_samples_bring_nothing(tmp_path):
    bank = build_bank(airframe(tmp_path, THREE).observe(), "mtes")
    columns = {f"{n}.p": np.zeros(100) for n in "ABC"}
    columns["A.p"][30:32] = np.nan
    own = bank.evaluate(signals(bank.system, columns), Differentiation())
    assert own.signals.rate_hz == 5.0
    window = window_of(own, 5.0, 2.0, faults=["A.p"])
    mean_b = 4 / 8
    assert distinguishability(window, [0]).detected[0] <= 0.5 / (1 / 8 + mean_b) * 1.01


@pytest.mark.parametrize("profile", ["step", "drift"])
def test_where_all_is_linear_a_fault_of_any_size_moves_each_test_by_its_slope(three, profile):
    window = window_of(three, 5.0, 2.0, profile)
    found = at_sizes(window, three, {"A.p": 3.0, "B.p": -7.0})
    assert found.at.tolist() == [3.0, -7.0, 0.0]
    assert found.response == pytest.approx(window.response, abs=1e-9)
    # of the tests that hold it, by as much as it is
    after = np.ones(10) if profile == "step" else np.arange(10) / 5.0
    for fault, own in zip(found.names, found.response, strict=True):
        for row, generator in enumerate(three.bank.generators):
            moved = after if fault in generator.faults else 0.0
            assert np.abs(own[found.residual == row]) == pytest.approx(moved, abs=1e-9)


KINK = """
format: 1
name: kink
components: {a: {group: sensor}}
variables: {p: {unit: m}, q: {unit: m}}
equations: {bent: "q = abs(p)"}
measurements:
  A: {component: a, fields: {p: {variable: p, accuracy: 1 m}}}
  B: {component: a, fields: {q: {variable: q, accuracy: 1 m}}}
"""


@pytest.mark.parametrize(("flown", "seen_more"), [(0.5, True), (500.0, False)])
def test_beside_a_corner_the_size_is_that_of_the_bank_itself(tmp_path, flown, seen_more):
    """By the slope over one accuracy to both sides half of A shows in it, further off all."""
    bank = build_bank(airframe(tmp_path, KINK).observe(), "mtes")
    columns = {"A.p": np.full(100, flown), "B.q": np.full(100, flown)}
    own = bank.evaluate(signals(bank.system, columns), Differentiation())
    window = window_of(own, 5.0, 2.0, faults=["A.p"])
    found = at_smallest(window, own, 0.01)
    slope, there = (distinguishability(one).detected[0] for one in (window, found))
    if seen_more:
        assert there > 1.1 * slope
    else:
        assert there == pytest.approx(slope, rel=1e-6)


BENT = KINK.replace("components: {a: {group: sensor}}", "components: {a: {group: sensor}, b: {}}")
BENT = BENT.replace("q: {unit: m}}", "q: {unit: m}, r: {unit: m}}").replace(
    'bent: "q = abs(p)"', 'link: {text: "r = p", fault: slip, component: b}, bent: "q = abs(r)"'
)


@pytest.mark.parametrize("flown", [1.0, -1.0])
def test_a_channel_may_be_off_to_the_side_that_shows_less_and_a_link_to_the_one_that_shows_more(
    tmp_path, flown
):
    """Away from the corner all of it shows, towards it at first less and less."""
    bank = build_bank(airframe(tmp_path, BENT).observe(), "mtes")
    columns = {"A.p": np.full(100, flown), "B.q": np.full(100, abs(flown))}
    own = bank.evaluate(signals(bank.system, columns), Differentiation())
    found = at_smallest(window_of(own, 5.0, 2.0, faults=["A.p", "slip"]), own, 0.01)
    channel, link = found.at * flown
    assert channel < 0 < link < -channel


def test_what_no_size_shows_is_not_seen(tmp_path):
    """To one side the error of a sensor that is cut off a little further up."""
    text = KINK.replace('"q = abs(p)"', '"q = min(p, most)"')
    text = text.replace("equations:", "parameters: {most: {value: 5, unit: m}}\nequations:")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes")
    columns = {"A.p": np.full(100, 5.1), "B.q": np.full(100, 5.0)}
    own = bank.evaluate(signals(bank.system, columns), Differentiation())
    found = at_smallest(window_of(own, 5.0, 2.0, faults=["A.p"]), own, 0.01)
    assert distinguishability(found).detected[0] == 0.0
