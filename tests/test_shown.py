"""Every public value shows itself in a notebook, and rows of findings are tables."""

import importlib
import inspect
import subprocess
import sys
from dataclasses import dataclass, is_dataclass, replace

import numpy as np
import pytest
from report.build import NOTHING, small_analysis

import fdi
from fdi.diagnosis import Evidence, Finding, Size, Term
from fdi.shown import Rows, Shown, html_table

ROOMS = (
    "fdi",
    "fdi.telemetry",
    "fdi.model",
    "fdi.structure",
    "fdi.residuals",
    "fdi.decision",
    "fdi.diagnosis",
    "fdi.methods.voting",
    "fdi.methods.estimator",
    "fdi.methods.setup",
    "fdi.evaluation",
)

FINDING = Finding(
    1, 0, "gps", ("GPS.alt",), "step", 3.0, 4.0, None, 0.9, (),
    Evidence("it jumps", ("r1",), ("GPS.alt",)), (), (),
)  # fmt: skip


def public_values():
    for room in ROOMS:
        module = importlib.import_module(room)
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isclass(value) and is_dataclass(value):
                yield pytest.param(value, id=f"{room}.{name}")


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return small_analysis(tmp_path_factory.mktemp("model"))


@pytest.mark.parametrize("value", list(public_values()))
def test_every_public_value_shows_itself_in_a_notebook(value):
    assert callable(getattr(value, "_repr_html_", None))


def test_the_values_of_an_analysis_give_html_of_moderate_size(analysis):
    parts = [analysis, *(getattr(analysis, name) for name in type(analysis).__slots__)]
    parts += [analysis.diagnosis.grid, analysis.diagnosis.implementable, *analysis.findings]
    shown = [part._repr_html_() for part in parts if hasattr(part, "_repr_html_")]
    assert len(shown) >= 12
    assert all("<table" in page or "<code" in page for page in shown)
    assert max(map(len, shown)) < 100_000


def test_what_a_log_says_is_escaped():
    @dataclass(frozen=True)
    class Value(Shown):
        name: str

    page = Value("<script>")._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page


def test_findings_are_a_tuple_and_a_frame(analysis):
    assert tuple(analysis.findings) == analysis.diagnosis.findings
    frame = analysis.findings.to_pandas()
    assert frame.loc[0, "component"] == "gps"
    assert frame.loc[0, "evidence.residuals"] == ("r5", "r6")
    assert frame["onset"].dtype == np.float64
    for name in ("consequences", "ruled_out", "not_testable"):
        rows = getattr(analysis, name)
        assert rows.to_pandas()["component"].tolist() == [one.component for one in rows]


def test_rows_of_which_some_lack_a_value_inside_have_its_columns(analysis):
    first = analysis.findings[0]
    size = Size(("GPS_RAW_INT.alt",), (), "bias", 40.0, 0.5, "m", 40.0)
    rows = Rows((first, replace(first, rank=2, size=size)))
    frame = rows.to_pandas()
    assert "size" not in frame
    assert frame["size.value"].isna().tolist() == [True, False]
    assert "40" in rows._repr_html_()


def test_no_findings_are_an_empty_frame(analysis):
    empty = replace(analysis, diagnosis=replace(analysis.diagnosis, **NOTHING))
    assert empty.findings.to_pandas().empty
    assert "nothing" in empty.findings._repr_html_()


def test_many_rows_are_cut_and_counted():
    assert "and 60 more" in html_table("many", ["n"], [[n] for n in range(100)])


def test_rows_keep_their_order_and_equality():
    assert Rows((3, 1, 2)) == (3, 1, 2)


def test_frames_hold_none_of_our_classes():
    term = {"feature": "alone", "words": "it alone", "weight": 2.0}
    finding = replace(FINDING, because=(Term("alone", "it alone", 2.0),))
    row = Rows([finding]).to_pandas().iloc[0]
    assert row["because"] == (term,)
    assert row["evidence.channels"] == ("GPS.alt",)
    assert repr(finding) == "<Finding 1: gps, step, from 3.0 s of the log, 90 % sure>"


def test_a_channel_is_told_in_a_line_and_taken_as_a_series():
    log = fdi.log_from_columns({"t": [0, 1, 2], "A.v": [1.0, np.nan, 3.0]}, {"A.v": "m/s"})
    channel = log.channel("A.v")
    assert len(repr(channel)) < 150
    assert "most 3, unit m/s" in repr(channel)
    series = channel.to_pandas()
    assert (series.name, series.index.name, series[2.0]) == ("m/s", "t", 3.0)
    t, value, unit = channel
    assert (t.size, value.size, unit) == (3, 3, "m/s")


def test_rooms_are_there_without_an_import_of_their_own():
    code = "import fdi; print(fdi.structure.Model.__name__, 'structure' in dir(fdi))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.split() == ["Model", "True"]
