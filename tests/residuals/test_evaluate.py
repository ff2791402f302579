"""A whole small model: what residuals show of a fault, and how far they stray without one."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fdi.errors import ModelError
from fdi.model.parts import Kind
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.rules import Reason
from fdi.telemetry import Signals
from fdi.telemetry.events import flight_state

from .build import GLIDER, airframe

RATE = 5.0


def signals(system, columns, rate=RATE):
    """Signals by hand; the channels' own period is 0, so that times are certain."""
    t = np.arange(len(next(iter(columns.values())))) / rate
    named = {request.channel: request.channel for request in system.channels}
    named |= {str(channel): channel for channel in named}
    by_channel = {named[name]: np.asarray(c, dtype=float) for name, c in columns.items()}
    assert set(by_channel) == {request.channel for request in system.channels}
    period = dict.fromkeys(by_channel, 0.0)
    return Signals(t, by_channel, period, flight_state(t, (), ()), rate, (), (), {}, "by hand")


def truth(n):
    """A steady course, the speed far from zero."""
    t = np.arange(n) / RATE
    return {
        "LOCAL_POSITION_NED.vx": np.full(n, 9.0),
        "LOCAL_POSITION_NED.vy": np.full(n, -12.0),
        "GPS_RAW_INT.vel": np.full(n, 15.0),
        "GPS_RAW_INT.cog": np.full(n, np.arctan2(-12.0, 9.0)),
        "VFR_HUD.alt": 100 + 2.0 * t,
        "VFR_HUD.climb": np.full(n, 2.0),
    }


ACCURACY = {
    "LOCAL_POSITION_NED.vx": 0.2,
    "LOCAL_POSITION_NED.vy": 0.2,
    "GPS_RAW_INT.vel": 0.3,
    "GPS_RAW_INT.cog": np.radians(3),
    "VFR_HUD.alt": 0.1,
    "VFR_HUD.climb": 0.4,
}


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    return build_bank(airframe(tmp_path_factory.mktemp("m")).observe(), "mtes+cross_checks")


def run(bank, columns):
    return bank.evaluate(signals(bank.system, columns), Differentiation())


def test_bank_holds_the_checks_that_the_model_allows(bank):
    vx, vy = "LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy"
    vel, cog, alt, climb = *list(ACCURACY)[2:4], "VFR_HUD.alt", "VFR_HUD.climb"
    assert {(frozenset(g.faults), g.restricted, g.origin) for g in bank.generators} == {
        (frozenset({vx, vy, vel}), True, "mtes"),
        (frozenset({vx, vy, cog}), True, "mtes"),
        (frozenset({vx, vel, cog}), False, "mtes"),  # a loop gives the other component
        (frozenset({vy, vel, cog}), False, "mtes"),
        (frozenset({alt}), True, "mtes"),  # its limit hides the next one from the minimal sets
        (frozenset({alt, climb}), True, "cross_check"),
    }
    assert [n.faults for n in bank.not_implementable] == [(climb,)]


def test_residuals_are_zero_when_nothing_is_wrong(bank):
    found = run(bank, truth(100))
    assert np.nanmax(np.abs(found.values)) < 1e-9
    assert np.isfinite(found.values).sum() > 0.9 * found.values.size


@pytest.mark.parametrize("channel", sorted(ACCURACY))
def test_a_drift_of_one_channel_shows_in_exactly_the_residuals_of_its_signature(bank, channel):
    columns = truth(100)
    healthy = run(bank, columns).values
    # upwards for the height, so that the limit of the height is not what is tested
    drift = np.linspace(0, 40 if "alt" not in channel else 1e4, 100) * ACCURACY[channel]
    shown = run(bank, {**columns, channel: columns[channel] + drift}).values
    moved = {
        g.id
        for g, before, after in zip(bank.generators, healthy, shown, strict=True)
        if np.nanmax(np.abs(after - before)) > 1e-6
    }
    holding = {g.id for g in bank.generators if channel in g.faults}
    if channel == "VFR_HUD.alt":  # within its limits the limit shows nothing
        limited = {g.id for g in bank.generators if g.faults == (channel,)}
        assert holding - limited <= moved <= holding
    else:
        assert moved == holding


