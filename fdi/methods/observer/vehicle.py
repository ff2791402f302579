"""What does the observer know of a multicopter? Mass, inertia, drag, and what its motors do.

In: a YAML file of one's own, or nothing: the quadrotor of the published observer. Out: `Vehicle`.
A file states ``mass`` (kg), ``inertia`` (three, kg m2), ``arm`` (m, motor to centre),
``torque_per_thrust`` (m), and may state ``drag`` (N s/m), ``rotational_drag`` (N m s) and
``thrust_max`` (N, of one motor; without it the flight's hover tells). Which motor stands where, and
how thrust grows with the output, are the log's to tell (``fdi.telemetry.motors``).

References
----------
Reference parameters: the diagnostic observer of a quadrotor in simulation; its arm and torque per
thrust are not published and are chosen, which changes the size of a rate's residual, not its sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from fdi.errors import ModelError
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import Motor

GRAVITY: Final = 9.81
"""m/s2, as the reference has it."""
REFERENCE: Final = "reference"


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A multicopter whose motors stand in a ring and push upwards.

    Attributes
    ----------
    name : str
    mass : float
        kg.
    inertia : (float, float, float)
        About the body's axes, kg m2.
    arm : float
        From the centre to every motor, m.
    torque_per_thrust : float
        m.
    drag : float
        N s/m, on a ground that the air does not move over.
    rotational_drag : float
        N m s.
    thrust_max : float or None
        Of one motor, N; None: the flight's hover tells.
    """

    name: str
    mass: float
    inertia: tuple[float, float, float]
    arm: float
    torque_per_thrust: float
    drag: float = field(default=0.001, kw_only=True)
    rotational_drag: float = field(default=0.001, kw_only=True)
    thrust_max: float | None = field(default=None, kw_only=True)


REFERENCE_QUADROTOR: Final = Vehicle(
    REFERENCE, 1.22, (0.008154, 0.008154, 0.017458), 0.25, 0.05, drag=0.001, rotational_drag=0.001
)
_NEEDED: Final = ("mass", "inertia", "arm", "torque_per_thrust")
_OPTIONAL: Final = ("drag", "rotational_drag", "thrust_max")


def read_vehicle(name: str | Path) -> Vehicle:
    """Return the vehicle that a preset or a YAML file states.

    Raises
    ------
    ModelError
        The file cannot be read or states no vehicle; all its faults are reported together.
    """
    from fdi.model.yaml import read_document  # reads slowly, and a preset needs no YAML

    if str(name) == REFERENCE:
        return REFERENCE_QUADROTOR
    document = read_document(Path(name))
    tree, problems = document.tree, []

    def problem(key: str, text: str) -> None:
        problems.append(f"{document.name}:{document.line((key,))}: {text}")

    for key in tree:
        if key not in (*_NEEDED, *_OPTIONAL, "name"):
            problem(key, f"a vehicle has no {key!r}; it has {', '.join((*_NEEDED, *_OPTIONAL))}")
    for key in _NEEDED:
        if key not in tree:
            problems.append(f"{document.name}: a vehicle needs {key}")
    for key in (*_NEEDED, *_OPTIONAL):
        wanted = 3 if key == "inertia" else 1
        if key in tree and not _is_positive(tree[key], wanted, zero="drag" in key):
            many = "three numbers" if wanted > 1 else "a number"
            problem(key, f"{key} must be {many} above 0")
    if problems:
        raise ModelError.of(problems)
    numbers = {key: float(tree[key]) for key in (*_NEEDED, *_OPTIONAL) if _is_one(tree, key)}
    inertia = tuple(float(one) for one in tree["inertia"])
    return Vehicle(
        str(tree.get("name", document.name)),
        inertia=inertia,  # type: ignore[arg-type]  # three, as was checked
        **numbers,
    )


def _is_one(tree: dict[str, Any], key: str) -> bool:
    return key in tree and key != "inertia"


def _is_positive(value: Any, count: int, *, zero: bool) -> bool:
    values = value if isinstance(value, list) else [value]
    if len(values) != count or isinstance(value, list) != (count > 1):
        return False
    return all(
        isinstance(one, int | float)
        and not isinstance(one, bool)
        and np.isfinite(one)
        and (one > 0 or (zero and one == 0))
        for one in values
    )


def mixing(vehicle: Vehicle, motors: Sequence[Motor]) -> Floats:
    """Return what thrusts of motors amount to: total thrust and three torques, (4, n).

    Parameters
    ----------
    vehicle : Vehicle
    motors : sequence of Motor
        Their factors count against the frame's largest; that all stand in a ring gives the arms.

    Returns
    -------
    (4, n) float
        1 and m; times thrusts (n,), N, it gives N and N m, body FRD.
    """
    roll, pitch, yaw = (
        np.array([getattr(m, axis) for m in motors]) for axis in ("roll", "pitch", "yaw")
    )
    squares = np.linalg.lstsq(
        np.stack([roll**2, pitch**2], axis=1), np.ones(len(motors)), rcond=None
    )[0]
    along, across = vehicle.arm * np.sqrt(np.maximum(squares, 0.0))
    return np.stack(
        [np.ones(len(motors)), along * roll, across * pitch, vehicle.torque_per_thrust * yaw]
    )
