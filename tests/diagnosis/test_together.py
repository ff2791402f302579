"""Who together explains all alarms: told where one component is not the whole answer."""

from dataclasses import replace

import numpy as np

from fdi.diagnosis import diagnose
from fdi.diagnosis.hypotheses import inquire
from fdi.diagnosis.naming import Cause, Effect
from fdi.diagnosis.together import together

from .build import alarms_of
from .test_naming import BANK, pairs


def answer(raised):
    return diagnose(alarms_of(BANK, raised, peak=20.0), BANK)


def test_one_component_that_explains_all_needs_no_list():
    assert answer(pairs("gps", "x", (40, 60))).together == ()
    assert answer({}).together == ()


def test_two_failed_components_are_the_only_minimal_diagnosis():
    """GPS against both others of x, compass against both others of z: nothing else hits all."""
    raised = pairs("gps", "x", (40, 60)) | pairs("compass", "z", (70, 90))
    (found,) = answer(raised).together
    assert found.flight == 0
    assert found.tests == len(raised)
    assert found.diagnoses == (("gps", "compass"),)


def test_two_that_are_accused_are_told_though_one_would_explain_all():
    """The second began long after the first: nothing says that these are one failure."""
    inquiries = inquire(alarms_of(BANK, pairs("gps", "x", (40, 60)), peak=20.0))
    first, second = (
        Cause(0, name, inquiries[0].runs[0], inquiries[0].runs, 0.9, (), ())
        for name in ("gps", "compass")
    )
    assert not list(together(inquiries, [first], []))
    (found,) = together(inquiries, [first, second], [])
    assert found.diagnoses[0] == ("gps",)


def test_where_it_takes_three_no_set_of_two_is_told():
    raised = pairs("gps", "x", (40, 60)) | pairs("compass", "z", (70, 90))
    third = pairs("camera", "y", (10, 30))
    assert answer(raised | third).together == ()
    assert len(answer(raised).together) == 1


def test_alarms_that_follow_or_merely_support_need_no_explanation():
    """What follows from the receiver is left out: then the receiver alone explains the rest."""
    raised = pairs("gps", "x", (40, 60)) | pairs("compass", "z", (42, 60))
    (inquiry,) = inquire(alarms_of(BANK, raised, peak=20.0))
    gps = [run for run in inquiry.runs if "gps" in inquiry.whom.of(run.row)]
    compass = tuple(run for run in inquiry.runs if run not in gps)
    cause = Cause(0, "gps", gps[0], tuple(gps), 0.9, (), ())
    assert [one.diagnoses for one in together([inquiry], [cause], [])] == [(("gps", "compass"),)]
    assert not list(together([inquiry], [cause], [Effect("compass", compass, cause)]))
    supports = np.isin(np.arange(len(inquiry.whom.supports)), [run.row for run in compass])
    supported = replace(inquiry, whom=replace(inquiry.whom, supports=supports))
    assert not list(together([supported], [cause], []))