def test_predicted_spread_is_the_measured_one_within_ten_percent(bank):
    rng = np.random.default_rng(7)
    n = 20_000
    columns = {name: column + rng.normal(0, ACCURACY[name], n) for name, column in truth(n).items()}
    found = run(bank, columns)
    checked = 0
    for generator, values, spread in zip(bank.generators, found.values, found.spread, strict=True):
        if bank.system.equations[generator.residual].kind != Kind.LIMIT:
            assert np.nanmedian(spread) == pytest.approx(np.nanstd(values), rel=0.1), generator
            checked += 1
    assert checked == 5


def test_an_unknown_input_makes_exactly_the_residuals_that_use_it_unknown(bank):
    columns = truth(60)
    columns["GPS_RAW_INT.vel"][30] = np.nan
    found = run(bank, columns)
    for generator, values in zip(bank.generators, found.values, strict=True):
        names = {bank.system.equations[i].name for i in generator.equations}
        # the course also asks for the ground speed, as its condition
        asked = "GPS_RAW_INT.vel" in generator.faults or "k_2" in names
        assert np.isnan(values[30]) == asked


def test_where_a_condition_does_not_hold_the_residual_is_unknown(bank):
    columns = truth(60)
    for name in ("LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy", "GPS_RAW_INT.vel"):
        columns[name][40:] *= 0.1
    found = run(bank, columns)
    row = next(i for i, g in enumerate(bank.generators) if "GPS_RAW_INT.cog" in g.faults)
    assert np.isfinite(found.values[row, :40]).all()
    assert np.isnan(found.values[row, 40:]).all()


DERIVED = GLIDER.replace("v_ground > slow", "twice > slow").replace(
    "  climb: {unit: m/s}", "  climb: {unit: m/s}\n  twice: {unit: m/s}"
)


@pytest.mark.parametrize(("share", "judged"), [(0.09, False), (0.15, True)])
def test_condition_on_what_follows_from_what_is_shown_holds_by_its_value(tmp_path, share, judged):
    """Of 15 m/s a tenth is below 1.5 m/s, where the double of it is at the condition's 3 m/s."""
    text = DERIVED.replace("limits:", "  k_4: twice = 2*v_ground\nlimits:")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    columns = truth(60)
    for name in ("LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy", "GPS_RAW_INT.vel"):
        columns[name][40:] *= share
    found = run(bank, columns)
    row = next(i for i, g in enumerate(bank.generators) if "GPS_RAW_INT.cog" in g.faults)
    assert np.isfinite(found.values[row, :40]).all()
    assert np.isfinite(found.values[row, 40:]).all() == judged


def test_condition_on_what_follows_from_itself_alone_cannot_be_read(tmp_path):
    circle = "  k_4: twice = more + v_ground\n  k_5: more = twice - v_ground\nlimits:"
    text = DERIVED.replace("limits:", circle).replace("  h:", "  more: {unit: m/s}\n  h:")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    assert not any("GPS_RAW_INT.cog" in g.faults for g in bank.generators)
    refused = [one for one in bank.not_implementable if "GPS_RAW_INT.cog" in one.faults]
    assert {one.reason for one in refused} == {Reason.CONDITION}


def test_a_difference_of_angles_is_wrapped(bank):
    columns = truth(20)
    columns["LOCAL_POSITION_NED.vx"][:], columns["LOCAL_POSITION_NED.vy"][:] = -15.0, -0.01
    columns["GPS_RAW_INT.cog"][:] = np.pi - 0.001
    row = next(i for i, g in enumerate(bank.generators) if "GPS_RAW_INT.cog" in g.faults)
    assert np.nanmax(np.abs(run(bank, columns).values[row])) < 0.01


def test_a_limit_shows_by_how_much_it_is_exceeded(tmp_path):
    bank = build_bank(airframe(tmp_path).observe(), "mtes")
    columns = truth(10)
    columns["VFR_HUD.alt"] = np.linspace(4900, 5100, 10)
    row = next(i for i, g in enumerate(bank.generators) if g.faults == ("VFR_HUD.alt",))
    excess = np.abs(run(bank, columns).values[row])
    assert excess == pytest.approx(np.maximum(columns["VFR_HUD.alt"] - 5000, 0))


LOOP = GLIDER.replace(
    'k_2: {text: "course = atan2(v_e, v_n)", when: "v_ground > slow", solves: [course]}',
    'k_2: {text: "tan(course) = v_e/v_n", when: "v_ground > slow", solves: []}',
)


