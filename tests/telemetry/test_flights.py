"""Take-off, landing and impact come from the motion, whatever the autopilot says."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import read
from fdi.telemetry.events import flight_state

from .build import AFTER, DOWN, Flight, mav, record, started_anew

pytestmark = pytest.mark.flights

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "flights"
HARD = 2.0  # m/s: labels call every ground contact after a fault an impact, landings too
BASE = Flight()


def test_flight_has_its_take_off_and_landing(load):
    log = load(BASE.bytes())
    (flight,) = log.flights
    up, _, _, ground = BASE.phases()
    assert flight.takeoff == pytest.approx(up, abs=0.5)
    assert flight.landing == pytest.approx(ground, abs=1.5)
    assert flight.impact is None
    kinds = [e.kind for e in log.events if e.kind in ("arm", "takeoff", "landing", "disarm")]
    assert kinds == ["arm", "takeoff", "landing", "disarm"]


def test_a_vehicle_stands_before_its_flight(load):
    log = load(BASE.bytes())
    (flight,) = log.flights
    low, high = flight.stood
    assert low == pytest.approx(log.span[0], abs=1.0)
    assert high == pytest.approx(flight.takeoff, abs=1.0)
    state = flight_state([low, (low + high) / 2, flight.takeoff + 5.0], log.events, log.flights)
    assert state.standing.tolist() == [True, True, False]


class Adrift(Flight):
    """The same, whose estimator nobody tells where it is: it drifts with 3 m/s."""

    def messages(self, t, tick):
        made = super().messages(t, tick)
        for one in made:
            if one.get_type() == "VFR_HUD":
                one.groundspeed = 3.0
        return made


@pytest.mark.parametrize(
    ("kind", "stands"), [(mav.MAV_TYPE_QUADROTOR, True), (mav.MAV_TYPE_FIXED_WING, False)]
)
def test_what_rotors_carry_stands_whatever_an_estimator_says_of_its_speed(load, kind, stands):
    (flight,) = load(Adrift(kind=kind).bytes()).flights
    assert (flight.stood is not None) is stands


def test_phases_follow_the_flight(load):
    log = load(BASE.bytes())
    (flight,) = log.flights
    state = log.state([1.0, 6.0, 12.0, flight.landing - 1, flight.landing + 1.5])
    assert state.phase.tolist() == ["ground", "takeoff", "flight", "landing", "ground"]
    assert state.airborne.tolist() == [False, True, True, True, False]
    assert state.armed.tolist() == [False, True, True, True, True]
    assert state.mode.tolist() == ["LOITER", "LOITER", "AUTO", "AUTO", "AUTO"]


def test_log_that_ends_in_the_air_has_no_landing(load):
    (flight,) = load(BASE.bytes(until=15.0)).flights
    assert flight.takeoff is not None
    assert (flight.landing, flight.impact) == (None, None)


class Disarmed(Flight):
    """The same, disarmed as it hovers, ``stands`` s after its rotors were last told to lift."""

    stands = 0.0
    at = 15.0

    def messages(self, t, tick):
        made = super().messages(t, tick)
        for one in made:
            if one.get_type() == "HEARTBEAT" and t >= self.at:
                one.base_mode &= ~0x80
            if one.get_type() == "VFR_HUD" and t >= self.at - self.stands:
                one.throttle = 0
        return made


@pytest.mark.parametrize("until", [15.0, 15.2])
def test_a_disarming_in_the_air_is_no_landing(load, until):
    log = load(Disarmed().bytes(until))
    (flight,) = log.flights
    assert (flight.landing, flight.impact) == (None, None)
    (end,) = log.ends
    assert (end.how, end.lost_by) == ("control_lost", "stop")
    assert end.lost_control == pytest.approx(15.0, abs=1.0)


def test_a_disarming_after_which_it_is_armed_again_stopped_no_motors(load):
    """A heartbeat with a wrong bit is no end of a flight that goes on."""

    class Flickers(Flight):
        def messages(self, t, tick):
            made = super().messages(t, tick)
            for one in made:
                if one.get_type() == "HEARTBEAT" and 11.0 <= t < 12.0:
                    one.base_mode &= ~0x80
            return made

    log = load(Flickers().bytes(18.0))
    assert "disarm" in [event.kind for event in log.events]
    assert [end.how for end in log.ends] == ["in_air"]


def test_who_is_disarmed_after_standing_high_up_has_landed_there(load):
    roof = Disarmed()
    object.__setattr__(roof, "stands", 2.0)
    log = load(roof.bytes(17.0))
    (flight,) = log.flights
    assert flight.landing is not None
    assert [end.how for end in log.ends] == ["landed"]


def test_what_starts_anew_in_the_air_and_is_given_throttle_flies_on(load):
    """A watchdog's restart comes up armed, and nobody arms it again."""
    log = load(b"".join([*BASE.records(11.0), *started_anew()]))
    assert [e.kind for e in log.events if e.kind in ("arm", "reboot", "disarm")] == [
        "arm",
        "reboot",
        "disarm",
    ]
    first, second = log.flights
    assert first.restart == pytest.approx(AFTER, abs=0.3)
    assert second.landing == pytest.approx(BASE.phases()[3], abs=1.5)


