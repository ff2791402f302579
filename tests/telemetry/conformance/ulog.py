"""Do the columns of a ULog hold what pyulog reads?

pyulog can loop for ever on a damaged file: it runs in a process of its own with a time limit.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry import Message, read
from fdi.units import Conversion, si

from .comparison import Comparison

SHARED: Final = Path(__file__).resolve().parents[3].parent / "shared"
LIMIT_S: Final = 120
_HECTO: Final = 100.0  # pressure is in hPa up to PX4 1.12, in Pa since
_SAME: Final = 1e-9
_SPELLED: Final = {"m/s2": "m/s/s", "A.s": "A*s", "1": ""}

DUMP: Final = """
import json, sys
import numpy
from pyulog import ULog

log = ULog(sys.argv[1])
arrays, names = {}, []
for topic in log.data_list:
    for field, values in topic.data.items():
        arrays[str(len(names))] = values
        names.append([topic.name, topic.multi_id, field])
numpy.savez(sys.argv[2] + "/columns.npz", **arrays)
said = {
    "names": names,
    "parameters": log.initial_parameters,
    "texts": [[m.timestamp, m.message] for m in log.logged_messages],
}
with open(sys.argv[2] + "/said.json", "w") as file:
    json.dump(said, file)
"""


def compare_ulog(path: Path) -> Comparison:
    """Return what the comparison of a ULog found."""
    found = Comparison(path.name, "ulog")
    with tempfile.TemporaryDirectory() as folder:
        ended = subprocess.run(
            [sys.executable, "-c", DUMP, str(path), folder],
            capture_output=True,
            timeout=LIMIT_S,
            check=False,
        )
        if not found.demand(ended.returncode == 0, f"pyulog: {ended.stderr[-200:]!r}"):
            return found
        said: dict[str, Any] = json.loads((Path(folder) / "said.json").read_text())
        with np.load(Path(folder) / "columns.npz") as columns:
            theirs = {tuple(name): columns[str(i)] for i, name in enumerate(said["names"])}
    log = read(path)
    for (topic, instance, field), values in theirs.items():
        key = f"{topic}[{instance}]" if instance else topic
        if field == "timestamp":
            found.records += values.size
        if "_padding" in field:
            found.explained["padding"] += values.size
        elif found.demand(key in log, f"we lack {key}"):
            _compare_field(log[key], field, values, found)
    parameters = said["parameters"]
    found.demand(parameters == dict(log.parameters), f"parameters: {len(parameters)}")
    texts = sum(event.kind == "text" for event in log.events)
    found.demand(texts == len(said["texts"]), f"{texts} texts for {len(said['texts'])}")
    return found


def _compare_field(ours: Message, field: str, values: NDArray[Any], found: Comparison) -> None:
    whole = field.rpartition("[")[0]
    if whole in ours and ours.columns[whole].is_text:
        place = int(field[len(whole) + 1 : -1])
        texts = ours.raw(whole).tolist()
        mine = [(text.encode("latin-1", "replace") + bytes(256))[place] for text in texts]
        wrong = sum(m != other % 256 for m, other in zip(mine, values.tolist(), strict=True))
        found.demand(not wrong, f"{ours.key}.{field}: {wrong} characters differ")
        found.explained["characters"] += values.size
        return
    # a flag of one byte may hold more than 0 and 1, which pyulog shows with a sign
    is_flag = field in ours and ours.raw(field).dtype == np.uint8
    found.compare_raw(ours, field, values.view(np.uint8) if is_flag else values)
    listed = _meanings().get(re.sub(r"\[\d+\]", "", f"{ours.name}.{field}"))
    if field not in ours or not listed:
        found.explained["unstated"] += values.size
        return
    stated = ours.columns[field].conversion
    if listed[0].unit == "us":
        found.compare_si(ours, field, Conversion("us"), "pulse")
    elif ours.name == "sensor_baro" and stated.scale == _HECTO:
        found.compare_si(ours, field, Conversion("Pa", _HECTO), "corrected")
    else:
        fitting = [one for one in listed if abs(one.scale / stated.scale - 1) < _SAME]
        found.compare_si(ours, field, [*fitting, *listed][0])


@cache
def _meanings() -> dict[str, list[Conversion]]:
    """Return what the table of correspondences says that ULog's fields are in SI."""
    rows = json.loads((SHARED / "telemetry" / "mapping.json").read_text("utf-8"))["quantities"]
    found: dict[str, list[Conversion]] = {}
    for quantity in rows:
        unit = quantity["unit"]
        for row in quantity["ulog"]:
            if isinstance(row["scale"], (int, float)) and unit not in ("enum", "bool"):
                made = Conversion("us") if unit == "us" else si(_SPELLED.get(unit, unit))
                scale = abs(row["scale"]) * made.scale
                name = re.sub(r"\[\w+\]", "", row["field"])
                found.setdefault(name, []).append(Conversion(made.unit, scale, made.offset))
    return found
