"""DataFlash logs in text form: the lines that people have, and what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest
from counting import calls
from hypothesis import example, given
from hypothesis import strategies as st

from fdi.errors import FdiError, LogError
from fdi.telemetry import read
from fdi.telemetry.formats.dataflash.text_lines import find_lines, find_numbers, number

from .build_text import text_lines
from .spoiling import SPOILED, assert_readable, spoilings

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared folder")

HEAD = b"""12
ArduCopter V3.1 (abcdef01)
Free RAM: 1000
FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format
FMT, 1, 19, ATT, IccccCC, TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw
FMT, 129, 23, PARM, Nf, Name,Value
FMT, 134, 67, MSG, Z, Message
FMT, 3, 6, MODE, Mh, Mode,ThrCrs
FMT, 4, 15, POS, LLI, Lat,Lng,TimeMS
PARM, RATE_RLL_P, 0.15
MSG, hello, world, again
MODE, AltHold, 400
"""


def attitude(i: int) -> bytes:
    return b"ATT, %d, 0.00, %.2f, 0.00, -1.25, 10.00, 12.00\n" % (1000 + 100 * i, i / 10)


def small(count: int = 20) -> bytes:
    return HEAD + b"".join(attitude(i) for i in range(count))


def told(log):
    return {record.kind: record for record in log.quality}


def test_values_have_the_scale_of_their_character_once(load):
    log = load(small())
    assert (log.format, log.vehicle, log.firmware) == (
        "dataflash_text",
        "quad",
        "ArduCopter V3.1 (abcdef01)",
    )
    assert log["ATT"].unit("Roll") == "rad"
    np.testing.assert_array_equal(log["ATT"].raw("Roll"), np.arange(20) / 10)
    np.testing.assert_allclose(log["ATT"].si("Roll"), np.deg2rad(np.arange(20) / 10), rtol=1e-15)
    np.testing.assert_allclose(log["ATT"].t, np.arange(20) / 10, atol=1e-9)
    assert not log.quality


@pytest.mark.parametrize(
    ("version", "share"),
    [
        ("ArduCopter V3.1 (abcdef01)", 0.01),
        ("APM:Copter V3.3-dev (abcdef01)", 0.01),
        ("APM:Copter V3.4 (abcdef01)", 1.0),
        ("ArduCopter V3.30 (abcdef01)", 1.0),
        ("ArduCopter V4.6.3 (abcdef01)", 1.0),
    ],
)
def test_rates_are_hundredths_of_a_degree_until_copter_3_4(load, version, share):
    head = HEAD.replace(b"ArduCopter V3.1 (abcdef01)", version.encode())
    layout = (
        b"FMT, 5, 55, RATE, Iffffffffffff, TimeMS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut\n"
    )
    rates = b"".join(
        b"RATE, %d, 1, 90, 0.25, 1, 1, 0, 1, 1, 0, 1, 1, 0\n" % (1000 + 100 * i) for i in range(20)
    )
    log = load(head + layout + b"".join(attitude(i) for i in range(20)) + rates)
    np.testing.assert_allclose(log["RATE"].si("R"), np.deg2rad(90 * share), rtol=1e-12)
    np.testing.assert_allclose(log["RATE"].si("ROut"), 0.25)
    np.testing.assert_allclose(log["ATTITUDE"].si("rollspeed"), np.deg2rad(90 * share), rtol=1e-12)


@pytest.mark.parametrize(("gyro", "share"), [(1.5, 1.0), (0.015, 0.01)])
def test_between_both_versions_the_gyroscopes_tell_the_unit_of_rates(load, gyro, share):
    """Development versions of 3.4: 90 is 1.57 rad/s, or a hundredth of that."""
    head = HEAD.replace(b"ArduCopter V3.1 (abcdef01)", b"APM:Copter V3.4-dev (abcdef01)")
    layout = b"FMT, 5, 17, RATE, Iff, TimeMS,RDes,R\nFMT, 6, 17, IMU, Iff, TimeMS,GyrX,GyrY\n"
    rows = b"".join(
        b"RATE, %d, 1, %d\nIMU, %d, %f, 0\n" % (t, 90 * sign, t, gyro * sign)
        for t, sign in ((1000 + 100 * i, (-1) ** i) for i in range(20))
    )
    log = load(head + layout + b"".join(attitude(i) for i in range(20)) + rows)
    rates = np.abs(log["RATE"].si("R"))
    np.testing.assert_allclose(rates, np.deg2rad(90 * share), rtol=1e-12)


def test_text_with_commas_is_whole_and_what_stands_before_the_records_is_a_text(load):
    texts = {event.text for event in load(small()).events if event.kind == "text"}
    assert {"hello, world, again", "Free RAM: 1000"} <= texts


@pytest.mark.parametrize("said", ["AltHold", "ALT_HOLD", "2"])
def test_mode_is_named_alike_however_it_is_written(load, said):
    log = load(small().replace(b"AltHold", said.encode()))
    assert [event.text for event in log.events if event.kind == "mode"] == ["ALT_HOLD"]


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data.replace(b"\n", b"\r\n"),
        lambda data: data.replace(b"\n", b"\r"),
        lambda data: data.replace(b", ", b","),
        lambda data: data.replace(b", ", b",\t "),
        lambda data: data.replace(b"\n", b" \t\n"),
        lambda data: data.replace(b"\n", b"\n\n"),
        lambda data: data.replace(b"\nATT", b"\n  ATT"),
        lambda data: data.replace(b"ATT, IccccCC", b"ATT,            IccccCC"),
        lambda data: data.replace(b"FMT, 1, 19", b"FMT, 1, 77"),
    ],
)
def test_line_ends_blanks_and_lengths_do_not_matter(load, change):
    log, other = load(small()), load(change(small()))
    assert set(log.messages) == set(other.messages)
    for field in log["ATT"].fields:
        np.testing.assert_array_equal(other["ATT"].raw(field), log["ATT"].raw(field))
    assert not other.quality


@pytest.mark.parametrize(
    "line",
    [
        b"ATT, 1500, 0.00, 1.00\n",
        b"ATT, 1500, 0.00, 1.00, 0.00, 1.00, 1.00, 1.00, 9\n",
        b"ATT, 1500, 0.00, one, 0.00, 1.00, 1.00, 1.00\n",
        b"ATT, 1500, 0.00, , 0.00, 1.00, 1.00, 1.00\n",
        b"ATT, 15.5, 0.00, 1.00, 0.00, 1.00, 1.00, 1.00\n",
        b"ATT, 5000000000, 0.00, 1.00, 0.00, 1.00, 1.00, 1.00\n",
        b"ATT, -1, 0.00, 1.00, 0.00, 1.00, 1.00, 1.00\n",
        b"ATT, 1500, 0.00, 1.0.0, 0.00, 1.00, 1.00, 1.00\n",
    ],
)
def test_record_that_is_none_is_left_out_and_told(load, line):
    data = small()
    log = load(data + line + attitude(20))
    assert len(log["ATT"]) == 21
    found = told(log)
    assert found["invalid_values"].count == 1
    assert "1 ATT" in found["invalid_values"].text
    assert found["lost_bytes"].count == len(line) - 1
    assert f"at byte {len(data)}" in found["lost_bytes"].text


def test_console_output_between_is_told_with_its_place(load):
    data, between = small(), b"Ready to FLY\nlogs: 3, 4\n\n\xff\xfe\n"
    log = load(data + between + attitude(20))
    assert len(log["ATT"]) == 21
    assert f"3 lines, 24 bytes at byte {len(data)}" in told(log)["lost_bytes"].text


def test_cut_last_line_is_left_out_though_it_may_be_whole(load):
    """Of a number whose last digits are missing nobody could tell."""
    log = load(small()[:-2])
    assert len(log["ATT"]) == 19
    assert told(log)["truncated"].count == len(attitude(19)) - 2


def test_type_without_definition_is_named(load):
    log = load(small() + b"RCOU, 1, 2, 3\n" * 5)
    assert "5 RCOU" in told(log)["unknown_message"].text


def test_known_firmware_fills_in_a_missing_definition(load):
    if not SHARED.is_dir():
        pytest.skip("needs the shared folder")
    lines = list(text_lines(SHARED / "flights" / "healthy" / "quad_short.bin"))
    whole = load(b"".join(lines))
    log = load(b"".join(line for line in lines if b", ATT, " not in line))
    np.testing.assert_array_equal(log["ATT"].raw("Roll"), whole["ATT"].raw("Roll"))
    assert "ATT" in told(log)["repaired"].text


def test_definitions_without_end_are_not_all_followed_and_told(load):
    def again(count):
        lines = (
            b"FMT, 3, 6, MODE, Mh, Mode,N%d\nMODE, AltHold, %d\n" % (i, i) for i in range(count)
        )
        return small() + b"".join(lines)

    log = load(again(5000))
    few, many = (calls(lambda: load(again(count))) for count in (5000, 10_000))  # noqa: B023
    assert many < 2 * few
    assert told(log)["invalid_values"].count == 5000 - 2000 + 5
    assert sum(len(m.stamp) for m in log.messages.values() if m.name.startswith("MODE")) == 5001


def test_two_logs_in_one_file_go_on(load):
    changed = small().replace(b"IccccCC, TimeMS,", b"Iccccff, TimeMS,").replace(b"Yaw\n", b"Y\n")
    log = load(small() + changed)
    assert (len(log["ATT"]), len(log["ATT#2"])) == (20, 20)
    assert "Y" in log["ATT#2"]
    found = told(log)
    assert "reboot" in found
    assert "3 lines" in found["lost_bytes"].text  # the second heading


def test_log_without_times_is_spread_between_those_of_the_gps(load):
    gps = b"FMT, 130, 35, GPS, BI, Status,Time\nFMT, 2, 7, IMU, f, GyrX\n"
    lines = [b"GPS, 3, %d\n" % (1000 * i) + b"IMU, 0.5\n" * (3 + i % 2) for i in range(1, 20)]
    log = load(small(0) + gps + b"".join(lines))
    t = log["IMU"].t
    assert np.all(np.diff(t) > 0)
    inside = (t > log["GPS"].t[3]) & (t < log["GPS"].t[4])
    assert inside.sum() == 3
    assert log["GPS"].t[5] - log["GPS"].t[4] == pytest.approx(1.0)


@pytest.mark.parametrize("data", [HEAD[: HEAD.index(b"PARM, ")], b"FMT, 1, 19, ATT, I, T\n"])
def test_log_without_data_is_refused(load, data):
    with pytest.raises(LogError, match="DataFlash text log"):
        load(data)


def test_number_that_is_defined_as_a_text_tells_no_time(load):
    odd = b"FMT, 130, 35, GPS, nHI, Status,Week,TimeMS\nFMT, 5, 7, EV, n, Id\n"
    log = load(small() + odd + b"GPS, good, 1774, 1000\nEV, arm\n")
    assert log["GPS"].raw("Status").tolist() == ["good"]
    assert log.clock.utc_source == "none"


# Words as numbers.

SPELLED = st.one_of(
    st.floats(allow_nan=False, width=64).map(repr),
    st.floats(-1e6, 1e6).map("{:.6f}".format),
    st.integers(-(2**63), 2**64 - 1).map(str),
    st.from_regex(r"[+\-]?[0-9.]{0,21}", fullmatch=True),
    st.text("0123456789.+-eE _naif", max_size=24),
)


@given(st.lists(SPELLED, min_size=1, max_size=30))
@example(["9" * 18, "9" * 19, "18446744073709551615", "9007199254740993.0", "-0.00", ".5", "5."])
def test_numbers_found_at_once_are_those_of_python(words):
    """The slow reading, one word at a time, is the oracle; Python's float that of both."""
    lines = find_lines(np.frombuffer(",".join(words).encode() + b"\n", np.uint8))
    found = find_numbers(lines)
    for i, word in enumerate(words):
        kind, integer, value = number(word.encode())
        if found.kind[i]:
            assert found.kind[i] == kind
            assert kind != 1 or found.integer[i] == integer
            assert str(found.value[i]) == str(value)
        if kind:
            assert str(value) == str(float(word))


