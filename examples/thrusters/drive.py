"""Write two minutes of a boat with four thrusters, one of which may die, as a table.

    python drive.py boat.csv [--dead 3] [--seed 1]

Outputs follow a pilot who goes ahead, sideways and turns at once; the boat follows with a lag of
1 s, and waves push it about.
"""

import argparse

import numpy as np

MIXER = np.array([[1, 1, 1, 1], [1, -1, -1, 1], [1, -1, 1, -1]])  # ahead, right, clockwise
FULL = np.array([1.2, 0.8, 0.9])
LAG, STEP, FAILS = 1.0, 0.1, 60.0

asked = argparse.ArgumentParser(description=__doc__)
asked.add_argument("path")
asked.add_argument("--dead", type=int, help="the thruster that gives no thrust from 60 s on")
asked.add_argument("--seed", type=int, default=1)
given = asked.parse_args()

draw = np.random.default_rng(given.seed)
t = np.arange(0.0, 120.0, STEP)
wish = np.c_[0.35 + 0.25 * np.sin(0.21 * t), 0.3 * np.sin(0.33 * t), 0.3 * np.sin(0.47 * t + 1)]
outputs = wish @ MIXER
thrust = outputs.copy()
if given.dead:
    thrust[t >= FAILS, given.dead - 1] = 0.0
steady = thrust @ MIXER.T / 4 * FULL
motion = np.zeros((t.size, 3))
for k in range(1, t.size):
    motion[k] = motion[k - 1] + (steady[k] - motion[k - 1]) * STEP / LAG
waves = np.zeros_like(motion)
for k in range(1, t.size):  # they come and go within some 2 s
    waves[k] = waves[k - 1] * (1 - STEP / 2) + draw.normal(0, 0.003, 3)
seen = motion + waves + draw.normal(0, [0.01, 0.01, 0.005], motion.shape)
currents = 12 * np.abs(thrust) ** 1.5 + draw.normal(0, 0.1, thrust.shape)
head = [f"OUT.thruster_{i}" for i in range(1, 5)]
head += [f"ESC.current_{i} [A]" for i in range(1, 5)]
head += ["DVL.ahead [m/s]", "DVL.right [m/s]", "IMU.turn [rad/s]"]
np.savetxt(
    given.path,
    np.c_[t, outputs, currents, seen],
    fmt="%.4f",
    delimiter=",",
    header=",".join(["t [s]", *head]),
    comments="",
)
