"""What the model of a fixed wing says of thrust, drag and moments, against flights that are solved.

A point mass with a parabolic drag polar and a vehicle that rolls against its damping are integrated
here; the model sees only what a log would hold of them.
"""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.model.expression import Symbol, symbols
from fdi.model.parts import Kind

G = 9.80665
THRUST, PARASITE, INDUCED = 4.0, 0.004, 1.3
"""Over mass: at full throttle, m/s^2; drag over the square of airspeed, 1/m, over lift^2/V^2, m."""
T = np.arange(0.0, 40.0, 0.02)
STOP = 20.0
model = cache(load_airframe)


def computed(name, given):
    """Return a variable by the model's equations, each solved for its left side."""
    relations = (e for e in model("fixed_wing").equations if e.kind is Kind.RELATION)
    equations = {e.left.name: e for e in relations if isinstance(e.left, Symbol)}
    columns = {k: np.float64(p.value) for k, p in model("fixed_wing").parameters.items()} | given

    def column(variable):
        if variable not in columns:
            equation = equations[variable]
            for needed in set(symbols(equation.right)):
                column(needed)
            columns[variable] = evaluate(equation.right, columns)
        return columns[variable]

    return column(name)


@cache
def flown(throttle, gives, bank=0.0):
    """Return what a log holds of a flight whose pilot keeps a flight path that suits the thrust.

    From ``STOP`` on the engine gives the share ``gives`` of its thrust; the nose then goes down so
    that the airspeed falls no more, as any autopilot does in the end.
    """
    lift = G / np.cos(bank)

    def rates(t, state):
        speed, _ = state
        share = 1.0 if t < STOP else gives
        excess = share * THRUST * throttle - PARASITE * speed**2 - INDUCED * lift**2 / speed**2
        sine = (excess + 0.3 * (speed - 16.0)) / G
        return excess - G * sine, speed * sine

    solved = solve_ivp(rates, (T[0], T[-1]), (17.0, 100.0), t_eval=T, rtol=1e-9, max_step=0.02)
    speed, height = solved.y
    return {
        "throttle": np.full_like(T, throttle),
        "throttle_recent": np.full_like(T, throttle),
        "air_speed": speed,
        "airspeed_wind": speed,
        "wind_speed_rate": np.gradient(speed, T),
        "est_v_d": -np.gradient(height, T),
        "lift_mean": np.full_like(T, lift),
        "thrust_per_throttle": np.float64(THRUST),
        "drag_parasite": np.float64(PARASITE),
        "drag_lift": np.float64(INDUCED),
        "height": height,
    }


SETTLED = (T > 2) & (T < STOP - 0.1)
AFTER = STOP + 0.1 < T


