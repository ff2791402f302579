"""What frame has a vehicle with rotors, where its type alone does not say?

In: the vehicle's type, its parameters and texts. Out: the vehicle as in `Log`, and how a person
calls a frame that is none of the ordinary ones (empty otherwise). A Y6 tells MAVLink that it is a
hexacopter, and a coaxial eight that it is an octocopter, but their rotors stand elsewhere: a model
of six motors in a ring would say things about them that are not so. They are ``other``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from fdi.telemetry.catalogue import data_table

_TEXT: Final = re.compile(r"Frame: ([A-Z0-9_]+)")
_ROTORS: Final = ("quad", "hexa", "octa")
_MOST: Final = 32  # rotors; a count above is none (PX4 knows twelve)


class Frame(NamedTuple):
    """A vehicle as in `Log`, and the name of its frame where that is no ordinary one."""

    vehicle: str
    name: str


def frame_of(
    vehicle: str,
    values: Mapping[str, float],
    texts: Iterable[str],
    *,
    autopilot: str,
    mav_type: int = 0,
) -> Frame:
    """Return the vehicle and its frame.

    Parameters
    ----------
    vehicle : str
        By its type or firmware alone.
    values : Mapping[str, float]
        The parameters as first downloaded.
    texts : iterable of str
        Of the autopilot.
    autopilot : str
        As in `Log`.
    mav_type : int
        Of its heartbeat; 0: not told.

    Examples
    --------
    >>> frame_of("hexa", {"FRAME_CLASS": 5.0}, (), autopilot="ardupilot")
    Frame(vehicle='other', name='Y6')
    """
    table = data_table("frames")
    by_type = Frame(vehicle, table["type"].get(str(mav_type), "") if vehicle == "other" else "")
    if autopilot == "px4":
        return _px4(by_type, values)
    if autopilot != "ardupilot" or vehicle not in (*_ROTORS, "helicopter"):
        return by_type
    told = table["class"].get(f"{values.get('FRAME_CLASS', 0):.0f}")
    if told is None:  # older firmware is built for one frame, and names it in a text
        named = (_TEXT.match(text) for text in texts)
        told = next((table["text"].get(found[1]) for found in named if found), None)
    if told is None and values.get("FRAME") == table["y6"]:
        return Frame("other", "Y6")
    return by_type if told is None else Frame(*told)


def _px4(by_type: Frame, values: Mapping[str, float]) -> Frame:
    """Return the frame by PX4's airframe number, and by where its rotors are."""
    table = data_table("frames")
    if by_type.vehicle not in (*_ROTORS, "helicopter", "other"):
        return by_type
    number = values.get("SYS_AUTOSTART", 0)
    for low, high, name in table["autostart"]:
        if low <= number < high:
            return Frame("other", name)
    count = values.get("CA_ROTOR_COUNT", 0)
    if by_type.vehicle not in _ROTORS or values.get("CA_AIRFRAME", 0) or not 0 < count <= _MOST:
        return by_type
    rotors = round(count)
    places = {(values.get(f"CA_ROTOR{i}_PX"), values.get(f"CA_ROTOR{i}_PY")) for i in range(rotors)}
    if len(places) < rotors and (None, None) not in places:
        return Frame("other", f"coaxial copter with {rotors} rotors")
    usual = table["rotors"].get(str(rotors))
    return Frame("other", f"copter with {rotors} rotors") if usual is None else Frame(usual, "")
