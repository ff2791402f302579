"""What docs/structure.md shows is what happens."""

import doctest
import re
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from fdi import structure

PAGE = (Path(__file__).parents[2] / "docs" / "structure.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"(?:<!-- tutorial: (\w+) -->\n)?```python\n(.*?)```", re.S)


def block(title):
    return next(text for name, text in BLOCK.findall(PAGE) if name == title)


def code_of(examples):
    return "".join(e.source for e in doctest.DocTestParser().get_examples(examples))


def test_the_examples_of_the_page_run():
    names = {}
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    shown = [text for _, text in BLOCK.findall(PAGE) if text.startswith(">>>")]
    assert len(shown) > 10
    for number, text in enumerate(shown):
        test = doctest.DocTestParser().get_doctest(
            text, names, f"block {number}", "structure.md", 0
        )
        report: list[str] = []
        runner.run(test, out=report.append, clear_globs=False)
        names = test.globs
        assert not report, "".join(report)


def test_both_ways_through_the_tutorial_give_the_same_answers():
    pytest.importorskip("faultdiagnosistoolbox")
    ours, theirs = {}, {}
    for names, title in ((ours, "fdi"), (theirs, "toolbox")):
        exec(code_of(block("model")) + block(title), names)  # noqa: S102
    model = ours["model"]
    assert {structure.members(bits) for bits in ours["mso"]} == {
        tuple(sorted(map(int, found))) for found in theirs["mso"]
    }
    assert {structure.members(bits) for bits in ours["mtes"]} == {
        tuple(sorted(map(int, found))) for found in theirs["mtes"]
    }
    for mine, other in zip(ours["isolability"], theirs["isolability"], strict=True):
        assert (mine == (np.asarray(other) == 0)).all()
    assert [[model.unknowns[u] for u in s] for s in ours["sensors"]] == theirs["sensors"]
    assert sum(ours["low_index"]) == sum(theirs["low_index"]) == 5
    assert all(ours["observable"])
    assert all(theirs["observable"])
    assert sorted(map(sum, ours["signatures"])) == sorted(map(sum, theirs["signatures"]))


def test_the_page_names_every_public_function_of_the_tutorial():
    for name in ("decompose", "classes", "detectable", "isolability", "place_sensors", "mso_sets"):
        assert f"structure.{name}(" in PAGE


OFFERS = PAGE.partition("<!-- offers: begin -->")[2].partition("<!-- offers: end -->")[0]
ROWS = [line.strip("| ").split(" | ") for line in OFFERS.strip().splitlines()[2:]]


def found(root, dotted):
    """What a dotted name may stand for: a module and an attribute may have the same name."""
    here, path = [import_module(root)], root
    for name in dotted.split("."):
        path = f"{path}.{name}"
        here = [getattr(one, name) for one in here if hasattr(one, name)]
        with suppress(ImportError):
            here.append(import_module(path))
    return here


def test_the_table_of_offers_names_what_is_there():
    assert len(ROWS) > 20
    for _, _, ours in ROWS:
        for name in re.findall("`([^`]+)`", ours):
            assert found("fdi", name), name


def test_the_table_of_offers_is_fair_to_the_toolbox():
    """What is said of its release is there; what is said of other editions is not."""
    pytest.importorskip("faultdiagnosistoolbox")
    for _, theirs, _ in ROWS:
        for part in theirs.split(";"):
            elsewhere = "(*" in part
            for name in re.findall("`([^`]+)`", part):
                roots = ("", "DiagnosisModel.") if elsewhere else ("",)
                there = any(found("faultdiagnosistoolbox", root + name) for root in roots)
                assert there != elsewhere, name