def test_log_that_begins_in_the_air_has_no_take_off(load):
    records = [r for r in BASE.records() if int.from_bytes(r[:8], "big") / 1e6 > 1_700_000_010]
    (flight,) = load(b"".join(records)).flights
    assert flight.takeoff is None
    assert flight.airborne[0] == pytest.approx(0.0, abs=0.3)


def test_log_that_begins_armed_on_a_high_field_does_not_begin_in_the_air(load):
    """Only the receiver tells the height, 400 m above the sea."""
    told = (mav.MAVLINK_MSG_ID_HEARTBEAT, mav.MAVLINK_MSG_ID_GPS_RAW_INT)
    records = [
        r for r in BASE.records(until=15.0)[60:] if int.from_bytes(r[15:18], "little") in told
    ]
    assert not any(flight.flew for flight in load(b"".join(records)).flights)


def test_log_that_ends_in_a_dive_near_the_ground_ends_with_an_impact(load):
    fall = BASE.but(height=60.0, down=8.0)
    log = load(fall.bytes(until=fall.phases()[3] - 1.0))
    (flight,) = log.flights
    assert flight.impact == pytest.approx(log.span[1])
    assert flight.impact_speed == pytest.approx(8.0, abs=0.1)
    assert log.state([flight.impact + 1]).phase.tolist() == ["impact"]


def crash(speed: float) -> bytes:
    """Return a flight that meets the ground at a speed, felt by the accelerometer."""
    flight = BASE.but(height=30.0, down=speed)
    ground = flight.phases()[3]
    blow = mav.MAVLink_raw_imu_message(
        round((flight.boot + ground) * 1e6), 0, 0, round(-1000 - 1500 * speed), 0, 0, 0, 0, 0, 0
    )
    return b"".join(sorted([*flight.records(), record(ground + 0.02, blow)], key=lambda r: r[:8]))


def test_hard_contact_is_an_impact_at_the_last_record_before_it(load):
    (flight,) = load(crash(6.0)).flights
    ground = BASE.but(height=30.0, down=6.0).phases()[3]
    assert ground - 0.5 < flight.impact <= ground + 0.05
    assert flight.landing is None


def test_soft_contact_is_a_landing(load):
    (flight,) = load(crash(DOWN)).flights
    assert flight.impact is None
    assert flight.landing is not None


FALL = 8.0  # m/s


class Falling(Flight):
    """A fall from 40 m, felt at 25 Hz; at ``jump`` before the ground the estimate jumps."""

    jump = 0.0  # s
    force_g = 2.0  # while it tumbles
    blow_g = 12.0
    disarm = 0.0  # s before the ground
    decay = 0.0  # s that the estimated climb rate takes to see that it rests
    logged = True  # the accelerometer

    def messages(self, t, tick):
        ground, out = self.phases()[3], []
        falls = ground - 40.0 / FALL < t < ground
        for message in super().messages(t, tick):
            kind = message.get_type()
            climb = None
            if self.jump and ground - self.jump < t < ground - self.jump + 0.2:
                climb = -3.0
            if self.decay and t >= ground:
                climb = -FALL * math.exp((ground - t) / self.decay)
            if climb is not None and kind == "VFR_HUD":
                message.climb = climb
            if climb is not None and kind == "GLOBAL_POSITION_INT":
                message.vz = round(-100 * climb)
            if kind == "RAW_IMU":
                if not self.logged:
                    continue
                hits = ground <= t < ground + 1.5 / self.rate
                message.zacc = round(
                    -1000 * (self.blow_g if hits else self.force_g if falls else 1)
                )
            if kind == "HEARTBEAT" and self.disarm and t > ground - self.disarm:
                message.base_mode &= ~0x80
            out.append(message)
        return out


