"""Motors that turn a vehicle against what they are asked for, and one that swings on its legs.

The rigid body of ``setup/build.py`` flips by its own equations; nothing of `fdi` is in it.
"""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav
from scipy.signal import lombscargle
from telemetry.build import record

from fdi import analyze
from fdi.methods.columns import Columns
from fdi.methods.response import response_columns
from fdi.methods.setup.against import HALF_A_TURN
from fdi.methods.setup.motors import check_motors
from fdi.methods.setup.oscillation import check_oscillation, share_of_sines
from fdi.telemetry import Log, read

from .setup.build import Quad, fly, write

QUARTER = ((0, -1, 0), (1, 0, 0), (0, 0, 1))
BACKWARDS = ((-1, 0, 0), (0, -1, 0), (0, 0, 1))
WRONG = (
    *({"places": one} for one in ((1, 0, 2, 3), (2, 1, 0, 3), (0, 3, 2, 1), (0, 2, 1, 3))),
    *({"places": one} for one in ((0, 1, 3, 2), (3, 0, 1, 2), (1, 2, 3, 0))),
    *({"board": one} for one in (QUARTER, BACKWARDS)),
)


def columns_of(log: Log) -> Columns:
    found = response_columns(log)
    assert isinstance(found, Columns)
    return found


def flown(tmp_path: Path, **how: object) -> Log:
    return read(write(tmp_path / "flight.tlog", Quad(**{"hover": 6.0, "rate": 25.0, **how})))


@pytest.mark.parametrize("rate", [4, 10, 50])
@pytest.mark.parametrize("how", WRONG)
def test_motors_or_a_board_elsewhere_turn_it_over_half_a_turn(
    tmp_path: Path, how: dict[str, object], rate: float
) -> None:
    found = columns_of(flown(tmp_path, rate=rate, **how)).values["turned_against"]
    assert np.nanmin(found) > HALF_A_TURN  # from when the rotors turn, not from when it shows
    assert np.nanmin(found) == np.nanmax(found)


@pytest.mark.parametrize("seed", range(3))
def test_a_healthy_vehicle_follows_its_motors(tmp_path: Path, seed: int) -> None:
    found = columns_of(flown(tmp_path, seed=seed, hover=10.0))
    assert np.nanmax(found.values["turned_against"]) < 0.1 * HALF_A_TURN
    assert np.isnan(found.values["swinging"]).all()  # it flew


def test_nothing_is_told_of_records_too_far_apart_or_of_a_frame_nobody_tells(
    tmp_path: Path,
) -> None:
    assert "0.3 s apart" in str(response_columns(flown(tmp_path, rate=3)))
    assert "frame" in str(response_columns(flown(tmp_path, tells_frame=False)))
    assert (
        response_columns(flown(tmp_path, kind=mav.MAV_TYPE_FIXED_WING)) is None
    )  # nor its ailerons


def test_a_flip_accuses_propulsion_before_take_off(tmp_path: Path) -> None:
    quad = Quad(places=(0, 2, 1, 3), rate=25)
    t, angles, *_ = fly(quad)
    over = t[np.argmax(np.abs(angles[:, :2]).max(axis=1) > np.pi / 2)]
    found = analyze(write(tmp_path / "flight.tlog", quad))
    first = found.findings[0]
    assert first.component == "propulsion"
    assert first.onset == pytest.approx(3.0, abs=0.5)  # the throttle comes up
    (end,) = found.log.ends
    assert (end.how, end.is_bad) == ("tipped_over", True)
    assert over - 1.0 < end.at < over
    assert found.verdict.startswith("Tipped over on the ground (log ")
    (check,) = check_motors(found.log)
    assert check.verdict == "wrong"
    assert "turns against them" in check.text


def test_a_healthy_take_off_accuses_nobody(tmp_path: Path) -> None:
    assert not analyze(write(tmp_path / "flight.tlog", Quad(rate=25, hover=12.0))).findings


def standing(path: Path, rate_hz: float, swing: float, driven: float) -> Path:
    """Write eight seconds on the ground, armed; in the fourth to seventh it rolls to and fro.

    ``swing`` rad/s and ``driven`` us are amplitudes of the rate and of the motors left and right.
    """
    told = {"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0, "MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0}
    told |= {f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 5)}
    parts = [
        record(0.0, mav.MAVLink_param_value_message(n.encode(), v, 9, len(told), i))
        for i, (n, v) in enumerate(told.items())
    ]
    for k in range(8 * 25):
        t = k / 25
        wave = np.sin(2 * np.pi * rate_hz * t) * (3.0 <= t < 7.0)
        off = round(driven * np.sin(2 * np.pi * rate_hz * t + 1.0) * (3.0 <= t < 7.0))
        armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        pulses = (1300 - off, 1300 + off, 1300 + off, 1300 - off, 0, 0, 0, 0)
        stamp, place = round(1000 * t), (470000000, 80000000, 400000, 0, 0, 0, 0, 0)
        kind, pilot = mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_ARDUPILOTMEGA
        beat = mav.MAVLink_heartbeat_message(kind, pilot, armed, 0, 4, 3)
        messages = [
            *([beat] if k % 25 == 0 else []),
            mav.MAVLink_attitude_message(stamp, 0.0, 0.0, 0.0, swing * wave, 0.0, 0.0),
            mav.MAVLink_servo_output_raw_message(1000 * stamp, 0, *pulses),
            mav.MAVLink_global_position_int_message(stamp, *place),
            mav.MAVLink_vfr_hud_message(0.0, 0.0, 0, 20, 400.0, 0.0),
            mav.MAVLink_extended_sys_state_message(0, mav.MAV_LANDED_STATE_ON_GROUND),
        ]
        parts += [record(t, message) for message in messages]
    path.write_bytes(b"".join(parts))
    return path


