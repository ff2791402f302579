"""What does one flight tell of one quantity of its vehicle? The value of this stage."""

from __future__ import annotations

from dataclasses import dataclass

from fdi.shown import Shown


@dataclass(frozen=True, slots=True)
class Trend(Shown):
    """A number to be followed over the flights of a vehicle.

    Attributes
    ----------
    quantity : str
        ``thrust_share``, ``vibration``, ``compass_deviation``, ``battery_resistance``,
        ``identified``.
    part : str
        Whose: a component's name, or the model's parameter that was identified.
    flight : int
        Of the log, from 0; -1 for what the log as a whole tells.
    value : float
        In ``unit``, SI.
    std : float
        Standard error, wide enough for two of them to hold 95 % although a flight is short.
    unit : str
    """

    quantity: str
    part: str
    flight: int
    value: float
    std: float
    unit: str
