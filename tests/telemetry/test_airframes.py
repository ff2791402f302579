"""Frames whose rotors stand where no motor model has them are not its vehicle, and are told."""

import math
import struct

import pytest

import fdi
from fdi.telemetry.airframes import frame_of

from .build import Flight, mav, record
from .build_ulog import parameter
from .build_ulog import small as ulog
from .test_dataflash import small

ARDUPILOT = [
    ("quad", {"FRAME_CLASS": 1.0}, (), ("quad", "")),
    ("quad", {"FRAME_CLASS": 2.0}, (), ("hexa", "")),
    ("octa", {"FRAME_CLASS": 4.0}, (), ("other", "octaquad")),
    ("hexa", {"FRAME_CLASS": 5.0}, (), ("other", "Y6")),
    ("quad", {"FRAME_CLASS": 7.0}, (), ("other", "tricopter")),
    ("quad", {"FRAME_CLASS": 9.0}, (), ("other", "coaxial copter")),
    ("quad", {"FRAME_CLASS": 0.0}, (), ("quad", "")),  # not chosen: the firmware's own
    ("quad", {"FRAME_CLASS": math.nan}, (), ("quad", "")),
    ("hexa", {"FRAME": 1.0}, ("PX4: 0a1b", "Frame: Y6"), ("other", "Y6")),
    ("quad", {"FRAME": 1.0}, ("Frame: TRI",), ("other", "tricopter")),
    ("quad", {"FRAME": 1.0}, ("Frame: QUAD/X",), ("quad", "")),
    ("quad", {"FRAME": 10.0}, (), ("other", "Y6")),
    ("quad", {"FRAME": 10.0}, ("Frame: QUAD",), ("quad", "")),
    ("plane", {"FRAME_CLASS": 7.0}, (), ("plane", "")),  # a plane has no such parameter
]


@pytest.mark.parametrize(("vehicle", "values", "texts", "frame"), ARDUPILOT)
def test_ardupilot_names_its_frame_by_class_text_or_old_number(vehicle, values, texts, frame):
    assert frame_of(vehicle, values, texts, autopilot="ardupilot") == frame


def rotors(*places):
    values = {"CA_ROTOR_COUNT": float(len(places)), "CA_AIRFRAME": 0.0}
    for i, (x, y) in enumerate(places):
        values |= {f"CA_ROTOR{i}_PX": x, f"CA_ROTOR{i}_PY": y}
    return values


RING = [(math.cos(math.pi * i / 3), math.sin(math.pi * i / 3)) for i in range(6)]
EIGHT = [(math.cos(math.pi * i / 4), math.sin(math.pi * i / 4)) for i in range(8)]


@pytest.mark.parametrize(
    ("vehicle", "values", "frame"),
    [
        ("quad", {"SYS_AUTOSTART": 4001.0}, ("quad", "")),
        ("quad", {"SYS_AUTOSTART": 14001.0}, ("other", "tricopter")),
        ("hexa", {"SYS_AUTOSTART": 11001.0}, ("other", "coaxial hexacopter")),
        ("hexa", rotors(*RING), ("hexa", "")),
        ("quad", rotors(*RING), ("hexa", "")),
        ("hexa", rotors(*RING[::2], *RING[::2]), ("other", "coaxial copter with 6 rotors")),
        ("quad", rotors(*EIGHT), ("octa", "")),
        ("octa", rotors(*EIGHT), ("octa", "")),
        ("octa", rotors(*EIGHT[::2], *EIGHT[::2]), ("other", "coaxial copter with 8 rotors")),
        ("quad", rotors(*RING[:5]), ("other", "copter with 5 rotors")),
        ("hexa", {"CA_ROTOR_COUNT": 6.0}, ("hexa", "")),
        ("quad", {"CA_ROTOR_COUNT": math.nan}, ("quad", "")),
        ("quad", {"CA_ROTOR_COUNT": math.inf}, ("quad", "")),
        ("quad", {"CA_ROTOR_COUNT": 1e30}, ("quad", "")),
        ("vtol", rotors(*RING[:4]), ("vtol", "")),
    ],
)
def test_px4_names_its_frame_by_number_or_by_where_the_rotors_are(vehicle, values, frame):
    assert frame_of(vehicle, values, (), autopilot="px4") == frame


def test_telemetry_of_a_y6_is_of_no_hexacopter(load):
    name = record(0.5, mav.MAVLink_param_value_message(b"FRAME_CLASS", 5.0, 9, 900, 1))
    flight = Flight(kind=mav.MAV_TYPE_HEXAROTOR)
    log = load(b"".join(sorted([*flight.records(), name], key=lambda r: r[:8])))
    assert (log.vehicle, log.frame) == ("other", "Y6")
    (found,) = log.flights  # rotors alone: as of any copter
    assert found.landing == load(flight.bytes()).flights[0].landing


@pytest.mark.parametrize(
    ("kind", "name"), [(mav.MAV_TYPE_TRICOPTER, "tricopter"), (mav.MAV_TYPE_COAXIAL, "coaxial")]
)
def test_telemetry_of_a_type_without_a_model_names_it(load, kind, name):
    log = load(Flight(kind=kind).bytes())
    assert log.vehicle == "other"
    assert name in log.frame


def test_a_recorded_tricopter_is_no_quadcopter(load):
    out = [small(), b"\xa3\x95" + bytes([22]) + struct.pack("<Q16sf", 900_000, b"FRAME", 1.0)]
    data = b"".join(out).replace(struct.pack("<f", 2.0), struct.pack("<f", 7.0))
    log = load(data)
    assert (log.vehicle, log.frame) == ("other", "tricopter")
    assert log.parameters["FRAME_CLASS"] == 7.0


@pytest.mark.parametrize(("kind", "number"), [(2, 14001), (15, 14001), (15, 4001)])
def test_a_ulog_of_a_tricopter_is_neither_quad_nor_vtol(load, kind, number):
    """PX4's airframe 14001 says MAV_TYPE 2 in some releases."""
    told = parameter("MAV_TYPE", kind) + parameter("SYS_AUTOSTART", number)
    log = load(ulog().replace(parameter("MAV_TYPE", 13), told))
    assert (log.vehicle, log.frame) == ("other", "tricopter")


def test_the_frame_is_told_where_no_model_knows_it(tmp_path):
    path = tmp_path / "tri.tlog"
    path.write_bytes(Flight(kind=mav.MAV_TYPE_TRICOPTER).bytes())
    told = " / ".join(fdi.analyze(path).warnings)
    assert "no shipped model is made for a vehicle of type tricopter: any_vehicle knows" in told