def test_a_loop_with_a_condition_is_solved_where_it_holds(tmp_path):
    bank = build_bank(airframe(tmp_path, LOOP).observe(), "mtes+cross_checks")
    loops = [g for g in bank.generators if not g.restricted]
    assert loops
    assert all("GPS_RAW_INT.cog" in g.faults for g in loops)
    columns = truth(40)
    for name in ("LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy", "GPS_RAW_INT.vel"):
        columns[name][20:] *= 0.1
    found = run(bank, columns)
    for row, generator in enumerate(bank.generators):
        if not generator.restricted:
            assert np.abs(found.values[row, :20]).max() < 1e-6
            assert np.isnan(found.values[row, 20:]).all()
            assert (found.spread[row, :20] > 0).all()


ROOT = """
format: 1
name: root
variables: {p: {unit: "1"}, q: {unit: "1"}, twice: {unit: "1"}}
equations:
  k: {text: "q = sqrt(p**2 + 9)", solves: [p]}
  l: {text: "twice = 2*p", solves: [twice]}
measurements:
  A: {component: a, group: sensor, fields: {twice: {variable: twice}}}
  B: {component: b, group: sensor, fields: {q: {variable: q}}}
"""


def test_a_square_that_undoes_a_root_is_no_solution_where_the_root_would_be_negative(tmp_path):
    """Of q = 5 the roots are 4 and -4; q = -5 has none, though its square has. Nothing tells 4
    from -4 but a domain, and with it the one root left is still none of q = -5."""
    columns = {"A.twice": np.full(4, 8.0), "B.q": np.array([5.0, -5.0, 5.0, np.nan])}
    bank = build_bank(airframe(tmp_path, ROOT).observe(), "mtes+cross_checks")
    (generator,) = bank.generators
    assert "p" in {name for _, name in generator.steps}
    found = run(bank, columns)
    assert np.isnan(found.values).all()
    assert found.ambiguous.tolist() == [[True, False, True, False]]
    assert found.notes()[0].startswith("r1 (")
    assert "50%" in found.notes()[0]
    bounded = ROOT.replace('p: {unit: "1"}', 'p: {unit: "1", domain: [0, null]}')
    bank = build_bank(airframe(tmp_path, bounded).observe(), "mtes+cross_checks")
    found = run(bank, columns)
    assert found.values[0] == pytest.approx([0, np.nan, 0, np.nan], nan_ok=True)
    assert not found.ambiguous.any()
    assert found.notes() == ()


def test_the_channel_that_picks_a_root_is_in_the_signature(tmp_path):
    """p is shown as well: its channel tells 4 from -4, so that its fault moves the residual."""
    shown = ROOT + "  C: {component: c, group: sensor, fields: {p: {variable: p}}}\n"
    bank = build_bank(airframe(tmp_path, shown).observe(), "mtes+cross_checks")
    row, own = next(
        (row, g) for row, g in enumerate(bank.generators) if set(g.faults) == {"A.twice", "B.q"}
    )
    assert "C.p" in bank.signature_names()[row]
    columns = {"A.twice": np.full(2, 8.0), "B.q": np.full(2, 5.0), "C.p": np.array([3.0, -3.0])}
    assert run(bank, columns).values[row] == pytest.approx([0.0, -16.0])
    assert own.restricted


def test_values_cannot_be_written(bank):
    found = run(bank, truth(10))
    with pytest.raises(ValueError, match="read-only"):
        found.values[0, 0] = 1.0


def test_an_error_lets_a_quantity_stray_with_its_change_since_the_beginning(tmp_path):
    text = GLIDER.replace(
        "  k_3:", '  k_4: {text: "h = 2*lift", solves: [h], error: 0.1*h}\n  k_3:'
    )
    text = text.replace("  climb: {unit: m/s}\n", "  climb: {unit: m/s}\n  lift: {unit: m}\n", 1)
    vy = "      vy: {variable: v_e, accuracy: 0.2 m/s}\n"
    text = text.replace(vy, vy + "      z: {variable: lift, accuracy: 0.1 m}\n")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    columns = truth(400)
    columns["LOCAL_POSITION_NED.z"] = columns["VFR_HUD.alt"] / 2
    found = run(bank, columns)
    pair = {"VFR_HUD.alt", "LOCAL_POSITION_NED.z"}
    (place,) = [i for i, g in enumerate(bank.generators) if set(g.faults) == pair]
    median = np.median(columns["VFR_HUD.alt"][: round(20 * RATE)])
    expected = np.sqrt(0.1**2 + 0.2**2 + (0.1 * (columns["VFR_HUD.alt"] - median)) ** 2)
    assert found.spread[place] == pytest.approx(expected, rel=1e-6)


