"""How the mixers of ArduPilot's frames ask motors for thrust, by the angles of their arms.

A controller mixes thrust, roll, pitch and yaw; a motor that gives less than asked makes it ask for
more. The mixes are solved here from the frames' angles, which the models never see.
"""

import numpy as np

# AP_MotorsMatrix.cpp, frames X: angle from the nose to the right, deg; sense, 1 like motor 1
FRAMES = {
    "quadcopter": ([45, -135, -45, 135], [1, 1, -1, -1]),
    "hexacopter": ([90, -90, -30, 150, 30, -150], [1, -1, 1, -1, -1, 1]),
    "octocopter": (
        [22.5, -157.5, 67.5, 157.5, -22.5, -112.5, -67.5, 112.5],
        [1, 1, -1, -1, -1, -1, 1, 1],
    ),
}


def mixer(name, turned=0.0):
    """(n, 4): what each output gets of thrust, roll, pitch and yaw; ``turned`` makes an X a +."""
    angles, senses = (np.array(part, float) for part in FRAMES[name])
    angles = np.radians(angles + turned)
    return np.stack([np.ones_like(angles), -np.sin(angles), np.cos(angles), senses], axis=1)


def outputs(name, works, thrust=0.4, turned=0.0, torque=(0.0, 0.0, 0.0)):
    """The thrust asked for that holds the vehicle where motors give shares ``works`` of it."""
    return asked(mixer(name, turned), works, thrust, torque)


def asked(mix, works, thrust=0.4, torque=(0.0, 0.0, 0.0)):
    effect = mix.T @ np.diag(works) @ mix
    wanted = np.array([thrust * len(mix), *torque])
    return mix @ np.linalg.solve(effect, wanted)
