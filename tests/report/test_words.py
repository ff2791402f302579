"""Words for people: foreign text is harmless, times and numbers keep what they say."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from unicodedata import category

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.report.words import (
    accuracies,
    at,
    clean,
    copied,
    flown,
    into_flight,
    latencies,
    log_time,
    number,
    shortened,
    size,
    span,
)
from fdi.residuals.accuracy import Told
from fdi.telemetry import Channel, Copy, Flight

from .build import LAG


@given(st.text())
def test_what_is_shown_has_no_control_characters_and_one_line(text):
    shown = clean(text)
    assert not any(category(c) in ("Cc", "Cs") for c in shown)
    assert not set("\u202a\u202b\u202d\u202e\u2066\u2067\u2068\ufeff") & set(shown)
    assert clean(shown) == shown


@given(st.text(st.characters(categories=["L", "N", "P", "S", "Zs"])))
def test_what_can_be_read_stays_as_it_is(text):
    assert clean(text) == text


def seconds_of(text):
    """Read a length of time back."""
    found = re.fullmatch(r"(?:(\d+) h )?(?:(\d+) min )?(?:([\d.]+) s)?", text)
    hours, minutes, seconds = (float(part or 0) for part in found.groups())
    assert seconds < 60
    assert minutes < 60
    return 3600 * hours + 60 * minutes + seconds


@given(st.floats(0, 1e6))
def test_a_length_of_time_says_what_it_is_to_a_tenth_and_above_an_hour_to_a_second(seconds):
    assert seconds_of(span(seconds)) == pytest.approx(
        seconds, abs=0.0501 if seconds < 3599 else 0.501
    )


@given(st.floats(-1e6, 1e6))
def test_a_time_is_told_to_a_tenth_and_never_as_minus_nought(t):
    assert float(at(t)) == pytest.approx(t, abs=0.0501)
    assert at(t) != "-0.0"


@given(st.floats(-1e300, 1e300), st.integers(2, 6))
def test_a_number_keeps_its_digits(value, digits):
    assert float(number(value, digits)) == pytest.approx(value, rel=0.5 * 10.0 ** (1 - digits))


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_what_is_unknown_is_a_dash(value):
    assert number(value) == "–"


@given(st.integers(0, 10**12))
def test_a_number_of_bytes_is_right_to_its_last_digit(count):
    value, unit = size(count).split()
    scale = {"bytes": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}[unit]
    assert float(value) * scale == pytest.approx(count, abs=0.0501 * scale)


@given(
    st.lists(st.text(st.characters(categories=["L"]), min_size=1), max_size=9), st.integers(1, 9)
)
def test_shortened_names_are_all_accounted_for(names, most):
    shown = shortened(names, most)
    head, _, rest = shown.rpartition(" and ")
    if len(names) > most:
        assert head.split(", ") == names[:most]
        assert rest == f"{len(names) - most} more"
    else:
        assert shown == ", ".join(names)


FIRST = Flight(10, 100, takeoff=20, landing=90)
SECOND = Flight(200, 300)


@pytest.mark.parametrize(
    ("t", "flights", "told"),
    [
        (25, (FIRST,), "5.0 s into the flight"),
        (12, (FIRST,), "8.0 s before take-off"),
        (150, (FIRST,), "2 min 30.0 s into the log"),
        (5, (), "5.0 s into the log"),
        (-0.4, (FIRST,), "0.4 s before the first record"),
        (25, (Flight(10, 100, flew=False),), "25.0 s into the log"),
        (25, (FIRST, SECOND), "5.0 s into flight 1"),
        (205, (FIRST, SECOND), "at least 5.0 s into flight 2"),
    ],
)
def test_a_moment_is_told_from_the_take_off_of_its_flight(t, flights, told):
    assert into_flight(t, SimpleNamespace(flights=flights)) == told


def test_the_flight_that_is_named_counts_and_not_the_one_that_holds_the_time():
    log = SimpleNamespace(flights=(FIRST, SECOND))
    assert into_flight(195, log, 1) == "5.0 s before the start of the flight"


def test_a_time_of_the_log_has_utc_where_the_clock_knows_it():
    clock = SimpleNamespace(utc=lambda t: "2024-05-06T07:08:09.123456Z")
    assert log_time(3, SimpleNamespace(clock=clock)) == "log 3.0 s, 2024-05-06 07:08:09.1 UTC"
    assert log_time(3, SimpleNamespace(clock=SimpleNamespace(utc=lambda t: None))) == "log 3.0 s"


def test_a_latency_is_told_whole_with_how_well_it_is_known():
    (line,) = latencies([LAG])
    assert line == (
        "gps in GPS_RAW_INT: 0.100 +- 0.010 s behind LOCAL_POSITION_NED (stated 0.15 s), taken off"
    )


def test_a_latency_that_is_not_used_says_why():
    (line,) = latencies([replace(LAG, used=False, why="too little motion")])
    assert line == "as the model states, too little motion: gps in GPS_RAW_INT"


def test_a_message_that_repeats_another_is_one_line_with_what_is_left_out():
    names = ("xmag", "ymag")
    copies = tuple(
        Copy(Channel("SCALED_IMU2", name), Channel("RAW_IMU", name), 1.0, 0.0, 1.0, 99)
        for name in names
    )
    system = SimpleNamespace(copies=copies, implied={"mag_2": copies[0]})
    assert copied(system) == [
        "SCALED_IMU2 repeats RAW_IMU (xmag, ymag): not counted; left out: mag_2"
    ]


def test_only_accuracies_worse_than_stated_are_told():
    good = Told(Channel("GPS_RAW_INT", "vel"), "m/s", 0.5, 0.3, 0.5, 0.4, 0.0)
    poor = replace(good, reported=0.7, used=0.7, worst=4.9, bounded=0.1)
    assert accuracies([good, poor]) == [
        "GPS_RAW_INT.vel reports 0.7 m/s in the median, 4.9 m/s at worst; the model states "
        "0.5 m/s, and 0.7 m/s is used in the median, bounded for 10 % of the flight"
    ]


def test_an_accuracy_that_differs_beyond_the_printed_digits_is_not_told_as_worse():
    same = Told(Channel("GPS_RAW_INT", "vel"), "m/s", 0.5, 0.43, 0.5, 0.503, 0.0)
    assert accuracies([same]) == []


def test_the_accuracy_of_a_place_is_told_in_metres():
    place = Told(Channel("GPS_RAW_INT", "lat"), "rad", 2e-7, 3e-7, 3e-7, 1e-6, 0.0)
    assert accuracies([place]) == [
        "GPS_RAW_INT.lat reports 1.9 m in the median, 6.4 m at worst; the model states 1.3 m, "
        "and 1.9 m is used in the median"
    ]


def test_a_log_without_a_landing_stops_in_flight():
    assert flown([Flight(0, 60, takeoff=5)]) == "1 flight; the recording stops in flight"
    two = [Flight(0, 60, takeoff=5, landing=50), Flight(90, 120)]
    assert flown(two) == "2 flights; the recording stops in the last of them"