@pytest.mark.parametrize("bank", [0.0, 0.7])
@pytest.mark.parametrize("throttle", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("gives", [1.0, 0.5, 0.0])
def test_the_thrust_that_is_missing_is_what_the_engine_no_longer_gives(throttle, gives, bank):
    missing = computed("thrust_missing", flown(throttle, gives, bank))
    assert missing[SETTLED] == pytest.approx(0.0, abs=0.01)
    assert missing[AFTER] == pytest.approx((1 - gives) * THRUST * throttle, abs=0.01)


def test_a_glide_goes_down_as_fast_as_its_drag_takes():
    """An engine that stopped is known by what goes, whatever its throttle says."""
    flight = flown(0.5, 0.0)
    wanted = {"height_wanted": 150.0 - flight["height"], "speed_wanted": np.zeros_like(T)}
    going = computed("energy_going", flight | wanted | {"energy_kept": np.float64(0.0)})
    speed = flight["air_speed"]
    drag = PARASITE * speed**2 + INDUCED * G**2 / speed**2
    assert going[AFTER] == pytest.approx((speed * drag / G)[AFTER], abs=0.02)
    assert (going[AFTER] > 1.0).all()


@pytest.mark.parametrize("gives", [1.0, 0.0])
def test_energy_that_nobody_wants_does_not_count(gives):
    flight = flown(0.5, gives)
    wanted = {"height_wanted": np.full_like(T, -20.0), "speed_wanted": np.zeros_like(T)}
    going = computed("energy_going", flight | wanted | {"energy_kept": np.float64(0.0)})
    assert (going <= 0).all()


PER_ROLL, DAMPING = 4.0, 0.5
"""m/rad: full aileron rolls by 1/4 rad a metre; 1/m: over the airspeed, how fast a roll dies."""


def mean_of_a_second(values):
    steps = round(1.0 / (T[1] - T[0]))
    summed = np.concatenate([np.zeros(steps), np.cumsum(values)])
    return (summed[steps:] - summed[:-steps]) / steps


def rolled(works):
    """Return what a log holds of a vehicle that sways, its ailerons having a share of effect."""
    speed = 18.0 + 3 * np.sin(T / 7)
    wanted = 0.5 * np.sin(0.8 * T)
    # the output for it, of roll' = DAMPING*speed*(speed*works*output/PER_ROLL - roll)
    output = (wanted + np.gradient(wanted, T) / (DAMPING * speed)) * PER_ROLL / (works * speed)
    return {
        "aileron_mean": mean_of_a_second(output + 0.1),
        "roll_mean": mean_of_a_second(wanted),
        "yaw_mean": np.zeros_like(T),
        "side_mean": np.zeros_like(T),
        "air_speed": speed,
        "aileron_trim": np.float64(0.1),
        "aileron_per_roll": np.float64(PER_ROLL),
        "aileron_per_yaw": np.float64(0.0),
        "aileron_per_slip": np.float64(0.0),
    }


KNOWN = T > 1.5


def test_an_aileron_in_health_is_explained_by_the_roll_that_it_makes():
    astray = computed("aileron_astray", rolled(1.0))[KNOWN]
    assert np.abs(astray).max() < 0.02
    assert np.ptp(rolled(1.0)["aileron_mean"][KNOWN]) > 0.15


@pytest.mark.parametrize("works", [0.3, -1.0])
def test_an_aileron_without_its_effect_is_astray_by_what_it_lacks(works):
    flight = rolled(works)
    astray = computed("aileron_astray", flight)[KNOWN]
    lacks = (1 - works) * (flight["aileron_mean"][KNOWN] - 0.1)
    assert astray == pytest.approx(lacks, abs=0.02)


def test_an_elevator_trims_lift_at_every_airspeed():
    """Moments over dynamic pressure: alpha by lift, elevator against it."""
    speed, load = np.array([12.0, 16.0, 24.0]), np.array([1.0, 1.5, 2.0])
    wing_loading, density, slope, stability, power = 8.0, 1.225, 5.0, -0.5, -1.1
    lift = load * G
    alpha = wing_loading * lift / (0.5 * density * speed**2 * slope)
    deflection = -stability * alpha / power + 0.05
    per_lift = -stability / power * wing_loading / (0.5 * density * slope)
    given = {
        "elevator_mean": deflection,
        "lift_mean": lift,
        "pitch_mean": np.zeros(3),
        "air_speed": speed,
        "elevator_trim": np.float64(0.05),
        "elevator_per_lift": np.float64(per_lift),
        "elevator_per_pitch": np.float64(0.0),
    }
    assert computed("elevator_astray", given) == pytest.approx(np.zeros(3), abs=1e-12)
    stuck = given | {"elevator_mean": deflection + 0.3}
    assert computed("elevator_astray", stuck) == pytest.approx(np.full(3, 0.3))


def residual(name, given):
    """Return by how much an equation of the model does not hold."""
    of = next(e for e in model("fixed_wing").equations if e.name == name)
    return evaluate(of.left, given) - evaluate(of.right, given)


@pytest.mark.parametrize("axis", np.eye(3))
@pytest.mark.parametrize("pitch", [0.0, 0.6, 1.5])
@pytest.mark.parametrize("name", ["att_7", "ctl_1"])
def test_attitudes_a_degree_apart_are_so_however_steep_the_nose(name, pitch, axis):
    """At 86 degrees one degree about a level axis changes the roll angle by twelve."""
    own = Rotation.from_euler("ZYX", [0.3, pitch, 0.2])
    other = Rotation.from_rotvec(np.radians(1.0) * axis) * own
    second = other.as_euler("ZYX")[2]
    given = {"roll": 0.2, "pitch": pitch, "roll_2": second, "roll_demand": second}
    apart = computed("roll_error", given) if name == "ctl_1" else residual(name, given)
    assert abs(float(apart)) < np.radians(1.01)
