"""Flights of one vehicle beside each other: which are healthy, which tests are the same."""

from dataclasses import replace

import numpy as np
import pytest
from report.build import NOTHING, small_analysis, small_log
from report.test_figures import texts

import fdi
from fdi.errors import LogError, UsageError
from fdi.telemetry import Flight


def flown(folder, name, bias=0.0, **changes):
    """Return the analysis of a flight that lands; nobody is accused unless ``bias`` is given."""
    log = small_log(name=name, bias=bias)
    data = np.full(9, len(name) + int(bias), np.uint8)
    flight = Flight(5.0, 88.0, takeoff=10.0, landing=85.0)
    log = replace(log, data=data, _cache={"flights": (flight,), "sha256": name}, **changes)
    said = {} if bias else NOTHING
    return small_analysis(folder, log, **said)


@pytest.fixture(scope="module")
def analyses(tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    sound = [flown(folder, f"good_{i}.tlog") for i in range(3)]
    changed = {"ARMING_CHECK": 1.0, "WP_SPEED": 9.0}
    return [*sound, flown(folder, "odd.tlog", bias=40.0, parameters=changed)]


@pytest.fixture(scope="module")
def found(analyses):
    return fdi.compare(analyses)


def test_the_biased_receiver_stands_out(found):
    first = found.differences[0]
    assert found.flights[first.flight].name == "odd.tlog"
    assert "GPS_RAW_INT.alt" in found.tests[first.test].equations
    assert first.bands > 10
    assert first.since == pytest.approx(30.0, abs=0.5)  # at 40 s of the log, after 10 s on ground
    assert abs(first.value) == pytest.approx(40.0, abs=2.0)


def test_tests_without_the_receiver_do_not_differ(found):
    for one in found.differences:
        if "GPS_RAW_INT.alt" not in found.tests[one.test].equations:
            assert one.bands <= 1.0


def test_who_is_accused_does_not_make_the_band(found):
    assert [one.is_healthy for one in found.flights] == [True, True, True, False]


def test_an_impact_does_not_make_the_band(analyses, tmp_path):
    crashed = replace(
        small_log(name="crash.tlog", bias=0.0),
        _cache={
            "flights": (Flight(5.0, 88.0, takeoff=10.0, impact=85.0, impact_speed=9.0),),
            "sha256": "c",
        },
    )
    found = fdi.compare([*analyses[:2], small_analysis(tmp_path, crashed, **NOTHING)])
    assert [one.is_healthy for one in found.flights] == [True, True, False]


def test_what_somebody_says_of_health_counts(analyses):
    found = fdi.compare(analyses, healthy=[True, False, False, True])
    assert [one.is_healthy for one in found.flights] == [True, False, False, True]


def test_parameters_that_differ_are_told_and_missing_ones_not(analyses, found):
    assert not found.settings  # WP_SPEED is told by one log alone
    other = replace(analyses[1], log=replace(analyses[1].log, parameters={"ARMING_CHECK": 0.0}))
    again = fdi.compare([analyses[0], other, analyses[3]])
    assert [(one.name, one.values) for one in again.settings] == [("ARMING_CHECK", (1.0, 0.0, 1.0))]


def test_what_the_vehicle_counts_is_no_parameter_that_differs(analyses):
    counted = {"STAT_RUNTIME": 7.0, "STAT_FLTTIME": 3.0, "LND_FLIGHT_T_LO": 1.0}
    logs = [
        with_log(one, parameters={n: v * k for n, v in counted.items()} | {"WP_SPEED": 5.0 + k})
        for k, one in enumerate(analyses[:2])
    ]
    assert [one.name for one in fdi.compare(logs).settings] == ["WP_SPEED"]


def test_two_flights_of_one_log_are_two_flights(analyses, tmp_path):
    two = replace(
        small_log(bias=0.0),
        _cache={
            "flights": (
                Flight(5.0, 40.0, takeoff=10.0, landing=38.0),
                Flight(45.0, 88.0, takeoff=50.0, landing=85.0),
            ),
            "sha256": "two",
        },
    )
    found = fdi.compare([small_analysis(tmp_path, two, **NOTHING)])
    assert [one.name for one in found.flights] == ["flight.tlog#1", "flight.tlog#2"]
    assert [one.start for one in found.flights] == [10.0, 50.0]


def test_the_order_of_logs_does_not_matter(analyses, found):
    again = fdi.compare(analyses[::-1])
    assert sorted(one.bands for one in again.differences) == pytest.approx(
        sorted(one.bands for one in found.differences)
    )


def test_the_figure_names_the_odd_flight_and_its_axes(found):
    shown = texts(found.plot())
    assert "odd.tlog" in shown
    assert "time after take-off (s)" in shown
    assert any(text.endswith("(m)") for text in shown)


def test_differences_are_a_frame(found):
    frame = found.differences.to_pandas()
    assert frame["bands"].is_monotonic_decreasing
    assert "<table" in found._repr_html_()


def with_log(analysis, **changes):
    return replace(analysis, log=replace(analysis.log, **changes))


@pytest.mark.parametrize(
    ("spoil", "error", "said"),
    [
        (lambda a: [], UsageError, "nothing to compare"),
        (lambda a: a[:1], UsageError, "no other to compare"),
        (lambda a: [a[0], a[0]], UsageError, "is the same log"),
        (lambda a: [a[0], with_log(a[1], vehicle="quad")], UsageError, "has another vehicle"),
        (
            lambda a: [a[0], replace(a[1], airframe=replace(a[1].airframe, name="other"))],
            UsageError,
            "has another model",
        ),
        (
            lambda a: [a[0], replace(a[1], bank=replace(a[1].bank, generators=()))],
            UsageError,
            "no test in common",
        ),
        (
            lambda a: [
                a[0],
                replace(a[1], signals=replace(a[1].signals, flights=(Flight(0, 9, flew=False),))),
            ],
            LogError,
            "has no flight",
        ),
    ],
)
def test_what_cannot_be_compared_is_said_in_one_line(analyses, spoil, error, said):
    with pytest.raises(error, match=said) as caught:
        fdi.compare(spoil(analyses))
    assert "\n" not in str(caught.value)


def test_without_a_healthy_flight_somebody_has_to_say(analyses):
    with pytest.raises(UsageError, match="in every flight somebody is accused"):
        fdi.compare(analyses, healthy=[False] * 4)
