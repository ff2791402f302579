"""Bytes of a log changed and inserted, and what holds of a log that is read all the same."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from fdi.telemetry import Log

SPOILED = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
ANYTHING = st.binary(max_size=40)


class Spoiling(NamedTuple):
    """Bytes that take another value, and where others come in between."""

    flips: list[tuple[int, int]]
    at: int
    inserted: bytes

    def of(self, intact: bytes) -> bytes:
        data = bytearray(intact)
        for place, value in self.flips:
            data[place % len(data)] = value
        data[self.at : self.at] = self.inserted
        return bytes(data)


def spoilings(last: int, inserted: st.SearchStrategy[bytes] = ANYTHING):
    """Return a strategy of changes up to a byte."""
    places = st.integers(0, last)
    flips = st.lists(st.tuples(places, st.integers(0, 255)), max_size=12)
    return st.builds(Spoiling, flips, places, inserted)


def assert_readable(log: Log) -> None:
    """Every column of every message can be had, and times ascend."""
    for message in log.messages.values():
        assert np.all(np.diff(message.t) > 0)
        for field in message.fields:
            message.si(field)
