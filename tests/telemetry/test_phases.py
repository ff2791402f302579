"""On the ground or in the air, by motions of which one source alone would tell another tale."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.telemetry.course import Course
from fdi.telemetry.events import flight_state
from fdi.telemetry.flights import find_flights
from fdi.telemetry.motion import Motion, motion_of
from fdi.telemetry.phases import find_phases
from fdi.telemetry.stretches import find_stretches

from .build import Flight

T = np.arange(0.0, 60.0, 0.1)
UP, DOWN = 10.0, 45.0  # s, when it leaves the ground and comes back
FLIES = (T >= UP) & (T < DOWN)


def motion(**changes):
    """A copter that climbs to 5 m in 2 s, hovers, sinks at 1 m/s; it stands before and after."""
    height = np.interp(T, [UP, UP + 2, DOWN - 5, DOWN], [0.0, 5.0, 5.0, 0.0])
    own = {
        "t": T,
        "height": height,
        "climb": np.gradient(height, T),
        "speed": np.where(FLIES, 0.4, 0.1),
        "airspeed": np.full(T.size, np.nan),
        "turns": np.where(FLIES, 0.1, 0.005),
        "upright": np.ones(T.size),
        "throttle": np.where(FLIES, 0.4, 0.0),
        "hover": np.full(T.size, np.nan),
        "landed_state": np.full(T.size, np.nan),
        "force": np.full(T.size, 9.81),
        "pressed": np.full(T.size, np.nan),
    }
    return Motion(**{**own, **changes}, is_dense=False)


def course(made, armed=True, wings="none"):
    on = np.full(T.size, armed) if isinstance(armed, bool) else armed
    phases = find_phases(made, on, wings=wings)
    return Course(made, phases, ((0.0, 60.0, False),) if on.any() else (), False, wings)


def airborne(*args, **options):
    return [flight.airborne for flight in find_flights(course(*args, **options))]


def test_a_plain_flight_begins_and_ends_where_it_leaves_the_ground_and_meets_it():
    ((up, down),) = airborne(motion())
    assert (up, down) == pytest.approx((UP, DOWN), abs=0.5)


def test_probability_is_one_of_a_probability_and_certain_in_the_midst():
    found = find_phases(motion(), np.ones(T.size, bool), wings="none")
    assert ((found.sure >= 0) & (found.sure <= 1)).all()
    assert found.sure[(found.t > UP + 3) & (found.t < DOWN - 6)].min() > 0.999
    assert found.sure[found.t < UP - 2].max() < 0.001


@pytest.mark.parametrize("high", [35.0, -20.0])
def test_a_barometer_that_freezes_or_jumps_before_the_landing_does_not_keep_it_up(high):
    wrong = np.where(T > DOWN - 3, high, motion().height)
    ((_, down),) = airborne(motion(height=wrong, climb=np.where(T > DOWN - 3, 0.0, motion().climb)))
    assert down == pytest.approx(DOWN, abs=1.5)


def test_an_estimate_that_falls_on_after_the_crash_is_no_flight():
    """Throttle and gyroscopes say that it lies there."""
    falls = T > DOWN - 5
    height = np.where(falls, 5.0 - 4.0 * (T - DOWN + 5), motion().height)
    ((_, down),) = airborne(motion(height=height, climb=np.gradient(height, T)))
    assert down < DOWN + 1.0


def test_a_hover_at_half_a_metre_flies():
    height = 0.1 * motion().height
    ((up, down),) = airborne(motion(height=height, climb=np.gradient(height, T)))
    assert up == pytest.approx(UP, abs=2.0)
    assert down == pytest.approx(DOWN, abs=2.0)


@pytest.mark.parametrize(("hover", "flies"), [(0.35, False), (0.2, True), (np.nan, True)])
def test_who_swings_on_its_legs_below_the_learned_hover_does_not_fly(hover, flies):
    """Without a row above the ground the throttle alone is about its own median."""
    swings = {"height": 0 * T, "climb": 0 * T, "turns": np.where(FLIES, 0.4, 0.005)}
    made = motion(**swings, throttle=np.where(FLIES, 0.2, 0.0), hover=np.full(T.size, hover))
    assert bool(airborne(made)) == flies


def test_who_gives_full_throttle_for_the_most_hovered_before():
    """A motor has failed: what it gave until then was no idling on the ground."""
    made = motion(height=20.0 + 0 * T, climb=0 * T, throttle=np.where(T < 10.0, 0.34, 1.0))
    made = replace(made, speed=0.4 + 0 * T, turns=0.02 + 0 * T)
    ((up, down),) = airborne(made)
    assert (up, down) == pytest.approx((0.0, T[-1]), abs=0.2)


def test_armed_with_idle_motors_is_no_flight_though_the_barometer_drifts():
    drift = 0.05 * T
    assert (
        airborne(motion(height=drift, climb=0 * T, throttle=0.05 + 0 * T, turns=0.02 + 0 * T)) == []
    )


def test_carried_up_a_stair_disarmed_is_no_flight():
    made = motion(throttle=0 * T, turns=np.where(FLIES, 0.8, 0.005))
    assert airborne(made, armed=False) == []
    found = [one.what for one in find_stretches(course(made, armed=False))]
    assert found == ["standing", "moved about", "standing"]


def test_disarmed_in_the_air_it_falls_to_the_ground():
    fall = np.interp(T, [UP, UP + 2, 30.0, 31.5], [0.0, 5.0, 5.0, 0.0])
    on = np.where(T < 30.0, 0.4, 0.0)
    made = motion(
        height=fall,
        climb=np.gradient(fall, T),
        throttle=np.where(T < UP, 0.0, on),
        turns=np.where((T >= UP) & (T < 31.5), 0.1, 0.005),
        speed=np.where((T >= UP) & (T < 31.5), 0.4, 0.1),
    )
    ((_, down),) = airborne(made, armed=T < 30.0)
    assert 29.5 <= down <= 32.5


def test_a_vtol_that_hovers_has_not_landed():
    slow = motion(throttle=np.full(T.size, np.nan))
    ((up, down),) = airborne(slow, wings="maybe")
    assert (up, down) == pytest.approx((UP, DOWN), abs=1.5)


def test_wings_in_a_headwind_stand_still_over_ground_and_fly():
    rolls = np.where(FLIES, 18.0, 0.5)
    made = motion(speed=np.where(FLIES & (T > 20), 1.0, rolls), airspeed=rolls)
    ((up, down),) = airborne(made, wings="alone")
    assert (up, down) == pytest.approx((UP, DOWN), abs=1.5)


@pytest.mark.parametrize(
    ("fastest", "flies"), [(2.6, False), (0.0, True), (np.nan, True), (14.0, True)]
)
def test_wings_that_are_never_fast_are_carried_unless_no_receiver_tells(fastest, flies):
    made = motion(speed=np.where(FLIES, fastest, 0.0), turns=np.where(FLIES, 0.3, 0.005))
    assert bool(airborne(made, wings="alone")) is flies


def test_wings_that_are_carried_do_not_fly_whatever_an_estimate_says_of_their_height():
    """A minute by hand under an estimate that stands 4 m high and climbs, then thrown."""
    thrown = 30.0
    made = motion(
        height=np.where(thrown > T, np.minimum(0.4 * T, 4.0), np.where(T < DOWN, 30.0, 4.0)),
        climb=np.where((thrown > T) & (T > 5.0), 1.3, 0.0),
        speed=np.where((thrown < T) & (T < DOWN), 14.0, 0.3),
        turns=np.where(T < DOWN, 0.12, 0.005),
        throttle=np.full(T.size, np.nan),
    )
    ((up, down),) = airborne(made, wings="alone")
    assert (up, down) == pytest.approx((thrown, DOWN), abs=1.0)


def test_wings_that_fall_straight_down_still_fly():
    falls = (T > 25) & (T < 30)
    made = motion(
        height=np.interp(T, [UP, 20.0, 25.0, 30.0], [0.0, 80.0, 80.0, 5.0]),
        speed=np.where(falls | ~FLIES, 0.2, 14.0),
        climb=np.where(falls, -15.0, 0.0),
        throttle=np.full(T.size, np.nan),
    )
    ((_, down),) = airborne(made, wings="alone")
    assert down > 29.0


def test_wings_that_roll_fast_on_the_ground_do_not_fly_yet():
    roll = np.interp(T, [5.0, UP], [0.0, 15.0])
    made = motion(speed=np.where(T < UP, roll, np.where(T < DOWN, 18.0, 0.5)))
    ((up, _),) = airborne(made, wings="alone")
    assert up == pytest.approx(UP, abs=1.0)


def test_one_that_spins_with_a_rotor_less_flies_though_its_height_says_little():
    spins = np.where((T > 20) & FLIES, 25.0, motion().turns)
    made = motion(turns=spins, throttle=np.full(T.size, np.nan), height=0.1 * motion().height)
    ((up, down),) = airborne(made)
    assert up == pytest.approx(UP, abs=2.5)
    assert down == pytest.approx(DOWN, abs=2.5)


def test_who_spins_as_nobody_can_hold_it_flies_though_height_and_autopilot_say_no():
    spins = np.where((T > 20) & FLIES, 25.0, 0.005)
    made = {"height": 0 * T, "climb": 0 * T, "throttle": np.full(T.size, np.nan)}
    says = {"landed_state": np.ones(T.size), "speed": np.full(T.size, np.nan)}
    assert airborne(motion(**made, **says, turns=spins / 5)) == []
    ((up, down),) = airborne(motion(**made, **says, turns=spins))
    assert (up, down) == pytest.approx((20.0, DOWN), abs=1.5)


@pytest.mark.parametrize(("upright", "up_s"), [(1.0, 12.0), (0.0, 20.0)])
def test_what_leads_into_such_a_spin_is_flown_too_and_who_rolls_over_rolls(upright, up_s):
    """It turns by 5 rad/s from 12 s on, as one that is carried may, and by 25 from 20 s on."""
    spins = np.select([(T > 20) & FLIES, (T > 12) & FLIES], [25.0, 5.0], 0.005)
    made = {"height": 0 * T, "climb": 0 * T, "throttle": np.full(T.size, np.nan)}
    says = {"landed_state": np.ones(T.size), "speed": np.full(T.size, np.nan)}
    lies = np.where(T < 20, upright, 1.0)
    ((up, _),) = airborne(motion(**made, **says, turns=spins, upright=lies))
    assert up == pytest.approx(up_s, abs=1.5)


def test_an_estimate_of_height_that_rests_holds_nobody_on_the_ground_who_spins():
    """It stands at nothing until 15 s, and then climbs."""
    high = np.interp(T, [15.0, 16.0, DOWN - 1, DOWN], [0.0, 5.0, 5.0, 0.0])
    spins = np.where((T > UP + 1.0) & FLIES, 25.0, motion().turns)
    made = motion(height=high, climb=np.gradient(high, T), turns=spins)
    ((up, _),) = airborne(made)
    assert up == pytest.approx(UP, abs=1.5)


def test_the_autopilots_word_decides_where_nothing_else_does():
    unknown = {"throttle": np.full(T.size, np.nan), "turns": np.full(T.size, 0.03)}
    still = {"height": 0 * T, "climb": 0 * T, "speed": np.full(T.size, np.nan)}
    word = np.where(FLIES, 2.0, 1.0)
    ((up, down),) = airborne(motion(**unknown, **still, landed_state=word))
    assert (up, down) == pytest.approx((UP, DOWN), abs=1.0)


def test_on_its_side_after_the_landing_is_told():
    made = motion(upright=np.where(T > DOWN + 1, 0.1, 1.0))
    found = [one.what for one in find_stretches(course(made))]
    assert found == ["armed on the ground", "in the air", "lying on its side"]


def test_a_bounce_is_one_landing():
    bounce = motion().height + np.where((T > DOWN + 0.5) & (T < DOWN + 1.2), 1.2, 0.0)
    assert len(airborne(motion(height=bounce, climb=np.gradient(bounce, T)))) == 1


def test_two_hops_are_two_flights_that_do_not_overlap():
    first, second = (T >= 5) & (T < 15), (T >= 30) & (T < 40)
    up = first | second
    made = motion(
        height=np.where(up, 3.0, 0.0),
        climb=0 * T,
        throttle=np.where(up, 0.4, 0.05),
        turns=np.where(up, 0.1, 0.02),
    )
    one, other = find_flights(course(made))
    assert one.end <= other.start
    assert one.landing == pytest.approx(15, abs=1)
    assert other.takeoff == pytest.approx(30, abs=1)


def dropped(speed, **changes):
    """One that sinks from 5 m at a speed, turns over at the ground, and whose estimate falls on."""
    touch = DOWN - 5 + 5.0 / speed
    sinks = np.where(T < UP + 2, motion().climb, np.where(T < DOWN - 5, 0.0, -speed))
    own = {
        "height": np.interp(T, [UP, UP + 2, DOWN - 5, 60.0], [0.0, 5.0, 5.0, -speed * 20 + 5]),
        "climb": sinks,
        "upright": np.where(touch > T, 1.0, -1.0),
        "turns": np.where(touch > T, 0.1, 0.005),
        "throttle": np.where((T >= UP) & (touch > T), 0.4, 0.0),
        "force": np.where(np.abs(T - touch) < 0.15, 25.0, 9.81),
    }
    return motion(**{**own, **changes}), touch


def test_who_sinks_faster_than_a_landing_gear_bears_and_stays_on_its_back_has_hit_the_ground():
    made, touch = dropped(6.0)
    (flight,) = find_flights(course(made))
    assert flight.impact == pytest.approx(touch, abs=0.3)
    assert flight.impact_speed == pytest.approx(6.0, abs=0.2)


def test_who_sinks_gently_or_feels_nothing_has_hit_nothing():
    for made, _ in (dropped(1.5), dropped(6.0, force=np.full(T.size, 9.81))):
        assert [flight.impact for flight in find_flights(course(made))] == [None]


@pytest.mark.parametrize("vehicle", ["rover", "boat", "sub"])
def test_what_drives_or_swims_does_not_fly_whatever_its_height(load, vehicle):
    log = load(Flight(rate=4).bytes())
    assert [flight.flew for flight in log.flights] == [True]
    other = replace(log, vehicle=vehicle, _cache={})
    assert [flight.flew for flight in other.flights] == [False]
    assert "in the air" not in {stretch.what for stretch in other.stretches}


def test_wings_that_stand_on_edge_or_nose_do_not_fly_whatever_the_speed_is_said_to_be():
    told = {"speed": np.full(T.size, 8.0), "height": np.full(T.size, 3.0), "climb": 0.2 + 0 * T}
    made = motion(**told, upright=np.full(T.size, 0.1), turns=np.full(T.size, 0.05))
    assert airborne(made, wings="alone") == []
    level = motion(**told, turns=np.full(T.size, 0.05))
    assert len(airborne(level, wings="alone")) == 1


def test_wings_in_a_steep_turn_or_a_dive_fly():
    fast = {"speed": np.where(FLIES, 20.0, 0.0), "airspeed": np.where(FLIES, 20.0, 0.0)}
    banks = (T > 20) & (T < 30)
    turning = motion(**fast, upright=np.where(banks, 0.2, 1.0), turns=np.where(banks, 1.2, 0.1))
    assert len(airborne(turning, wings="alone")) == 1
    dives = motion(**fast, upright=np.where(banks, 0.1, 1.0), climb=np.where(banks, -15.0, 0.0))
    assert len(airborne(dives, wings="alone")) == 1


def test_a_flight_whose_records_begin_in_the_air_begins_with_them():
    late = T >= 20.0
    made = motion()
    begun = Motion(
        **{
            name: getattr(made, name)[late]
            for name in made.__dataclass_fields__
            if name != "is_dense"
        },
        is_dense=False,
    )
    phases = find_phases(begun, np.ones(begun.t.size, bool), wings="none")
    (flight,) = find_flights(Course(begun, phases, ((0.0, 60.0, False),), True, "none"))
    assert flight.airborne == pytest.approx((20.0, DOWN), abs=0.5)
    assert flight.takeoff is None
    assert flight.aloft == (pytest.approx((20.0, DOWN - 2.5), abs=0.2),)


def test_it_is_aloft_while_more_than_two_metres_and_a_half_above_the_ground():
    (flight,) = find_flights(course(motion()))
    assert flight.aloft == (pytest.approx((UP + 1.0, DOWN - 2.5), abs=0.2),)
    aloft = flight_state(T, (), (flight,)).aloft
    assert T[aloft][[0, -1]].tolist() == list(flight.aloft[0])


def test_who_comes_down_to_a_metre_is_not_aloft_there():
    height = np.interp(T, [UP, UP + 2, 20, 22, 34, 36, DOWN - 5, DOWN], [0, 5, 5, 1, 1, 5, 5, 0.0])
    (flight,) = find_flights(course(motion(height=height, climb=np.gradient(height, T))))
    first, second = flight.aloft
    assert first == pytest.approx((UP + 1.0, 21.2), abs=0.2)
    assert second == pytest.approx((34.8, DOWN - 2.5), abs=0.2)
    aloft = flight_state(T, (), (flight,)).aloft
    assert not aloft[(T > 22) & (T < 34)].any()


def test_who_hovers_at_two_metres_is_never_aloft():
    height = np.where(FLIES, 2.0, 0.0)
    (flight,) = find_flights(course(motion(height=height, climb=np.gradient(height, T))))
    assert flight.aloft == ()
    state = flight_state(T, (), (flight,))
    assert state.airborne.any()
    assert not state.aloft.any()


def test_on_a_bench_an_estimate_that_swings_by_metres_is_not_believed_against_the_air():
    """Turned about by hand; no throttle is recorded."""
    swings = 30.0 * np.sin(0.3 * T)
    bench = {
        "height": swings,
        "climb": np.gradient(swings, T),
        "turns": np.full(T.size, 0.6),
        "throttle": np.full(T.size, np.nan),
        "speed": np.zeros(T.size),
    }
    assert airborne(motion(**bench)) != []  # nothing else tells
    still = 0.2 * np.sin(T)
    assert airborne(motion(**bench, pressed=still)) == []


class Column(dict):
    """A message of columns in SI."""

    t = T

    def si(self, name):
        return self[name]

    @property
    def fields(self):
        return tuple(self)


@pytest.mark.parametrize(("told", "throttle"), [(None, 0.4), (0.7, 0.7)])
def test_a_throttle_that_no_record_tells_is_the_mean_of_the_motors(told, throttle):
    shares = {f"motor_{i}": np.full(T.size, 0.1 + 0.12 * i) for i in range(1, 5)}
    messages = {"LOCAL_POSITION_NED": Column(z=-T), "MOTORS": Column(shares)}
    if told is not None:
        messages["VFR_HUD"] = Column(throttle=np.full(T.size, told))
    np.testing.assert_allclose(motion_of(messages).throttle, throttle)


@pytest.mark.parametrize(("scatter", "asked"), [(0.2, True), (20.0, False)])
def test_a_barometer_that_scatters_is_not_asked(scatter, asked):
    height = motion().height + np.random.default_rng(3).normal(0, scatter, T.size)
    messages = {
        "LOCAL_POSITION_NED": Column(z=-motion().height),
        "SCALED_PRESSURE": Column(press_abs=101325.0 * np.exp(-height / 8434.0)),
    }
    made = motion_of(messages)
    assert np.isfinite(made.pressed).all() == asked
    if asked:
        assert np.ptp(made.pressed) == pytest.approx(5.0, abs=2.0)


@pytest.mark.parametrize("name", ["BarAlt", "BAlt"])
def test_without_a_pressure_the_autopilots_barometric_height_is_asked(name):
    messages = {"LOCAL_POSITION_NED": Column(z=T), "CTUN": Column({name: 0.1 * T})}
    np.testing.assert_allclose(motion_of(messages).pressed, 0.1 * T)
    messages["SCALED_PRESSURE"] = Column(press_abs=np.full(T.size, 1e5))
    np.testing.assert_allclose(motion_of(messages).pressed, 0.0)


@pytest.mark.parametrize("low", [0.0, 20.0, 40.0])
def test_where_an_estimator_tells_no_height_air_pressure_does_and_nobody_the_climb(low):
    """At the beginning, amid and at the end: for 20 s it has no position."""
    height = motion().height
    untold = (low <= T) & (low + 20.0 > T)
    told = {"vz": np.where(untold, np.nan, 1.0), "z": np.where(untold, np.nan, -height - 7.0)}
    messages = {
        "LOCAL_POSITION_NED": Column(told),
        "SCALED_PRESSURE": Column(press_abs=101325.0 * np.exp(-height / 8434.0)),
    }
    made = motion_of(messages)
    assert np.diff(made.t).max() < 1.2
    assert made.height == pytest.approx(np.interp(made.t, T, height + 7.0), abs=0.2)
    deep = (made.t > low + 2.0) & (made.t < low + 18.0)
    assert np.isnan(made.climb[deep]).all()
    assert np.isfinite(made.climb[(made.t < low) | (made.t >= low + 20.0)]).all()


def test_a_flight_is_one_by_its_barometer_where_the_estimate_has_gone_astray():
    made = motion(pressed=motion().height)
    gone = motion(pressed=motion().height, height=motion().height - 2.0 * np.maximum(T - 20, 0))
    ((up, down),) = airborne(made)
    assert airborne(gone) == [pytest.approx((up, down), abs=1.0)]


def test_an_estimate_that_settles_as_the_log_begins_is_no_take_off():
    """It climbs by metres while the rotors turn faster and nothing is felt; then it rises."""
    height = np.interp(T, [0.0, 4.0, UP, UP + 3, DOWN - 5, DOWN], [-4.0, 0.3, 1.0, 6.0, 6.0, 0.9])
    flown = motion(
        height=height,
        climb=np.gradient(height, T),
        throttle=np.where(FLIES, 0.5, np.interp(T, [2.0, 5.0, DOWN, DOWN + 0.1], [0, 0.4, 0.4, 0])),
        force=np.where(FLIES, 11.0, 9.81),
    )
    ((up, _),) = airborne(flown)
    assert up == pytest.approx(UP, abs=0.5)


def test_who_is_carried_away_after_disarming_has_landed_before():
    """Rotors that are disarmed in the air would fall."""
    off = DOWN + 1.0
    height = np.interp(
        T, [UP, UP + 2, DOWN - 5, DOWN, off + 3, off + 6], [0, 5.0, 5.0, 0.9, 0.9, 0]
    )
    moved = motion(
        height=height,
        climb=np.gradient(height, T),
        turns=np.where((T >= UP) & (off + 6 > T), 0.3, 0.005),
        speed=np.where((T >= UP) & (off + 6 > T), 1.5, 0.1),
        throttle=np.where((T >= UP) & (off > T), 0.4, np.nan),
    )
    made = replace(course(moved, armed=off > T), armed=((0.0, off, True),))
    (flight,) = find_flights(made)
    assert flight.landing is not None
    assert flight.landing <= off
