"""Builds a small analysis by hand: three altimeters, one of which is biased in flight.

The chain itself is the real one; findings, consequences and the like are set by the test, so that a
test of the report does not depend on how the diagnosis ranks.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fdi.decision import load_policy
from fdi.diagnosis import (
    Agreement,
    Consequence,
    Ending,
    Evidence,
    Fact,
    Finding,
    First,
    NotTestable,
    Open,
    RuledOut,
    Term,
    WouldShow,
    diagnose,
)
from fdi.methods.setup import Check
from fdi.model import load_airframe
from fdi.residuals import build_bank
from fdi.residuals.latency import Lag
from fdi.result import Analysis
from fdi.telemetry import Clock, Event, Flight, Log, Message, QualityRecord
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.message import Column
from fdi.units import Conversion

MODEL = """
format: 1
name: altimeters
description: Three channels that show one altitude.
components:
  gps: {group: sensor, description: Satellite receiver, affects: [estimator]}
  barometer: {group: sensor, description: Static pressure}
  estimator: {group: navigation, description: State estimator}
  compass: {group: sensor, description: Magnetometers}
variables:
  altitude: {unit: m}
parameters:
  lowest: {value: -100, unit: m}
limits:
  not_below: {variable: altitude, min: lowest, max: null, component: estimator}
measurements:
  GPS_RAW_INT:
    component: gps
    fields:
      alt: {variable: altitude, accuracy: 1 m}
  VFR_HUD:
    component: barometer
    fields:
      alt: {variable: altitude, accuracy: 1 m}
  GLOBAL_POSITION_INT:
    component: estimator
    fields:
      alt: {variable: altitude, accuracy: 1 m}
"""


def message(name: str, fields: Mapping[str, Any], t: np.ndarray[Any, Any]) -> Message:
    """Return a message whose fields are metres."""
    columns = {
        field: Column(partial(np.array, values), Conversion("m"))
        for field, values in fields.items()
    }
    return Message(name, None, t, t, np.arange(len(t)), columns)


def small_log(
    *, name: str = "flight.tlog", text: str = "Crash: Disarming", bias: float = 40.0
) -> Log:
    """Return 90 s at 4 Hz: in the air from 10 s, impact at 85 s, GPS biased from 40 to 60 s."""
    t = np.arange(0.0, 90.0, 0.25)
    noise = np.random.default_rng(1).normal(0, 0.3, (3, len(t)))
    altitude = np.clip(t - 10, 0, 20) + 100
    gps = altitude + noise[0] + bias * ((t >= 40) & (t < 60))
    messages = {
        "GPS_RAW_INT": message("GPS_RAW_INT", {"alt": gps}, t),
        "VFR_HUD": message("VFR_HUD", {"alt": altitude + noise[1]}, t),
        "GLOBAL_POSITION_INT": message("GLOBAL_POSITION_INT", {"alt": altitude + noise[2]}, t),
    }
    return Log(
        path=Path(name),
        format="tlog",
        data=np.zeros(12345, np.uint8),
        duration=90.0,
        span=(0.0, 89.75),
        messages=messages,
        parameters={"ARMING_CHECK": 1.0},
        parameter_changes=(),
        reported=(
            Event(5.0, "arm", "armed"),
            Event(12.0, "parameter", "SIM_WIND", None, 3.0),
            Event(70.0, "text", text, 2),
        ),
        quality=(
            QualityRecord("lost_bytes", None, 33.0, 34.0, 17, "17 bytes belong to no record"),
        ),
        clock=Clock(np.array([0.0]), np.array([30.0]), np.array([1.7e9]), 0.1, 0.1, "vehicle"),
        vehicle="plane",
        autopilot="ardupilot",
        firmware="ArduPlane V4.6.3",
        system_id=1,
        sources=(),
        _cache={"flights": (Flight(5.0, 88.0, takeoff=10.0, impact=85.0, impact_speed=9.8),)},
    )


LAG = Lag(
    source="GPS_RAW_INT",
    component="gps",
    channels=(),
    against=("LOCAL_POSITION_NED",),
    stated=0.15,
    value=-0.05,
    sigma=0.01,
    assumed=0.05,
    blocks=4.2,
    used=True,
    why="",
)


LIMITS = Check(
    "motor limits",
    "not known",
    "in 9 % (3 to 20 %) of the time in the air a motor is at its upper limit",
    {"share": 0.09, "share_least": 0.03, "share_most": 0.2},
    strikes=True,
)


def small_analysis(
    folder: Path, log: Log | None = None, model: str = MODEL, **changes: Any
) -> Analysis:
    """Return the analysis of a log, with findings set by hand; ``changes`` are to its diagnosis."""
    path = folder / "altimeters.yaml"
    path.write_text(model)
    log = log or small_log()
    airframe, policy = load_airframe(path), load_policy("default")
    system = airframe.observe(log)
    bank = build_bank(system, policy.tests)
    signals = log.signals(system.channels, policy.sampling)
    residuals = bank.evaluate(signals, policy.differentiation)
    alarms = policy.decide(residuals)
    diagnosis = replace(diagnose(alarms, bank), **{**by_hand(), **changes})
    return Analysis(
        log=log,
        airframe=airframe,
        policy=policy,
        system=system,
        bank=bank,
        signals=signals,
        residual_values=residuals,
        alarms=alarms,
        diagnosis=diagnosis,
        estimator=None,
        setup=(LIMITS,),
        stood_out=(Fact("motor limits", LIMITS.text),),
        lags=(LAG,),
        warnings=("VFR_HUD.climb: this log has no field climb",),
        timings={"read": 0.1},
        command=("fdi", "analyze", "flight.tlog"),
        version="0.1.0",
    )


def by_hand() -> dict[str, Any]:
    """Return what the diagnosis says."""
    evidence = Evidence("GPS_RAW_INT.alt contradicts altitude", ("r5", "r6"), ("GPS_RAW_INT.alt",))
    return {
        "verdict": "gps failed first, from 40.0 s.",
        "methods": (
            Agreement("estimator", 0, 1, True, "the method estimator points to the gps as well"),
            Agreement("estimator", 1, None, False, "the method estimator shows something at 9 s"),
        ),
        "findings": (
            Finding(
                1,
                0,
                "gps",
                ("GPS_RAW_INT.alt",),
                "step",
                40.0,
                41.5,
                60.0,
                0.75,
                (),
                evidence,
                (Term("alone", "a test that concerns nobody else", 2.5),),
                (("barometer", 0.04),),
            ),
        ),
        "consequences": (
            Consequence("estimator", ("GLOBAL_POSITION_INT.alt",), 44.0, 1, "estimator shows it"),
        ),
        "outlook": "accused",
        "endings": (
            Ending(
                FlightEnd(0, "impact", 60.0, 9.0),
                (First(55.0, "alarm", "GPS receiver shows another height", "gps"),),
            ),
        ),
        "ruled_out": (
            RuledOut(
                "barometer",
                "a lasting change of 1 hPa would have shown",
                ("r2",),
                (WouldShow("SCALED_PRESSURE.press_abs", 100.0, "Pa"),),
            ),
        ),
        "open": (Open("battery", "its tests do not say how small a fault they would show"),),
        "not_testable": (NotTestable("compass", "no test of it reads a channel of this log"),),
    }


NOTHING: dict[str, Any] = {
    "verdict": "No component is accused.",
    "findings": (),
    "consequences": (),
    "outlook": "healthy",
    "endings": (),
    "ruled_out": (),
    "open": (),
    "not_testable": (),
}