def test_a_vehicle_that_swings_on_its_legs_with_its_motors_accuses_the_controller(
    tmp_path: Path,
) -> None:
    found = analyze(standing(tmp_path / "swings.tlog", 5.0, 1.0, 150.0))
    lasted = found.log["response"].si("swinging")
    assert np.nanmax(lasted) == pytest.approx(4.0, abs=0.5)
    assert found.findings[0].component == "attitude_control"
    assert found.findings[0].onset == pytest.approx(3.0, abs=0.7)
    assert "never seen to fly" not in found.verdict.split(".", maxsplit=1)[0]


@pytest.mark.parametrize(
    ("rate_hz", "swing", "driven"),
    [(5.0, 1.0, 5.0), (5.0, 0.05, 150.0), (0.3, 1.0, 150.0)],
    ids=["motors hardly move", "it hardly moves", "by hand"],
)
def test_who_is_shaken_or_turned_by_hand_does_not_swing(
    tmp_path: Path, rate_hz: float, swing: float, driven: float
) -> None:
    found = analyze(standing(tmp_path / "stands.tlog", rate_hz, swing, driven))
    assert not found.findings
    assert "What only a flight shows is not tested" in found.verdict
    assert found.log["response"].si("swinging").max() < 0.5


def test_gains_that_throw_the_motors_about_accuse_the_controller(tmp_path: Path) -> None:
    """Six times the gain of the rate, 4.5 times that of the angle, from the eighth second on."""
    quad = Quad(rate=25, hover=20.0, gains=(6.0, 4.5))
    found = analyze(write(tmp_path / "thrown.tlog", quad))
    assert found.findings[0].component == "attitude_control"
    assert 8.0 < found.findings[0].onset < 13.0
    t, rate = (fly(quad)[k] for k in (0, 2))
    roll = rate[(t > 12) & (t < 22), 0]
    crossed = np.count_nonzero(np.diff(np.sign(roll - roll.mean()))) / 2 / 10
    (check,) = check_oscillation(found.log)
    assert check.strikes
    assert check.numbers["lasts_s"] > 10
    assert check.numbers["frequency_hz"] == pytest.approx(crossed, rel=0.15)


def test_a_swing_that_leaves_motors_their_room_is_told_and_accuses_nobody(tmp_path: Path) -> None:
    found = analyze(write(tmp_path / "swings.tlog", Quad(rate=25, hover=20.0, gains=(20.0, 4.2))))
    assert not found.findings
    assert "Oscillation: it swings in roll at 2." in found.verdict


@pytest.mark.parametrize("seed", range(3))
def test_gusts_and_sticks_are_no_swing(tmp_path: Path, seed: int) -> None:
    (check,) = check_oscillation(flown(tmp_path, seed=seed, hover=20.0))
    assert check.verdict == "in order"


def test_four_records_a_second_show_no_swing(tmp_path: Path) -> None:
    (check,) = check_oscillation(flown(tmp_path, rate=4.0))
    assert (check.verdict, check.strikes) == ("not known", False)
    assert "0.15 s" in check.text


@given(
    st.lists(st.floats(0.001, 0.2), min_size=8, max_size=80),
    st.integers(0, 2**31),
    st.sampled_from([0.0, 1.6e9]),
)
def test_the_share_of_a_sine_is_the_one_of_lomb_and_scargle(
    gaps: list[float], seed: int, start: float
) -> None:
    t = np.cumsum(gaps)
    values = np.random.default_rng(seed).normal(size=t.size)
    tried = 2 * np.pi * np.linspace(2.0, 9.0, 15)
    taken = share_of_sines(start + t, values, tried)
    # times since 1970 have a resolution of 0.2 us
    expected = lombscargle(t, values, tried, normalize=True)
    assert taken == pytest.approx(expected, abs=1e-3 if start else 1e-6)


def test_a_sine_alone_takes_all_the_power_and_one_at_its_zeros_is_none() -> None:
    t = np.arange(50) * 0.1
    taken = share_of_sines(t, np.cos(2 * np.pi * 5.0 * t), 2 * np.pi * np.array([5.0, 3.0]))
    assert taken == pytest.approx([1.0, 0.0], abs=1e-9)  # 5 Hz: its sine is zero in every record
