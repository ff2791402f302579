"""Do the columns of a ULog hold what pyulog reads?

pyulog can loop for ever on a damaged file: it runs in a process of its own with a time limit.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from fdi.telemetry import read

from .comparison import Comparison

LIMIT_S: Final = 120

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
        if not found.demand(key in log, f"we lack {key}"):
            continue
        message, whole = log[key], field.rpartition("[")[0]
        if "_padding" in field:
            found.explained["padding"] += values.size
        elif whole in message and message.columns[whole].is_text:
            place = int(field[len(whole) + 1 : -1])
            texts = message.raw(whole).tolist()
            ours = [(text.encode("latin-1", "replace") + bytes(256))[place] for text in texts]
            wrong = [
                mine
                for mine, other in zip(ours, values.tolist(), strict=True)
                if mine != other % 256
            ]
            found.demand(not wrong, f"{key}.{field}: {len(wrong)} characters differ")
            found.explained["characters"] += values.size
        else:
            # a flag of one byte may hold more than 0 and 1, which pyulog shows with a sign
            is_flag = field in message and message.raw(field).dtype == np.uint8
            found.compare_raw(message, field, values.view(np.uint8) if is_flag else values)
    parameters = said["parameters"]
    found.demand(parameters == dict(log.parameters), f"parameters: {len(parameters)}")
    texts = sum(event.kind == "text" for event in log.events)
    found.demand(texts == len(said["texts"]), f"{texts} texts for {len(said['texts'])}")
    return found
