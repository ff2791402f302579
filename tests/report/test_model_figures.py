"""The pictures of a model hold what they are pictures of; sizes come in words and colours."""

import numpy as np
import pytest

import fdi
from fdi.errors import UsageError
from fdi.model import load_airframe
from fdi.report.model_document import study
from fdi.report.model_figures import model_figure, size_figure
from fdi.report.sizes import Sizes, sizes_document, sizes_of, sizes_summary
from fdi.report.style import image
from fdi.residuals.distinguish import Distinguishability

MODEL = """
format: 1
name: small
components: {s: {group: sensor}}
variables:
  h: {unit: m}
  climb: {unit: m/s}
  rho: {unit: kg/m^3}
  q: {unit: Pa}
  v: {unit: m/s, domain: [0, null]}
equations:
  k_1: climb = der(h)
  k_2: q = 0.5*rho*v**2
measurements:
  A:
    component: s
    fields:
      h: {variable: h, accuracy: 1 m}
      climb: {variable: climb, accuracy: 0.1 m/s}
  B: {component: s, fields: {h: {variable: h, accuracy: 2 m}}}
  C:
    component: s
    fields:
      q: {variable: q, accuracy: 5 Pa}
      v: {variable: v, accuracy: 1 m/s}
      rho: {variable: rho, accuracy: 0.01 kg/m^3}
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    path = tmp_path_factory.mktemp("m") / "small.yaml"
    path.write_text(MODEL, encoding="utf-8")
    airframe = load_airframe(path)
    return airframe, study(airframe, airframe.observe())


def words(figure) -> set[str]:
    """Every text that stands in the picture's axes."""
    axes = figure.axes[0]
    labels = [*axes.get_xticklabels(), *axes.get_yticklabels(), *axes.texts]
    return {text.get_text() for text in labels}


@pytest.mark.parametrize("kind", ["graph", "dm", "matching"])
def test_a_picture_of_the_structure_names_every_equation_and_unknown(small, kind):
    model = small[1].system.structure()
    assert words(model_figure(small[1], kind)) >= {*model.equations, *model.unknowns}


def test_a_matching_runs_straight_and_leaves_the_residual_equation_over(small):
    own = next(g for g in small[1].bank.generators if len(g.steps) > 1)
    axes = model_figure(small[1], "matching", own.id).axes[0]
    bold = [line for line in axes.lines if line.get_linewidth() > 1]
    names = {text.get_text() for text in axes.texts}
    assert len(bold) == len(own.steps)
    assert all(len(set(line.get_ydata())) == 1 for line in bold)
    assert small[1].system.equations[own.residual].name in names


def test_a_sequence_tells_every_step_in_symbols(small):
    bank = small[1].bank
    own = next(g for g in bank.generators if "C.q" in g.faults)
    shown = words(model_figure(small[1], "sequence", own.id))
    assert {"ρ", "residual", "= C.rho"} <= shown
    assert any("ρ·v²" in text or "√(" in text for text in shown)


HEADS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.mark.parametrize(("kind", "head"), HEADS.items())
def test_a_figure_is_drawn_the_same_every_time(small, kind, head):
    drawn = [image(model_figure(small[1], "sequence"), kind) for _ in range(2)]
    assert drawn[0] == drawn[1]
    assert drawn[0].startswith(head)


def test_what_there_is_not_is_refused(small):
    with pytest.raises(UsageError, match="no figure"):
        model_figure(small[1], "portrait")
    with pytest.raises(UsageError, match="no residual generator"):
        model_figure(small[1], "sequence", "r99")


def sizes(detected, told) -> Sizes:
    return Sizes(
        Distinguishability(("f", "g"), ("m", "m"), np.array(detected), np.array(told)),
        np.array([1.0, np.nan]),
        np.array([np.inf, np.nan]),
        ("g", ""),
    )


def test_a_size_that_is_not_known_is_null_and_counted():
    found = sizes([0.5, np.nan], [[0, 0.0], [np.nan, 0]])
    rows = sizes_document(found)["faults"]
    assert [row["seen"] for row in rows] == [1.0, None]
    assert [row["known"] for row in rows] == [True, False]
    assert len(list(sizes_summary(found))) == 3


def test_colours_are_the_factor_between_telling_and_seeing():
    told = np.array([[0, 0.5], [0, 0]])
    found = Distinguishability(("f", "g"), ("m", "m"), np.array([2.0, 2.0]), told)
    shown = size_figure(found, "two").axes[0].images[0].get_array()
    assert shown[0, 1] == pytest.approx(2.0)
    assert np.ma.getmaskarray(np.ma.masked_invalid(shown))[1, 0]


def test_sizes_of_a_flight_of_ones_own(small):
    """Two sensors of height with 1 and 2 m, one value a second: seen and told from a formula."""
    t = np.arange(0.0, 60.0)
    columns = {"A.h": 0 * t, "A.climb": 0 * t, "B.h": 0 * t, "C.q": 0 * t + 50, "C.v": 0 * t + 10}
    units = {"A.h": "m", "A.climb": "m/s", "B.h": "m", "C.q": "Pa", "C.v": "m/s"}
    log = fdi.log_from_columns({"t": t, **columns}, units)
    found = sizes_of(fdi.residuals_of(log, small[0]).residuals)
    place = found.found.names.index("B.h")
    assert found.found.detected[place] > 0.5 / ((1 + 4) / 5)  # at least by A.h alone
    assert found.seen[place] <= found.told[place]