def fall(**changes) -> tuple[bytes, float]:
    """Return the log of such a fall and when it meets the ground."""
    flight = Falling(height=40.0, down=FALL, rate=25.0)
    for name, value in changes.items():
        object.__setattr__(flight, name, value)
    return flight.bytes(), flight.phases()[3]


def test_a_jump_of_the_estimate_without_a_blow_is_no_impact(load):
    """A vehicle that tumbles feels 2 g and more; its estimator jumps by 5 m/s in one step."""
    data, ground = fall(jump=1.5)
    (flight,) = load(data).flights
    assert flight.impact == pytest.approx(ground, abs=0.15)
    assert flight.impact_speed == pytest.approx(FALL, abs=0.3)


def test_without_an_accelerometer_a_fall_that_ends_at_rest_by_its_height_is_an_impact(load):
    """The estimated climb rate sees for seconds nothing of it."""
    data, ground = fall(logged=False, decay=8.0)
    (flight,) = load(data).flights
    assert flight.impact == pytest.approx(ground, abs=0.5)
    assert flight.impact_speed == pytest.approx(FALL, abs=0.5)
    assert flight.landing is None


def test_a_vehicle_that_is_disarmed_as_it_falls_meets_the_ground_all_the_same(load):
    data, ground = fall(disarm=1.5)
    (flight,) = load(data).flights
    assert flight.impact == pytest.approx(ground, abs=0.15)
    assert flight.end >= flight.impact
    assert flight.landing is None


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
@pytest.mark.parametrize(
    ("name", "impact", "within"),
    [
        ("crash/mechanical_fail.log", 107.0, 1.0),  # no accelerometer is logged
        ("px4_motor/sil_01.ulg", 36.05, 0.2),  # blows of 10 g and more, after a second of tumbling
        ("px4_motor/sil_03.ulg", 35.95, 0.2),
        ("px4_motor/hil_00.ulg", 21.3, 0.2),
        ("px4_motor/hil_02.ulg", 21.45, 0.2),  # disarmed 0.1 s before
        ("px4_motor/sil_06.ulg", 36.25, 0.2),
    ],
)
def test_impacts_of_tumbling_vehicles_are_where_the_blow_is(name, impact, within):
    (flight,) = read(SHARED / name).flights
    assert flight.impact == pytest.approx(impact, abs=within)
    assert flight.landing is None


def test_arming_without_leaving_the_ground_is_no_flight(load):
    idle = BASE.but(height=0.0, hover=3.0)
    log = load(
        b"".join(idle.records() + BASE.but(start=idle.duration, boot=20 + idle.duration).records())
    )
    assert len(log.flights) == 1
    assert not load(idle.bytes()).flights[0].flew


def low(*, told: bool) -> bytes:
    """Return a flight at 0.9 m, at whose beginning and end the autopilot may tell that it flies."""
    flight = BASE.but(height=0.9)
    up, _, _, ground = flight.phases()
    states = [
        record(t, mav.MAVLink_extended_sys_state_message(0, 2 if up <= t < ground else 1))
        for t in np.arange(0.2, flight.duration, 0.5)
    ]
    return b"".join(sorted([*flight.records(), *(states if told else ())], key=lambda r: r[:8]))


def test_low_flight_is_one_whether_the_autopilot_says_so_or_not(load):
    up, _, _, ground = BASE.but(height=0.9).phases()
    for told in (True, False):
        (flight,) = load(low(told=told)).flights
        assert flight.flew
        assert flight.takeoff == pytest.approx(up, abs=1.0)
        assert flight.landing == pytest.approx(ground, abs=1.0)


