"""Which shipped model fits a log, by the type of its vehicle?"""

from __future__ import annotations

from fdi.errors import ModelError
from fdi.model.load import find_model, shipped_models
from fdi.model.yaml import read_document
from fdi.telemetry import Log


def choose_model(log: Log) -> str:
    """Return the name of the shipped model for the log's vehicle.

    Raises
    ------
    ModelError
        No shipped model is made for this vehicle.
    """
    fitting = []
    for name in shipped_models():
        vehicles = read_document(find_model(name)).tree.get("vehicles") or []
        if isinstance(vehicles, list) and log.vehicle in vehicles:
            fitting.append(name)
    if len(fitting) != 1:
        known = ", ".join(shipped_models())
        raise ModelError(
            f"no shipped model is made for a vehicle of type {log.vehicle!r}",
            where=log.name,
            hint=f"choose one with --model: {known}, or a file of your own",
        )
    return fitting[0]
