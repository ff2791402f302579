"""A quad X as a rigid body under a linear controller, as records and as a telemetry log.

The body follows the nonlinear equations, written here once more from the published text (z down);
nothing of `fdi` computes it. Motors 1 front right, 2 rear left, 3 front left, 4 rear right.
"""

from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav
from telemetry.build import record

MASS, INERTIA, ARM, TURN, G = 1.22, np.array([0.008154, 0.008154, 0.017458]), 0.25, 0.05, 9.81
LEVER = ARM * 0.5**0.5
MIX = np.array(
    [
        [1.0, 1.0, 1.0, 1.0],
        [-LEVER, LEVER, LEVER, -LEVER],
        [LEVER, -LEVER, LEVER, -LEVER],
        [TURN, TURN, -TURN, -TURN],
    ]
)
T_MAX = 4 * MASS * G / 4 / 1.4
STEP, LAG = 0.0025, 0.02
PARAMETERS = {
    "FRAME_CLASS": 1.0,
    "FRAME_TYPE": 1.0,
    "MOT_THST_EXPO": 0.0,
    "MOT_SPIN_MIN": 0.0,
    "MOT_SPIN_MAX": 1.0,
    "MOT_PWM_MIN": 1000.0,
    "MOT_PWM_MAX": 2000.0,
    **{f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 5)},
}


def fly(seconds: float, weak: tuple[int, float, float, float] | None = None, seed: int = 0):
    """Return t (n,), states (12, n) NED and thrusts commanded (4, n) as shares, every step.

    ``weak``: motor, share of its thrust that is left, from when to when.
    """
    rng = np.random.default_rng(seed)
    x, acts, windup = np.zeros(12), np.full(4, MASS * G / 4), np.zeros(4)
    rows = []
    solve = np.linalg.inv(MIX)
    for k in range(int(seconds / STEP)):
        t = k * STEP
        goal = np.array([0.0, 0.0, -min(max(t - 4.0, 0.0), 10.0)])
        wanted = 0.8 * (goal - x[:3]) - 1.6 * x[3:6]
        tilt = np.clip([wanted[1] / G, -wanted[0] / G], -0.3, 0.3)
        error = np.array([tilt[0] - x[9], tilt[1] - x[10], -x[11]])
        turn = INERTIA * (60.0 * error - 12.0 * x[6:9])
        windup += np.array([-0.5 * wanted[2], *(20.0 * INERTIA * error)]) * STEP
        given = solve @ (np.array([MASS * (G - wanted[2]), *turn]) + windup)
        given = np.clip(given / T_MAX, 0.0, 1.0)
        acts += (given * T_MAX - acts) * STEP / LAG
        real = acts.copy()
        if weak is not None and weak[2] <= t < weak[3]:
            real[weak[0] - 1] *= weak[1]
        rows.append((t, *x, *given))
        u = MIX @ real
        x = x + STEP * _moves(x, u)
        if t < 4.0:
            x = np.zeros(12)
            windup[:] = 0.0
        else:
            x[6:9] += rng.normal(0, 2e-4, 3)
    found = np.array(rows)
    return found[:, 0], found[:, 1:13].T, found[:, 13:].T


def _moves(x, u):
    phi, theta, psi = x[9:]
    p, q, r = x[6:9]
    f, c = u[0] / MASS, np.cos
    s = np.sin
    return np.array(
        [
            *x[3:6],
            -f * (c(psi) * s(theta) * c(phi) + s(psi) * s(phi)),
            -f * (s(psi) * s(theta) * c(phi) - c(psi) * s(phi)),
            G - f * c(phi) * c(theta),
            (u[1] - (INERTIA[2] - INERTIA[1]) * q * r) / INERTIA[0],
            (u[2] - (INERTIA[0] - INERTIA[2]) * p * r) / INERTIA[1],
            u[3] / INERTIA[2],
            p + (q * s(phi) + r * c(phi)) * np.tan(theta),
            q * c(phi) - r * s(phi),
            (q * s(phi) + r * c(phi)) / c(theta),
        ]
    )


def write(
    path: Path,
    seconds: float = 60.0,
    weak=None,
    *,
    rate: float = 10.0,
    kind: int = mav.MAV_TYPE_QUADROTOR,
    attitude: bool = True,
    seed: int = 0,
) -> Path:
    """Write the telemetry log of a flight, with noise of usual size."""
    t, states, thrust = fly(seconds, weak, seed)
    rng = np.random.default_rng(seed + 1)
    noise = np.repeat([0.01, 0.01, 0.005, 0.0005], 3)[:, None]
    every = slice(0, None, round(1 / rate / STEP))
    t, thrust = t[every], thrust[:, every]
    seen = states[:, every] + noise * rng.normal(size=(12, t.size))
    parts = [
        record(0.0, mav.MAVLink_param_value_message(n.encode(), v, 9, len(PARAMETERS), i))
        for i, (n, v) in enumerate(PARAMETERS.items())
    ]
    for k, when in enumerate(t.tolist()):
        parts += _at(when, seen[:, k], thrust[:, k], kind, attitude=attitude)
    path.write_bytes(b"".join(parts))
    return path


def _at(t, x, thrust, kind, *, attitude):
    stamp = round(1000 * t)
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    pwm = [round(1000 + 1000 * one) for one in thrust]
    x = [float(one) for one in x]
    found = [
        mav.MAVLink_local_position_ned_message(stamp, *x[:6]),
        mav.MAVLink_servo_output_raw_message(stamp * 1000, 0, *pwm, 0, 0, 0, 0),
        mav.MAVLink_vfr_hud_message(0.0, 0.0, 0, 50, -x[2], -x[5]),
        mav.MAVLink_global_position_int_message(
            stamp, 450000000, 90000000, 0, round(-1000 * x[2]), 0, 0, round(100 * x[5]), 0
        ),
    ]
    if attitude:
        found.append(mav.MAVLink_attitude_message(stamp, *x[9:], *x[6:9]))
    if stamp % 1000 == 0:
        found.append(
            mav.MAVLink_heartbeat_message(
                kind, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, armed if t > 2 else 1, 4, 4, 3
            )
        )
    return [record(t, one) for one in found]
