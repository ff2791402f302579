"""Machine code is a matter of speed: it is optional, and no answer depends on it."""

import sys

import numpy as np
import pytest

from fdi.telemetry.formats.bytes import compiled as room
from fdi.telemetry.formats.bytes.compiled import compiled

LARGE = 50_000_000


def total(values):
    """A kernel like those of the room."""
    found = 0
    for value in values:
        found += value
    return found


@pytest.fixture(autouse=True)
def _forget():
    yield
    room._machine_code.cache_clear()


def test_switch_decides_before_size(monkeypatch):
    monkeypatch.setenv("FDI_FAST", "0")
    assert compiled(total, LARGE) is None
    monkeypatch.delenv("FDI_FAST")
    assert compiled(total, 1000) is None


def test_without_numba_numpy_does_the_work(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setenv("FDI_FAST", "1")
    assert compiled(total, LARGE) is None


def test_machine_code_says_the_same(monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setenv("FDI_FAST", "1")
    fast = compiled(total, 0)
    assert fast is not None
    assert fast is not total
    assert fast(np.arange(10)) == total(np.arange(10)) == 45
