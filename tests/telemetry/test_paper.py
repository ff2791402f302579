"""The published resampling of the published log, channel by channel."""

import csv
import gzip
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import Channel, Request, Sampling, read

SHARED = Path(__file__).resolve().parents[2].parent / "shared"


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")
def test_published_recipe_gives_the_published_columns():
    """79 channels in raw units, 333 samples; the data set's own stamps are rounded to 0.24 us."""
    with gzip.open(SHARED / "paper" / "resampled_1hz.csv.gz", "rt") as lines:
        head, *rows = csv.reader(lines)
    known = np.array(rows, float)
    channels = [Channel.parse(name) for name in head[1:]]
    recipe = Sampling(
        rate_hz=1.0,
        window=(2000.0, 2332.0),
        clock="record",
        extrapolate=True,
        unwrap=False,
        hold_discrete=False,
        gap_factor=float("inf"),
    )
    log = read(SHARED / "flights" / "paper" / "afrika.tlog")
    signals = log.signals([Request(c, (c.field,), raw=True) for c in channels], recipe)
    for place, channel in enumerate(channels, 1):
        scale = np.abs(known[:, place]).max()
        off = np.abs(signals.columns[channel] - known[:, place])
        assert off.max() <= 2e-6 * scale + 1e-9, channel
