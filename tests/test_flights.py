"""Flights from log to cause: the examples, healthy reference flights, and the published crash."""

import json

import jsonschema
import numpy as np
import pytest
from flights import ROOT, SHARED, accused, components, document_of, examples, shared

from fdi.analysis import analyze
from fdi.decision import load_policy
from fdi.telemetry import read
from fdi.telemetry.writing import Change, rewritten

SITL = "sitl/{}.tlog"
HEALTHY = shared(
    *(
        SITL.format(name)
        for name in (
            "copter/c01_ref_slow_line",
            "copter/c02_hover_calm",
            "copter/c03_ref_square_wind",
            "copter/c07_ref_aggressive",
            "plane/p01_rect_calm",
            "plane/p02_rect_wind_land",
        )
    )
)
AFRIKA = SHARED / "paper" / "afrika.tlog"
IMPACT = 2331.62  # s, last message of the aircraft; paper_model.md section 2
CONTACT = 0.3  # s from a label's evaluate_until to the first ground contact; sitl/README.md
# When the aircraft was short of energy: airspeed below 12.5 m/s at full throttle, 15 m/s demanded;
# log time, s, paper_model.md section 2. The last one became the stall.
SHORTAGES = (
    (900.5, 924.0),  # the climb after take-off: 9.4 to 10.4 m/s at full throttle and 15 degrees
    (1800.5, 1805.1),
    (2007.6, 2007.6),
    (2126.2, 2133.4),
    (2174.2, 2175.5),
    (2224.2, 2226.8),
    (2245.9, 2258.2),
    (2317.6, 2319.8),
)


def told(document):
    """Findings in short, for the message of a failing test."""
    return [
        (f["component"], f["onset"]["log_s"], f["alarm"]["log_s"]) for f in document["findings"]
    ]


@pytest.mark.parametrize("case", examples())
def test_right_component_is_named_first(case):
    document = document_of(case.path)
    assert document["findings"], document["verdict"]
    assert document["findings"][0]["component"] in case.right, told(document)


@pytest.mark.parametrize("case", examples())
def test_cause_is_accused_after_it_began_and_before_the_impact(case):
    first = document_of(case.path)["findings"][0]
    assert case.onset - 1.0 <= first["onset"]["log_s"] <= case.label["evaluate_until"]
    assert case.onset <= first["alarm"]["log_s"] <= case.label["evaluate_until"] + CONTACT


@pytest.mark.parametrize("case", examples())
def test_nothing_after_the_impact_is_a_cause(case):
    document = document_of(case.path)
    late = case.label["evaluate_until"] + CONTACT
    assert not [said for said in told(document) if said[1] > late]


@pytest.mark.parametrize("case", HEALTHY)
def test_nobody_is_accused_on_a_healthy_flight(case):
    document = document_of(case.path)
    assert not document["findings"], told(document)


@pytest.mark.parametrize("case", [*examples(), *HEALTHY])
def test_document_is_of_the_promised_form(case):
    path = ROOT / "fdi" / "report" / "analysis.schema.json"
    schema = json.loads(path.read_text(encoding="utf-8"))
    document = json.loads(json.dumps(document_of(case.path), allow_nan=False))
    jsonschema.Draft202012Validator(schema).validate(document)


@pytest.mark.parametrize("case", [*examples(), *HEALTHY])
def test_nobody_is_accused_and_cleared_at_once(case):
    document = document_of(case.path)
    cleared, untested = components(document["ruled_out"]), components(document["not_testable"])
    assert not accused(document) & (cleared | untested)
    assert not cleared & untested


@pytest.mark.parametrize("case", [*examples(), *HEALTHY])
def test_residuals_that_clear_a_component_concern_it_and_were_quiet(case):
    assert_cleared_truthfully(document_of(case.path))


def assert_cleared_truthfully(document):
    """Every residual named holds a fault of the component, ran, and raised no lasting alarm."""
    component_of = {row["fault"]: row["component"] for row in document["fault_grid"]["rows"]}
    residuals = {residual["id"]: residual for residual in document["residuals"]}
    for item in document["ruled_out"]:
        assert item["residuals"], item
        for name in item["residuals"]:
            found = residuals[name]
            assert item["component"] in {component_of[f] for f in found["signature"]}, (item, found)
            assert found["status"] == "ok"
            lasting = [i for i in found["triggered"] if i[1] - i[0] >= shortest_alarm(document)]
            assert not lasting, (item["component"], name, lasting)


