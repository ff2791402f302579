"""How strongly a finding is said, and what else may be, is in the sentence."""

from types import SimpleNamespace

import pytest

from fdi.diagnosis.claim import claim_of
from fdi.model.parts import Component

KNOWN = {"gps": Component("gps", title="GPS receiver")}


def claim(confidence, rivals=(), equals=()):
    return claim_of(
        SimpleNamespace(
            component="gps", confidence=confidence, rivals=rivals, inseparable_from=equals
        )
    )


@pytest.mark.parametrize(
    ("confidence", "said"),
    [
        (0.99, "failed first (99 % sure)"),
        (0.90, "failed first (90 % sure)"),
        (0.89, "probably failed first (89 % sure)"),
        (0.70, "probably failed first (70 % sure)"),
        (0.51, "may have failed first (51 % sure; nothing at all 49 %)"),
    ],
)
def test_words_follow_the_probability(confidence, said):
    found = claim(confidence)
    assert f"{found.verb('first')} ({found.odds(KNOWN)})" == said
    assert found.subject(KNOWN) == "GPS receiver"


@pytest.mark.parametrize(
    ("confidence", "said"),
    [(0.99, "left"), (0.8, "probably left"), (0.6, "may have left")],
)
def test_what_failed_the_recording_alone_is_told_as_a_gap(confidence, said):
    assert claim(confidence).verb("gap") == f"{said} a gap in the recording"


def test_of_equals_below_half_the_set_is_named():
    others = (("gyroscope", 0.29), ("accelerometer", 0.29))
    found = claim(0.29, others, ("gyroscope", "accelerometer"))
    assert found.subject(KNOWN) == "GPS receiver, gyroscope or accelerometer"
    assert found.verb("first") == "probably failed first"
    assert found.odds(KNOWN) == ("87 % sure that it was one of them, the data do not tell which")


def test_who_explains_it_as_well_is_never_dropped():
    found = claim(0.6, (("compass", 0.35),), ("compass",))
    assert found.odds(KNOWN) == "60 % sure; compass 35 %; nothing at all 5 %"
    assert claim(0.53, (("a", 0.2), ("b", 0.1))).odds(KNOWN) == (
        "53 % sure; another part 30 %; nothing at all 17 %"
    )


def test_together_they_are_never_certain():
    found = claim(0.45, (("a", 0.45), ("b", 0.3)), ("a", "b"))
    assert found.odds(KNOWN).startswith("99 % sure")
