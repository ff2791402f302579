import base64
import itertools
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fdi.diagnosis import Ending, Evidence, First, Other, RuledOut
from fdi.diagnosis.concerns import concerns
from fdi.model.parts import Component
from fdi.report.html import html_report
from fdi.report.page import channels
from fdi.report.page.airframe import airframe_svg, states_of
from fdi.report.page.channels import held_channels
from fdi.report.page.document import page_of
from fdi.report.page.drawing import grid_svg, panel_svg
from fdi.report.page.evidence import Court, _side_words
from fdi.report.page.marks import grid_rows, marks, modes
from fdi.report.page.panel import Curve, Panel
from fdi.report.page.script import json_for_page
from fdi.report.page.sides import Parts, Side, residual_of
from fdi.report.page.suspects import alarmed, behind, ending_words, first_signs, rest, suspects
from fdi.residuals.respond import respond, stretch
from fdi.result import Analysis
from fdi.telemetry import Event
from fdi.telemetry.ends import FlightEnd

from ..build import MODEL, NOTHING, message, small_analysis, small_log

MOST_BYTES = 6_000_000


def test_the_evidence_shows_the_accused_components_own_channel_first(analysis: Analysis) -> None:
    case = Court(analysis).of_finding(analysis.findings[0])
    assert case is not None
    assert case.window == (25.0, 45.0)
    channels = [panel for panel in case.tests[0].panels if "recorded" in panel.curves[0].label]
    own = [panel for panel in channels if panel.title.startswith("GPS_RAW_INT.alt (")]
    assert own


def test_a_channel_is_shown_beside_those_that_differ_by_a_number(tmp_path: Path) -> None:
    """Of one of several the others say whether it is unlike them; its own curve lies above."""
    log = small_log()
    alt = {f"alt_{i}": log.channel("GPS_RAW_INT.alt").value for i in (1, 2)}
    twins = message("HEIGHTS", alt | {"other": alt["alt_1"]}, log["GPS_RAW_INT"].t)
    field = "{variable: altitude, accuracy: 1 m}"
    model = MODEL.replace("GPS_RAW_INT:", "HEIGHTS:").replace(
        f"alt: {field}\n  VFR_HUD", f"alt_1: {field}\n      alt_2: {field}\n  VFR_HUD"
    )
    found = small_analysis(tmp_path, log.with_message(twins), model)
    row = next(
        g
        for g in found.bank.generators
        if {str(c) for c in found.bank.channels(g)} == {"HEIGHTS.alt_1", "HEIGHTS.alt_2"}
    )
    (finding,) = found.findings
    finding = replace(finding, evidence=Evidence("", (row.id,), ("HEIGHTS.alt_1",)))
    case = Court(found).of_finding(finding)
    assert case is not None
    (panel,) = [p for p in case.tests[0].panels if p.title.startswith("HEIGHTS.alt_1")]
    assert [curve.label for curve in panel.curves][:2] == ["alt_2", "recorded"]
    assert panel.curves[0].channel == "HEIGHTS.alt_2"


def test_a_channel_is_predicted_as_what_would_make_the_test_agree(analysis: Analysis) -> None:
    """The bias of 40 m is the distance of what is recorded from what is predicted."""
    case = Court(analysis).of_finding(analysis.findings[0])
    assert case is not None
    panel = next(
        panel
        for test in case.tests
        for panel in test.panels
        if panel.title.startswith("GPS_RAW_INT.alt (")
    )
    recorded, predicted = panel.curves
    off = recorded.value - predicted.value
    assert np.nanmedian(off[(recorded.t > 42) & (recorded.t < 58)]) == pytest.approx(40, abs=1.5)
    assert np.nanmedian(off[(recorded.t > 15) & (recorded.t < 38)]) == pytest.approx(0, abs=1.5)


def test_a_plot_of_a_statement_says_in_words_what_it_is_about(analysis: Analysis) -> None:
    system = analysis.system
    altitude = replace(system.variables["altitude"], description="height above the sea")
    known = replace(system, variables={**system.variables, "altitude": altitude})
    about = Court(replace(analysis, system=known))._about
    assert about([Side("altitude", np.zeros(1)), Side("lowest", np.zeros(1), is_bound=True)]) == (
        "height above the sea; stated: "
    )
    assert about([Side("altitude - 3", np.zeros(1))]) == "what is stated, "