def strayed(tmp_path, error):
    """The spread of two heights against each other, with an error of one of them, and columns."""
    stated = f'  k_4: {{text: "h = 2*lift", error: {error}}}\n  k_5: unseen = also\n  k_3:'
    text = GLIDER.replace("  k_3:", stated)
    more = "  climb: {unit: m/s}\n  lift: {unit: m}\n  unseen: {unit: m/s}\n  also: {unit: m/s}\n"
    text = text.replace("  climb: {unit: m/s}\n", more, 1)
    vy = "      vy: {variable: v_e, accuracy: 0.2 m/s}\n"
    text = text.replace(vy, vy + "      z: {variable: lift, accuracy: 0.1 m}\n")
    text = text.replace("parameters:\n", "parameters:\n  lag: {value: 0.3, unit: s}\n")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    columns = truth(400)
    columns["LOCAL_POSITION_NED.z"] = columns["VFR_HUD.alt"] / 2
    columns["LOCAL_POSITION_NED.vx"][200:] = 15.0
    pair = {"VFR_HUD.alt", "LOCAL_POSITION_NED.z"}
    (place,) = [i for i, g in enumerate(bank.generators) if set(g.faults) == pair]
    return bank, place, run(bank, columns).spread[place], columns


def test_an_error_may_depend_on_what_the_test_does_not(tmp_path):
    """Only its change since the beginning counts, and no fault of what it reads is in the test."""
    bank, place, spread, _ = strayed(tmp_path, "lag*v_n")
    faster = np.where(np.arange(400) < 200, 0.0, 0.3 * 6.0)
    assert spread == pytest.approx(np.sqrt(0.1**2 + 0.2**2 + faster**2), rel=1e-6)
    assert not any("vx" in name for name in bank.signature_names()[place])


def test_errors_are_independent_of_each_other(tmp_path):
    _, _, spread, columns = strayed(tmp_path, "[0.1*h, lag*v_n]")
    high = columns["VFR_HUD.alt"]
    climbed = 0.1 * (high - np.median(high[: round(20 * RATE)]))
    faster = np.where(np.arange(400) < 200, 0.0, 0.3 * 6.0)
    assert spread == pytest.approx(np.sqrt(0.1**2 + 0.2**2 + climbed**2 + faster**2), rel=1e-6)


def test_an_error_that_nothing_tells_is_left_out(tmp_path):
    _, _, spread, _ = strayed(tmp_path, "[lag*unseen, 0.1*h]")
    assert np.isfinite(spread).all()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        ("v_n", "unit mismatch: h"),
        ("der(h)", "der(x) stands alone"),
        ("lag*wind", "unknown symbol 'wind'"),
    ],
)
def test_an_error_has_the_unit_of_the_statement_and_known_names(tmp_path, error, said):
    with pytest.raises(ModelError, match=re.escape(said)):
        strayed(tmp_path, error)


