"""The page of many logs: what stands out, what is not claimed, and how large it is."""

import re
from html import unescape

import pytest

from fdi.fleet import Job, failed
from fdi.report.fleet.document import fleet_page
from fdi.report.fleet.flagged import is_flagged
from fdi.report.fleet.sparks import curves_of, spark_svg
from fdi.report.fleet.trend import Point, drawn
from fdi.report.fleet.vehicles import vehicles_of
from fdi.telemetry import Log

from ..build import message, small_log
from ..test_text import HOSTILE
from .build import accused, finding, row, trend

HARM = "\"'><img src=x onerror=document.title='harm'><script>document.title='harm'</script>"
MOST_BYTES = 6_000_000


def texts(page: str) -> str:
    return unescape(re.sub(r"<[^>]*>", " ", page.split("<main", 1)[1].split("<script", 1)[0]))


def test_a_row_says_how_it_ended_and_who_is_accused_when_and_how_sure() -> None:
    said = " ".join(texts(fleet_page([accused("a.tlog"), row("b.tlog")], "t.parquet")).split())
    assert "hit the ground at 9.8 m/s, 85.0 s" in said
    assert "Motor 1 (front right) from 34.5 s, 93 %" in said
    assert "1 ended badly or with an accusation, 1 neither, 0 without an analysis" in said
    assert "cannot be shown by this log: airspeed" in said


def test_the_worst_stand_first_and_numbers_are_those_of_the_table() -> None:
    rows = [
        row("quiet.tlog"),
        failed(Job("none.bin"), OSError("gone")),
        accused("less.tlog", findings=[finding("motor_1", confidence=0.6)], ended="landed"),
        accused("more.tlog", findings=[finding("motor_1", confidence=0.9)], ended="landed"),
        accused("impact.tlog"),
    ]
    page = fleet_page(rows, "t.parquet")
    assert re.findall(r'<tr id="log-(\d)"', page) == ["5", "4", "3", "2", "1"]


def test_two_logs_of_one_flight_are_one_flight_to_look_at() -> None:
    logs = [accused("a.tlog"), accused("a.bin", same_flight_as="a.tlog"), row("b.tlog")]
    page = fleet_page(logs, "t.parquet")
    assert "3 logs: 1 flight to look at" in texts(page)
    assert texts(page).count("same flight as a.tlog") == 1
    (alike,) = vehicles_of(logs)
    assert alike.rows == (0, 2)


def test_a_log_without_an_analysis_says_why_and_claims_nothing() -> None:
    bad = failed(Job("x/none.bin"), OSError("no such file"))
    page = fleet_page([bad], "t.parquet")
    said = texts(page)
    assert "no such file" in said
    assert "nobody" not in said
    assert "landed" not in said


def test_a_report_is_linked_where_it_stands_beside_the_page() -> None:
    one = accused("a b#?.tlog", report="t.reports/a b#?-12.fdi")
    page = fleet_page([one, row("c.tlog")], "t.parquet")
    assert re.findall(r'class="report" href="([^"]*)"', page) == [
        "t.reports/a%20b%23%3F-12.fdi/report.html"
    ]


def test_foreign_text_is_inert() -> None:
    one = accused(
        f"{HARM}/{HARM}{HOSTILE}.tlog",
        verdict=HARM + HOSTILE,
        warnings=[HARM],
        hardware=HARM,
        vehicle=HARM,
        firmware=HOSTILE,
    )
    one["findings"][0].update(component=HARM, text=HOSTILE)
    one["names"] = [{"component": HARM, "name": HARM}]
    two = row("\udcff\u202e.tlog", hardware=HARM, vehicle=HARM, trends=one["trends"])
    page = fleet_page([one, two], HARM)
    page.encode()
    assert "<img" not in page
    assert page.count("<script") == 1
    assert not re.search(
        r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", page
    )


def test_nothing_is_fetched_and_only_our_script_may_run() -> None:
    page = fleet_page([row("a.tlog")], "t.parquet")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert unescape(policy[1]).startswith("default-src 'none'; script-src 'sha256-")
    assert "http" not in page.replace("http-equiv", "")
    assert not re.search(r'\bstyle="', page)  # which the policy would refuse


def test_two_hundred_logs_stay_below_six_megabytes() -> None:
    parts = [f"motor_{i}" for i in range(1, 9)]
    long = "x" * 200
    rows = [
        accused(
            f"{long}_{i}.tlog",
            verdict=long * 3,
            warnings=[long] * 9,
            trends=[trend(part, 1 + 0.01 * i) for part in parts]
            + [trend(f"{name}_trim", 0.1, quantity="identified") for name in parts],
        )
        for i in range(200)
    ]
    assert len(fleet_page(rows, "t.parquet").encode()) < MOST_BYTES


