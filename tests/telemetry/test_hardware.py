"""Which hardware a log names: ids taken apart, settings and texts, and what is not told."""

import json
from importlib.resources import files
from pathlib import Path

import pytest

from fdi.telemetry import hardware_of, log_from_columns, read
from fdi.telemetry.hardware import KINDS, sensor_of_id

FLIGHTS = Path(__file__).parents[3] / "shared" / "flights" / "crash"
needs_flights = pytest.mark.skipif(not FLIGHTS.is_dir(), reason="no ../shared")


# PX4's developer guide takes these two apart by hand: (address 0x1E, I2C bus 1) and SPI bus 1
@pytest.mark.parametrize(
    ("number", "types", "autopilot", "told"),
    [
        (73225, "type", "px4", "HMC5883 on I2C bus 1, address 0x1e"),
        (263178, "type", "px4", "AK8963 on SPI bus 1, address 4"),
        (0x3D0000 | 77 << 8 | 2 << 3 | 1, "type", "px4", "MS5611 on I2C bus 2, address 0x4d"),
        (721186, "barometer", "ardupilot", "MS5611 on SPI bus 4, address 1"),
        (2753028, "imu", "ardupilot", "simulated on SITL bus 0, address 2"),
        (97539, "compass", "ardupilot", "a DroneCAN sensor, bus 0, node 125"),
        (0xFE0000 | 2, "compass", "ardupilot", "type 254 on SPI bus 0, address 0"),
        (1, "imu", "ardupilot", "id 1, which names no type"),
    ],
)
def test_an_id_is_taken_apart_as_the_firmware_puts_it_together(number, types, autopilot, told):
    assert sensor_of_id(number, types, autopilot) == told


def test_tables_hold_types_of_one_byte_and_words():
    table = json.loads((files("fdi.telemetry") / "data" / "hardware.json").read_text("utf-8"))
    for maker in ("ardupilot", "px4"):
        for kind, names in table[maker].items():
            assert all(0 <= int(number) <= 255 and name for number, name in names.items()), kind


def test_a_log_that_tells_nothing_says_of_what():
    log = log_from_columns({"t": [0.0, 1.0], "ATTITUDE.roll": [0.0, 0.1]})
    found = hardware_of(log)
    assert found.parts == ()
    assert set(found.not_told) == set(KINDS) - {"airspeed sensor", "operating system"}


@needs_flights
def test_a_log_of_ardupilot_names_its_parts():
    found = hardware_of(read(FLIGHTS / "motor2_lost.bin"))
    told = {part.what: part.kind for part in found.parts}
    assert told["fmuv3 002F001F 33375111 37353832"] == "autopilot board"
    assert told["GPS 1: detected as u-blox at 115200 baud"] == "GPS receiver"
    assert told["1: set to: analogue, voltage and current"] == "battery monitor"
    assert told["1: AK09916 on I2C bus 1, address 0x0c"] == "compass"
    assert [k for k in KINDS if k in told.values()] == list(dict.fromkeys(told.values()))
    assert found.not_told == ("barometer", "radio control receiver")


@needs_flights
def test_a_ulog_names_its_parts():
    found = hardware_of(read(FLIGHTS / "motors_cut_in_air.ulg"))
    told = {part.told_by: part.what for part in found.parts}
    assert told["the log's own information"].startswith("NXP_MR_TROPIC 0005")
    assert told["CAL_BARO0_ID = 7239201"] == "1: BMP390 on I2C bus 4, address 0x76"
    assert "battery monitor" in found.not_told
