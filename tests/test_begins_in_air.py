"""A log whose first records are of a vehicle that flies already."""

import re
from importlib import import_module

import pytest

from fdi import analyze
from fdi.report.explained import explained
from tests.flights import EXAMPLES, joined, records


def cut(name, start, tmp_path):
    """Return the analysis of a flight whose records of the first ``start`` s are lost."""
    flight = records(EXAMPLES / name)
    late = flight[0].stamp + start * 1e6
    kept = [one for one in flight if one.stamp >= late or one.name == "PARAM_VALUE"]
    path = tmp_path / "begins_in_air.tlog"
    path.write_bytes(joined(kept))
    return analyze(path)


def test_what_is_violated_all_along_is_so_from_the_logs_beginning_on(tmp_path, monkeypatch):
    name = "plane_engine_failure_stall.tlog"
    module = import_module("fdi.diagnosis.stood_out")
    monkeypatch.setattr(module, "violated_from_start", lambda _: {0: 0.9})
    for found, what in ((analyze(EXAMPLES / name), "flight"), (cut(name, 18.0, tmp_path), "log")):
        (fact,) = (one for one in found.stood_out if "in 90 % of it" in one.text)
        assert f"from the beginning of the {what} on" in fact.text


@pytest.mark.parametrize(
    ("name", "start", "component"),
    [
        ("copter_motor_failure_crash.tlog", 30.0, "motor_1"),
        ("plane_engine_failure_stall.tlog", 18.0, "engine"),
    ],
)
def test_it_flies_from_the_first_record_on_for_a_time_that_nobody_knows(
    name, start, component, tmp_path
):
    whole, found = analyze(EXAMPLES / name), cut(name, start, tmp_path)
    (flight,) = found.log.flights
    assert flight.takeoff is None
    assert flight.flew
    assert [one.component for one in found.findings][:1] == [component]
    assert found.log.ends[-1].how == whole.log.ends[-1].how
    assert found.log.ends[-1].speed == pytest.approx(whole.log.ends[-1].speed, abs=0.1)
    assert "at least" in found.verdict
    assert "at least" not in whole.verdict
    told = explained(found, "facts")
    assert "flight 1: in the air from its first record on" in told
    (high,) = re.findall(r"rests on height above .* at log \S+ s: (\S+) m", told)
    assert float(high) > 20.0
    assert "in the air from its first record" not in explained(whole, "facts")
