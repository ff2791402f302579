"""A log with an injected fault shows that change at that channel, and nowhere else."""

import numpy as np
import pytest
from flights import EXAMPLES, SHARED

from fdi.cli import main
from fdi.errors import UsageError
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import faulty, lost_records, parse_fault
from fdi.telemetry import Channel, read

TLOG = EXAMPLES / "copter_gps_loss_landing.tlog"
BIN = SHARED / "propeller_cut" / "good_prop_hover_1.bin"
ULOG = SHARED / "triplex" / "comm_fail" / "instance_0.ulg"
TEXT = SHARED / "odd" / "underpowered.log"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
OTHER_FORMATS = [pytest.param(name, marks=needs_shared) for name in ("bin", "ulg")]


@pytest.fixture(scope="module", params=["tlog", *OTHER_FORMATS])
def log(request):
    return read({"tlog": TLOG, "bin": BIN, "ulg": ULOG}[request.param])


def put(log, text, folder):
    path = folder / "other"
    path.write_bytes(injected(log, parse_fault(text)))
    return read(path)


def spanned(log, text):
    """Return a fault over the middle third of the log."""
    low, high = log.span
    return f"{text}@{low + (high - low) / 3:.2f}:{low + 2 * (high - low) / 3:.2f}"


def differing(log, other):
    """Return the log's own channels, texts too, of which any time or raw value differs."""
    assert set(other.messages) == set(log.messages)
    found = set()
    for key, message in log.messages.items():
        if message.made_from is not None:
            continue
        again = other[key]
        same_times = np.array_equal(message.t, again.t)
        for name in message.fields:
            if not same_times or not alike(message.raw(name), again.raw(name)):
                found.add(f"{key}.{name}")
    return found


def alike(one, two):
    if one.dtype.kind == "f":
        return np.array_equal(one, two, equal_nan=True)
    return np.array_equal(one, two)


OWN = {  # channel: its own name in a DataFlash log and in a ULog, quantum in SI, size
    "GPS_RAW_INT.alt": ("GPS.Alt", "vehicle_gps_position.alt", 0.01, 15.0),
    "VFR_HUD.climb": ("CTUN.CRt", "vehicle_local_position.vz", 0.01, 2.0),
    "SCALED_PRESSURE.press_abs": (
        "BARO.Press",
        "vehicle_air_data.baro_pressure_pa",
        0.5,
        500.0,
    ),
    "RAW_IMU.zgyro": ("IMU.GyrZ", "sensor_combined.gyro_rad[2]", 0.001, 0.25),
    "ATTITUDE.roll": ("ATT.Roll", "vehicle_attitude.q[1]", 2e-4, 0.0625),
}


@pytest.mark.parametrize("kind", ["bias", "drift", "scale", "noise", "freeze"])
@pytest.mark.parametrize("name", OWN)
def test_exactly_that_channel_reads_otherwise(log, name, kind, tmp_path):
    record, topic, quantum, size = OWN[name]
    target = {"tlog": name, "dataflash": record, "ulog": topic}[log.format]
    if name == "ATTITUDE.roll" and log.format == "ulog":  # made of four of the log's own fields
        name = target
    sizes = {"freeze": "", "scale": "=1.25"}  # much more would be called impossible
    text = spanned(log, f"{name}:{kind}{sizes.get(kind, f'={size}')}")
    other = put(log, text, tmp_path)
    assert differing(log, other) == {target}
    t, before, _ = log.channel(name)
    expected = faulty(parse_fault(text), t, before, channel=name)
    after = other.channel(name).value
    assert np.array_equal(np.isnan(after), np.isnan(before))
    np.testing.assert_allclose(after, expected, atol=quantum, rtol=1e-6)
    assert [q for q in other.quality if q not in log.quality] == []


def test_a_dropout_leaves_out_the_records_of_the_message_only(log, tmp_path):
    key = {"tlog": "GPS_RAW_INT", "dataflash": "GPS", "ulog": "vehicle_gps_position"}[log.format]
    text = spanned(log, "GPS_RAW_INT.alt:dropout")
    fault, other = parse_fault(text), put(log, text, tmp_path)
    assert {channel.split(".")[0] for channel in differing(log, other)} == {key}
    before = log[key].t
    assert np.array_equal(other[key].t, before[~fault.holds(before)])
    assert [s.lost for s in other.sources] == [s.lost for s in log.sources]


