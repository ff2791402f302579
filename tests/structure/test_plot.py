"""Pictures show what was computed, in an order that shows the structure, with readable names."""

import io
import itertools

import numpy as np
import pytest
from hypothesis import given

from fdi.structure import (
    Model,
    detectable,
    isolability,
    load_reference,
    members,
    mso_sets,
)
from fdi.structure.plot import plot_decomposition, plot_isolability, plot_signatures

from .models import REFERENCE, dense, models, needs_shared, tried

SMALL_AND_LARGE = [
    path for path in REFERENCE if path.stem in ("corner_cases", "three_tank", "fuel_cell_sensors")
]


def drawn(figure):
    """The matrix that a figure shows, and the names of its rows and columns."""
    axes = figure.axes[0]
    matrix = np.asarray(axes.images[0].get_array())
    rows = [text.get_text() for text in axes.get_yticklabels()]
    return matrix, rows, [text.get_text() for text in axes.get_xticklabels()]


def frames(figure):
    """Corner, width and height of the outlined blocks, in cells."""
    return [
        (
            round(p.get_y() + 0.5),
            round(p.get_x() + 0.5),
            round(p.get_height()),
            round(p.get_width()),
        )
        for p in figure.axes[0].patches
    ]


@given(models())
@tried(12)
def test_the_decomposed_matrix_is_the_incidence_matrix_in_another_order(model):
    matrix, rows, columns = drawn(plot_decomposition(model))
    if not rows or not columns:
        return
    assert sorted(rows) == sorted(model.equations)
    assert sorted(columns) == sorted(model.unknowns)
    found = {(rows[i], columns[j]) for i, j in np.argwhere(matrix).tolist()}
    expected = {
        (model.equations[e], model.unknowns[u]) for e, row in enumerate(model.rows) for u in row
    }
    assert found == expected


@given(models(max_equations=9, max_unknowns=8))
@tried(15)
def test_nothing_is_left_of_or_below_the_blocks(model):
    figure = plot_decomposition(model)
    matrix = drawn(figure)[0]
    for row, column, height, width in frames(figure):
        assert not matrix[row : row + height, :column].any()
        assert not matrix[row + height :, column : column + width].any()
    assert sum(f[2] for f in frames(figure)) <= len(model.equations)


def test_the_parts_stand_in_their_order():
    model = Model.from_matrix([[0, 0, 1, 1, 0], [0, 1, 0, 0, 0], [1, 0, 0, 0, 0], [1, 1, 0, 0, 0]])
    _, rows, columns = drawn(plot_decomposition(model))
    assert rows[0] == "e0"
    assert set(columns[:3]) == {"x2", "x3", "x4"}
    assert set(columns[3:]) == {"x0", "x1"}


def test_faults_are_named_beside_their_equations():
    figure = plot_decomposition(Model.from_matrix([[1], [1]], faults={"leak": 1, "stuck": 1}))
    row = drawn(figure)[1].index("e1")
    beside = {text.get_position()[1]: text.get_text() for text in figure.axes[0].texts}
    assert beside[row] == "leak, stuck"


def test_signatures_are_drawn_as_they_are():
    model = dense(10, 7)
    sets = list(mso_sets(model))
    matrix, rows, columns = drawn(plot_signatures(model, sets))
    assert rows == [f"t{i}" for i in range(1, len(sets) + 1)]
    for i, test in enumerate(sets):
        held = set(members(test))
        hit = [bool(held.intersection(fault.equations)) for fault in model.faults]
        assert matrix[i].astype(bool).tolist() == hit
    assert columns == [fault.name for fault in model.faults]


@given(models())
@tried(12)
def test_isolability_is_drawn_as_it_is(model):
    if not model.faults:
        return
    matrix, rows, columns = drawn(plot_isolability(model))
    assert rows == columns
    order = [[fault.name for fault in model.faults].index(name) for name in rows]
    told, seen = isolability(model), detectable(model)
    assert ((matrix == 0) == told[np.ix_(order, order)]).all()
    assert ((matrix == 2).any(axis=1) == ~seen[order]).all()


@needs_shared
@pytest.mark.parametrize("path", SMALL_AND_LARGE, ids=[path.stem for path in SMALL_AND_LARGE])
@pytest.mark.parametrize("plot", [plot_decomposition, plot_isolability])
def test_names_fit_into_the_picture_and_do_not_overlap(path, plot):
    figure = plot(load_reference(path))
    figure.canvas.draw()
    renderer, page = figure.canvas.get_renderer(), figure.bbox
    axes = figure.axes[0]
    rows = [text.get_window_extent(renderer) for text in axes.get_yticklabels()]
    columns = [text.get_window_extent(renderer) for text in axes.get_xticklabels()]
    texts = [text.get_window_extent(renderer) for text in (*axes.texts, *figure.texts)]
    for box in (*rows, *columns, *texts):
        assert box.x0 >= page.x0
        assert box.x1 <= page.x1
        assert box.y0 >= page.y0
        assert box.y1 <= page.y1
    for upper, lower in itertools.pairwise(rows):
        assert upper.y0 >= lower.y1 - 1
    on_top = [box for box in columns if box.y0 > page.y1 / 2]  # they are repeated at the bottom
    assert len(on_top) == len(drawn(figure)[0][0])
    for left, right in itertools.pairwise(on_top):
        assert left.x1 <= right.x0 + 1


def test_a_model_too_large_for_names_says_so():
    figure = plot_decomposition(dense(400, 390))
    assert drawn(figure)[1:] == ([], [])
    assert "too large for labels" in figure.texts[0].get_text()
    assert max(figure.get_size_inches()) < 70


def test_names_are_never_read_as_mathematics():
    model = Model(("$e_1$", "a"), ("$x^2$",), ((0,), (0,)), name="$m$")
    figure = plot_decomposition(model)
    figure.savefig(io.BytesIO(), format="png")
    assert not any(text.get_parse_math() for text in figure.axes[0].get_yticklabels())


def test_empty_models_are_drawn():
    empty = Model((), (), ())
    for figure in (plot_decomposition(empty), plot_isolability(empty), plot_signatures(empty, [])):
        figure.savefig(io.BytesIO(), format="svg")
