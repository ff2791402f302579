"""Which shipped model fits a log, by the type of its vehicle?

The models' files are not parsed for that, which would cost more than the analysis of a short log:
``vehicles: [helicopter, other]`` stands on one line of a shipped model, and that line is read.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from fdi.errors import ModelError
from fdi.model.airframe import Airframe
from fdi.model.load import find_model, load_airframe, shipped_models
from fdi.telemetry import Log

VEHICLES: Final = re.compile(r"^vehicles: *\[([a-z0-9, ]*)\] *(?:#.*)?$", re.MULTILINE)


def choose_model(log: Log) -> str:
    """Return the name of the shipped model for the log's vehicle.

    Raises
    ------
    ModelError
        No shipped model is made for this vehicle.
    """
    made = {name: vehicles_of(find_model(name)) for name in shipped_models()}
    own = kind_of(log)
    fitting = [name for name, vehicles in made.items() if own in vehicles]
    if len(fitting) != 1:
        known = ", ".join(shipped_models())
        raise ModelError(
            f"no shipped model is made for a vehicle of type {log.vehicle!r}",
            where=log.name,
            hint=f"choose one with --model: {known}, or a file of your own (docs/airframe.md)",
        )
    return fitting[0]


def kind_of(log: Log) -> str:
    """Return the frame of a log's vehicle if a shipped model is made for it, else its type."""
    frame = log.frame.lower()
    known = any(frame in vehicles_of(find_model(name)) for name in shipped_models())
    return frame if known else log.vehicle


def is_general(name: str) -> bool:
    """Return whether a shipped model is for vehicles that have none of their own."""
    return "other" in made_for(name)


def made_for(name: str) -> tuple[str, ...]:
    """Return the vehicle types that a shipped model is made for; none for other models."""
    return vehicles_of(find_model(name)) if name in shipped_models() else ()


def is_shipped(airframe: Airframe) -> bool:
    """Return whether a model is a shipped one, unchanged: what the weights were fitted with."""
    name = airframe.name
    return name in shipped_models() and load_airframe(name).sha256 == airframe.sha256


def vehicles_of(path: Path) -> tuple[str, ...]:
    """Return the vehicle types that a shipped model's file names, none where it names none."""
    found = VEHICLES.search(path.read_text(encoding="utf-8"))
    return tuple(found[1].replace(",", " ").split()) if found else ()