@pytest.mark.parametrize(
    "word", [b"", b"-", b".", b"1_0", b"0x10", b"1.2.3", b"e5", b"--1", b"one", b"\xff", b"1,0"]
)
def test_what_is_no_number_is_none(word):
    assert number(word)[0] == 0


# The same log in both forms.


def test_long_word_that_is_no_number_costs_no_more_than_its_length():
    word = b"9" * 200_000 + b"x"
    assert number(word) == number(b"x")
    assert calls(lambda: number(word)) < 2 * calls(lambda: number(word[100_000:])) + 1000


@needs_shared
@pytest.mark.parametrize(
    "name", ["telemetry/samples/copter_sitl_4.7.bin", "flights/healthy/quad_short.bin"]
)
def test_log_written_as_text_is_the_same_log(load, name):
    lines = text_lines(SHARED / name)
    log = read(SHARED / name)
    # FILE.Data is binary: its line ends cannot be told from others
    again = load(b"".join(line for line in lines if not line.startswith(b"FILE,")))
    apart = {"FILE", "FMT"}  # of FMT old firmware does not name the last field
    assert set(again.messages) - apart == set(log.messages) - apart
    for key in sorted(set(log.messages) - apart):
        for field in log[key].fields:
            mine, theirs = again[key], log[key]
            assert mine.unit(field) == theirs.unit(field)
            np.testing.assert_allclose(mine.si(field), theirs.si(field), rtol=1e-7, atol=1e-12)
            if theirs.columns[field].is_text:
                stripped = [text.strip() for text in theirs.raw(field)]
                assert mine.raw(field).tolist() == stripped, f"{key}.{field}"
    assert again.flights == log.flights
    assert again.parameters == log.parameters
    assert (again.vehicle, again.firmware) == (log.vehicle, log.firmware)
    heading = {"1", "Free RAM: 1331"}
    events = [event for event in again.events if event.text not in heading]
    assert [(e.kind, e.text) for e in events] == [(e.kind, e.text) for e in log.events]
    # records without a time of their own stand between others, by bytes
    assert [e.t for e in events] == pytest.approx([e.t for e in log.events], abs=0.02)


@SPOILED
@given(spoilings(1300))
def test_damage_costs_the_lines_that_it_hits(load, spoiling):
    data = spoiling.of(small())
    try:
        log = load(data)
    except FdiError:
        return
    assert_readable(log)
    flips, at, inserted = spoiling
    if "ATT" in log and at > len(HEAD) and all(place > len(HEAD) for place, _ in flips):
        hit = {data.count(b"\n", 0, place) for place, _ in [*flips, (at, 0)]}
        assert log["ATT"].stamp.size >= 20 - 3 * len(hit) - inserted.count(b"\n")