def test_the_same_fault_is_the_same_bytes(log):
    name = "vehicle_attitude.q[1]" if log.format == "ulog" else "ATTITUDE.roll"
    fault = parse_fault(spanned(log, f"{name}:noise=0.1"))
    assert injected(log, fault) == injected(log, fault)


def test_a_fault_at_a_component_is_at_all_its_channels(tmp_path):
    log = read(TLOG)
    other = put(log, spanned(log, "gyroscope:scale=1.5"), tmp_path)
    found = differing(log, other)
    assert {f"RAW_IMU.{axis}gyro" for axis in "xyz"} <= found
    assert all("gyro" in channel for channel in found)


def test_a_bias_at_channels_of_several_units_is_refused():
    with pytest.raises(UsageError, match="several units"):
        injected(read(TLOG), parse_fault("gps:bias=3@20"))


@needs_shared
def test_a_text_log_is_refused_plainly():
    log = read(TEXT)
    with pytest.raises(UsageError, match="cannot be rewritten yet"):
        injected(log, parse_fault("CTUN.BarAlt:bias=1@9"))


def test_an_angle_goes_round():
    fault = parse_fault("ATTITUDE.yaw:bias=1@0")
    t = np.arange(3.0)
    made = faulty(fault, t, np.array([-3.0, 0.0, 3.0]), channel="ATTITUDE.yaw")
    np.testing.assert_allclose(made, [-2.0, 1.0, 4.0 - 2 * np.pi])


def test_a_dropout_loses_its_share():
    t = np.arange(10_000.0)
    lost = lost_records(parse_fault("A.b:dropout=0.3@5000"), t, message="A")
    assert not lost[:5000].any()
    assert 0.27 < lost[5000:].mean() < 0.33


@pytest.mark.parametrize(
    "text",
    [
        "GPS_RAW_INT.alt",
        "GPS_RAW_INT.alt:bias@3",
        "GPS_RAW_INT.alt:bias=x@3",
        "GPS_RAW_INT.alt:bias=nan@3",
        "GPS_RAW_INT.alt:bend=1@3",
        "GPS_RAW_INT.alt:freeze=1@3",
        "GPS_RAW_INT.alt:noise=-1@3",
        "GPS_RAW_INT.alt:dropout=2@3",
        "GPS_RAW_INT.alt:bias=1@5:4",
        "GPS_RAW_INT.alt:bias=1@nan",
    ],
)
def test_what_is_no_fault_is_refused(text):
    with pytest.raises(UsageError):
        parse_fault(text)


def test_the_command_writes_a_log_and_replaces_none_unasked(tmp_path, capsys):
    out = tmp_path / "bad.tlog"
    words = ["inject", str(TLOG), "--fault", "GPS_RAW_INT.alt:bias=15@30", "--out", str(out)]
    assert main(words) == 0
    assert read(out).channel(Channel.parse("GPS_RAW_INT.alt")).value.max() > 15
    assert main(words) == 5
    assert main([*words, "--force"]) == 0
    assert main(["inject", str(TLOG), "--fault", "no.such:bias=1@30", "--out", str(out) + "x"]) == 2
    capsys.readouterr()


@pytest.mark.parametrize("kind", ["bias=1", "dropout=0.5"])
def test_several_faults_are_all_put_in_one_after_another(log, kind, tmp_path):
    """As if each were put into the log that the one before had made."""
    faults = [
        spanned(log, text)
        for text in ("GPS_RAW_INT.alt:bias=15", f"GPS_RAW_INT.alt:{kind}", "VFR_HUD.alt:bias=4")
    ]
    (tmp_path / "at_once").write_bytes(injected(log, *map(parse_fault, faults)))
    again = log
    for number, text in enumerate(faults):
        (folder := tmp_path / str(number)).mkdir()
        again = put(again, text, folder)
    at_once = read(tmp_path / "at_once")
    assert not differing(at_once, again)
    assert len(differing_values(log, at_once)) > 1


def differing_values(log, other):
    """Return the keys of messages that hold other records or values."""
    return {
        key
        for key, message in log.messages.items()
        if any(not alike(message.raw(name), other[key].raw(name)) for name in message.fields)
    }