def test_up_positive_vertical_speed_is_turned_and_told(load):
    old, new = load(BASE.but(vz_sign=-1.0).bytes()), load(BASE.bytes())
    np.testing.assert_allclose(
        old["GLOBAL_POSITION_INT"].si("vz"), new["GLOBAL_POSITION_INT"].si("vz"), atol=1e-9
    )
    assert old["GLOBAL_POSITION_INT"].raw("vz").max() == 300
    assert [(q.kind, q.channel) for q in old.quality] == [("repaired", "GLOBAL_POSITION_INT.vz")]


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
def test_impacts_of_recorded_flights_are_found_and_landings_are_none():
    """Labelled crashes within 0.6 s and late by less than a record; no other flight has one."""
    labels = json.loads((SHARED / "labels.json").read_text())["flights"]
    wrong = []
    for name, label in labels.items():
        if not name.endswith(".tlog"):
            continue
        speed = label.get("impact_speed") or 0.0
        wanted = label["impact"] if speed > HARD else None
        log = read(SHARED / name)
        found = [f.impact for f in log.flights if f.impact is not None]
        if name == "paper/afrika.tlog":  # the label has no impact; the text says where it ended
            wanted = 2331.6
        is_right = (
            not found if wanted is None else len(found) == 1 and -0.6 < found[0] - wanted < 0.1
        )
        if not is_right:
            wrong.append((name, wanted, found))
    assert not wrong


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
@pytest.mark.parametrize(
    ("name", "takeoff", "landing"),
    [  # of the autopilot's land detector; the first is a flight at 0.6 m in a room
        ("healthy/no_battery_monitor.ulg", 4.35, 73.08),
        ("triplex/gps_fail/instance_0.ulg", 15.0, 51.43),
    ],
)
def test_flights_of_px4_have_their_take_off_and_landing(name, takeoff, landing):
    (flight,) = read(SHARED / name).flights
    assert flight.takeoff == pytest.approx(takeoff, abs=2.5)
    assert flight.landing == pytest.approx(landing, abs=2.5)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
def test_impact_is_one_though_the_estimate_falls_on():
    """The blow of 40 g stops the vehicle, but its estimator goes on sinking for ten seconds."""
    (flight,) = read(SHARED / "crash" / "motors_cut_in_air.ulg").flights
    assert flight.impact == pytest.approx(68.8, abs=0.15)
    assert flight.landing is None


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
def test_airborne_times_of_long_flights_agree_with_the_labels():
    """Labels count until the motors stop: up to 4 s (copter) or 30 s (plane) after touch-down."""
    labels = json.loads((SHARED / "labels.json").read_text())["flights"]
    for name, label in labels.items():
        if not label.get("airborne") or not name.endswith(".tlog"):
            continue
        flights = read(SHARED / name).flights
        assert len(flights) == len(label["airborne"]), name
        for flight, (low, high) in zip(flights, label["airborne"], strict=True):
            start, end = flight.airborne
            assert abs(start - low) < 2.5, name
            assert -30.0 < end - high < 0.5, name


@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
def test_a_height_that_drifts_on_the_ground_is_no_flight():
    """Its rest would begin with its take-off."""
    assert read(SHARED / "others" / "jschall.tlog").flights == ()


@pytest.mark.parametrize(
    ("kind", "parameters", "right"),
    [
        (mav.MAV_TYPE_FIXED_WING, {"Q_ENABLE": 1.0}, "vtol"),
        (mav.MAV_TYPE_FIXED_WING, {"Q_ENABLE": 0.0}, "plane"),
        (mav.MAV_TYPE_QUADROTOR, {"Q_ENABLE": 1.0}, "quad"),
    ],
)
def test_a_plane_whose_parameters_give_it_rotors_is_no_plane_alone(load, kind, parameters, right):
    told = b"".join(
        record(0.0, mav.MAVLink_param_value_message(name.encode(), value, 9, 1, 0))
        for name, value in parameters.items()
    )
    assert load(told + Flight(kind=kind).bytes()).vehicle == right
