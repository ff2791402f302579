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
        if found.demand(key in log, f"we lack {key}"):
            found.compare_raw(log[key], field, values)
    return found
