"""What does a log say with a recovered block in place of the one that failed?

In: a log and the file that ``fdi heading --recover`` wrote of it. Out: the log, in which the
block's own channels are unknown from the first recovered sample on, and one more message holds
what was recovered, each sample with its deviation. What that message shows stands in
``models/shared/recovered.yaml``: it stands in for the sensor, so what contradicts it still concerns
the sensor that failed.

The height of a recovered position is the barometer's and is not taken: it would be its own witness.
What a receiver says of itself (fix, satellites, accuracies) is no measurement that is replaced: it
stays, or what followed from a lost fix would have no cause left but another sensor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry import Log
from fdi.telemetry.message import Column, Floats, Message
from fdi.units import si

if TYPE_CHECKING:
    import pandas as pd

APART_S: Final = 1e-3
"""A recovered sample has the time of an inertial record; a text may round it."""
HINT: Final = "it takes a file that `fdi heading LOG --recover FILE` wrote of this log"
_CLOCK: Final = "RAW_IMU"


@dataclass(frozen=True, slots=True)
class Block:
    """A block that can be replaced.

    Attributes
    ----------
    message : str
        Of the log, that holds what failed.
    fields : tuple of str
        What it measures: they become unknown.
    columns : Mapping[str, str]
        Of the file, and what they are called as fields of the new message.
    """

    message: str
    fields: tuple[str, ...]
    columns: Mapping[str, str]


BLOCKS: Final[Mapping[str, Block]] = MappingProxyType(
    {
        "recovered_satellite": Block(
            "GPS_RAW_INT",
            ("lat", "lon", "alt", "alt_ellipsoid", "vel", "cog", "yaw"),
            {"lat_deg": "lat", "lon_deg": "lon", "sigma_m": "sigma"},
        ),
        "recovered_magnetometer": Block(
            "RAW_IMU",
            ("xmag", "ymag", "zmag"),
            {"heading_deg": "heading", "sigma_heading_deg": "sigma"},
        ),
        "recovered_angular_rate": Block(
            "RAW_IMU",
            ("xgyro", "ygyro", "zgyro"),
            {
                "roll_deg": "roll",
                "pitch_deg": "pitch",
                "roll_rate_deg_s": "roll_rate",
                "pitch_rate_deg_s": "pitch_rate",
                "yaw_rate_deg_s": "yaw_rate",
                "sigma_tilt_deg": "sigma",
            },
        ),
        "recovered_accelerometer": Block(
            "RAW_IMU",
            ("xacc", "yacc", "zacc"),
            {"roll_deg": "roll", "pitch_deg": "pitch", "sigma_tilt_deg": "sigma"},
        ),
    }
)
"""By the name of the new message; the first whose columns are all in a file is its block."""
_UNITS: Final = {"_deg": "rad", "_deg_s": "rad/s", "_m": "m"}


def with_recovered(log: Log, path: str | Path) -> Log:
    """Return a log with what a file recovered in place of the block that failed.

    Raises
    ------
    LogError
        The file cannot be read, holds no recovery, or is not of this log.
    """
    table = _read(Path(path))
    found = [name for name, one in BLOCKS.items() if set(one.columns) <= set(table.columns)]
    if "t_s" not in table.columns or not found or len(table) < 2:
        raise LogError("holds no recovered block", where=str(path), hint=HINT)
    name = found[0]
    block = BLOCKS[name]
    t = _times(log, table, path)
    if block.message not in log:
        raise LogError(
            f"replaces {block.message}, which {log.name} does not hold", where=str(path), hint=HINT
        )
    columns = {}
    for column, field in block.columns.items():
        unit = _UNITS[next(end for end in ("_deg_s", "_deg", "_m") if column.endswith(end))]
        values = _numbers(table, column, path)
        own = values if unit == "m" else np.radians(values)
        columns[field] = Column(load=lambda own=own: own, conversion=si(unit))  # type: ignore[misc]
    made = Message(name, None, t, t, np.arange(t.size), columns, made_from=block.message)
    return log.with_message(_unknown(log[block.message], block, t[0])).with_message(made)


def _read(path: Path) -> pd.DataFrame:
    import pandas as pd
    from pyarrow import ArrowException

    try:
        return pd.read_parquet(path) if path.suffix.lower() == ".parquet" else pd.read_csv(path)
    except (OSError, ValueError, ArrowException) as error:
        what = "cannot be read as a table" if path.is_file() else "is no file"
        raise LogError(what, where=str(path), hint=HINT) from error


def _numbers(table: pd.DataFrame, column: str, path: str | Path) -> Floats:
    try:
        return table[column].to_numpy(np.float64)
    except (TypeError, ValueError) as error:
        raise LogError(f"holds no numbers as {column}", where=str(path), hint=HINT) from error


def _times(log: Log, table: pd.DataFrame, path: str | Path) -> Floats:
    """Return the times of the rows; refuse those that are not inertial records of the log."""
    t = _numbers(table, "t_s", path)
    own = log[_CLOCK].t if _CLOCK in log else np.zeros(0)
    is_ascending = np.isfinite(t).all() and bool((np.diff(t) > 0).all())
    if is_ascending and own.size > 1:
        after = np.clip(np.searchsorted(own, t), 1, own.size - 1)
        apart = np.minimum(np.abs(own[after] - t), np.abs(own[after - 1] - t))
        if apart.max() <= APART_S:
            return t
    raise LogError(
        f"is not of {log.name}: its times are no records of it", where=str(path), hint=HINT
    )


def _unknown(message: Message, block: Block, start: float) -> Message:
    """Return a message whose fields are unknown from a time on, s."""
    t = np.interp(np.arange(message.stamp.size), message.kept, message.t)
    gone = t >= start

    def absent(column: Column) -> Column:
        before = column.absent

        def both() -> NDArray[np.bool_] | None:
            earlier = before()
            return gone if earlier is None else gone | earlier

        return column._replace(absent=both)

    changed = {
        name: absent(column) if name in block.fields else column
        for name, column in message.columns.items()
    }
    return replace(message, columns=changed, _cache={})
