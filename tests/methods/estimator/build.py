"""Composes small PX4 logs with an estimator's topics, a dict of columns each."""

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from telemetry.build_ulog import (
    data,
    flag_bits,
    header,
    info,
    keyed,
    logged,
    parameter,
    subscribe,
    topic,
)

from fdi.telemetry import Log, read

RATIOS = ("vel_test_ratio", "pos_test_ratio", "hgt_test_ratio", "mag_test_ratio", "tas_test_ratio")
Columns = Mapping[str, Sequence[float]]
START_US = 1_000_000


def px4_log(
    path: Path,
    topics: Mapping[str, tuple[Sequence[float], Columns]],
    *,
    release: int | None = 0x010C0000,
    parameters: Mapping[str, float] | None = None,
    texts: Sequence[tuple[float, str]] = (),
) -> Log:
    """Return a log of topics: by key (``estimator_status[1]``) times in s and columns of floats."""
    parts = [header(START_US), flag_bits(), info("sys_name", "PX4")]
    if release is not None:
        parts.append(keyed("I", "uint32_t ver_sw_release", struct.pack("<I", release)))
    parts += [
        parameter(name, value) for name, value in {"MAV_TYPE": 2, **(parameters or {})}.items()
    ]
    records: list[tuple[float, bytes]] = []
    names = list(dict.fromkeys(key.partition("[")[0] for key in topics))
    for name in names:
        columns = next(c for key, (_, c) in topics.items() if key.partition("[")[0] == name)
        parts.append(
            topic(f"{name}:uint64_t timestamp;" + "".join(f"double {c};" for c in columns))
        )
    for number, (key, (t, columns)) in enumerate(topics.items()):
        name, _, instance = key.partition("[")
        parts.append(subscribe(number, name, int(instance[:-1] or 0) if instance else 0))
        rows = np.array([columns[c] for c in columns], np.float64).T
        for at, row in zip(t, rows, strict=True):
            stamp = START_US + round(at * 1e6)
            records.append((at, data(number, "Q" + "d" * len(row), stamp, *row)))
    records += [(t, logged(START_US + round(t * 1e6), text)) for t, text in texts]
    parts += [record for _, record in sorted(records, key=lambda one: one[0])]
    path.write_bytes(b"".join(parts))
    return read(path)


def status(t: Sequence[float], **columns: Sequence[float]) -> tuple[Sequence[float], Columns]:
    """Return an estimator_status with all ratios 0.1 and no faults, but for what is given."""
    count = len(t)
    made = {name: np.full(count, 0.1) for name in RATIOS}
    made["filter_fault_flags"] = np.zeros(count)
    made["solution_status_flags"] = np.full(count, 0x33F)
    return t, {**made, **columns}
