"""What a report says of its own percentages: counts of flights, and nothing under another model."""

import json
from importlib.resources import files

from fdi.diagnosis.worth import FILE, worth_of
from fdi.model import load_airframe

from .build import model


def test_a_shipped_model_is_told_with_the_counts_of_its_trials():
    tried = json.loads(files("fdi.diagnosis").joinpath(FILE).read_text("utf-8"))
    told = worth_of(load_airframe("quadcopter"))
    for kind in ("simulated", "recorded"):
        assert f"{tried[kind]['right']} of {tried[kind]['given']}" in told
    assert told.endswith("on flights that people flew, known when it was made.")


def test_a_model_of_ones_own_is_not_calibrated(tmp_path):
    own = tmp_path / "quadcopter.yaml"  # the name of a shipped one alone is not enough
    own.write_text(model({"gps": ["x"], "baro": ["x"]}), encoding="utf-8")
    assert "not calibrated" in worth_of(load_airframe(own))
    assert " of " not in worth_of(load_airframe(own)).replace("of accusations", "")
