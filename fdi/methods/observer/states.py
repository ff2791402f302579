"""How are the observer's states, inputs and residuals called, and what are their units?

Names only. World NED about the log's origin, body FRD: x north, y east, z down; roll right wing
down, pitch nose up, yaw from north clockwise.
"""

from __future__ import annotations

from typing import Final

STATES: Final = ("x", "y", "z", "vx", "vy", "vz", "p", "q", "r", "phi", "theta", "psi")
INPUTS: Final = ("u_f", "u_p", "u_q", "u_r")
"""Total thrust less the weight, N; torques about the body's axes, N m."""
HORIZONTAL: Final = "vh"
RESIDUALS: Final = (*STATES, HORIZONTAL)
"""The twelve, and the horizontal speed of the velocity's residual, which is never negative."""
UNITS: Final = dict(
    zip(
        RESIDUALS,
        (*3 * ("m",), *3 * ("m/s",), *3 * ("rad/s",), *3 * ("rad",), "m/s"),
        strict=True,
    )
)
POSITION: Final = slice(0, 3)
VELOCITY: Final = slice(3, 6)
RATES: Final = slice(6, 9)
ANGLES: Final = slice(9, 12)
PSI: Final = STATES.index("psi")
