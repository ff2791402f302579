"""Which quantities of a vehicle are followed over its flights? One table; the stage itself.

In: an analysis. Out: its `Trend`s. Each quantity is a function from a flight of the analysis to
parts with a mean; a flight counts from when it has settled until it goes wrong or ends, since what
a tumbling vehicle shows is not its condition. What was identified from the model is told of the log
as a whole: it comes from the first seconds in the air.

The trap for a maintainer: the heading of an estimator comes from its compass. A deviation of the
compass that it uses shows only as far as the receiver corrects that heading; another compass'
deviation is one against the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.diagnosis.ending import went_wrong
from fdi.methods.setup.compass import COMPASSES, compass_readings, earth_field, in_flight
from fdi.methods.setup.records import attitude
from fdi.residuals.between import tells
from fdi.result import Analysis
from fdi.shown import Rows
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.message import Floats
from fdi.trends.battery import resistance
from fdi.trends.blocks import Mean, block_edges, block_means, mean_of
from fdi.trends.values import Trend

BATTERIES: Final = (
    ("BATTERY_STATUS", "voltages[0]", "current_battery"),
    ("SYS_STATUS", "voltage_battery", "current_battery"),
)
"""Messages that may tell voltage and current at one moment, the best first."""
RIGHT_ANGLE: Final = np.pi / 2
"""rad: a mean direction that two standard errors turn by more is none."""
LEAST_VOLTAGE: Final = 1.0
"""V: no battery of a vehicle has less; without a monitor 0 or 0.05 is told."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """The part of a flight that counts, s of the log's clock."""

    analysis: Analysis
    start: float
    end: float

    def edges(self) -> Floats:
        """Return the blocks of this stretch."""
        return block_edges(self.start, self.end)


Parts = Iterator[tuple[str, Mean | None]]


def trends_of(analysis: Analysis) -> Rows[Trend]:
    """Return what every flight of an analysis tells of its vehicle."""
    found = []
    for number, stretch in _stretches(analysis):
        for quantity, (unit, parts) in _QUANTITIES.items():
            found += [
                Trend(quantity, part, number, mean.value, mean.std, unit)
                for part, mean in parts(stretch)
                if mean is not None
            ]
    return Rows([*found, *_identified(analysis)])


def _stretches(analysis: Analysis) -> Iterator[tuple[int, _Stretch]]:
    bad = {end.flight: went_wrong(end) for end in analysis.log.ends if end.is_bad}
    for number, flight in enumerate(analysis.log.flights):
        low, high = flight.airborne
        yield (
            number,
            _Stretch(analysis, low + SETTLING_S, min(high, bad.get(number, high))),
        )


def _thrust_shares(stretch: _Stretch) -> Parts:
    """Yield what each motor is asked for over the mean of all, 1 where all are alike.

    Thrust is (1 - c) x + c x^2 of the output's share x of its range (ArduPilot, MOT_THST_EXPO), as
    in the models; the ratio is that of a block's means.
    """
    log, parameters = stretch.analysis.log, stretch.analysis.system.parameters
    if "MOTORS" not in log or "thrust_curve" not in parameters:
        return
    low, high, curve = (
        parameters[name].value for name in ("motor_low", "motor_high", "thrust_curve")
    )
    message = log["MOTORS"]
    share = (np.array([message.si(name) for name in message.fields]) - low) / (high - low)
    share = np.clip(share, 0.0, None)
    thrust = block_means(message.t, (1 - curve) * share + curve * share**2, stretch.edges())
    mean = thrust.mean(axis=0)
    mean[~(mean > 0)] = np.nan
    for name, row in zip(message.fields, thrust, strict=True):
        yield name, mean_of(row / mean)


def _vibration(stretch: _Stretch) -> Parts:
    """Yield how much each unit shakes, all axes together."""
    log = stretch.analysis.log
    for number, key in enumerate(("VIBRATION", "VIBRATION[1]", "VIBRATION[2]"), 1):
        if key not in log:
            continue
        names = [name for name in ("vibration_x", "vibration_y", "vibration_z") if name in log[key]]
        values = np.array([log[key].si(name) for name in names])
        if len(values) == 3 and np.nanmax(np.abs(values), initial=0.0) > 0:  # 0: nobody measures
            size = np.linalg.norm(values, axis=0)[None]
            yield f"vibration_{number}", mean_of(block_means(log[key].t, size, stretch.edges())[0])


def _compass_deviations(stretch: _Stretch) -> Parts:
    """Yield by what angle each compass shows north elsewhere than attitude and place say."""
    log = stretch.analysis.log
    known, model = attitude(log), earth_field(log)
    if known is None or model is None:
        return
    for number, key in enumerate(COMPASSES, 1):
        readings = compass_readings(log, key)
        if readings is None:
            continue
        turn, field = in_flight(log, readings, known, stretch.start, stretch.end)
        north, east, _ = np.einsum("nij,ni->jn", turn.values, field)
        off = np.arctan2(east, north) - np.arctan2(model[1], model[0])
        both = block_means(turn.t, np.array([np.cos(off), np.sin(off)]), stretch.edges())
        yield f"compass_{number}", _mean_direction(*both)


def _mean_direction(cosines: Floats, sines: Floats) -> Mean | None:
    """Return the mean of angles, rad, by what they are off their common direction."""
    middle = np.arctan2(np.nansum(sines), np.nansum(cosines))
    off = np.angle(np.exp(1j * (np.arctan2(sines, cosines) - middle)))
    mean = mean_of(off)
    if mean is None or 2 * mean.std > RIGHT_ANGLE:
        return None
    return mean._replace(value=float(middle + mean.value))


def _batteries(stretch: _Stretch) -> Parts:
    log = stretch.analysis.log
    for key, volts, amperes in BATTERIES:
        if key not in log or not {volts, amperes} <= set(log[key].fields):
            continue
        voltage, current = log[key].si(volts), log[key].si(amperes)
        voltage = np.where(voltage > LEAST_VOLTAGE, voltage, np.nan)
        if not np.isfinite(voltage + current).any():
            continue
        yield "battery", resistance(log[key].t, voltage, current, stretch.start, stretch.end)
        return


def _identified(analysis: Analysis) -> Iterator[Trend]:
    for name, parameter in analysis.system.parameters.items():
        if tells(parameter) and parameter.std is not None:
            unit = "" if parameter.unit == "1" else parameter.unit
            yield Trend("identified", name, -1, parameter.value, parameter.std, unit)


_QUANTITIES: Final[dict[str, tuple[str, Callable[[_Stretch], Parts]]]] = {
    "thrust_share": ("", _thrust_shares),
    "vibration": ("m/s^2", _vibration),
    "compass_deviation": ("rad", _compass_deviations),
    "battery_resistance": ("ohm", _batteries),
}
