"""A quad X as a rigid body with a rate controller, motors with lag, and its telemetry log.

What is set up wrongly is an argument: which place each output drives, which way propellers turn,
how the gyroscopes are turned. The body follows from its own equations alone; nothing of `fdi` is
used. Places: 45 degrees right and left of nose and tail; motors 1 front right, 2 rear left, 3 front
left, 4 rear right; 1 and 2 turn counter-clockwise (ArduPilot's quad X).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav
from telemetry.build import record

HALF = 0.5**0.5
# what a motor at a place does to roll, pitch, yaw: right wing down, nose up, nose right
PLACES = np.array(
    [[-HALF, HALF, 1.0], [HALF, -HALF, 1.0], [HALF, HALF, -1.0], [-HALF, -HALF, -1.0]]
)
INERTIA = np.array([60.0, 60.0, 4.0])  # rad/s2 for a share of thrust
EXPO, SPIN_MIN, SPIN_MAX = 0.65, 0.15, 0.95
HOVER = 0.35
STEP = 0.0025
LAG = 0.05


@dataclass(frozen=True)
class Quad:
    """A quad and its flight; ``places``: which place each motor stands in, 0 to 3."""

    places: Sequence[int] = (0, 1, 2, 3)
    turns: float = 1.0  # -1: all propellers the other way round
    effect: Sequence[float] = (1.0, 1.0, 1.0, 1.0)
    board: Sequence[Sequence[float]] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    rate: float = 10.0
    hover: float = 40.0
    seed: int = 0
    calm: bool = False
    kind: int = mav.MAV_TYPE_QUADROTOR
    frame: int = 1
    tells_frame: bool = True
    gains: Sequence[float] = (1.0, 1.0)  # of rate and angle, so many times from 8 s on


def fly(quad: Quad) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return t (n,), angles (n, 3), rates (n, 3), outputs (n, 4) in us, every step.

    Three seconds at rest, then the throttle comes up within one; the ground holds the vehicle until
    the motors carry most of it. It ends a second after it lies on its back.
    """
    rng = np.random.default_rng(quad.seed)
    angles, rates, gust = np.zeros(3), np.zeros(3), np.zeros(3)
    given, acts = np.zeros(4), np.zeros(4)
    board = np.array(quad.board, float)
    effect = (PLACES[list(quad.places)] * np.array(quad.effect)[:, None]).T
    effect[2] *= quad.turns
    wanted, rows, over = np.zeros(3), [], None
    for k in range(int((4.0 + quad.hover) / STEP)):
        t = k * STEP
        lift = HOVER * np.clip((t - 3.0) / 0.8, 0.0, 1.0)
        if not quad.calm and k % int(1.5 / STEP) == 0 and t > 6:
            wanted = rng.normal(0, 1, 3) * [0.15, 0.15, 0.5]
        seen = board @ rates
        tilt = board @ angles
        of_rate, of_angle = quad.gains if t > 8 else (1.0, 1.0)
        rate_wanted = 5.0 * of_angle * (np.array([wanted[0], wanted[1], 0.0]) - tilt)
        rate_wanted[2] = wanted[2]
        demand = of_rate * (rate_wanted - seen) * [0.06, 0.06, 0.3] if lift > 0 else np.zeros(3)
        given = np.clip(lift + PLACES @ demand * 0.25, 0.0, 1.0) if lift > 0 else np.zeros(4)
        acts = acts + (given - acts) * STEP / LAG
        gust = gust * (1 - STEP / 0.3) + rng.normal(0, 1, 3) * np.sqrt(STEP) * (
            0.3 if quad.calm else 4.0
        ) * [1, 1, 0.1]
        moments = INERTIA * (effect @ acts) - 0.5 * rates + gust
        if acts.mean() > 0.7 * HOVER:
            rates = rates + moments * STEP
            angles = angles + rates * STEP
        rows.append((t, *angles, *rates, *_pulse(given)))
        if over is None and np.abs(angles[:2]).max() > np.pi / 2:
            over = t
        if over is not None and t > over + 1.0:
            break
    found = np.array(rows)
    seen = found[:, 4:7] @ board.T + rng.normal(0, 0.01, (len(found), 3))
    return found[:, 0], found[:, 1:4] @ board.T, seen, found[:, 7:]


def _pulse(thrust: np.ndarray) -> np.ndarray:
    """Return what ArduPilot puts out for a share of the thrust: its curve, solved."""
    x = (np.sqrt((1 - EXPO) ** 2 + 4 * EXPO * thrust) - (1 - EXPO)) / (2 * EXPO)
    share = np.where(thrust > 0, SPIN_MIN + x * (SPIN_MAX - SPIN_MIN), 0.0)
    return np.round(1000 + 1000 * share)


def write(path: Path, quad: Quad) -> Path:
    """Write the telemetry log of a flight."""
    t, angles, rates, outputs = fly(quad)
    told = {
        **({"FRAME_CLASS": 1.0, "FRAME_TYPE": float(quad.frame)} if quad.tells_frame else {}),
        **{"MOT_THST_EXPO": EXPO, "MOT_SPIN_MIN": SPIN_MIN, "MOT_SPIN_MAX": SPIN_MAX},
        **{"MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0},
        **{f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 5)},
    }
    parts = [
        record(0.0, mav.MAVLink_param_value_message(n.encode(), v, 9, len(told), i))
        for i, (n, v) in enumerate(told.items())
    ]
    flips = np.abs(angles[:, :2]).max() > np.pi / 2
    for k in range(0, len(t), round(1 / quad.rate / STEP)):
        parts += _at(t[k], angles[k], rates[k], outputs[k], quad, climbs=not flips)
    path.write_bytes(b"".join(parts))
    return path


def _at(t, angles, rates, outputs, quad, *, climbs) -> list[bytes]:
    stamp = round(1000 * t)
    height = 5.0 * np.clip(t - 4.0, 0.0, 1.0) if climbs else 0.0
    wrapped = (angles + np.pi) % (2 * np.pi) - np.pi
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    quarter = round(4 * t * quad.rate) % round(quad.rate) == 0
    beat = mav.MAVLink_heartbeat_message(quad.kind, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, 0, 4, 3)
    pulses = (*(int(x) for x in outputs), 0, 0, 0, 0)
    position = (470000000, 80000000, round(1000 * (400 + height)), round(1000 * height), 0, 0, 0, 0)
    messages = [
        *([beat] if quarter else []),
        mav.MAVLink_attitude_message(stamp, *wrapped, *rates),
        mav.MAVLink_servo_output_raw_message(1000 * stamp, 0, *pulses),
        mav.MAVLink_global_position_int_message(stamp, *position),
        mav.MAVLink_vfr_hud_message(0.0, 0.0, 0, 35, 400 + height, 0.0),
    ]
    return [record(t, message) for message in messages]
