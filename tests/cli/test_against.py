"""What `fdi structure --against` says of models whose difference is known."""

import json
from pathlib import Path

import pytest

from .conftest import LOG, Run

BAROMETER = (
    "  SCALED_PRESSURE: {component: gps, fields: {press_abs: {variable: altitude, raw: true}}}\n"
)
KINDS = ("added", "changed", "removed", "without_effect")
GPS, OWN, THIRD = "GPS_RAW_INT.alt", "GLOBAL_POSITION_INT.alt", "SCALED_PRESSURE.press_abs"


@pytest.fixture
def wider(model: Path) -> Path:
    path = model.with_name("wider.yaml")
    path.write_text(model.read_text() + BAROMETER)
    return path


def against(run: Run, model: Path, older: Path) -> dict:
    ended = run("structure", model, "--log", LOG, "--against", older, "--json")
    assert ended.code == 0
    return json.loads(ended.out)["against"]


def test_a_third_altitude_tells_the_first_two_apart(run: Run, model: Path, wider: Path) -> None:
    found = against(run, wider, model)
    assert found["equations"] == {
        "added": [THIRD],
        "changed": [],
        "removed": [],
        "without_effect": [],
    }
    assert found["detectable"] == {"added": [THIRD], "removed": []}
    pairs = {tuple(pair) for pair in found["isolable"]["added"]}
    assert {(GPS, OWN), (OWN, GPS)} <= pairs
    tests = {tuple(sorted(one["signature"])) for one in found["residual_generators"]["added"]}
    assert tests == {tuple(sorted((GPS, THIRD))), tuple(sorted((OWN, THIRD)))}
    assert (found["residual_generators"]["before"], found["residual_generators"]["now"]) == (2, 4)
    told = run("structure", wider, "--log", LOG, "--against", model).out
    assert f"{GPS} from {OWN}" in told
    assert "2 new tests: 2 before, 4 now" in told


def test_the_other_way_round_is_what_is_lost(run: Run, model: Path, wider: Path) -> None:
    gained, lost = against(run, wider, model), against(run, model, wider)
    for part in ("detectable", "isolable", "residual_generators"):
        assert lost[part]["removed"] == gained[part]["added"]
        assert lost[part]["added"] == []
    told = run("structure", model, "--log", LOG, "--against", wider).out
    assert "Removed" in told
    assert "No longer told apart" in told
    assert f"No longer detectable\n  {THIRD}" in told


def test_a_model_against_itself_buys_nothing(run: Run, model: Path) -> None:
    found = against(run, model, model)
    assert found["equations"] == {key: [] for key in KINDS}
    assert found["parameters"] == {}
    told = run("structure", model, "--against", model).out
    assert "No further fault can be detected or told from another" in told


def test_a_channel_that_the_log_lacks_is_told_to_have_no_effect(run: Run, model: Path) -> None:
    wider = model.with_name("wider.yaml")
    wider.write_text(model.read_text() + BAROMETER.replace("PRESSURE", "PRESSURE3"))
    found = against(run, wider, model)
    assert found["equations"]["without_effect"] == ["SCALED_PRESSURE3.press_abs"]
    assert found["residual_generators"]["added"] == []


def test_what_is_stated_otherwise_is_changed(run: Run, model: Path) -> None:
    other = model.with_name("other.yaml")
    other.write_text(model.read_text().replace("effort = u_1", "effort = 2*u_1"))
    assert against(run, other, model)["equations"]["changed"] == ["mot_1"]
    assert "mot_1: effort = 2*u_1" in run("structure", other, "--against", model).out


def test_new_parameters_are_told_with_their_source(run: Run, model: Path) -> None:
    other = model.with_name("other.yaml")
    other.write_text(
        model.read_text()
        .replace(
            'effort_max: {value: 0.9, unit: "1"}',
            'effort_max: {value: 0.9, unit: "1"}\n'
            '  gain: {unit: "1", identify: {prior: 1, bounds: [0.5, 1.5], zero: effort}}\n'
            '  nowhere: {unit: "1", log: {name: NOBODY_SETS_IT}}',
        )
        .replace("effort = u_1", "effort = gain*u_1 - nowhere")
    )
    found = against(run, other, model)["parameters"]
    assert found["gain"] == {
        "value": 1,
        "unit": "1",
        "source": "default",
        "identify": [0.5, 1.5],
    }
    assert found["nowhere"]["value"] is None
    told = run("structure", other, "--log", LOG, "--against", model).out
    assert "nowhere: unknown" in told
    assert "gain: not known before the analysis" in told


@pytest.mark.parametrize("text", [None, "", "format: 1\nname: [", "format: 1\nname: lonely\n"])
def test_an_older_model_that_is_none_is_one_clear_line(run: Run, model: Path, text) -> None:
    older = model.with_name("older.yaml")
    if text is not None:
        older.write_text(text)
    ended = run("structure", model, "--log", LOG, "--against", older)
    assert ended.code in (3, 4)
    assert not ended.out
    assert ended.err.startswith("fdi: ")
    assert ended.err.count("\n") <= 2


def test_two_questions_at_once_are_refused(run: Run, model: Path) -> None:
    ended = run("structure", model, "--against", model, "--place")
    assert ended.code == 2
    assert "ask one at a time" in ended.err