@pytest.mark.parametrize(
    ("swings", "by"),
    [
        ("3 deg", np.radians(3)),
        ("[3 deg, 0.1*(v_ground - slow)/slow]", np.hypot(np.radians(3), 0.2)),
        ("0.1*(slow - v_ground)/slow", 0.2),
    ],
)
def test_constant_that_swings_may_change_as_the_vehicle_turns(tmp_path, swings, by):
    """Against the first headings by up to twice itself, a quarter turn off them by 1.4 times.

    By how much tell the first seconds: what is fast later does not swing more.
    """
    text = GLIDER.replace("solves: [course]", f"solves: [course], offset: 20 deg, swings: {swings}")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    turned = np.linspace(0, 2 * np.pi, 400).clip(0.1) - 0.1
    heading = (3.1 + turned + np.pi) % (2 * np.pi) - np.pi  # begins beside the seam
    columns = truth(400)
    speed = np.where(np.arange(400) < 300, 9.0, 30.0)
    columns["LOCAL_POSITION_NED.vx"] = speed * np.cos(heading)
    columns["LOCAL_POSITION_NED.vy"] = speed * np.sin(heading)
    columns["GPS_RAW_INT.cog"] = heading
    columns["GPS_RAW_INT.vel"] = speed
    found = run(bank, columns)
    equations = bank.system.equations
    (held,) = [i for i, g in enumerate(bank.generators) if equations[g.residual].name == "k_2"]
    early = np.exp(1j * turned[: round(20 * RATE)]).mean()
    swing = np.abs(np.exp(1j * turned) - early)
    assert found.swing[held] == pytest.approx(swing, abs=1e-6)
    slow = speed == 9
    assert (found.spread[held] ** 2 - found.spread[held, 0] ** 2)[slow] == pytest.approx(
        (by**2 * (swing**2 - swing[0] ** 2))[slow], abs=1e-4
    )
    assert found.spread[held, -1] <= np.hypot(by * swing[-1], found.spread[held, 0])
    assert (np.delete(found.swing, held, axis=0) == 0).all()


def test_what_a_constant_swings_by_may_change_its_sign_in_the_first_seconds(tmp_path):
    """A field of the vehicle's own adds to one side's strength and takes from the other's."""
    text = GLIDER.replace(
        "solves: [course]", "solves: [course], offset: 20 deg, swings: 0.1*(v_ground - slow)/slow"
    )
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    columns = truth(400)
    sign = np.where(np.arange(400) % 2, 1.0, -1.0)
    slow = 3.0
    speed = slow + 2.0 * sign
    heading = np.where(np.arange(400) < 200, 0.5, 2.0)
    columns["LOCAL_POSITION_NED.vx"] = speed * np.cos(heading)
    columns["LOCAL_POSITION_NED.vy"] = speed * np.sin(heading)
    columns["GPS_RAW_INT.cog"], columns["GPS_RAW_INT.vel"] = heading, speed
    found = run(bank, columns)
    equations = bank.system.equations
    (held,) = [i for i, g in enumerate(bank.generators) if equations[g.residual].name == "k_2"]
    by = 0.1 * 2.0 / slow * 2 * np.sin(1.5 / 2)
    more = found.swung[held, -100:]
    assert more == pytest.approx(np.full(100, by), rel=1e-6)


def test_a_constant_that_may_be_as_large_as_what_it_is_of_says_nothing(tmp_path):
    """A field of the vehicle's own as strong as the Earth's turns the heading by any angle."""
    text = GLIDER.replace("solves: [course]", "solves: [course], offset: 20 deg, swings: 40 deg")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    found = run(bank, truth(400))
    equations = bank.system.equations
    (held,) = [i for i, g in enumerate(bank.generators) if equations[g.residual].name == "k_2"]
    assert (found.swung[held] == np.pi).all()


def test_a_derivative_is_one_by_the_right_clock(bank):
    columns = truth(400)
    slow = replace(signals(bank.system, columns), pace=1.25)
    own, right = (
        bank.evaluate(one, Differentiation()) for one in (signals(bank.system, columns), slow)
    )
    (row,) = [
        i
        for i, g in enumerate(bank.generators)
        if set(g.faults) == {"VFR_HUD.alt", "VFR_HUD.climb"}
    ]
    assert np.nanmedian(own.values[row]) == pytest.approx(0.0, abs=1e-9)
    assert abs(np.nanmedian(right.values[row])) == pytest.approx(2.0 - 2.0 / 1.25)


@pytest.mark.parametrize(
    ("swings", "said"),
    [("3 kg", "does not fit"), ("2*wind", "unknown symbol 'wind'"), ("v_ground", "unit mismatch")],
)
def test_what_a_constant_swings_by_is_checked(tmp_path, swings, said):
    text = GLIDER.replace("solves: [course]", f"solves: [course], offset: 20 deg, swings: {swings}")
    with pytest.raises(ModelError, match=said):
        airframe(tmp_path, text)


@pytest.mark.parametrize(("limit", "judged"), [(0.1, False), (0.3, True)])
def test_condition_knows_the_time_between_two_samples(tmp_path, limit, judged):
    text = GLIDER.replace(
        "k_3: climb = der(h)", f'k_3: {{text: "climb = der(h)", when: "step < {limit}"}}'
    )
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    found = run(bank, truth(100))
    pair = {"VFR_HUD.alt", "VFR_HUD.climb"}
    (place,) = [i for i, g in enumerate(bank.generators) if set(g.faults) == pair]
    assert np.isfinite(found.values[place]).any() == judged


