"""Channels that stand still, constants that are healthy, sides that count: what a model may say."""

import numpy as np
import pytest

from fdi.errors import ModelError
from fdi.model import load_airframe
from fdi.model.evaluate import evaluate
from fdi.model.expression import parse
from fdi.model.parts import Kind
from fdi.model.records import FEW_RECORDS, still
from fdi.telemetry.signals import TIME

TEXT = """format: 1
name: small
components:
  gps: {affects: [estimator]}
  estimator: {computed: true}
variables:
  x: {unit: m}
  v: {unit: m/s}
  held: {unit: s}
equations:
  e_1: v = der(x)
  e_2: {text: "v = 0", fault: estimator.drift, component: estimator, offset: 0.2 m/s, side: above}
limits:
  l_1: {variable: held, max: 3, component: gps}
measurements:
  GPS_RAW_INT:
    component: gps
    fields:
      alt: {variable: x, accuracy: 2 m, jitter: 0.1 m, freeze: 4 s}
inputs:
  GPS_RAW_INT:
    fields:
      "vel:still": {variable: held, accuracy: 0.1 s}
"""


def airframe(tmp_path, text=TEXT):
    path = tmp_path / "small.yaml"
    path.write_text(text, encoding="utf-8")
    return load_airframe(path)


def test_what_a_model_says_arrives_in_its_system(tmp_path):
    system = airframe(tmp_path).observe()
    by_name = {equation.name: equation for equation in system.equations}
    assert (by_name["e_2"].offset, by_name["e_2"].side) == (0.2, "above")
    assert by_name["GPS_RAW_INT.alt"].measurement.jitter == 0.1
    assert system.components["estimator"].computed
    frozen = by_name["GPS_RAW_INT.alt:frozen"]
    assert (frozen.kind, frozen.component) == (Kind.LIMIT, "gps")
    assert {f.name for f in system.faults} >= {"GPS_RAW_INT.alt:frozen", "GPS_RAW_INT.alt"}


def test_an_equation_with_a_side_is_never_solved(tmp_path):
    system = airframe(tmp_path).observe()
    (edges,) = (e.edges for e in system.equations if e.name == "e_2")
    assert set(edges.values()) == {"fixed"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("freeze: 4 s", "freeze: 0 s", "must be positive"),
        ("jitter: 0.1 m", "jitter: 3 m", "within the accuracy"),
        ("v = der(x)", "v = still(x)", "measured field"),
        ("side: above", "side: left", "side"),
    ],
)
def test_what_makes_no_sense_is_said_with_its_line(tmp_path, old, new, said):
    with pytest.raises(ModelError, match=r"small\.yaml:\d+") as error:
        airframe(tmp_path, TEXT.replace(old, new))
    assert said in str(error.value)


def test_the_seventh_equal_record_is_the_first_that_tells_of_standing_still():
    t, values = np.arange(9.0), np.array([1.0, 2, 2, 2, 2, 2, 2, 2, 2])
    np.testing.assert_array_equal(still(t, values), [np.nan, 0, 0, 0, 0, 0, 0, 6, 7])


def test_stillness_counts_from_the_last_change_and_a_few_equal_records_are_none():
    t = np.arange(20) / 2
    x = np.array([1.0, 2.0, 2.0, 2.0, *[3.0] * 14, np.nan, 3.0])
    still = evaluate(parse("still(x)"), {TIME: t, "x": x})
    assert np.isnan(still[18])
    assert (still[1:4] == 0).all()
    begins = 4 + FEW_RECORDS
    assert (still[4:begins] == 0).all()
    assert still[begins:18].tolist() == (t[begins:18] - t[4]).tolist()
    assert still[19] == 0  # unknown in between is not the same


def test_stillness_is_unknown_until_the_quantity_has_moved():
    """An output that is connected to nothing never moves; nor does unknown make a movement."""
    t = np.arange(20) / 2
    x = np.array([np.nan, *[5.0] * 9, *[6.0] * 10])
    still = evaluate(parse("still(x)"), {TIME: t, "x": x})
    assert np.isnan(still[:10]).all()
    assert still[10] == 0
    assert still[19] == 4.5


def test_recent_is_the_mean_of_the_last_seconds_and_unknown_before_them():
    t = np.arange(20) / 2
    x = np.array([*[4.0] * 10, *[1.0] * 10])
    recent = evaluate(parse("recent(x)"), {TIME: t, "x": x})
    seconds = 3.0
    assert np.isnan(recent[t < seconds]).all()
    assert (recent[(t >= seconds) & (t < 5)] == 4.0).all()
    assert recent[10] == pytest.approx((5 * 4.0 + 1.0) / 6)
    assert (recent[t >= 5 - 0.5 + seconds] == 1.0).all()


def test_recent_leaves_unknown_records_out():
    t = np.arange(20) / 2
    x = np.where(np.arange(20) % 2, np.nan, 3.0)
    recent = evaluate(parse("recent(x)"), {TIME: t, "x": x})
    assert np.isnan(recent[1::2]).all()
    assert (recent[6::2] == 3.0).all()


def test_recent_is_an_input_beside_the_field_itself(tmp_path):
    text = """format: 1
name: small
variables: {v: {unit: m/s}, v_recent: {unit: m/s}, w: {unit: m/s}}
equations: {e: {text: "v = v_recent", solves: [], fault: changed}}
inputs:
  VFR_HUD:
    fields:
      airspeed: {variable: v, accuracy: 1 m/s}
      "airspeed:recent": {variable: v_recent, accuracy: 1 m/s}
measurements:
  VFR_HUD: {fields: {groundspeed: {variable: w, accuracy: 1 m/s}}}
equalities: {f: {text: "w = v", solves: []}}
"""
    path = tmp_path / "small.yaml"
    path.write_text(text, encoding="utf-8")
    shown = {str(m.channel): m for m in load_airframe(path).measurements}
    assert shown["VFR_HUD.airspeed:recent"].trusted
    assert shown["VFR_HUD.airspeed:recent"].variable == "v_recent"
    assert not shown["VFR_HUD.airspeed:recent"].stillness
