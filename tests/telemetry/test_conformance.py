"""Values and records against the reference readers; all files: `make conformance`."""

import pytest

from .conformance.__main__ import SHARED, compare

pytestmark = [
    pytest.mark.flights,
    pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder"),
]

FILES = (
    "telemetry/samples/copter_sitl_v2.tlog",
    "telemetry/samples/mixed_v1_v2_head.tlog",
    "flights/alfa/no_failure_4.tlog",
    "flights/healthy/copter_2013.tlog",
    "flights/sitl/copter/c88_telemetry_gap_12s.tlog",
    "flights/odd/cut_mid_packet.tlog",
    "flights/odd/tlog_named_log.log",
    "telemetry/samples/copter_sitl_4.7.bin",
    "flights/healthy/quad_short.bin",
    "flights/odd/cut_64k.bin",
    "flights/odd/nan.log",
    "flights/odd/robert_lefebvre_octo_PM.log",
    "flights/odd/tradheli_brownout.log",
    "flights/odd/underpowered.log",
    "flights/crash/mechanical_fail.log",
    "flights/crash/motor2_lost.bin",
    "telemetry/samples/cubeorange_1.11.ulg",
    "flights/odd/appended_multiple.ulg",
    "flights/odd/sitl_2017.ulg",
)


@pytest.mark.parametrize("name", FILES)
def test_every_field_of_every_message_equals_the_reference_reader(name):
    found = compare(SHARED / name)
    assert not found.unexplained
    assert found.values > 4000
    assert found.records > 500


@pytest.mark.parametrize("name", ["mixed_v1_v2_head.tlog", "copter_sitl_4.7.bin"])
def test_comparison_notices_one_changed_value(name, tmp_path, monkeypatch):
    """Else a comparison that compares nothing would pass."""
    from fdi.telemetry.message import Message

    raw = Message.raw

    def spoiled(self, field):
        values = raw(self, field)
        if (self.key, field) in (("ATTITUDE", "roll"), ("ATT", "Roll")):
            values = values.copy()
            values[len(values) // 2] += 1
        return values

    monkeypatch.setattr(Message, "raw", spoiled)
    found = compare(SHARED / "telemetry" / "samples" / name)
    assert len([line for line in found.unexplained if "1 of" in line]) == 1