def test_what_is_not_known_of_a_latency_widens_a_turn_and_no_straight_flight(tmp_path):
    """A receiver that may be 0.1 s late is 0.1 s of turning off, and nothing else."""
    text = GLIDER.replace("    when: fix_type", "    latency_accuracy: 0.1 s\n    when: fix_type")
    late, plain = (
        build_bank(airframe(tmp_path, t).observe(), "mtes+cross_checks") for t in (text, GLIDER)
    )
    n, rate = 200, 0.5
    t = np.arange(n) / RATE
    course = np.where(t < 20, 0.0, rate * (t - 20))
    columns = truth(n) | {
        "LOCAL_POSITION_NED.vx": 15 * np.cos(course),
        "LOCAL_POSITION_NED.vy": 15 * np.sin(course),
        "GPS_RAW_INT.cog": np.angle(np.exp(1j * course)),
    }
    spreads = []
    for bank in (late, plain):
        known = signals(bank.system, columns)
        told = {r.channel: r.latency_accuracy for r in bank.system.channels if r.latency_accuracy}
        values = bank.evaluate(replace(known, late=told), Differentiation())
        row = next(k for k, g in enumerate(bank.generators) if "GPS_RAW_INT.cog" in g.faults)
        spreads.append(values.spread[row])
    assert spreads[0][50] == spreads[1][50]
    added = np.sqrt(spreads[0][150] ** 2 - spreads[1][150] ** 2)
    assert added == pytest.approx(0.1 * rate, rel=0.02)


def test_records_of_one_message_are_late_together_and_show_nothing_of_it(bank):
    """Height and climb of one message agree whenever it comes, also in a climb that grows."""
    t = np.arange(200) / RATE
    columns = truth(200) | {"VFR_HUD.alt": 100 + t**3 / 60, "VFR_HUD.climb": t**2 / 20}
    known = signals(bank.system, columns)
    late = {channel: 0.5 for channel in known.columns if channel.message == "VFR_HUD"}
    assert len(late) == 2
    plain, widened = (
        bank.evaluate(replace(known, late=given), Differentiation()).spread for given in ({}, late)
    )
    (row,) = (
        i for i, g in enumerate(bank.generators) if {"VFR_HUD.alt", "VFR_HUD.climb"} == {*g.faults}
    )
    np.testing.assert_array_equal(plain[row], widened[row])


TWICE = """
format: 1
name: twice
variables: {p: {unit: m}, two: {unit: m}, q: {unit: m}}
equations:
  k: {text: "two = 2*p", solves: [two]}
  l: {text: "q = two - p", solves: [q]}
measurements:
  A: {component: a, group: sensor, fields: {p: {variable: p, accuracy: 3 m}}}
  B: {component: b, group: sensor, fields: {q: {variable: q, accuracy: 4 m}}}
"""


def test_an_error_that_enters_on_two_ways_is_one_error(tmp_path):
    """2 p - p is p: of 3 m, and with the other sensor's 4 m it is 5."""
    bank = build_bank(airframe(tmp_path, TWICE).observe(), "mtes+cross_checks")
    found = run(bank, {"A.p": np.arange(20.0), "B.q": np.arange(20.0)})
    assert found.values == pytest.approx(0.0)
    assert found.spread == pytest.approx(5.0)


def test_of_an_accuracy_only_what_changes_from_sample_to_sample_is_noise_of_a_derivative(tmp_path):
    """A barometer off by a metre all along climbs as well as one that is not."""
    added = []
    for stated in ("", ", jitter: 0.02 m"):
        text = GLIDER.replace(
            "variable: h, accuracy: 0.1 m", f"variable: h, accuracy: 0.1 m{stated}"
        )
        bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
        (row,) = [
            i
            for i, one in enumerate(bank.generators)
            if set(one.faults) == {"VFR_HUD.alt", "VFR_HUD.climb"}
        ]
        found = run(bank, truth(50)).spread[row, 25]
        added.append(np.sqrt(found**2 - 0.4**2))  # the climb's own accuracy
    assert added[1] == pytest.approx(0.2 * added[0])