def test_a_long_formula_is_no_name_of_a_curve() -> None:
    """It stands in the title; under the plot it would take the width of a phone twice."""
    long = Side("wrap(" + "h_x*sin(roll) + " * 5 + "declination)", np.zeros(1))
    assert [_side_words(long, place) for place in (0, 1)] == ["the first side", "the other side"]
    assert _side_words(Side("altitude", np.zeros(1)), 1) == "altitude"


def test_the_threshold_that_is_shown_is_the_one_that_was_used(analysis: Analysis) -> None:
    case = Court(analysis).of_finding(analysis.findings[0])
    assert case is not None
    row = [g.id for g in analysis.bank.generators].index(case.tests[0].id)
    panel = next(p for p in case.tests[0].panels if "sample by sample" in p.title)
    np.testing.assert_array_equal(panel.curves[1].value, analysis.alarms.threshold[row])
    beyond = np.abs(panel.curves[0].value) > panel.curves[1].value
    assert (beyond == (analysis.alarms.state[row] == 1))[
        np.isfinite(panel.curves[0].value)
    ].mean() > 0.95  # a mean beyond its own threshold is a trigger as well


def test_what_is_predicted_of_a_channel_leaves_no_residual(analysis: Analysis) -> None:
    """Put it back into the data, as a fault is put there, and the residual is gone."""
    piece = stretch(analysis.residual_values, slice(0, None))
    tried = 0
    for row in range(len(analysis.bank.generators)):
        for part in Parts(analysis.alarms, piece).of(row, "gps", (41.0, 59.0)):
            if part.predicted is None or part.recorded is None:
                continue
            known = np.isfinite(part.predicted)
            change = np.where(known, part.predicted - part.recorded, 0.0)
            after = residual_of(analysis.alarms, row) + respond(piece, {part.equation: change})[row]
            np.testing.assert_allclose(after[known], 0.0, atol=1e-6)
            tried += 1
    assert tried >= 4


def test_the_evidence_reaches_to_the_alarm_where_it_takes_long(analysis: Analysis) -> None:
    finding = replace(analysis.findings[0], alarm=52.0)
    case = Court(analysis).of_finding(finding)
    assert case is not None
    assert case.window == (25.0, 57.0)


def test_an_end_that_nobody_is_accused_for_has_a_case_too(tmp_path: Path) -> None:
    changes = NOTHING | {
        "outlook": "ended badly",
        "endings": (Ending(FlightEnd(0, "impact", 60.0, 9.0)),),
    }
    found = page_of(small_analysis(tmp_path, **changes))
    ((_, shown),) = found.firsts
    assert shown is not None
    assert shown.case.window == (45.0, 65.0)
    assert "What showed first" in html_report(small_analysis(tmp_path, **changes))


@pytest.mark.parametrize(("group", "shown"), [("autopilot", 1), ("sensor", 0)])
def test_with_a_controller_that_is_accused_stands_what_it_asked_of_its_motors(
    tmp_path: Path, group: str, shown: int
) -> None:
    log = small_log()
    own = log["GPS_RAW_INT"]
    outputs = message(
        "SERVO_OUTPUT_RAW", {"servo1_raw": log.channel("GPS_RAW_INT.alt").value}, own.t
    )
    model = MODEL.replace("gps: {group: sensor", f"gps: {{group: {group}")
    page = page_of(small_analysis(tmp_path, log.with_message(outputs), model))
    ((_, case),) = page.findings
    assert case is not None
    titles = [plot.title for plot in case.context]
    assert len(titles) == shown
    assert all(title.startswith("Outputs") for title in titles)
    assert len(page.data["cases"]["finding.0"]["context"]) == shown


def test_the_second_suspect_must_answer_for_alarms_that_do_not_concern_it(
    analysis: Analysis,
) -> None:
    finding = replace(analysis.findings[0], confidence=0.6, rivals=(("barometer", 0.39),))
    suspect, nobody = suspects(finding, analysis, concerns(analysis.bank))
    assert suspect.name == "Barometer"
    assert nobody.share == pytest.approx(0.01)
    assert suspect.share == 0.39
    assert suspect.asks


