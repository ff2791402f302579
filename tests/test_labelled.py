"""What is said of every labelled flight: nothing untrue, whatever else it is.

All flights of ``../shared/flights`` are analysed once, in two processes, and every claim is held
against every verdict.
"""

import re

import pytest
from flights import SHARED

from fdi.evaluation.labels import load_labels
from fdi.evaluation.run import Evaluation, evaluate
from fdi.evaluation.totals import totals

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")

BAD = ("impact", "control_lost")
UNIT = r"(?:s|ms|m|km|m/s|m/s\^2|deg|deg/s|%|V|A|W|hPa|Pa|us|mgauss|Hz|min|h|bytes|rad|A/s|V/s)"
COUNTED = r"(?:tests?|others?|more|flights?|times|component)"
NAMED = r"(?:flight|[Mm]otor|[Aa]ileron|IMU|[Cc]ompass|[Bb]arometer|unit|log|of|all|sensor)"
NUMBER = re.compile(r"(?<![\w.^])[-+]?\d+(?:\.\d+)?(?![\w.])")


@pytest.fixture(scope="module")
def found() -> Evaluation:
    return evaluate(load_labels(SHARED / "labels.json"), workers=2)


def pairs(found: Evaluation):
    return [(s, r) for s, r in zip(found.scores, found.rows, strict=True) if r["error"] is None]


def test_no_flight_fails(found):
    assert [(row["path"], row["error"]) for row in found.rows if row["error"]] == []


def test_no_part_that_failed_is_ruled_out(found):
    assert [score.label.key for score in found.scores if score.cleared] == []


def test_no_flight_that_ended_badly_is_called_health(found):
    for score, row in pairs(found):
        if row["ended"] in BAD or row["lost_control_s"] is not None:
            assert row["outlook"] in ("accused", "ended badly"), score.label.key
            assert "stayed within" not in row["verdict"], score.label.key


def test_an_impact_leads_the_verdict(found):
    last = [row for _, row in pairs(found) if row["ended"] == "impact" and row["flights"] == 1]
    assert len(last) >= 40
    for row in last:
        assert row["verdict"].startswith("Hit the ground at "), row["verdict"]


def test_first_sentences_are_words_that_a_pilot_reads(found):
    for score, row in pairs(found):
        verdict = row["verdict"]
        assert len(verdict) <= 240, score.label.key
        assert not set("_<=>") & set(verdict), verdict
        assert "..." not in verdict, verdict  # cut off
        assert loose_numbers(verdict) == [], verdict


def loose_numbers(text: str) -> list[str]:
    """Return the numbers of a text with neither a unit nor a noun that they number or count."""
    loose = []
    text = re.sub(r'"[^"]*"', "", text)  # the autopilot's own words
    for number in NUMBER.finditer(text):
        before, after = text[: number.start()].rstrip(), text[number.end() :]
        has_unit = re.match(rf" ?{UNIT}(?![\w/^])", after)
        is_count = re.match(rf" (?:of \d+ )?(?:\w+ )?{COUNTED}\b", after)
        is_name = re.search(rf"\b{NAMED}$", before)
        if not (has_unit or is_count or is_name):
            loose.append(number.group())
    return loose


def test_a_number_without_a_unit_is_found():
    assert loose_numbers("off by 3, at 4 m") == ["3"]
    assert (
        loose_numbers("Motor 2 of 19 of 82 tests, 1 min 4 s, 80 % sure, flight 2 (log 43.6 s)")
        == []
    )


def test_healthy_flights_stay_unaccused(found):
    healthy = [s for s in found.scores if not s.is_faulty]
    own = [s.label.key for s in healthy if s.false and not s.label.key.startswith(OTHERS)]
    public = [s.label.key for s in healthy if s.false and s.label.key.startswith(OTHERS)]
    assert own == []
    assert len(public) <= 1, public


OTHERS = ("real/", "others/")


def test_no_motor_loss_of_px4_is_called_health(found):
    own = [(s, r) for s, r in pairs(found) if s.label.key.startswith("px4_motor/")]
    assert len(own) == 6
    for score, row in own:
        assert row["outlook"] != "healthy", score.label.key
        assert "motor_1" not in row["ruled_out"], score.label.key
    assert sum(score.named for score, _ in own) >= 3


def test_naming_does_not_fall(found):
    """137 and 124 of 166 before sentences were made true; a change may cost none of them."""
    whole = totals(found.scores)
    assert (whole.named.of, whole.timely.of) == (166, 166)
    assert whole.named.hits >= 137
    assert whole.timely.hits >= 124
