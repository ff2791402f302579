"""The firmware's own defaults of parameters, where a log holds them."""

from pathlib import Path

import pytest

from fdi.telemetry import read

FLIGHTS = Path(__file__).parents[3] / "shared" / "flights"


def flight(name: str) -> Path:
    path = FLIGHTS / name
    if not path.is_file():
        pytest.skip("the labelled flights are not here")
    return path


def test_a_ulog_tells_the_defaults_that_pyulog_reads():
    from pyulog import ULog

    path = flight("px4_motor/sil_01.ulg")
    log = read(path)
    assert log.defaults == pytest.approx(ULog(str(path)).get_default_parameters(0))
    assert log.altered["BAT1_N_CELLS"] == (4, 0)


def test_new_dataflash_tells_every_default_and_old_none():
    log = read(flight("sitl/copter/c30_accel_bias_y_both.BIN"))
    assert log.defaults.keys() == log.parameters.keys()
    assert 0 < len(log.altered) < 100
    assert all(value != default for value, default in log.altered.values())
    assert not read(flight("crash/motor2_lost.bin")).defaults
