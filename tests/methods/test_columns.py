"""A method of twenty lines comes in by the same door as the shipped ones."""

import numpy as np
import pytest
from report.build import MODEL, message, small_log

import fdi
from fdi.errors import ModelError, UsageError
from fdi.methods.columns import Columns, Method, with_columns
from fdi.methods.table import METHODS, methods_of

WITH_SPREAD = (
    MODEL.replace(
        "limits:",
        """  spread: {unit: m}
  most: {value: 5, unit: m}
limits:
  apart: {variable: spread, max: most, component: gps, says: is far from the others}""",
    )
    .replace("  spread: {unit: m}\n  most:", "  most:")
    .replace("  altitude: {unit: m}\n", "  altitude: {unit: m}\n  spread: {unit: m}\n")
    + """  altimeters:
    component: estimator
    made_by: altimeters
    fields:
      spread: {variable: spread, accuracy: 0.5 m}
"""
)


def altimeters(log):
    """How far the receiver's altitude is from the mean of the others."""
    if "GPS_RAW_INT" not in log:
        return "the log has no receiver"
    gps, others = log["GPS_RAW_INT"], (log["VFR_HUD"], log["GLOBAL_POSITION_INT"])
    mean = np.mean([np.interp(gps.t, one.t, one.si("alt")) for one in others], axis=0)
    apart = np.abs(gps.si("alt") - mean)
    return Columns(gps.t, {"spread": apart}, "GPS_RAW_INT", {"spread": "m"})


MINE = Method("altimeters", altimeters)


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "altimeters.yaml"
    path.write_text(WITH_SPREAD)
    return path


def test_a_method_of_twenty_lines_is_judged_and_weighed_like_a_test_of_the_model(model):
    log, silent = with_columns(small_log(bias=40.0), [MINE])
    assert silent == ()
    chain = fdi.residuals_of(log, model)
    (row,) = [i for i, name in enumerate(chain.bank.methods()) if name == "altimeters"]
    assert chain.bank.generators[row].faults == ("altimeters.spread",)
    alarms = chain.policy.decide(chain.residuals)
    assert alarms.alarm[row].any()
    found = fdi.diagnose(alarms, chain.bank)
    assert [one.method for one in found.methods] == ["altimeters"] * len(found.methods) != []


def test_without_the_method_nothing_of_its_statements_is_tested(model):
    chain = fdi.residuals_of(small_log(), model)
    assert set(chain.bank.methods()) == {""}
    assert "altimeters.spread" not in {fault.name for fault in chain.system.faults}
    assert "apart" not in {chain.system.equations[g.residual].name for g in chain.bank.generators}


def test_columns_do_not_pace_the_grid(model):
    """The tests of the model would see another flight with them than without."""
    log, _ = with_columns(small_log(), [MINE])
    asked = fdi.residuals_of(log, model).system.channels
    assert [one.channel.source for one in asked if not one.paces] == ["altimeters"]


def test_columns_keep_unit_time_and_origin():
    log, _ = with_columns(small_log(), [MINE])
    data = log.channel("altimeters.spread")
    assert data.unit == "m"
    assert np.array_equal(data.t, log["GPS_RAW_INT"].t)
    assert log["altimeters"].made_from == "GPS_RAW_INT"
    assert "altimeters.spread" in {str(channel) for channel in log.channels}


def test_the_log_itself_is_left_as_it_is():
    log = small_log()
    before = log.channels
    with_columns(log, [MINE])
    assert "altimeters" not in log
    assert log.channels == before


def test_a_method_that_shows_nothing_says_why():
    log, silent = with_columns(small_log(), [Method("mute", lambda log: "there is no such sensor")])
    assert "mute" not in log
    assert silent == ("the method mute is not weighed: there is no such sensor",)


def test_a_message_of_the_logs_own_is_neither_replaced_nor_taken_for_columns(model):
    log = small_log(bias=40.0)
    own = message("altimeters", {"spread": np.full(4, 99.0)}, np.arange(4.0))
    log = log.with_message(own)
    both, silent = with_columns(log, [MINE])
    assert both["altimeters"] is own
    assert silent == (
        "the method altimeters is not weighed: the log holds a message of its own that is "
        "called so",
    )
    assert set(fdi.residuals_of(both, model).bank.methods()) == {""}


def test_columns_may_be_made_again():
    once, _ = with_columns(small_log(), [MINE])
    again, silent = with_columns(once, [MINE])
    assert silent == ()
    assert np.array_equal(again["altimeters"].si("spread"), once["altimeters"].si("spread"))


def test_a_model_that_names_a_method_which_there_is_not_is_told_so(model):
    (said,) = fdi.residuals_of(small_log(), model, "paper").silent
    assert said == (
        "the model takes altimeters from the method altimeters, which there is not (there are "
        "estimator, heading, observer, response, voting): what it would show is left out"
    )
    given, _ = with_columns(small_log(), [MINE])
    assert fdi.residuals_of(given, model, "paper").silent == ()


def test_a_column_that_the_method_does_not_give_is_told(model):
    log, _ = with_columns(small_log(), [MINE])
    model.write_text(model.read_text().replace("      spread: {v", "      width: {v"))
    chain = fdi.residuals_of(log, model)
    assert "altimeters.width: the method altimeters gives no width" in chain.system.warnings


def test_methods_are_found_by_name_in_the_order_of_the_table():
    assert methods_of(reversed(list(METHODS))) == tuple(METHODS.values())
    assert methods_of([]) == ()
    with pytest.raises(UsageError, match="no method nonsense"):
        methods_of(["nonsense"])


def test_a_policy_may_name_only_methods_that_there_are(tmp_path):
    from fdi.decision import load_policy
    from fdi.decision.policy import policy_text

    text = policy_text(load_policy("default"))
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    assert load_policy(path).methods == ("estimator", "heading", "response", "voting")
    assert load_policy("default").methods == ("estimator", "heading", "response", "voting")
    path.write_text(text.replace("estimator", "nonsense"))
    with pytest.raises(ModelError, match="there is no method nonsense"):
        load_policy(path)


def test_the_published_recipe_uses_no_method():
    from fdi.decision import load_policy

    assert load_policy("paper").methods == ()