def test_vehicles_are_told_apart_by_their_boards() -> None:
    boards = ("cube 0031003D 3136510F 36383534", "cube 0031003D 3136510F 36383535")
    rows = [
        row(f"{i}.bin", hardware=boards[i % 2], hardware_kind="board", system_id=1)
        for i in range(5)
    ]
    found = vehicles_of(rows)
    assert [one.rows for one in found] == [(0, 2, 4), (1, 3)]
    assert not any(one.doubt for one in found)


def test_who_has_no_board_may_be_several_vehicles_and_that_is_said() -> None:
    (alike,) = vehicles_of([row("a.tlog"), row("b.tlog")])
    assert "another vehicle of that build" in alike.doubt
    unknown = [row(f"{i}.tlog", hardware="", hardware_kind="none") for i in range(2)]
    (doubted,) = vehicles_of(unknown)
    assert "may be of several vehicles" in doubted.doubt


def test_flights_stand_by_their_dates_where_all_tell_one() -> None:
    dates = ("2024-03-01T00:00:00.000Z", "2024-01-01T00:00:00.000Z", "2024-02-01T00:00:00.000Z")
    rows = [row(f"{i}.tlog", start_utc=date) for i, date in enumerate(dates)]
    (one,) = vehicles_of(rows)
    assert one.rows == (1, 2, 0)
    (other,) = vehicles_of([*rows, row("3.tlog", start_utc=None)])
    assert other.rows == (0, 1, 2, 3)
    assert "not all tell" in other.order


def test_a_flight_that_does_not_tell_a_quantity_has_no_point() -> None:
    rows = [row("a.tlog"), row("b.tlog", trends=[]), row("c.tlog")]
    (one,) = vehicles_of(rows)
    assert [trend.svg.count('class="dot"') for trend in one.groups[0].trends] == [2, 2]


def points(*values: float, flagged: tuple[int, ...] = ()) -> list[Point]:
    return [Point(v, 0.01, f"{i}.bin", i + 1, i in flagged) for i, v in enumerate(values)]


def test_a_last_flight_far_off_the_quiet_ones_is_told() -> None:
    usual = drawn("Thrust", "", points(1.0, 1.02, 0.99, 1.01, 1.0))
    assert not usual.is_outside
    odd = drawn("Thrust", "", points(1.0, 1.02, 0.99, 1.01, 1.2))
    assert odd.is_outside
    assert "last: 1.2 +- 0.01, outside what the quiet flights before let expect" in odd.told


def test_flagged_flights_do_not_teach_what_is_usual() -> None:
    with_crash = drawn("Thrust", "", points(1.0, 1.02, 0.99, 1.01, 1.4, 1.2, flagged=(4,)))
    assert with_crash.is_outside
    only_crashes = drawn("Thrust", "", points(1.0, 1.4, 1.2, flagged=(0, 1)))
    assert not only_crashes.is_outside
    assert "too few quiet flights" in only_crashes.told


@pytest.mark.parametrize("value", [0.0, 1.0, -3e9, 1e-12])
def test_flights_that_are_all_alike_have_a_picture(value: float) -> None:
    same = [Point(value, 0.0, "a", 1, False)] * 3
    assert "nan" not in drawn("x", "m", same).svg
    assert drawn("x", "m", same).svg.count('class="dot"') == 3


def log_of(values: list[float], t: list[float]) -> Log:
    from dataclasses import replace

    import numpy as np

    own = message("VFR_HUD", {"alt": values}, np.array(t, float))
    return replace(small_log(), messages={"VFR_HUD": own})


def test_a_curve_keeps_its_extremes_and_breaks_where_records_are_missing() -> None:
    t = [*range(300), *range(700, 1000)]
    values = [float(i % 7) for i in range(600)]
    values[411] = 99.0
    (curve,) = curves_of(log_of(values, t))
    assert curve["name"] == "height"
    assert max(v for v in curve["value"] if v is not None) == 99.0
    assert curve["value"].count(None) == 1
    assert len(curve["t"]) == len(curve["value"]) < 70
    assert spark_svg(curve, [800.0]).count("M") == 3  # two stretches and a mark


def test_a_height_that_never_moves_is_no_curve() -> None:
    assert curves_of(log_of([0.0] * 50, list(range(50)))) == []


@pytest.mark.parametrize(
    ("ended", "lost", "flagged"),
    [
        ("landed", None, False),
        ("in_air", None, False),
        ("impact", None, True),
        ("failsafe", None, True),
        ("control_lost", None, True),
        ("landed", 30.0, True),
    ],
)
def test_who_ended_badly_is_flagged(ended: str, lost: float | None, flagged: bool) -> None:
    assert is_flagged(row("a.tlog", ended=ended, lost_control_s=lost)) == flagged
    assert is_flagged(row("a.tlog", accused=["gps"]))