def shortest_alarm(document):
    """Return how long a residual is triggered before the default policy calls it an alarm, s."""
    recipe = load_policy("default").decision
    step = float(np.median(np.diff(document["fault_grid"]["t"])))
    return max(round(recipe.persistence_s / step), recipe.least_samples) * step - step / 2


@pytest.fixture(scope="module")
def afrika():
    """The published crash by the model and policy that a user gets."""
    if not AFRIKA.is_file():
        pytest.skip("no ../shared")
    return document_of(AFRIKA, "fixed_wing")


def test_shortage_of_energy_is_the_first_cause_of_the_published_crash(afrika):
    assert afrika["findings"], afrika["verdict"]
    assert afrika["findings"][0]["component"] == "speed_height_control", told(afrika)


def test_published_crash_is_seen_before_control_is_lost(afrika):
    own = [said for said in told(afrika) if said[0] == "speed_height_control"]
    assert [said for said in own if 2311 <= said[2] <= 2322], own


def test_speed_height_control_is_accused_only_where_energy_was_short(afrika):
    """Throttle at its limit alone is normal in this flight: 27 % of the cruise."""
    own = [f for f in afrika["findings"] if f["component"] == "speed_height_control"]
    for finding in own:
        onset = finding["onset"]["log_s"]
        end = IMPACT if finding["end"] is None else finding["end"]["log_s"]
        assert any(low - 15 <= end and onset <= high + 5 for low, high in SHORTAGES), (onset, end)


def test_nobody_else_is_accused_before_the_published_crash(afrika):
    others = [said for said in told(afrika) if said[0] != "speed_height_control"]
    assert not [said for said in others if said[1] < 2300]


def test_nothing_after_the_published_impact_is_a_cause(afrika):
    assert not [said for said in told(afrika) if said[1] > IMPACT or said[2] > IMPACT + 1]
    marked = [i for row in afrika["fault_grid"]["rows"] for i in row["intervals"]]
    assert not [interval for interval in marked if interval[0] > IMPACT]


def test_the_airspeed_is_neither_accused_nor_ruled_out(afrika):
    """The wind by which it is compared follows it, so that quiet tests say little for it."""
    assert_cleared_truthfully(afrika)
    assert "airspeed" not in accused(afrika), told(afrika)
    assert "airspeed" in components(afrika["open"]) | components(afrika["not_testable"])


def test_shortages_of_energy_are_in_the_log():
    """The table that the tests above rely on, from the log itself."""
    if not AFRIKA.is_file():
        pytest.skip("no ../shared")
    t, airspeed, _ = read(AFRIKA).channel("VFR_HUD.airspeed")
    slow = t[(airspeed < 12.5) & (t > 900) & (t < 2322)]
    inside = np.array([(slow >= low - 1) & (slow <= high + 1) for low, high in SHORTAGES])
    assert inside.any(axis=1).all()
    cruise = (slow > 960) & (slow < 2320)
    assert inside[:, cruise].any(axis=0).all(), slow[cruise & ~inside.any(axis=0)]


@pytest.mark.parametrize(
    "case",
    shared(SITL.format("copter/c42_compass_freeze"), SITL.format("plane/p51_compass_freeze")),
)
def test_frozen_compass_is_named_where_there_is_no_other(case, tmp_path):
    log = read(case.path)
    second = Change({}, np.ones(log["SCALED_IMU2"].stamp.size, np.bool_))
    path = tmp_path / case.path.name
    path.write_bytes(rewritten(log, {"SCALED_IMU2": second}))
    found = analyze(path)
    assert [f.component for f in found.findings][:1] == ["compass"]
    still = [g.id for g in found.bank.generators if "compass.stuck_1" in g.faults]
    assert set(still) & set(found.document()["findings"][0]["evidence"]["residuals"])
