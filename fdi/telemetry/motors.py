"""Where does every motor stand, and which way does its propeller turn?

In: the parameters of a log, its autopilot and vehicle. Out: the motors in the autopilot's own
numbers, with what each does to roll, pitch and yaw; nothing where the log does not tell the frame.
``data/motors.json`` holds ArduPilot's frames and PX4's older ones, with their sources; newer PX4
says itself where its rotors are (``CA_ROTORn_PX``, ``_PY``; ``_KM`` above zero is
counter-clockwise).

A motor at an angle from the nose has the roll factor -sin and the pitch factor cos of it, as in
ArduPilot's AP_MotorsMatrix; as there, both count against the largest of the frame. The trap for a
maintainer: a propeller that turns counter-clockwise turns the vehicle clockwise, which is +.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, isfinite, nan, radians, sin
from typing import Final, NamedTuple

from fdi.telemetry.catalogue import data_table

ROTORS: Final = {"quad": 4, "hexa": 6, "octa": 8}
"""How many motors have the vehicles whose type says so."""
LIFTING: Final = 4
"""Motors that lift an aeroplane of whose motors something is said."""
MOST: Final = 12
"""Motors that an autopilot drives."""
_Y6B: Final = 10.0  # FRAME of Copter 3.1 to 3.4, which had no FRAME_CLASS
_Y6: Final = 5.0
_CLASSES: Final = {"quad": 1.0, "hexa": 2.0, "octa": 3.0}  # FRAME_CLASS
_NAMES: Final = ("FRAME_TYPE", "FRAME")
_LIFT: Final = ("Q_FRAME_CLASS", "Q_FRAME_TYPE")  # of an aeroplane that rotors lift
_TILTS: Final = ("Q_TILT_MASK", "Q_TILT_ENABLE", "Q_TAILSIT_ENABLE")
_STANDARD: Final = 2.0  # CA_AIRFRAME: an aeroplane with rotors that lift and rotors that push
_DIGITS: Final = 9  # of a factor: -sin(180 degrees) is 0

Parameters = Mapping[str, float]


class Motor(NamedTuple):
    """A motor and what its thrust does to the vehicle.

    Attributes
    ----------
    number : int
        Of the autopilot, from 1 on.
    roll, pitch : float
        -1 to 1: of thrust that rolls right and pitches up, against the frame's largest. A motor on
        the left rolls right.
    yaw : float
        1 for a propeller that turns counter-clockwise seen from above, and so the vehicle to the
        right; -1 for clockwise; less where ArduPilot gives it less to do; NaN where nobody says.
    """

    number: int
    roll: float
    pitch: float
    yaw: float


def motors_of(parameters: Parameters, autopilot: str, vehicle: str) -> tuple[Motor, ...]:
    """Return the motors of a vehicle, none where the log does not tell its frame.

    Parameters
    ----------
    parameters : Mapping[str, float]
        As first downloaded.
    autopilot, vehicle : str
        As in `Log`.

    Examples
    --------
    >>> motors_of({"FRAME_CLASS": 1.0, "FRAME_TYPE": 0.0}, "ardupilot", "quad")[0]
    Motor(number=1, roll=-1.0, pitch=0.0, yaw=1.0)
    >>> motors_of({"FRAME_CLASS": 1.0, "FRAME_TYPE": 99.0}, "ardupilot", "quad")
    ()
    """
    if vehicle not in (*ROTORS, "other", "vtol"):
        return ()
    if autopilot == "ardupilot":
        rows = _quadplane(parameters) if vehicle == "vtol" else _ardupilot(parameters, vehicle)
    elif autopilot == "px4":
        start = nan if vehicle == "vtol" else parameters.get("SYS_AUTOSTART", nan)
        rows = _positions(parameters, vehicle) or _px4(start)
    else:
        rows = ()
    count = LIFTING if vehicle == "vtol" else ROTORS.get(vehicle, len(rows))
    return _normalised(rows) if len(rows) == count and 0 < count <= MOST else ()


def lifting(parameters: Parameters, autopilot: str, vehicle: str) -> int:
    """Return how many motors lift a vehicle, 0 where neither its type nor its frame says.

    Examples
    --------
    >>> lifting({}, "px4", "hexa"), lifting({}, "px4", "vtol")
    (6, 0)
    """
    return ROTORS.get(vehicle) or len(motors_of(parameters, autopilot, vehicle))


def names_frame(parameters: Parameters, autopilot: str) -> bool:
    """Return whether a log names a frame, known or not; PX4 tells every rotor by itself.

    Examples
    --------
    >>> names_frame({"FRAME_CLASS": 1.0, "FRAME_TYPE": 99.0}, "ardupilot")
    True
    """
    return autopilot == "ardupilot" and any(name in parameters for name in _NAMES)


def _ardupilot(parameters: Parameters, vehicle: str) -> Sequence[Sequence[float]]:
    """Return the rows of a frame; without FRAME_CLASS the vehicle's type tells how many."""
    older = _Y6 if parameters.get("FRAME") == _Y6B else 0.0
    kind = f"{parameters.get('FRAME_CLASS', _CLASSES.get(vehicle, older)):.0f}"
    order = parameters.get("FRAME_TYPE", parameters.get("FRAME"))
    frame = data_table("frames")["class"].get(kind)
    if order is None or not isfinite(order) or frame is None or frame[0] != vehicle:
        return ()
    types = data_table("motors")["ardupilot"].get(kind, {})
    rows: Sequence[Sequence[float]] = types.get(f"{order:.0f}", types.get("", ()))
    return rows