def test_why_it_was_nobody_else_is_told_of_alarms_first_and_not_of_who_is_told_already(
    analysis: Analysis,
) -> None:
    others = (
        Other("barometer", 41.0, ("a",)),
        Other("gyroscope", 43.0, ("b", "c")),
        Other("compass", None, ("the only test of its own was quiet",)),
        Other("battery", None, ()),
    )
    finding = replace(
        analysis.findings[0], confidence=0.6, rivals=(("barometer", 0.4),), others=others
    )
    told = suspects(finding, analysis, concerns(analysis.bank))
    assert told[0].against == ("a",)
    found = rest(finding, told, analysis)
    assert found.alarmed == (("Gyroscope", 43.0, ("b", "c")),)
    assert (found.more, found.quiet) == ((), ("Compass",))


def test_a_suspect_that_nothing_speaks_against_is_told_so(analysis: Analysis) -> None:
    finding = replace(analysis.findings[0], confidence=0.6, rivals=(("barometer", 0.39),))
    suspect, _ = suspects(finding, analysis, concerns(analysis.bank))
    assert suspect.against == ("nothing that the tests show speaks against it",)


def test_what_may_be_behind_a_program_is_named_unless_it_is_ruled_out(analysis: Analysis) -> None:
    parts = {
        "attitude_control": Component("attitude_control", group="autopilot"),
        "motor_1": Component("motor_1", affects=("attitude_control",)),
        "gyroscope": Component("gyroscope", affects=("estimator",)),
        "estimator": Component("estimator", affects=("attitude_control",)),
        "compass": Component("compass"),
    }
    known = replace(analysis, system=replace(analysis.system, components=parts))
    finding = replace(analysis.findings[0], component="attitude_control")
    assert behind(finding, known) == ("Motor 1", "Estimator")
    cleared = (RuledOut("motor_1", "", (), ()),)
    ruled = replace(known, diagnosis=replace(known.diagnosis, ruled_out=cleared))
    assert behind(finding, ruled) == ("Estimator",)
    assert behind(replace(finding, component="motor_1"), known) == ()


def test_nobody_is_the_second_suspect_where_the_rest_is_nobodys(analysis: Analysis) -> None:
    finding = replace(analysis.findings[0], confidence=0.6, rivals=())
    (suspect,) = suspects(finding, analysis, concerns(analysis.bank))
    assert suspect.name == "no part at all"
    assert suspect.share == pytest.approx(0.4)


def test_the_first_signs_hold_what_somebody_is_accused_of_however_early(
    analysis: Analysis,
) -> None:
    """It began long before the seconds that an ending looks at, and others fill these."""
    (finding,) = analysis.findings
    own = First(56.0, "alarm", "GPS receiver shows another height", "gps")
    late = [First(55.0 + i, "alarm", f"sign {i}", "compass") for i in range(9)]
    end = FlightEnd(finding.flight, "impact", 65.0)
    signs = first_signs(Ending(end, (own, *late)), analysis)
    assert len(signs) == 5
    assert (signs[0].at, signs[0].component) == (finding.onset, "gps")
    assert own in signs
    assert first_signs(Ending(replace(end, how="landed"), ()), analysis) == []


def test_what_somebody_is_accused_of_is_told_once_from_its_onset_on(analysis: Analysis) -> None:
    (finding,) = analysis.findings
    end = FlightEnd(finding.flight, "impact", 65.0)
    (sign,) = first_signs(Ending(end), analysis)
    later = replace(sign, at=58.0, kind="trigger")
    (again,) = first_signs(Ending(end, (later,)), analysis)
    assert (again.at, again.kind) == (finding.onset, "trigger")
    healed = replace(finding, end=50.0)
    diagnosis = replace(analysis.diagnosis, findings=(healed,))
    assert first_signs(Ending(end), replace(analysis, diagnosis=diagnosis)) == []


