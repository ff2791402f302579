"""Which surface does every output of a plane drive?

In: a log's messages and parameters. Out: the message ``OUTPUTS``, the outputs under the name of the
surface that they drive (``aileron``, ``aileron_2``, ``aileron_3``, ``elevator``, ``rudder``), as a
share of their throw from the middle. A model that reads it needs to know neither the wiring nor the
autopilot. Elevons, V-tails and flaperons are told as what was mixed into them (`mixed`). What the
log does not tell is left out.

=======================  ===========================================================================
autopilot                which output drives what
=======================  ===========================================================================
ArduPilot from 3.8 on    ``SERVOn_FUNCTION``: 4 aileron, 19 elevator, 21 rudder, 24 and 25
                         flaperons, 77 and 78 elevons, 79 and 80 V-tail, each left and right
ArduPilot before         ``RCMAP_ROLL``, ``_PITCH``, ``_YAW``, and ``RC5_FUNCTION`` on; unless
                         ``ELEVON_OUTPUT`` or ``VTAIL_OUTPUT`` mixes them
neither in the log       ArduPilot's own: 1, 2, 4, and what moves on 5 and 6 counts as ailerons
PX4 from 1.14 on         ``actuator_servos`` where it is logged, in the order of ``CA_SV_CSn_TYPE``;
                         else the output whose ``PWM_MAIN_FUNCn`` (``HIL_ACT_FUNCn``) names it
PX4 else                 mixers (AETR, AERT) put aileron and elevator on 1 and 2, engine and rudder
                         on 3 and 4: the engine is the one that follows the throttle, if one does.
                         Flying wings (``SYS_AUTOSTART`` 3000 to 3999) are mixed
=======================  ===========================================================================

Sources: ArduPilot SRV_Channel.h (k_aileron ...), RCMAP of AP_RCMapper, 3.x Parameters; PX4
ROMFS/px4fmu_common/mixers (AETRFG, AERT), output_functions.yaml (Servo1 is 201),
control_allocator/module.yaml (CA_SV_CSn_TYPE).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from fdi.telemetry.meaning.mixed import MIXED, share_of, unmixed
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

NAME: Final = "OUTPUTS"
_SERVOS: Final = "SERVO_OUTPUT_RAW"
_ARDUPILOT: Final = {4.0: "aileron", 19.0: "elevator", 21.0: "rudder", 24.0: "flaperon_left",
                     25.0: "flaperon_right", 77.0: "elevon_left", 78.0: "elevon_right",
                     79.0: "vtail_left", 80.0: "vtail_right"}  # fmt: skip
_MAPPED: Final = (("RCMAP_ROLL", 1, "aileron"), ("RCMAP_PITCH", 2, "elevator"),
                  ("RCMAP_YAW", 4, "rudder"))  # fmt: skip
_MIXED: Final = ("ELEVON_OUTPUT", "VTAIL_OUTPUT")
_PX4_TYPES: Final = {1: "aileron", 2: "aileron", 15: "aileron", 3: "elevator", 4: "rudder",
                     5: "elevon_left", 6: "elevon_right", 7: "vtail_left",
                     8: "vtail_right"}  # fmt: skip
_PX4_NAMES: Final = ("PWM_MAIN_FUNC", "HIL_ACT_FUNC")
_PX4_SERVO: Final = 200  # Servo1 is 201
_FLYING_WINGS: Final = (3000, 4000)
_OUTPUTS: Final = 16
_AILERONS: Final = 3
_THROW_US: Final = {"ardupilot": 400.0, "px4": 500.0}
"""From the middle to the end: by default 1100 to 1900 us, and 1000 to 2000 us."""
_FOLLOWS: Final = 0.98
_APART: Final = 0.9
_THROTTLE: Final = 0.05  # an engine that stands is at its own value for that, 900 us
_MOVED: Final = 0.03  # of the throttle, standard deviation: else nothing is seen to follow it

Messages = Mapping[str, Message]
Parameters = Mapping[str, float]


def with_outputs(
    messages: Messages, parameters: Parameters, autopilot: str, vehicle: str
) -> dict[str, Message]:
    """Return the messages with ``OUTPUTS``, where the vehicle is a plane and its outputs are known.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    parameters : Mapping[str, float]
    autopilot, vehicle : str
        As in `Log`.
    """
    known = dict(messages)
    if vehicle not in ("plane", "vtol") or NAME in known:
        return known
    servos = known.get("actuator_servos")
    types = [(n, parameters.get(f"CA_SV_CS{n - 1}_TYPE")) for n in range(1, 9)]
    if servos is not None and autopilot == "px4" and any(kind for _, kind in types):
        drives = [(n, _PX4_TYPES[int(kind)]) for n, kind in types if kind in _PX4_TYPES]
        made = _of(servos, "control[{}]", [(n - 1, what) for n, what in drives], {})
    elif _SERVOS in known:
        drives = drives_of(parameters, autopilot) or _by_throttle(known, parameters, autopilot)
        throw = _THROW_US.get(autopilot, _THROW_US["ardupilot"])
        own = Conversion("", 1 / throw, -1500 / throw)
        shares = {
            n: share_of(parameters, autopilot, n, throw) if what in MIXED else own
            for n, what in drives
        }
        made = _of(known[_SERVOS], "servo{}_raw", drives, shares)
    else:
        return known
    return dict(sorted({**known, NAME: made}.items())) if made.columns else known


def drives_of(parameters: Parameters, autopilot: str) -> list[tuple[int, str]]:
    """Return the outputs and what the parameters say that they drive.

    Examples
    --------
    >>> drives_of({"PWM_MAIN_FUNC3": 203, "CA_SV_CS2_TYPE": 4}, "px4")
    [(3, 'rudder')]
    >>> drives_of({"SERVO1_FUNCTION": 4, "SERVO2_FUNCTION": 77}, "ardupilot")
    [(1, 'aileron'), (2, 'elevon_left')]
    """
    outputs = range(1, _OUTPUTS + 1)
    if autopilot == "px4":
        named = {name: [parameters.get(f"{name}{i}", 0.0) for i in outputs] for name in _PX4_NAMES}
        functions = next((found for found in named.values() if any(found)), [])
        servos = [(i, int(n) - _PX4_SERVO) for i, n in zip(outputs, functions, strict=False)]
        types = [(i, parameters.get(f"CA_SV_CS{k - 1}_TYPE")) for i, k in servos if k > 0]
        return [(i, _PX4_TYPES[int(kind)]) for i, kind in types if kind in _PX4_TYPES]
    if any(f"SERVO{i}_FUNCTION" in parameters for i in outputs):
        told = [(i, parameters.get(f"SERVO{i}_FUNCTION")) for i in outputs]
        return [(i, _ARDUPILOT[kind]) for i, kind in told if kind in _ARDUPILOT]
    if any(parameters.get(name) for name in _MIXED):
        return []
    mapped = [(int(parameters.get(name, own)), what) for name, own, what in _MAPPED]
    aux = [(i, parameters.get(f"RC{i}_FUNCTION", 4.0)) for i in (5, 6)]
    return mapped + [(i, _ARDUPILOT[kind]) for i, kind in aux if kind in _ARDUPILOT]


def _by_throttle(
    messages: Messages, parameters: Parameters, autopilot: str
) -> list[tuple[int, str]]:
    """Return what PX4's common mixers drive, as far as the engine is seen to be where it should."""
    frame = parameters.get("SYS_AUTOSTART", 0.0)
    if autopilot != "px4" or _FLYING_WINGS[0] <= frame < _FLYING_WINGS[1]:
        return []
    engine = _engine(messages[_SERVOS], messages.get("VFR_HUD"))
    rudder = {3: 4, 4: 3}.get(engine or 0)
    return [(1, "aileron"), (2, "elevator"), (rudder, "rudder")] if rudder else []


