"""What a person reads carries names, and foreign text is shown as text."""

import numpy as np
import pytest
from hypothesis import given

from fdi.structure import (
    Model,
    bitset,
    classes,
    decompose,
    isolability,
    mso_sets,
)
from fdi.structure.frames import (
    fault_frame,
    incidence_frame,
    isolability_frame,
    set_frame,
    signature_frame,
)
from fdi.structure.isolability import isolability_of_signatures
from fdi.structure.matching import maximum_matching

from .models import dynamic_models, models


@given(dynamic_models())
def test_the_incidence_frame_names_every_edge(model):
    frame = incidence_frame(model)
    assert list(frame.index) == list(model.equations)
    assert list(frame.columns) == list(model.unknowns)
    found = {(e, u) for e, u in np.argwhere(frame.to_numpy() != "").tolist()}
    assert found == {(e, u) for e, row in enumerate(model.rows) for u in row}
    for e, u, kind in model.derivative:
        assert frame.iat[e, u] == kind


@given(models())
def test_frames_hold_what_the_arrays_hold(model):
    names = [fault.name for fault in model.faults]
    frame = isolability_frame(model)
    assert list(frame.index) == list(frame.columns) == names
    assert (frame.to_numpy() == isolability(model)).all()
    signatures = signature_frame(model, mso_sets(model))
    assert (isolability_of_signatures(signatures.to_numpy()) == isolability(model)).all()
    enters = fault_frame(model)
    for fault in model.faults:
        assert tuple(np.flatnonzero(enters[fault.name])) == fault.equations


def test_sets_are_shown_by_name():
    model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": (0, 2)})
    frame = set_frame(model, [bitset((0, 1)), bitset((1, 2))])
    assert frame.loc["t2", "equations"] == ("e1", "e2")
    assert frame["faults"].tolist() == [("f", "g"), ("g",)]


def test_notebooks_show_names_as_text_and_cut_long_tables():
    model = Model.from_matrix(np.ones((99, 1)), faults={"<b>": 0}, name="<script>")
    page = model._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "<b>" not in page
    assert page.count("<tr>") == 42
    assert "and 59 more" in page


@pytest.mark.parametrize(
    "value",
    [
        decompose(Model.from_matrix([[1, 0], [1, 0], [0, 1]])),
        classes(Model.from_matrix([[1], [1]])),
        maximum_matching(((0,), (0,)), 1),
    ],
    ids=["decomposition", "classes", "matching"],
)
def test_values_have_a_table_for_notebooks_with_their_repr_as_caption(value):
    assert repr(value)[1:-1] in value._repr_html_()