def test_what_alarmed_is_told_where_nobody_is_accused(analysis: Analysis) -> None:
    nobody = replace(analysis, diagnosis=replace(analysis.diagnosis, findings=(), endings=()))
    told = alarmed(nobody)
    assert told
    assert [at for at, _ in told] == sorted(at for at, _ in told)
    assert min(told)[0] == pytest.approx(40.0, abs=2.0)
    assert len({text for _, text in told}) == len(told)
    assert f"from log {told[0][0]:.1f} s: {told[0][1]}" in html_report(nobody)
    assert alarmed(analysis) == []


def test_how_it_ended_is_told() -> None:
    lost = Ending(FlightEnd(0, "impact", 80.5, 11.2, 77.6))
    assert ending_words(lost) == (
        "It hit the ground at 11.2 m/s, log 80.5 s. Control was lost 2.9 s before (log 77.6 s)."
    )
    assert ending_words(None) == "No flight is seen in this log."


def test_a_quadcopter_is_drawn_with_its_motors_where_they_are(analysis: Analysis) -> None:
    frame = {"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0}
    log = replace(analysis.log, vehicle="quad", parameters=frame)
    drawn = airframe_svg(replace(analysis, log=log))
    for number, turn in ((1, "counter-clockwise"), (2, "counter-clockwise"), (3, "clockwise")):
        assert f"motor {number}, turns {turn}" in drawn
    assert drawn.count("<circle") == 4


def test_a_winged_vehicle_whose_motors_are_not_known_is_drawn_with_wings(
    analysis: Analysis,
) -> None:
    for vehicle, wings in (("vtol", 1), ("plane", 1), ("rover", 0)):
        log = replace(analysis.log, vehicle=vehicle, parameters={})
        drawn = airframe_svg(replace(analysis, log=log))
        assert drawn.count('<path class="hull"') == wings


def test_an_aeroplane_that_rotors_lift_is_drawn_with_wings_and_motors(analysis: Analysis) -> None:
    frame = {"Q_ENABLE": 1.0, "Q_FRAME_CLASS": 1.0, "Q_FRAME_TYPE": 1.0}
    log = replace(analysis.log, vehicle="vtol", parameters=frame)
    drawn = airframe_svg(replace(analysis, log=log))
    assert drawn.count('<path class="hull"') == 1
    assert drawn.count("<circle") == 4


@pytest.mark.parametrize("frame_class", [4.0, 5.0])
def test_motors_on_one_arm_do_not_cover_each_other(analysis: Analysis, frame_class: float) -> None:
    frame = {"FRAME_CLASS": frame_class, "FRAME_TYPE": 1.0}
    drawn = airframe_svg(
        replace(analysis, log=replace(analysis.log, vehicle="other", parameters=frame))
    )
    circles = [
        tuple(map(float, found))
        for found in re.findall(r'<circle cx="(\d+)" cy="(\d+)" r="(\d+)"', drawn)
    ]
    assert len(circles) in (6, 8)
    for (x, y, r), (a, b, q) in itertools.combinations(circles, 2):
        assert np.hypot(x - a, y - b) >= r + q


def test_the_accused_is_marked_on_the_airframe(analysis: Analysis) -> None:
    assert states_of(analysis)["gps"] == "accused"
    assert states_of(analysis)["compass"] == "untested"
    assert '<g class="pill accused"><title>Gps: accused</title>' in airframe_svg(analysis)


def test_modes_become_bands_that_end_with_the_next() -> None:
    log = small_log()
    events = (Event(1.0, "mode", "AUTO"), Event(2.0, "mode", "AUTO"), Event(30.0, "mode", "RTL"))
    log = replace(log, reported=events, _cache={"flights": log.flights})
    assert modes(log) == [(1.0, 30.0, "AUTO"), (30.0, 89.75, "RTL")]


def test_marks_hold_take_off_impact_and_the_onset(analysis: Analysis) -> None:
    found = {mark["kind"]: mark["at"] for mark in marks(analysis)}
    assert (found["takeoff"], found["impact"], found["onset"]) == (10.0, 85.0, 40.0)
    assert found["parameter"] == 12.0  # in flight


def test_the_mark_of_finding_1_says_which_it_is_though_another_onset_is_earlier(
    analysis: Analysis,
) -> None:
    """The button "moment" looks for it: the first mark may be that of a lesser finding."""
    first = analysis.findings[0]
    earlier = replace(first, rank=2, onset=12.0)
    both = replace(analysis.diagnosis, findings=(first, earlier))
    onsets = [m for m in marks(replace(analysis, diagnosis=both)) if m["kind"] == "onset"]
    assert [(m["rank"], m["at"]) for m in onsets] == [(2, 12.0), (1, first.onset)]


def test_a_page_stays_small_however_long_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = small_analysis(tmp_path)
    assert len(html_report(found).encode()) < MOST_BYTES / 10
    monkeypatch.setattr(channels, "MOST_BYTES", 6_000)
    held = held_channels(found.log, ["GPS_RAW_INT.alt"])
    assert held.messages["GPS_RAW_INT"]["k"] == 360
    assert held.messages["VFR_HUD"]["k"] < 200
    assert held.thinned == 2


def test_messages_too_long_to_look_at_are_named(
    analysis: Analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channels, "MOST_VALUES", 400)
    held = held_channels(analysis.log, ["GPS_RAW_INT.alt"])
    assert set(held.messages) == {"GPS_RAW_INT"}
    assert held.left_out == ("VFR_HUD", "GLOBAL_POSITION_INT")


def test_json_holds_no_letter_that_ends_a_script() -> None:
    told = json_for_page({"a": "</script><script>alert(1)</script><!-- \u2028"})
    assert "<" not in told
    assert "\u2028" not in told


def test_a_page_draws_without_the_library_for_pictures(
    analysis: Analysis, monkeypatch: pytest.MonkeyPatch
) -> None:
    """matplotlib costs more than the whole page."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "data-plot" in html_report(analysis)


def test_what_plots_need_is_thinned_too_where_there_is_no_room(analysis: Analysis) -> None:
    held = held_channels(analysis.log, ["GPS_RAW_INT.alt"], room=2_000)
    assert all(message["k"] < 100 for message in held.messages.values())
    values = analysis.log["GPS_RAW_INT"].si("alt")
    kept = held.messages["GPS_RAW_INT"]["f"]["alt"]
    shown = np.frombuffer(base64.b64decode(kept["f"]), "<f4") + kept.get("b", 0.0)
    assert (shown.min(), shown.max()) == pytest.approx((values.min(), values.max()), rel=1e-6)


def test_the_grid_says_which_faults_are_of_the_accused(analysis: Analysis) -> None:
    """In words and by the colour of their bars, which is no subsystem's."""
    rows = grid_rows(analysis)
    accused = [row for row in rows if row["accused"]]
    assert {row["name"].split(":")[0] for row in accused} == {"Gps"}
    drawn = grid_svg(rows, (0.0, 90.0))
    assert drawn.count(", accused<") == len(accused)
    assert drawn.count('class="bar accused"') == sum(bool(row["on"]) for row in accused)


def test_no_line_of_the_grid_crosses_a_name(analysis: Analysis) -> None:
    rows = grid_rows(analysis)
    drawn = grid_svg(rows, (0.0, 90.0), [(40.0, "onset")])
    names = [float(y) for y in re.findall(r'class="tick[^"]*" x="62" y="([0-9.]+)"', drawn)]
    lines = re.findall(r'class="mark onset" d="M[0-9.]+ ([0-9.]+)V([0-9.]+)"', drawn)
    assert len(lines) == len(names) == len(rows)
    assert not any(float(a) < y - 4 < float(b) for a, b in lines for y in names)


def test_bars_of_the_grid_stand_at_their_time_on_the_axis_of_the_plots() -> None:
    t = np.array([0.0, 5.0, 10.0])
    row = {"name": "gps.drift", "group": "sensor", "accused": False} | {"on": [[5, 10]], "off": []}
    panel = Panel("height", "m", (Curve("flown", t, t),))
    (bar,) = re.findall(r'class="bar g-sensor" d="M([0-9.]+) ', grid_svg([row], (0.0, 10.0)))
    assert f"L{bar} " in panel_svg(panel, (0.0, 10.0))  # of the middle sample