def _quadplane(parameters: Parameters) -> Sequence[Sequence[float]]:
    """Return the rows of the motors that lift ArduPilot's aeroplane, none of one that tilts."""
    if any(parameters.get(name, 0.0) for name in _TILTS):
        return ()
    kind, order = (f"{parameters.get(name, 1.0):.0f}" for name in _LIFT)
    rows: Sequence[Sequence[float]] = data_table("motors")["ardupilot"].get(kind, {}).get(order, ())
    return rows if _LIFT[0] in parameters else ()


def _positions(parameters: Parameters, vehicle: str) -> Sequence[Sequence[float]]:
    """Return the rows of PX4's rotors, as far as all of them are told and push upwards.

    Those of an aeroplane that they lift are followed by rotors that push it forwards.
    """
    count = parameters.get("CA_ROTOR_COUNT", 0.0)
    own = _STANDARD if vehicle == "vtol" else 0.0
    if not 0 < count <= MOST or parameters.get("CA_AIRFRAME", 0.0) != own:
        return ()
    rows = []
    for rotor in (f"CA_ROTOR{n}" for n in range(int(count))):
        forward, right = (parameters.get(f"{rotor}_P{axis}", nan) for axis in "XY")
        turn, up = parameters.get(f"{rotor}_KM", nan), -parameters.get(f"{rotor}_AZ", -1.0)
        if own and not up:
            break
        if not (isfinite(forward) and isfinite(right) and up > 0):
            return ()
        rows.append((-right, forward, turn if not turn else turn / abs(turn)))
    return rows


def _px4(start: float) -> Sequence[Sequence[float]]:
    """Return the rows of one of PX4's kinds of airframe, by its number."""
    for first, last, rows in data_table("motors")["px4"]:
        if first <= start <= last:
            found: Sequence[Sequence[float]] = rows
            return found
    return ()


def _normalised(rows: Sequence[Sequence[float]]) -> tuple[Motor, ...]:
    """Return motors whose largest factors of roll and of pitch are 1."""
    factors = [_factors(row) for row in rows]
    roll, pitch = (max(abs(f[axis]) for f in factors) or 1.0 for axis in (0, 1))
    return tuple(
        Motor(n, round(f[0] / roll, _DIGITS) + 0.0, round(f[1] / pitch, _DIGITS) + 0.0, f[2])
        for n, f in enumerate(factors, 1)
    )


def _factors(row: Sequence[float]) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a motor at an angle, or that has them itself."""
    if len(row) == 2:  # an angle
        return -sin(radians(row[0])), cos(radians(row[0])), float(row[1])
    return float(row[0]), float(row[1]), float(row[2])