def _engine(servos: Message, hud: Message | None) -> int | None:
    """Return which of the outputs 3 and 4 follows the throttle while the other does not."""
    if hud is None or "throttle" not in hud or len(hud) < 2:
        return None
    throttle = np.interp(servos.t, hud.t, hud.si("throttle"))
    follows = {}
    for output in (3, 4):
        name = f"servo{output}_raw"
        if name not in servos:
            return None
        values = servos.si(name)
        known = np.isfinite(values) & (throttle > _THROTTLE)
        if known.sum() < _OUTPUTS or np.std(throttle[known]) < _MOVED or not np.ptp(values[known]):
            return None
        follows[output] = float(np.corrcoef(values[known], throttle[known])[0, 1])
    best = max(follows, key=lambda output: follows[output])
    return best if follows[best] > _FOLLOWS and follows[7 - best] < _APART else None


def _of(
    base: Message,
    field: str,
    drives: Iterable[tuple[int, str]],
    shares: Mapping[int, Conversion],
) -> Message:
    """Return the outputs of a message under the names of what they drive."""
    columns: dict[str, Column] = {}
    sides: dict[str, Column] = {}
    for output, what in drives:
        column = base.columns.get(field.format(output))
        if column is None:
            continue
        if output in shares:
            column = column._replace(conversion=shares[output])
        if what in MIXED:
            sides.setdefault(what, column)
        else:
            _put(columns, what, column)
    for what, column in unmixed(base, sides):
        _put(columns, what, column)
    told = base.made_from or base.key
    return replace(base, name=NAME, instance=None, columns=columns, made_from=told, _cache={})


def _put(columns: dict[str, Column], what: str, column: Column) -> None:
    """Add an output: of several ailerons each under a name of its own, of others the first."""
    count = sum(known.startswith(what) for known in columns)
    if not count:
        columns[what] = column
    elif what == "aileron" and count < _AILERONS:
        columns[f"{what}_{count + 1}"] = column
